"""Arrays of a user as plain numbers in SI: units that an array states count, and nothing is dropped in silence."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from structures.units import factor


def in_si_units(name: str, values: ArrayLike, unit: str) -> NDArray[np.float64]:
    """Return `values` as an array of floats in an SI unit, or raise a ValueError.

    The units of a DataArray and of a pint quantity are converted; moments of datetime64 count from the first one.
    Masked and complex numbers, and text, are refused.
    """
    array, stated = _parts(values)
    if np.ma.is_masked(array):
        place = tuple(int(index[0]) for index in np.nonzero(np.ma.getmaskarray(array)))
        raise ValueError(f"{name}[{', '.join(map(str, place))}] is masked: must be a finite number")
    try:
        plain = np.asarray(array)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: must be an array of numbers, in {unit}") from None
    if plain.dtype.kind in "mM":
        return _seconds(name, plain, unit)
    if plain.dtype.kind == "c":
        raise ValueError(f"{name}: holds complex numbers, must be real ones, in {unit}")
    if plain.dtype.kind not in "iufO":
        raise ValueError(f"{name}: holds {plain.dtype}, must be numbers, in {unit}")
    try:
        numbers = plain.astype(float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name}: must be an array of numbers, in {unit}") from None
    if not stated:
        return numbers
    try:
        return numbers * float(factor(stated, unit))
    except ValueError as error:
        raise ValueError(f"{name}: is in {stated!r}, must be in {unit} ({error})") from None


def _parts(values: Any) -> tuple[Any, str]:
    """Return the bare array, and the unit that it states, or ""."""
    attributes = getattr(values, "attrs", {})
    labelled = hasattr(values, "attrs") and hasattr(values, "values")  # a DataArray, or a Series of pandas
    inner: Any = getattr(values, "data", None) if labelled else values
    if hasattr(inner, "magnitude") and hasattr(inner, "units"):  # a quantity of pint
        return inner.magnitude, f"{inner.units}"
    return (values.values, str(attributes.get("units", ""))) if labelled else (values, "")


def _seconds(name: str, array: NDArray[Any], unit: str) -> NDArray[np.float64]:
    """Return the moments and durations of numpy in seconds."""
    if unit != "s":
        raise ValueError(f"{name}: holds {array.dtype}, must be numbers, in {unit}")
    if np.isnat(array).any():
        raise ValueError(f"{name}[{int(np.flatnonzero(np.isnat(array))[0])}] is NaT: must be a time")
    spans = array - array.flat[0] if array.dtype.kind == "M" and array.size else array
    if np.datetime_data(spans.dtype)[0] in ("generic", "Y", "M"):
        raise ValueError(f"{name}: holds {array.dtype}, must be times in units of a week or less")
    return np.asarray(spans / np.timedelta64(1, "s"), dtype=float)
