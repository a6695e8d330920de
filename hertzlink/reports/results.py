"""What a report shows of each kind of result: sentences, figures and tables."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import islice, product
from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.identification import AT_END, BLIND, IDENTIFIED, NUISANCE, unknowns_of
from coupling.inference.tap_maps import MEASURED, place_of, points_of, verdict_of
from coupling.plots import traces
from coupling.plots.canvas import COLOURS, from_zero, in_words, legend_below, styled
from coupling.plots.identified import identified
from coupling.plots.mapped import mapped
from coupling.plots.swept import MOST_CURVES, label_of, parameter, swept, varied, words_of
from coupling.results.ar_and_tof import UNCERTAINTY, amplitude_ratio, reflections, time_of_flight
from coupling.results.critical_distance import SWALLOWED
from coupling.results.findings import findings_of
from coupling.results.measures import energy_error, sensor_force
from coupling.results.provenance import stored
from coupling.results.reading import Reading
from coupling.results.schema import RUN, kind_of, unit_of
from coupling.results.waves import ABOVE_ONE, NoWave, ReflectedWave, Wave
from hertzlink.reports import HEIGHT, WIDTH, Page, Picture, Table, drawn
from structures.checks import count_of
from structures.units import handy, readable

MOST_ROWS, MOST_PICTURES = 60, 4  # Of a table and of a measure; the files beside a report hold all.

DEFINED = (
    "AR, the amplitude ratio, is the peak force of a reflected wave over that of the incident wave. TOF, the time of "
    "flight, is the time between these two peaks. Both are read at a sensor: the mean of the two contact forces of a "
    "bead. Bead 1 is the struck one."
)

WHICH_DISTANCE = "If in doubt, use the greater distance: it is safe on fresh spots and on spots that taps have dented."

SMALLER_BEADS = "The structure absorbs such a wave, or leaves less than 1 % of it; smaller beads get more of it back."

UNSETTLED = "It is not known whether AR has settled at the greatest distance; greater distances show it."

FIRST_TAP = " on elastic contacts; where a contact yields, a first tap may give a smaller AR"

FRESH_SPOT = (
    "The first tap on a fresh spot dents the metal, which takes energy from the wave. Later taps of the same strength "
    "find the dent: the AR of a thick body is then that of elastic contacts; that of a thin plate stays near the first."
)


def run_page(data: xr.Dataset, sensors: Any, yielded: xr.Dataset | None = None) -> Page:
    """Return the page of a run or a signal. yielded: the same run with contacts that yield."""
    reading, is_run = Reading(data), kind_of(data) == RUN
    numbers, chains = traces.sensors_of(reading, sensors), data.sizes.get("chain", 1)
    page, beads = Page("Run" if is_run else "Measured signal"), ", ".join(map(str, numbers))
    for i in range(chains):
        who, name, one, fresh = "", "", data, yielded
        if chains > 1:
            who, name, one = f" of chain {i}", f"-chain-{i}", data.isel(chain=i)
            fresh = None if yielded is None else yielded.isel(chain=i)
        page.sentences.append(f"At bead {numbers[0]}{who} {waves_in_words(one, numbers[0])}.")
        if fresh is not None:
            page.sentences.append(f"On a fresh spot, where the metal yields, {waves_in_words(fresh, numbers[0])}.")

        def forces(ax: Any, one: xr.Dataset = one, fresh: xr.Dataset | None = fresh) -> None:
            traces.traces(one, numbers, ax)
            if fresh is None:
                return
            for place, number in enumerate(numbers, len(numbers)):
                force, colour = sensor_force(fresh, number), COLOURS[place % len(COLOURS)]
                where = f"bead {number} on a fresh spot, "
                label = f"{where}where the metal yields"
                ax.plot(1e6 * force.time.values, force.values, color=colour, linewidth=1.3, label=label)
                traces.mark_waves(ax, fresh, number, colour, where, ("primary", "secondary"))
            legend_below(ax)

        words = f"Force at bead{'s' * (len(numbers) > 1)} {beads}{who}, and its waves."
        page.pictures.append(drawn(f"traces{name}", words, forces))
        if is_run and not Reading(one).at_sensors:
            words = f"Force at each contact{who} over time: waves run down the chain, and back from the structure."
            page.pictures.append(drawn(f"map{name}", words, partial(traces.contact_map, one)))

        rows = list[list[str]]()
        spots = {"": one} if fresh is None else {"": one, ", fresh spot": fresh}
        for (where, there), number in product(spots.items(), numbers):
            for wave, found in waves_at(there, number).items():
                if isinstance(found, NoWave):
                    cells = ["", "", "", "", f"none; {found.reason}"]
                else:
                    cells = [f"{found.amplitude:.2f}", f"{1e6 * found.arrival:.2f}", "", "", ""]
                if isinstance(found, ReflectedWave):
                    cells[2:] = *found.texts, ABOVE_ONE * (found.amplitude_ratio > 1.0)
                rows.append([f"bead {number}, {wave}{where}", *cells])
        head = "sensor and wave", "peak (N)", "arrival (µs)", "AR", "TOF (µs)", "remark"
        page.tables.append(Table(f"AR and TOF at the sensors{who}", head, rows))
        if budgets := json.loads(one.attrs.get(UNCERTAINTY, "{}")):
            shares = [row for budget in budgets.values() for row in budget["rows"]]
            columns = "measure", "value ± standard uncertainty", "shares of the variance"
            page.tables.append(Table("Effect of uncertain parameters on AR and TOF", columns, shares))

    page.sentences += [FRESH_SPOT] * (yielded is not None) + [DEFINED]
    length = f"{1e6 * (reading.time[-1] - reading.time[0]):.6g} µs in {count_of(reading.time.size, 'sample')}"
    record = f"The record is {'simulated' if is_run else 'measured'}: {length}."
    if is_run and "kinetic_energy" in data:
        record += f" The energy changes by {float(energy_error(data)):.1g} of the impact energy."
        words = "The energy of each part over time. The sum must not change."
        page.pictures.append(drawn("energy", words, partial(traces.energy, data), folded=True))
    page.sentences.append(record)
    return page


def waves_at(data: xr.Dataset, sensor: int) -> dict[str, Wave | NoWave]:
    """Return the waves at a sensor by name; of a signal that lacks the samples of a peak, why none can be read."""
    try:
        return reflections(data, sensor)._asdict()
    except ValueError as error:
        return {"primary": NoWave("primary", str(error))}


def waves_in_words(data: xr.Dataset, sensor: int) -> str:
    waves = waves_at(data, sensor)
    if isinstance(waves["primary"], NoWave):
        return f"no reflected wave is found: {waves['primary'].reason}"
    found = {name: wave.texts for name, wave in waves.items() if isinstance(wave, ReflectedWave)}
    return " and ".join(f"the {name} wave has AR {ratio} and TOF {tof} µs" for name, (ratio, tof) in found.items())


def sweep_page(data: xr.Dataset, sensors: Any = None) -> Page:
    """Return the page of a sweep or a batch, with all forces or with AR and TOF alone."""
    page, kept = Page("Sweep"), "amplitude_ratio" in data
    numbers = [int(number) for number in data.sensor.values] if kept else traces.sensors_of(Reading(data), sensors)
    for number in numbers:
        runs = data.sel(sensor=number) if kept else data
        measured = dict[str, xr.DataArray]()
        for wave, prefix in (("primary", ""), ("secondary", "secondary_")):
            for name, factor, measure in (("AR", 1.0, amplitude_ratio), ("TOF (µs)", 1e6, time_of_flight)):
                values = runs[prefix + measure.__name__] if kept else measure(runs, number, wave)
                measured[f"{wave} {name}"] = factor * values
        ratio = measured["primary AR"]

        missing = int(ratio.isnull().sum())
        if missing < ratio.size:
            places = [np.unravel_index(end(ratio.values), ratio.shape) for end in (np.nanargmin, np.nanargmax)]
            least, most = (f"{ratio.values[place]:.3f}" for place in places)
            said = f"is {least}"
            if least != most:
                first, last = (said_of(point_in_words(ratio, ratio.dims, place)) for place in places)
                said = f"lies between {least} ({first}) and {most} ({last})"
            without = f"; {count_of(missing, 'run has', 'runs have')} no primary wave" * bool(missing)
            elastic = FIRST_TAP * any(finding.startswith("yield: ") for finding in findings_of(data))
            page.sentences.append(f"AR of the primary wave at bead {number} {said}{elastic}{without}.")
        for wave in ("primary", "secondary"):
            if bool(measured[f"{wave} AR"].notnull().any()):
                page.pictures += swept_pictures(runs, ratio, number, wave)
            else:
                page.sentences.append(f"No run has a {wave} wave at bead {number}.")

        rows = []
        for place in islice(np.ndindex(*ratio.shape), MOST_ROWS):
            cells = [float(values.values[place]) for values in measured.values()]
            texts = ["none" if np.isnan(cell) else f"{cell:.5g}" for cell in cells]
            rows.append([*point_in_words(ratio, ratio.dims, place).values(), *texts])
        left = f" of {MOST_ROWS} of {ratio.size} runs" if ratio.size > MOST_ROWS else ""
        head = [*(words_of(ratio[name]) for name in ratio.dims), *measured]
        page.tables.append(Table(f"AR and TOF at bead {number}{left}", head, rows))
    over = "; ".join(f"{words_of(data[name])} ({values})" for name, values in varied(data).items())
    page.sentences += [f"Varied: {over}."] * bool(over) + [DEFINED]
    return page


def point_in_words(values: xr.DataArray, names: Iterable[Any], place: Iterable[Any]) -> dict[str, str]:
    """Return parameters of a point as texts with units, by their names in words. place: the number of each value."""
    texts = {}
    for name, i in zip(names, place, strict=True):
        (factor, unit), value = parameter(values[name]), values[name].values[i]
        texts[words_of(values[name])] = f"{factor * value:.5g} {unit}".rstrip() if np.isreal(value) else str(value)
    return texts


def said_of(point: dict[str, str]) -> str:
    return ", ".join(f"{name} {value}" for name, value in point.items())


def swept_pictures(runs: xr.Dataset, ratio: xr.DataArray, sensor: int, wave: str) -> Iterator[Picture]:
    """Yield AR and TOF over the parameter with most values, a curve for each value of another one, and more figures."""
    names = sorted(map(str, ratio.dims), key=lambda name: (ratio[name].dtype.kind not in "iuf", -ratio.sizes[name]))
    curves = next((name for name in names[1:] if 1 < ratio.sizes[name] <= MOST_CURVES), None)
    fixed = [name for name in names[1:] if name != curves]
    places = np.ndindex(*(ratio.sizes[name] for name in fixed)) if names else ()
    for place in islice(places, MOST_PICTURES):
        part = runs.isel(dict(zip(fixed, place, strict=True)))
        where = ", " * bool(fixed) + said_of(point_in_words(ratio, fixed, place))
        for measure, words in (("amplitude_ratio", "Amplitude ratio AR"), ("time_of_flight", "Time of flight TOF")):
            name = "-".join([measure, wave, str(sensor), *map(str, place)])
            of_forces = None if "amplitude_ratio" in part else sensor
            draw = partial(swept, part, of_forces, measure, names[0], wave)
            yield drawn(name, f"{words} of the {wave} wave at bead {sensor}{where}.", draw)


def critical_page(data: xr.Dataset, yielded: xr.Dataset | None = None) -> Page:
    """Return the page of a critical distance, for each combination of the other parameters."""
    page, critical, words = Page("Critical distance"), data.critical_distance, words_of(data.distance)
    what = "the edge" if "distance" in words else words
    # A case with a law of its own has one result, whose contacts may yield.
    spots = {"": data} if yielded is None else {"on elastic contacts": data, "on a fresh spot": yielded}
    factor, unit = parameter(data.distance)
    rows, unsettled, swallowed = list[list[str]](), False, False
    for number, place in enumerate(np.ndindex(*critical.shape)):
        at = point_in_words(critical, critical.dims, place)
        where = f", for {said_of(at)}" * bool(at)
        curves = {spot: runs.isel(dict(zip(critical.dims, place, strict=True))) for spot, runs in spots.items()}
        spots_by_answer = dict[str, list[str]]()
        for spot, curve in curves.items():
            low, high = factor * curve.bracket.values.ravel()
            ends = low, factor * float(curve.critical_distance), high
            low_end, distance, high_end = (f"{end:#.4g}".rstrip(".") for end in ends)
            between, far = f"{low_end} to {high_end}", f"{float(curve.far_value):.4f}"
            changes = f"{what} changes AR by less than {float(curve.within):g}"
            said = f"beyond {distance} {unit} ({between} {unit}) {changes}"
            if np.isnan(curve.far_value):
                between, far = "no reflected wave far away", "none"
                why = "the record ends before the wave comes back" if curve.short_record else SWALLOWED
                swallowed |= not curve.short_record
            elif np.isnan(low):
                between = "a reflected wave from the greatest distance only"
                why = "a wave returns from the greatest distance only"
            elif np.isinf(high):
                between = why = "greater distances are needed"

            if np.isnan(low):
                distance, said = "not found", f"the influence of {what} is not known, because {why}"
            elif np.isinf(high):
                distance, said = f"more than {low_end}", f"at {low_end} {unit} {changes.replace('less', 'more')}; {why}"
            elif low <= 0.0:
                distance = f"less than {distance}"
                said = f"from the smallest distance with a wave on, {high_end} {unit}, {changes}"
            if np.isfinite(high) and not curve.settled:
                far, unsettled = f"{far}, perhaps not settled", True
            spots_by_answer.setdefault(said, []).append(spot)
            rows.append([*at.values(), *([spot] * bool(spot)), distance, between, far])

        # One sentence for all spots, in which what the edge changes is said once.
        first, *others = [f"{said} {' and '.join(of)}".rstrip() for said, of in spots_by_answer.items()]
        same = f" {changes}" * (changes in first)
        answer = ", and ".join([first, *(one.replace(same, "") for one in others)])
        page.sentences.append(f"{answer[:1].upper()}{answer[1:]}{where}.")
        if number < MOST_PICTURES:
            name = "-".join(["critical-distance", *map(str, place)])
            caption = f"AR at bead {data.attrs['sensor']} over {words}{where}, and the critical distance."
            page.pictures.append(drawn(name, caption, partial(draw_critical, curves)))
    head = [*(words_of(critical[name]) for name in critical.dims), *["contacts"] * (yielded is not None)]
    head += [f"critical distance ({unit})", f"between ({unit})", "AR far away"]
    page.tables.append(Table("Critical distances", head, rows))
    both = np.all([runs.critical_distance.notnull() for runs in spots.values()], axis=0)
    page.sentences += [UNSETTLED] * unsettled + [SMALLER_BEADS] * swallowed
    page.sentences += ([WHICH_DISTANCE] * bool(both.any()) + [FRESH_SPOT]) * (yielded is not None) + [DEFINED]
    return page


def draw_critical(curves: dict[str, xr.Dataset], ax: Any) -> None:
    """Draw the runs of each curve over the distance, and the bracket of its critical distance."""
    for colour, (spot, curve) in zip(COLOURS, curves.items(), strict=False):
        factor, unit = parameter(curve.distance)
        runs, look = curve.isel(distance=curve.sampled.values.astype(bool)), {"color": colour, "label": spot or "AR"}
        ax.plot(factor * runs.distance, runs.amplitude_ratio, "o-", markersize=4, linewidth=1.1, **look)
        (low, high), far, within = factor * curve.bracket.values.ravel(), float(curve.far_value), float(curve.within)
        if np.isfinite(far):
            words = f"far away ± {within:g}"
            ax.axhspan(far - within, far + within, color=colour, alpha=0.12, linewidth=0.0, label=words)
        if np.isfinite([low, high]).all():
            words = ", ".join(filter(None, ("critical", spot)))
            ax.axvspan(low, high, color=colour, alpha=0.35, label=f"{words}: {low:.4g} to {high:.4g} {unit}")
    from_zero(ax)
    styled(ax, label_of(curve.distance), "amplitude ratio AR")
    legend_below(ax)


def identification_page(data: xr.Dataset) -> Page:
    """Return what was found, how far it is known, and whether the model explains the signal."""
    page, unknowns = Page("Identification"), unknowns_of(data)
    size = f"its residual is {float(data.attrs['misfit']):.3g} times the noise"
    if data.attrs["explained"]:
        values = list[str]()
        for one in unknowns:
            name, unit = in_words(one.name.split(".")[-1]), one.unit
            if one.verdict == BLIND:
                values.append(f"{name} not determined by the signal")
            elif one.verdict != NUISANCE:
                if not unit and (unit := unit_of(one.name)):  # of a builder's argument its name says it
                    factor, unit = handy([one.value], unit)
                    one = replace(one, unit=unit, unit_size=1.0 / factor)
                _, value, interval, _ = one.row()
                end = ", at the end of its range" if one.verdict == AT_END else ""
                values.append(f"{f'{name} {value} {unit}'.rstrip()} ({interval}){end}")
        found = ", ".join(values)
        page.sentences += [f"{found[:1].upper()}{found[1:]}.", f"The model explains the signal: {size}."]
    else:
        page.sentences.append(f"No value can be trusted: the model does not explain the signal; {size}.")
        page.sentences.append("Correct the model first: a wrong model biases values by more than any interval.")

    # The files of the signal, one or one for each sensor, and the units to which their columns were converted.
    read = stored(data.attrs.get("input")).get("identify", {}).get("signal") or {}
    of, files = "", read.get("signal", "arrays")
    if files != "arrays":
        name = ", ".join(dict.fromkeys(files.values())) if isinstance(files, dict) else files
        page.title, of = f"Identification: {name}", f" of {name}"
        if units := [*dict.fromkeys(read.get("columns_converted_to", {}).values())]:
            of += f", whose columns were converted to {' and '.join(units)}"
    of = f" were fitted to {data.time.size} samples{of}" if "time" in data.dims else ""
    page.sentences.append(f"{int(data.attrs['runs'])} runs{of}.")

    rows = [unknown.row() for unknown in unknowns]
    page.tables.append(Table("Unknowns", ("unknown", "value", "95 % interval", "verdict"), rows))
    if data.sizes.get("mode", 0) > 1:
        fits = data.modes.values[1:] / [unknown.unit_size for unknown in unknowns]
        caption = "Other fits that the noise does not exclude"
        page.tables.append(Table(caption, [one.head for one in unknowns], [[f"{x:.4g}" for x in fit] for fit in fits]))

    def picture(name: str, words: str, *what: Any, height: float = HEIGHT, folded: bool = False) -> None:
        page.pictures.append(drawn(name, words, partial(identified, data, *what), height, folded))

    for number in np.atleast_1d(data.sensor.values).astype(int).tolist() if "time" in data.dims else []:
        picture(f"fit-{number}", f"Fitted and measured force at bead {number}.", "fit", number)
        words = f"The residual of the fit at bead {number}, in units of the noise."
        picture(f"residual-{number}", words, "residual", number, folded=True)
    picture("intervals", "How exactly each unknown is determined.", "intervals", height=1.4 + 0.42 * len(unknowns))
    words = "Correlations: unknowns near 1 or −1 cannot be distinguished."
    picture("correlation", words, "correlation", height=WIDTH - 1.0, folded=True)
    return page


def map_page(data: xr.Dataset) -> Page:
    """Return what differs at which points, and maps with their table."""
    page, points = Page("Map"), points_of(data)
    for name in points[0].unknown.values.tolist():
        page.sentences.append(difference_in_words(data.sel(unknown=name), name))
        for what, words in (("value", "values"), ("error", "half of the 95 % intervals")):
            draw = partial(mapped, data, name, what)
            page.pictures.append(drawn(f"{name}-{what}".replace(".", "-"), f"{in_words(name)}: {words}.", draw, 4.4))

    rows, failed = list[list[str]](), list[list[str]]()
    for point in points:
        found = ["{} ({})".format(*one.row()[1:3]) for one in unknowns_of(point)]
        rows.append([*place_of(point), str(int(point.taps)), *found, verdict_of(point)])
        if error := str(point.error.item()):
            failed.append([*place_of(point), str(point.files.item()), error])
    counts = ", ".join(f"{many} {verdict}" for verdict, many in Counter(row[-1] for row in rows).items())
    page.sentences.append(f"{count_of(len(points), 'point')}: {counts}.")
    along = [f"{axis} ({data[axis].attrs['unit']})" for axis in "xy"]
    heads = [in_words(one.name) + f" ({one.unit})" * bool(one.unit) for one in unknowns_of(points[0])]
    page.tables.append(Table("Points", [*along, "taps", *heads, "verdict"], rows))
    if failed:
        page.tables.append(Table("Points that failed", [*along, "files", "reason"], failed))
    return page


def difference_in_words(one: xr.Dataset, name: str) -> str:
    """Return a sentence: which points differ from the median by more than interval and scatter, or that all agree."""
    words, unit = in_words(name.split(".")[-1]), f" {one.unit.item()}".rstrip()
    along, up = (one[axis].attrs["unit"] for axis in "xy")
    known = one.isel(point=np.isin(one.verdict.values, (IDENTIFIED, MEASURED)))
    value, width = (numbers.values / float(one.unit_size) for numbers in (known.value, known.high - known.low))
    if not value.size:
        return f"No point has a reliable {words}."
    median = float(np.median(value))
    middle = readable(median, "", 4) + unit
    if value.size == 1:
        return f"One point has a reliable {words}: {middle}."

    away = value - median
    scatter = 1.4826 * float(np.median(abs(away)))  # that of a normal distribution, from its median
    far = abs(away) > np.maximum(3.0 * scatter, np.nan_to_num(width))
    sides = ("thinner", "thicker") if name.endswith("thickness") else ("lower", "higher")
    texts = list[str]()
    for side, here in zip(sides, (far & (away < 0.0), far & (away > 0.0)), strict=True):
        if here.any():
            sizes = abs(away[here])
            places = [place_of(known.isel(point=k)) for k in np.flatnonzero(here)[:3]]
            by = " to ".join(dict.fromkeys(readable(float(size), "", 2) for size in (sizes.min(), sizes.max())))
            where = "; ".join(f"x = {x} {along}, y = {y} {up}" for x, y in places) + "; …" * (sizes.size > 3)
            verb = "is" if sizes.size == 1 else "are"
            texts.append(f"{sizes.size} of {value.size} points ({where}) {verb} {by}{unit} {side}")
    if texts:
        return f"{' and '.join(texts)} than the median {words} of {middle}."
    if (abs(away) > width).any():
        low, high = (readable(float(end), "", 4) for end in (value.min(), value.max()))
        return f"{words[:1].upper()}{words[1:]} varies from {low} to {high}{unit} over {count_of(value.size, 'point')}."
    return f"All {value.size} points agree in {words}: {middle}, with a scatter of {readable(scatter, '', 1)}{unit}."
