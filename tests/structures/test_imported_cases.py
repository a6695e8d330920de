"""Structures from other programs in case files: the numbers of the same Python, and back."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.io import mmwrite

import hertzlink as hl
from hertzlink.cases.case import read

ROD = hl.rod([hl.Layer(hl.ALUMINIUM_6061, length=0.1, radius=0.01)], elements=4)
CHAIN = """
chain = { beads = 6, bead = { shape = "sphere", radius = "4.76 mm", material = "steel 440C" }, impact_speed = 0.02 }
run.until = "0.3 ms"
[structure]
"""


def case(tmp_path: Path, structure: str) -> Path:
    for name in ("mass", "stiffness"):
        mmwrite(tmp_path / f"{name}.mtx", sparse.coo_matrix(getattr(ROD, name)), precision=17)
    np.savetxt(tmp_path / "contact.txt", ROD.contact)
    (tmp_path / "modes.csv").write_text("frequency,shape\n900,2.0\n2500,1.5\n")
    (tmp_path / "case.toml").write_text(CHAIN + structure)
    return tmp_path / "case.toml"


def test_matrices_in_a_case(tmp_path: Path) -> None:
    files = 'mass = "mass.mtx"\nstiffness = "stiffness.mtx"\ncontact = "contact.txt"\n'
    run = read(case(tmp_path, 'kind = "matrices"\nmaterial = "aluminium 6061"\n' + files))[0].run()
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    body = hl.from_matrices(ROD.mass, ROD.stiffness, hl.ALUMINIUM_6061, ROD.contact)
    same = hl.CoSimulation(hl.Chain([bead] * 6, bead, impact_speed=0.02), body).run(until=3e-4)
    assert run.contact_force.equals(same.contact_force)


def test_modes_in_a_case(tmp_path: Path) -> None:
    text = 'kind = "modes"\nfrequencies = "modes.csv"\nresidual_flexibility = "1e-9 m/N"\nmaterial = "PTFE"\n'
    run = read(case(tmp_path, text))[0].run()
    assert json.loads(run.attrs["input"])["structure"]["modes"] == 2


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ('stiffness = "stiffness.mtx"\ncontact = "contact.txt"', "structure.mass: is missing; give the file of a mass"),
        ('mass = "no.mtx"\nstiffness = "stiffness.mtx"\ncontact = "contact.txt"', 'structure.mass: there is no file "'),
    ],
)
def test_faults_name_the_entry(tmp_path: Path, entries: str, message: str) -> None:
    path = case(tmp_path, f'kind = "from_matrices"\nmaterial = "PTFE"\n{entries}\n')
    with pytest.raises(ValueError) as caught:
        read(path)[0].run()
    assert message in str(caught.value)
