"""Numbers of other authors: what is reproduced stays so, a wrong law is seen, and no row lacks its source."""

import dataclasses
import warnings
from collections import Counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from hertzlink.studies import literature as study
from hertzlink.studies.writing import Written


@pytest.fixture(scope="module")
def chains() -> tuple[dict[str, float], dict[str, float]]:
    with warnings.catch_warnings():
        warnings.simplefilter("error", hl.HertzlinkWarning)
        return study.of_chains()


def test_hertz_gives_the_published_numbers_of_chains(chains: tuple[dict[str, float], ...]) -> None:
    assert study.problems(*chains) == []


@pytest.mark.parametrize(
    ("name", "value"),
    [("Hinch and Saint-Jean: speed of the last ball", 0.98), ("LAMMPS: largest overlap of two spheres", 274.2)],
)
def test_a_number_that_differs_is_named(chains: tuple[dict[str, float], ...], name: str, value: float) -> None:
    values, errors = chains
    (line,) = study.problems(values | {name: value}, errors)
    assert name in line


def test_each_value_that_was_compared_is_named(chains: tuple[dict[str, float], ...]) -> None:
    values, errors = chains
    name = "MOOSE: restitution at 3 m/s"
    (line,) = study.problems(values | {name: 0.67, f"{name}{study.OTHERWISE}{study.PARTED}": 0.65}, errors)
    assert line == f"  {name}: 0.67; 0.65 if {study.PARTED}; printed 0.661"


def test_a_wrong_law_is_refused() -> None:
    def softer(first: hl.Bead, second: hl.Bead | hl.Surface) -> hl.ContactLaw:
        law = hl.contact_law(first, second)
        return hl.laws.PowerLaw(0.9 * float(law.force(1.0)), 1.5)

    with pytest.raises(AssertionError, match="LAMMPS: largest overlap of two spheres"):
        hl.testing.assert_literature(softer)


@pytest.mark.parametrize(("size", "exponent"), [(1.0, 1.6), (0.1, 1.5), (100.0, 1.5)])
def test_a_law_far_from_hertzs_is_refused_with_the_numbers_that_differ(size: float, exponent: float) -> None:
    """Some of its waves do not come within the record, or have no width."""

    def far(first: hl.Bead, second: hl.Bead | hl.Surface) -> hl.ContactLaw:
        return hl.laws.PowerLaw(size * float(hl.contact_law(first, second).force(1.0)), exponent)

    with pytest.raises(AssertionError, match=r"MOOSE: the same duration, by its formula: .*; printed 0\.81"):
        hl.testing.assert_literature(far)


def on_simple_edges(side: float, thickness: float, material: hl.Material, x: float, y: float) -> hl.Structure:
    return hl.kirchhoff_plate(side, side, thickness, material, hl.Supports(*["simple"] * 4), cells=(16, 16)).at(x, y)


def test_a_plate_has_the_published_frequencies() -> None:
    hl.testing.assert_literature(plate=on_simple_edges)


def test_a_plate_that_is_too_thick_is_refused() -> None:
    with pytest.raises(AssertionError, match=r"8 comparisons(.|\n)*simple edges: mode 4: 9\.697.* Hz; printed 9\.507"):
        hl.testing.assert_literature(plate=lambda side, thickness, *of: on_simple_edges(side, 1.02 * thickness, *of))


class Two:
    """Two masses on springs, of which one is damped, advanced exactly: a participant."""

    surface = hl.Surface(hl.PTFE)
    rates = np.array([-0.3 + 2.0j * np.pi * 3.0, 2.0j * np.pi * 7.1])

    def start(self) -> np.ndarray:
        return np.zeros(2, complex)

    def advance(self, state: np.ndarray, force: float, window: float) -> tuple[np.ndarray, float]:
        grown = np.exp(self.rates * window)
        state = grown * state + force * (grown - 1.0) / self.rates
        return state, float(state.imag.sum())


def test_ringing_finds_the_frequencies_of_a_participant() -> None:
    found, _ = study.ringing(Two(), 3.0, 7.0)
    for frequency in (3.0, 7.1):
        assert abs(found / frequency - 1.0).min() < 1e-7


class Answers:
    """A participant that gives one displacement, or None for its answer."""

    surface = hl.Surface(hl.PTFE)

    def __init__(self, answer: float | None) -> None:
        self.answer = answer

    def start(self) -> float:
        return 0.0

    def advance(self, state: float, force: float, window: float) -> Any:
        return None if self.answer is None else (state, self.answer)


def test_a_plate_that_moves_too_far_is_refused() -> None:
    def light(side: float, thickness: float, material: hl.Material, x: float, y: float) -> hl.Structure:
        plate = on_simple_edges(side, thickness, material, x, y)
        return dataclasses.replace(plate, mass=plate.mass / 1.03, stiffness=plate.stiffness / 1.03, matrices=None)

    with pytest.raises(AssertionError, match=r"2 comparisons failed:\n  NAFEMS, simple edges: modes .* 1\.03 times"):
        hl.testing.assert_literature(plate=light)


@pytest.mark.parametrize(
    ("returned", "named"),
    [(None, "plate = NoneType: must be a Structure"), (Answers, "plate = the class Answers"),
     (SimpleNamespace(surface=hl.Surface(hl.PTFE), start=lambda: 0.0), "has no advance; must be a Structure"),
     (Answers(float("nan")), r"plate: Answers\.advance returned a displacement of nan"),
     (Answers(0.0), r"plate: Answers\.advance returned no displacement"),
     (Answers(None), r"plate: Answers\.advance returned None")],
)  # fmt: skip
def test_what_cannot_be_struck_is_named(returned: Any, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        hl.testing.assert_literature(plate=lambda *of: returned)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [({}, "law = None, plate = None"), ({"plate": 3}, "plate = 3"), ({"plate": lambda side: side}, "plate"),
     ({"law": hl.contact_law, "rtol": 0.0}, "rtol = 0.0")],
)  # fmt: skip
def test_wrong_arguments_are_named(arguments: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        hl.testing.assert_literature(**arguments)


def test_a_law_that_is_no_function_is_named() -> None:
    with pytest.raises(ValueError, match="law"):
        hl.testing.assert_literature(hl.laws.JacksonGreen())  # type: ignore[arg-type]


def test_every_number_has_a_source_and_a_set_up() -> None:
    entries = study.row.entries
    assert len(entries) >= 40
    assert all(entry.source and entry.reason for entry in entries.values())
    assert sum(study.MEMORY not in source for source in study.sources().values()) >= 35


@pytest.mark.thorough
def test_verdicts_table_and_figures() -> None:
    data: xr.Dataset = study.run(quick=True)
    words = Counter(word for _, _, word, _ in study.judged(data))
    assert words == {
        "reproduced": 20, "reproduced under a condition": 3, "differs": 15, "misprint": 2, "not defined": 2,
    }  # fmt: skip
    assert float(abs(data.error).max()) < 0.5
    written = Written("literature", study, data)
    assert "literature" in written.table.splitlines()[0]
    assert set(study.figures(data)) == {"differences", "wave"}
