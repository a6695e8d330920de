"""The result of a run or a sweep in a sentence, and what AR, TOF and a sensor are."""

import numpy as np
import xarray as xr

from coupling.plots.swept import varied, words_of
from coupling.results.ar_and_tof import reflections
from coupling.results.waves import NoWave, ReflectedWave
from structures.checks import count_of
from structures.units import handy

DEFINED = (
    "AR, the amplitude ratio, is the peak force of a reflected wave over that of the incident wave. TOF, the time of "
    "flight, is the time between these two peaks. Both are read at a sensor: the mean of the two contact forces of a "
    "bead. Bead 1 is the struck one."
)


def of_run(data: xr.Dataset, sensor: int, who: str = "") -> str:
    """Return what came back at a sensor. who: which of several chains."""
    where = f"At bead {sensor}{' of ' * bool(who)}{who}"
    try:
        waves = reflections(data, sensor)
    except ValueError as error:
        return f"{where} no AR and TOF can be read: {error}."
    waves_found = {name: wave for name, wave in waves._asdict().items() if isinstance(wave, ReflectedWave)}
    if isinstance(waves.primary, NoWave):
        return f"{where} no reflected wave is found: {waves.primary.reason}."
    texts = [
        f"the {name} wave has AR {wave.amplitude_ratio:.3f} and TOF {1e6 * wave.time_of_flight:.1f} µs"
        for name, wave in waves_found.items()
    ]
    return f"{where} {' and '.join(texts)}."


def of_sweep(data: xr.Dataset, ratio: xr.DataArray, sensor: int | None) -> str:
    """Return what was varied, and between which values AR lies."""
    over = "; ".join(f"{words_of(data[name])} ({values})" for name, values in varied(data).items())
    runs = f"{count_of(ratio.size, 'run')} over {over or ', '.join(map(str, ratio.dims))}"
    values = ratio.values[np.isfinite(ratio.values)]
    if not values.size:
        return f"{runs}: no run has a primary wave."
    where = f" at bead {sensor}" if sensor is not None else ""
    missing = ratio.size - values.size
    without = f"; {count_of(missing, 'run has', 'runs have')} no such wave" if missing else ""
    return f"{runs}: AR of the primary wave{where} lies between {values.min():.3f} and {values.max():.3f}{without}."


def of_critical(data: xr.Dataset, contacts: str = "") -> str:
    """Return the critical distance, or between which values it lies for the values of other parameters.

    contacts: of which contacts it is, such as " of elastic contacts".
    """
    low, high = data.bracket.values.reshape(-1, 2).T
    if not np.isfinite(high).all():
        return "AR does not settle within the distances: the critical distance lies beyond them."
    factor, unit = handy(high, "m")
    ends = f"{factor * low.min():.4g} and {factor * high.max():.4g} {unit}"
    many = f", one for each of {low.size} curves" if low.size > 1 else ""
    return f"The critical distance{contacts}, beyond which AR stays near its value far away, lies between {ends}{many}."
