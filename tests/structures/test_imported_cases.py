"""Structures from other programs in case files: the numbers of the same Python, and back."""

import json
from pathlib import Path

import numpy as np
import pytest

import hertzlink as hl
from hertzlink.cases.case import read

DATA = Path(__file__).parent / "data" / "calculix"
CHAIN = """[chain]
beads = 6
bead = { shape = "sphere", radius = "4.76 mm", material = "steel 440C" }
striker = "bead"
impact_speed = "0.02 m/s"
[run]
until = "0.3 ms"
[structure]
"""


def case(tmp_path: Path, structure: str) -> Path:
    for file in DATA.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "case.toml").write_text(CHAIN + structure)
    return tmp_path / "case.toml"


def test_matrices_in_a_case(tmp_path: Path) -> None:
    text = 'kind = "matrices"\nmass = "one_cell.mas"\nstiffness = "one_cell.sti"\nnode = 7\nresidual_flexibility = 0\n'
    run = read(case(tmp_path, text + 'material = "aluminium 6061"\n'))[0].run()
    cell = hl.from_matrices(
        tmp_path / "one_cell.mas", tmp_path / "one_cell.sti", hl.ALUMINIUM_6061, node=7, residual_flexibility=0.0
    )
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    same = hl.CoSimulation(hl.Chain([bead] * 6, bead, impact_speed=0.02), cell).run(until=3e-4)
    assert run.contact_force.equals(same.contact_force)
    again = hl.from_input(run.attrs["input"])
    assert again.run().contact_force.equals(run.contact_force)


def test_modes_and_a_response_in_a_case(tmp_path: Path) -> None:
    s = 2j * np.pi * (hertz := np.linspace(50.0, 9e3, 300))
    values = s / (1.7e7 + 20.0 * s + 0.0141 * s**2)
    np.savetxt(tmp_path / "mobility.csv", np.column_stack([hertz, values.real, values.imag]), delimiter=",")
    modes = 'kind = "modes"\nfrequencies = "one_cell.frd"\nnode = 7\nresidual_flexibility = "1e-9 m/N"\n'
    response = 'kind = "frequency_response"\nresponse = "mobility.csv"\n'
    for text, size in ((modes, 3), (response, None)):
        done = read(case(tmp_path, text + 'material = "PTFE"\n'))[0].run()
        again = hl.from_input(done.attrs["input"])
        assert again.run().contact_force.equals(done.contact_force)
        assert size is None or json.loads(done.attrs["input"])["structure"]["modes"] == size


def test_numbers_in_memory_are_in_no_case() -> None:
    body = hl.from_modes([900.0], hl.PTFE, shapes=[2.0], residual_flexibility=0.0)
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    run = hl.CoSimulation(hl.Chain([bead] * 6, bead, impact_speed=0.02), body).run(until=3e-4)
    with pytest.raises(ValueError, match="numbers in memory; write them to a file"):
        hl.from_input(run.attrs["input"])


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ('stiffness = "one_cell.sti"\nnode = 7', "structure.mass: is missing; give the file of a mass matrix"),
        ('mass = "no.mas"\nstiffness = "one_cell.sti"\nnode = 7', 'structure.mass: there is no file "'),
        ('mass = "one_cell.mas"\nstiffness = "one_cell.sti"\nnode = 70', "structure.node: 70 is none of the 7 nodes"),
    ],
)
def test_faults_name_the_entry(tmp_path: Path, entries: str, message: str) -> None:
    path = case(tmp_path, f'kind = "from_matrices"\nmaterial = "PTFE"\n{entries}\n')
    with pytest.raises(ValueError) as caught:
        read(path)[0].run()
    assert message in str(caught.value)
