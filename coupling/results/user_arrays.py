"""Arrays of a user as plain numbers in SI: units that an array states count, and nothing is dropped in silence."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from structures.units import factor


def in_si_units(name: str, values: ArrayLike, unit: str) -> NDArray[np.float64]:
    """Return `values` as an array of floats in an SI unit; of a DataArray, Series, pint quantity, or moments, too."""
    array: Any = values
    stated = ""
    if hasattr(array, "attrs") and hasattr(array, "values"):  # a DataArray, or a Series of pandas
        inner = getattr(array, "data", None)
        stated = str(array.attrs.get("units", ""))
        array = inner if hasattr(inner, "magnitude") else array.values
    if hasattr(array, "magnitude") and hasattr(array, "units"):  # a quantity of pint
        array, stated = array.magnitude, f"{array.units}"
    if np.ma.is_masked(array):
        place = tuple(int(index[0]) for index in np.nonzero(np.ma.getmaskarray(array)))
        raise ValueError(f"{name}[{', '.join(map(str, place))}] is masked: must be a finite number")
    is_time = unit == "s" and getattr(array, "dtype", np.dtype(float)).kind in "mM"
    try:
        plain = np.asarray(_seconds(name, array) if is_time else array)
        if plain.dtype.kind not in "iufO":
            raise TypeError(f"it holds {plain.dtype}")
        numbers = plain.astype(float)
    except (TypeError, OverflowError, ValueError) as error:
        raise ValueError(f"{name}: must be an array of real numbers, in {unit} ({error})") from None
    try:
        return numbers * float(factor(stated, unit)) if stated else numbers
    except ValueError as error:
        raise ValueError(f"{name}: is in {stated!r}, must be in {unit} ({error})") from None


def _seconds(name: str, array: NDArray[Any]) -> NDArray[np.float64]:
    """Return the moments and durations of numpy in seconds."""
    if np.isnat(array).any():
        raise ValueError(f"{name}[{int(np.flatnonzero(np.isnat(array))[0])}] is NaT")
    spans = array - array.flat[0] if array.dtype.kind == "M" and array.size else array
    if np.datetime_data(spans.dtype)[0] in ("generic", "Y", "M"):
        raise ValueError(f"{array.dtype} has no units of a week or less")
    return np.asarray(spans / np.timedelta64(1, "s"), dtype=float)
