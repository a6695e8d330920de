"""Structures from other programs in case files: the numbers of the same Python, and back."""

from pathlib import Path

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
