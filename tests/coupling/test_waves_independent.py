"""The wave finder beside a rule that follows the reflected wave through the map of the power, and shares no code."""

import warnings
from collections.abc import Iterator

import pytest
import xarray as xr
from independent.chains import COUNT, run_of
from independent.waves import changes, compare

import hertzlink as hl


def found(run: xr.Dataset, sensor: int) -> tuple[float, float] | None:
    """AR and TOF of the primary wave, None where there is none."""
    wave = hl.reflections(run, sensor).primary
    return (wave.amplitude_ratio, wave.time_of_flight) if wave else None


def is_doubted(run: xr.Dataset, sensor: int) -> bool:
    """True if the user is warned that a small change may give another wave, or that the record is short."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        hl.reflections(run, sensor)
    return any("a small change" in str(one.message) or "record" in str(one.message) for one in caught)


def runs(numbers: range, scale: float = 1.0) -> Iterator[tuple[str, xr.Dataset]]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield from (run_of(number, scale) for number in numbers)


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
def test_the_finder_and_the_eye_agree() -> None:
    agree, beads, differ = compare(found, runs(range(0, COUNT, 2)))
    assert beads > 1000
    assert agree >= 0.975 * beads, "\n".join(map(str, differ))
    assert sum(not one.doubt for one in differ) <= 0.01 * beads, "\n".join(map(str, differ))


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
def test_a_small_change_of_a_radius_changes_little() -> None:
    """The change is 0.1 %: the same pulse is found. If another one is, with a TOF 1 % apart, there was a warning.

    AR itself may change by some percent: beads that rattle scatter the wave, and the eye's AR changes as much.
    """
    silent, beads = list[str](), 0
    for number in range(0, COUNT, 8):
        (first,), (second,) = runs(range(number, number + 1)), runs(range(number, number + 1), 1.001)
        _, count, differ = changes(found, [(first, second)])
        beads += count
        jumps = [one for one in differ if one.kind != "AR"]
        silent += [str(one) for one in jumps if not any(is_doubted(run, one.bead) for _, run in (first, second))]
    assert beads > 200
    assert len(silent) <= 0.01 * beads, "\n".join(silent)
