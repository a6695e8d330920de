"""Calls of the public API with bad and extreme arguments: a finite result, or an error that names an argument.

`python tests/fuzz.py 10000 seed` reports each kind of fault once, where a test stops at the first.
"""

import random
import warnings
from functools import cache
from pathlib import Path
from typing import Any

import fuzz
import fuzz_cases
import pytest
from fuzz_targets import targets, things
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st
from test_docstrings import PUBLIC

from hertzlink.cases import CaseError

QUICK, MANY = 200, 1_500
"""Calls of the quick and of the thorough test."""

CHEAP = (
    *("Sphere", "HollowSphere", "Cylinder", "Ellipsoid", "Material", "Surface", "drop_speed", "Layer", "Outline"),
    *("Supports", "circle", "critical_distance", "rod", "theory.hertz_stiffness", "theory.hertz_pressure"),
    *("theory.UniformChain", "theory.zener_restitution", "theory.hertz_contact_time"),
)
"""Targets of the quick test, of which a call takes about a millisecond."""

ROOMS = ("theory.", "Sphere", "HollowSphere", "Cylinder")
"""Beginnings of the names of closed forms."""

ELSEWHERE = {  # and plots, whose tests have tables of bad calls
    # Protocols and bases of a user's own parts: test_own_parts, test_own_step, hertzlink.conformance.
    *("Bead", "laws.ContactLaw", "Dissipation", "Excitation", "damping.Viscous"),
    "stepping.StructureState",
    "laws.YieldingLaw",
    *("HertzlinkWarning", "NotConverged"),
    # Of a user's own parts: test_described, test_quantities, test_extending.
    *("described", "quantities.Quantity", "quantities.Count", "quantities.OneOf"),
}


@cache
def parameters() -> set[str]:
    """The names of all arguments of the API."""
    return {name for one in targets().values() for name in fuzz.argument_names(one)}


def bad_call(data: Any, names: list[str]) -> None:
    """Draw a target and its arguments, and call it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table, others = targets(), things()
    name = data.draw(st.sampled_from(names))
    target = table[name]
    arguments = data.draw(st.lists(st.sampled_from(list(target.good)), min_size=1, max_size=2, unique=True))
    changes = {}
    for one in arguments:
        values = target.values(one, others)
        changes[one] = values[data.draw(st.integers(0, len(values) - 1))]
    note(f"{name}: {str(changes)[:300]}")
    assert fuzz.attempt(target, changes, parameters()) is None


def test_every_public_name_is_a_target() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        covered = {name.split(",")[0].split(" ")[0] for name in targets()}
    assert {name for name in PUBLIC if not name.startswith("plots.")} - covered == ELSEWHERE


def test_a_raw_error_is_a_fault() -> None:
    """The basis of the checks below: Python's own errors, silent NaN and other exceptions are found."""
    wrong = {
        "raw TypeError": lambda size: 1.0 + size,
        "raw ValueError": lambda size: float(size),
        "not finite": lambda size: float("nan"),
        "KeyError": lambda size: {}[size],
    }
    for kind, call in wrong.items():
        fault = fuzz.attempt(fuzz.Target(call, {"size": 1.0}), {"size": "x"}, ())
        assert fault is not None
        assert fault.kind == kind
    assert fuzz.attempt(fuzz.Target(lambda size: size, {"size": 1.0}), {}, ()) is None


@given(st.data())
@settings(max_examples=QUICK, suppress_health_check=list(HealthCheck))
def test_bad_calls_of_cheap_functions(data: Any) -> None:
    bad_call(data, [*CHEAP])


@pytest.mark.parametrize("count", [QUICK, pytest.param(MANY, marks=pytest.mark.thorough)])
def test_wrong_cases(count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for seed in range(count):
        fault = fuzz_cases.attempt(fuzz_cases.wrong_case(random.Random(seed)))
        assert fault is None, f"seed {seed}: {fault}"


def test_a_fault_of_a_case_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    def raw(_: str) -> None:
        raise KeyError("x")

    def several_lines(_: str) -> None:
        raise CaseError("case.toml: one\ntwo")

    for read, fault in ((raw, "KeyError"), (several_lines, "no place")):
        assert (fuzz_cases.attempt({}, read) or "").startswith(fault)


@pytest.mark.thorough
def test_good_calls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each target by itself is right, or the search would try one argument of a call that fails at another."""
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table = targets()
    faults = {name: fuzz.attempt(target, {}, parameters()) for name, target in table.items()}
    assert {name: fault for name, fault in faults.items() if fault} == {}


@pytest.mark.thorough
def test_bad_calls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Calls of closed forms; `python tests/fuzz.py` searches runs, structures, plates and pictures, some of which last
    seconds."""
    inside = tmp_path / "inside"
    inside.mkdir()
    monkeypatch.chdir(inside)  # some targets write files
    closed_forms = [name for name in targets() if name.startswith(ROOMS)]

    @given(st.data())
    @settings(max_examples=MANY, suppress_health_check=list(HealthCheck))
    def search(data: Any) -> None:
        bad_call(data, closed_forms)

    search()
