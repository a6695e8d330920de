"""What a file of an oscilloscope or recorder holds, as `hertzlink signal` shows it: a table and a picture."""

import re
from collections.abc import Iterator
from io import BytesIO

import numpy as np
from matplotlib.figure import Figure

from coupling.inference.identification import LINE, as_text
from coupling.results.sensor_trace import is_inverted
from coupling.signals.overview import COLOURED, SILENT, Look, Overview
from hertzlink.output import REMARKS
from hertzlink.reports import default_style
from structures.checks import count_of
from structures.units import readable

SHOWN = 8
"""The most channels and notes that are shown."""

COARSE = 1e-4
"""A contact of beads lasts 10 µs to some ms: samples that are further apart (s) are probably in another unit."""

OURS = "Written by hertzlink signal"
"""The remark inside a picture. A picture with it may be replaced."""


def table(seen: Overview) -> str:
    """Return the channels of a file as a table, and what may mislead below it, in lines of at most 80 columns."""
    first, looks = seen.looks[0], seen.looks[:SHOWN]
    step = float(first.time[1] - first.time[0])
    begin, end = (readable(float(first.time[k]), "s", 4) for k in (0, -1))
    rows, notes = [["column", "name", "least", "greatest", "step", "noise", "hum"]], list[str]()
    for look in looks:
        ends = np.array([np.nanmin(look.values), np.nanmax(look.values)])
        ends[abs(ends) <= SILENT * abs(ends).max()] = 0.0
        sizes = (readable(float(value), look.unit) for value in (*ends, look.measures.step, look.noise))
        hum = "lead too short" if look.lead < 0.02 else "none"  # a period of 50 Hz
        if look.hum:
            hum = f"{look.hum[0]:g} Hz {readable(look.hum[1], look.unit)}"
        rows.append([str(look.column), look.name, *sizes, hum])
        notes += [f"column {look.column}: {text}" for text in remarks(look, first)]

    # Names are shortened to the room that the numbers leave in a line.
    without_names = as_text([[column, "", *numbers] for column, _, *numbers in rows], [], are_numbers=True)
    room = LINE - max(map(len, without_names.splitlines()))
    for row in rows:
        if len(row[1]) > room:
            row[1] = f"{row[1][: room - 9]}…{row[1][-8:]}"

    if len(seen.looks) > SHOWN:
        notes.append(f"and {count_of(len(seen.looks) - SHOWN, 'more channel')}")
    notes += [f"column {column}: {as_options(reason)}" for column, reason in [*seen.refused.items()][:SHOWN]]
    if step > COARSE:
        coarse = f"note: a sample every {readable(step, 's', 4)} is too coarse for contacts of beads"
        notes.append(f"{coarse}; if the times are in ms or µs, give --time-unit; in a case, identify.time_unit")
    notes += [f"note: {note}"[:200] for note in seen.notes[:SHOWN]]
    what = f"{seen.kind}, {first.time.size} samples, one every {readable(step, 's', 4)}, from {begin} to {end}"
    return f"{what}\n{as_text(rows, notes, are_numbers=True)}"


def as_options(message: str) -> str:
    """Return a message in which arguments of `read_signal` are options of the command."""
    text = message.replace("interval=, s, such as 5e-7", '--interval "0.5 us"')
    return re.sub(r"\b(interval|time_unit|unit)(=(, s)?|(?=:))", lambda m: "--" + m[1].replace("_", "-"), text)


def remarks(look: Look, first: Look) -> Iterator[str]:
    """Yield what may mislead a fit. first: the first channel of the file."""
    span, step, white = float(np.nanmax(look.values) - np.nanmin(look.values)), look.measures.step, look.measures.noise
    its, usual = (float(one.time[1] - one.time[0]) for one in (look, first))
    if look.time.size != first.time.size or abs(its - usual) > 1e-3 * usual:
        yield f"{look.time.size} samples, one every {readable(its, 's', 4)}"
    if not span:
        yield f"is constant, {readable(float(np.nanmax(look.values)), look.unit)}: must hold a wave"
        return
    if is_inverted(look.measures.filled):
        yield "the waves are negative: the polarity is reversed; change the sign of the calibration"
    if look.clipped:
        yield f"{count_of(look.clipped, 'sample is', 'samples are')} clipped: record it with a wider range"
    if missing := int(np.isnan(look.values).sum()):
        yield f"{count_of(missing, 'sample is', 'samples are')} missing or beyond the range"
    if not look.lead:
        yield "no quiet lead: begin the record before the impact"
    elif look.noise > max(COLOURED * white, step):
        times = f"{readable(look.noise / white, '', 2)} times as much as" if white else "more than"
        yield f"the lead scatters {times} white noise would: hum or drift"
    if 0.0 < span < 64 * step:
        yield f"only {count_of(round(span / step), 'step')} of the digitiser: use a narrower range"


def drawn(seen: Overview, form: str) -> bytes:
    """Return a picture of the channels, one above the other."""
    looks, content = seen.looks[:SHOWN], BytesIO()
    with default_style():
        figure = Figure(figsize=(8.0, 1.2 + 1.6 * len(looks)), layout="constrained")
        axes = figure.subplots(len(looks), sharex=True, squeeze=False)[:, 0]
        for axis, look in zip(axes, looks, strict=True):
            axis.plot(1e3 * look.time, look.values, linewidth=0.8)
            axis.set_ylabel(f"{look.name[:20] or f'column {look.column}'}\n{look.unit}")
            axis.grid(alpha=0.3)
        axes[-1].set_xlabel("time, ms")
        figure.savefig(content, format=form, dpi=120, metadata={REMARKS[form]: OURS})
    return content.getvalue()
