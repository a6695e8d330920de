"""Numbers of the thesis computed without hertzlink: the scripts give what values.json keeps, and are right themselves.

`coarse` recomputes an entry with a hundred times the tolerance and cells twice as long: it has to lie as far from the
file's value as the file says. The tools are compared with closed forms that the entries do not contain.
"""

import ast
import sys
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from independent.thesis import ellipses, plates
from independent.thesis.chapters import CHAPTERS, entries
from independent.thesis.line import on_rods, rod_cells
from independent.thesis.materials import PTFE, STEEL_440C
from independent.thesis.values import COARSE, Entry, load, numbers
from scipy.integrate import quad
from scipy.linalg import eigvalsh

QUICK = ("geometry", "fem_validation")
SLOW = [chapter.group for chapter in CHAPTERS if chapter.group not in QUICK]
SCATTER = 1e-4
"""Other processors and other versions of the libraries step differently: losses that switch on and off, and peaks that
are sampled, have changed by 1.4e-5."""


def coarse(entry: Entry) -> list[str]:
    """The variants that differ from the file's."""
    known, found = load()[entry.name]["values"], entry.compute(COARSE)
    assert list(found) == list(known)
    wrong = []
    for variant, value in found.items():
        kept = known[variant]
        for given, fine, error in zip(numbers(value), numbers(kept["value"]), numbers(kept["error"]), strict=True):
            if abs(given - fine) > 3.0 * error + SCATTER * abs(fine):
                wrong.append(f"{entry.name}, {variant}: {given:.10g}, in the file {fine:.10g} ± {error:.1g}")
    return wrong


@pytest.mark.parametrize("group", QUICK)
def test_scripts_give_the_file(group: str) -> None:
    assert [line for entry in entries(group) for line in coarse(entry)] == []


@pytest.mark.thorough
@pytest.mark.parametrize("group", SLOW)
def test_slow_scripts_give_the_file(group: str) -> None:
    assert [line for entry in entries(group) for line in coarse(entry)] == []


def test_the_file_holds_every_entry_as_the_scripts_state_it() -> None:
    known = load()
    assert [one.name for one in entries()] == list(known)
    for one in entries():
        kept = known[one.name]
        assert (list(one.printed), one.unit, one.conditions) == (kept["printed"], kept["unit"], kept["conditions"])


def test_nothing_of_hertzlink_is_imported() -> None:
    """numpy, scipy and the standard library."""
    folder = Path(ellipses.__file__).parent
    allowed = set(sys.stdlib_module_names) | {"numpy", "scipy"}
    for file in folder.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            assert {name.partition(".")[0] for name in names} <= allowed, file.name


def test_two_equal_rods_of_cells_are_a_rod_and_converge_to_its_frequency() -> None:
    """Fixed at the base: ω₁ = πc/(2L), second order in the cell."""
    errors = []
    for cell in (10e-3, 5e-3):
        half = rod_cells(0.1, 1e-4, STEEL_440C.density, STEEL_440C.youngs_modulus, cell)
        mass, bonds = on_rods([half, half])
        stiffness = np.diag(bonds + np.append(0.0, bonds[:-1])) - np.diag(bonds[:-1], 1) - np.diag(bonds[:-1], -1)
        lowest = sqrt(eigvalsh(stiffness, np.diag(mass))[0])
        errors.append(1.0 - lowest / (pi * STEEL_440C.bar_speed / 0.4))
    assert 0.0 < errors[1] < 1e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)


def test_an_elliptic_contact_carries_the_force_of_its_pressure() -> None:
    """A contact area of the axes a and b under Hertz's pressure: radii, approach and force (Johnson, 4.23 to 4.26)."""
    a, b, pressure = 2e-4, 0.7e-4, 1e9
    square = 1.0 - (b / a) ** 2
    first = quad(lambda t: (1.0 - square * np.sin(t) ** 2) ** -0.5, 0.0, pi / 2.0, epsabs=0.0)[0]
    second = quad(lambda t: (1.0 - square * np.sin(t) ** 2) ** 0.5, 0.0, pi / 2.0, epsabs=0.0)[0]
    modulus = 0.5 / PTFE.compliance
    larger = 0.5 / (pressure / modulus * b / (square * a**2) * (first - second))
    smaller = 0.5 / (pressure / modulus * b / (square * a**2) * ((a / b) ** 2 * second - first))
    approach, force = pressure / modulus * b * first, 2.0 / 3.0 * pressure * pi * a * b
    body = ellipses.Surface(2.0 * larger, 2.0 * smaller)
    assert ellipses.stiffness(body, body, PTFE) == pytest.approx(force / approach**1.5, rel=1e-9)


def test_waves_of_plates_have_known_speeds() -> None:
    """Rayleigh's at ν = 1/4, √(2 − 2/√3) c_s; A0 tends to Kirchhoff's plate and Rayleigh's wave."""
    assert plates.rayleigh_over_shear(0.25) == pytest.approx(sqrt(2.0 - 2.0 / sqrt(3.0)), rel=1e-12)
    bending = 2e-3 / sqrt(12.0 * plates.PLATE.compliance * plates.PLATE.density)
    frequencies = [1.0 - plates.flexural_frequency(k, 2e-3) / (bending * k**2) for k in (60.0, 30.0)]
    speeds = [1.0 - plates.group_speed(k, 2e-3) / (2.0 * bending * k) for k in (60.0, 30.0)]
    for coarse_one, fine_one in (frequencies, speeds):
        assert 0.0 < fine_one < 2e-3
        assert np.log2(coarse_one / fine_one) == pytest.approx(2.0, abs=0.05)
    short = 20000.0
    surface = plates.rayleigh_over_shear(plates.PLATE.poisson_ratio) * plates.SHEAR
    assert plates.flexural_frequency(short, 2e-3) / short == pytest.approx(surface, rel=1e-6)
