"""Regression tests of your own models: their waves, compared with a saved reference or with published numbers."""

from collections.abc import Callable as _Callable
from typing import Any as _Any

from coupling.references import assert_same_waves as assert_same_waves
from particles.chain import LawOfPair as _LawOfPair
from structures.checks import count_of as _count_of
from structures.checks import function as _function
from structures.checks import positive as _positive
from structures.checks import short as _short
from structures.checks import takes as _takes
from structures.material import Material as _Material

_Plate = _Callable[[float, float, _Material, float, float], _Any]


def assert_literature(law: _LawOfPair | None = None, plate: _Plate | None = None, rtol: float = 1e-3) -> None:
    """Compare a contact law, or a plate, of your own with numbers that other authors and programs print.

    Parameters
    ----------
    law : callable, optional
        A function law(body, next body or Surface) that returns a contact law; `contact_law` is Hertz's. It is compared
        with the numbers of chains and collisions.
    plate : callable, optional
        A function or class plate(side, thickness, material, x, y) that returns a Structure or a participant: a thin
        square plate on simple edges, struck at (x, y) from a corner, in m. Its natural frequencies are compared, and
        how far each mode moves the contact, with Navier's closed form; a participant rings for them after a smooth
        pulse. Its surface, losses and amplitude ratios are not tested.
    rtol : float
        How far beyond its printed digits a frequency of the plate may lie, as a part of it; a motion, ten times as far.

    Raises
    ------
    ValueError
        If there is neither a law nor a plate, one of them is no function, or what plate returns cannot be struck: it is
        no structure or participant, or answers NaN or nothing.
    AssertionError
        If a number differs by more than its printed digits or scatter allow; the message lists each one.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.testing.assert_literature(hl.contact_law)
    >>> def plate(side, thickness, material, x, y):
    ...     edges = hl.Supports(*["simple"] * 4)
    ...     return hl.kirchhoff_plate(side, side, thickness, material, edges, cells=(16, 16)).at(x, y)
    >>> hl.testing.assert_literature(plate=plate)
    """
    from hertzlink.studies.literature import of_chains, of_plate, problems, too_far

    if law is None and plate is None:
        raise ValueError("law = None, plate = None: give one of them, or both")
    _positive("rtol", rtol)
    found: list[str] = []
    if law is not None:
        _function("law", law, 2, "a function of a body and the next body, such as hl.contact_law")
        found += problems(*of_chains(law))
    if plate is not None:
        what = "a function or class of side, thickness, material, x and y"
        if not callable(plate):
            raise ValueError(f"plate = {_short(plate)}: must be {what}")
        _takes("plate", plate, 5, what)
        frequencies, motions = of_plate(plate)
        found += problems(frequencies, {name: rtol * value for name, value in frequencies.items()})
        found += too_far(motions, 10.0 * rtol)
    if found:
        raise AssertionError("\n".join([f"{_count_of(len(found), 'comparison')} failed:", *found]))
