"""What a file of an oscilloscope or recorder holds, as `hertzlink signal` shows it: a table and a picture."""

from collections.abc import Iterator
from io import BytesIO
from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from coupling.signals.overview import COLOURED, Look, Overview
from hertzlink.reports import default_style
from structures.checks import count_of
from structures.units import readable

SHOWN = 8
"""Channels and notes that are shown."""

COARSE = 1e-4
"""A contact of beads lasts 10 µs to some ms: samples that are further apart (s) are probably in another unit."""

OURS = "Written by hertzlink signal"
"""The remark inside a picture. A picture with it may be replaced."""

REMARKS = {".png": "Comment", ".svg": "Description", ".pdf": "Subject"}
"""Formats of pictures, and the entry of their metadata that holds the remark."""


def table(seen: Overview) -> str:
    """Return the channels of a file as lines of at most 80 columns."""
    first = seen.looks[0]
    step = float(first.time[1] - first.time[0])
    begin, end = (readable(float(first.time[k]), "s", 4) for k in (0, -1))
    lines = [
        f"{seen.kind}, {first.time.size} samples, one every {readable(step, 's', 4)}, from {begin} to {end}",
        f"{'column':>6}  {'name':14}{'least':>10}{'greatest':>10}{'step':>10}{'noise':>10}  {'hum':14}",
    ]
    for look in seen.looks[:SHOWN]:
        ends = np.nanmin(look.values), np.nanmax(look.values)
        sizes = (f"{readable(float(value), look.unit):>10}" for value in (*ends, look.measures.step, look.noise))
        hum = "lead too short" if look.lead < 0.02 else "none"  # a period of 50 Hz
        if look.hum:
            hum = f"{look.hum[0]:g} Hz {readable(look.hum[1], look.unit)}"
        lines.append(f"{look.column:6d}  {look.name[:13]:14}{''.join(sizes)}  {hum}")
        its_step = float(look.time[1] - look.time[0])
        if look.time.size != first.time.size or abs(its_step - step) > 1e-3 * step:
            lines.append(f"{'':8}{look.time.size} samples, one every {readable(its_step, 's', 4)}")
        lines += [f"{'':8}{text}" for text in remarks(look)]
    if len(seen.looks) > SHOWN:
        lines.append(f"and {count_of(len(seen.looks) - SHOWN, 'more channel')}")
    lines += [fill(f"column {column}: {reason}", 80) for column, reason in [*seen.refused.items()][:SHOWN]]
    if step > COARSE:
        coarse = f"note: a sample every {readable(step, 's', 4)} is too coarse for contacts of beads"
        lines.append(fill(f'{coarse}; if the times are in ms or µs, give identify time_unit = "ms" or "us"', 80))
    return "\n".join([*lines, *(f"note: {note}"[:200] for note in seen.notes[:SHOWN])])


def remarks(look: Look) -> Iterator[str]:
    """Yield what may mislead a fit."""
    span, step, white = float(np.nanmax(look.values) - np.nanmin(look.values)), look.measures.step, look.measures.noise
    if look.clipped:
        yield f"{count_of(look.clipped, 'sample is', 'samples are')} clipped: record it with a wider range"
    if missing := int(np.isnan(look.values).sum()):
        yield f"{count_of(missing, 'sample is', 'samples are')} missing or beyond the range"
    if not look.lead:
        yield "no quiet lead: record from before the impact on"
    elif look.noise > max(COLOURED * white, step):
        yield f"the lead scatters {look.noise / white:.1f} times as much as white noise would: hum or drift"
    if 0.0 < span < 64 * step:
        yield f"only {count_of(round(span / step), 'step')} of the digitiser: use a narrower range"


def drawn(seen: Overview, suffix: str) -> bytes:
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
        figure.savefig(content, format=suffix[1:], dpi=120, metadata={REMARKS[suffix]: OURS})
    return content.getvalue()
