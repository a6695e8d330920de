"""Bodies that CalculiX meshed, through their matrices, against those of hertzlink: AR, and the figure of the docs.

    python benchmarks/calculix.py FOLDER [PICTURE]

Needs ccx. A block and a plate of C3D10 are `solid` here; a plate of S8 is `mindlin_plate`. The block is pressed on
a patch and on a node, in finer and finer meshes: the point force indents the mesh the more, the patch does not. FOLDER
takes the files of CalculiX.
"""

import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import hertzlink as hl
from structures.linear_algebra.factor import factorise

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "structures"))
from test_imported import write_box

METAL, BEAD, UNTIL, SENSOR = hl.ALUMINIUM_6061, hl.Sphere(4.76e-3, hl.STEEL_440C), 0.9e-3, 5
BLOCK, PLATE, SHELL = (0.04, 0.04, 0.04), (0.1, 0.1, 0.008), (0.1, 0.004)
CELLS, RADIUS = (8, 10, 12, 14), 0.011


def solved(folder: Path, name: str) -> dict[str, Path]:
    """Run CalculiX; return the matrices."""
    subprocess.run(["ccx", name], cwd=folder, check=True, capture_output=True)
    return {"mass": folder / f"{name}.mas", "stiffness": folder / f"{name}.sti"}


def struck(body: hl.Structure) -> tuple[float, Any]:
    run = hl.CoSimulation(hl.Chain([BEAD] * 12, BEAD, 0.02), hl.reduce(body, UNTIL)).run(until=UNTIL)
    return float(hl.reflections(run, sensor=SENSOR).primary.amplitude_ratio), run


def compliance(body: hl.Structure) -> float:
    """Return the compliance at the contact for forces that grow as e^(st), nm/N: a free body has no static one."""
    dynamic = body.stiffness + (2.0 * np.pi * 35e3) ** 2 * body.mass
    return 1e9 * float(body.contact @ factorise(dynamic)(body.contact) + body.flexibility)


def write_shell(path: Path, cells: int) -> int:
    """Write a free plate of S8 and the step that stores its matrices; return the node in its middle."""
    side, thickness = SHELL
    line = np.linspace(0.0, side, 2 * cells + 1)
    number = np.arange(line.size**2).reshape(line.size, -1) + 1
    ring = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    first = [(2 * i, 2 * j) for i in range(cells) for j in range(cells)]
    elements = [[number[i + a, j + b] for a, b in ring] for i, j in first]
    rows = [
        "*NODE",
        *(f"{n}, {line[(n - 1) // line.size]:.9g}, {line[(n - 1) % line.size]:.9g}, 0" for n in np.unique(elements)),
    ]
    rows += ["*ELEMENT, TYPE=S8, ELSET=BODY", *(", ".join(map(str, (i, *e))) for i, e in enumerate(elements, 1))]
    rows += ["*MATERIAL, NAME=METAL", "*ELASTIC", f"{METAL.youngs_modulus!r}, {METAL.poisson_ratio!r}", "*DENSITY"]
    rows += [f"{METAL.density!r}", "*SHELL SECTION, ELSET=BODY, MATERIAL=METAL", f"{thickness}"]
    path.write_text("\n".join([*rows, "*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "*END STEP", ""]))
    return int(number[cells, cells])


def main(folder: Path, picture: Path | None) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore")  # the metal yields; both programs are elastic
    runs, patch, node = {}, [], []
    for name, cells, sides, radius in (("block", (10, 10, 10), BLOCK, RADIUS), ("plate", (24, 24, 1), PLATE, RADIUS)):
        write_box(folder / f"{name}.inp", cells, sides)
        at = {"mesh": folder / f"{name}.inp", "patch_radius": radius}
        point = (sides[0] / 2.0, sides[1] / 2.0, sides[2])
        theirs = struck(hl.from_matrices(**solved(folder, name), material=METAL, point=point, **at))
        ours = struck(hl.solid(material=METAL, contact=point, **at))
        runs[name] = theirs[1], ours[1]
        print(
            f"{name}: AR {theirs[0]:.6f} (CalculiX), {ours[0]:.6f} (solid), difference {theirs[0] / ours[0] - 1.0:.1e}"
        )
    middle = write_shell(folder / "shell.inp", 24)
    theirs = struck(hl.from_matrices(**solved(folder, "shell"), material=METAL, node=middle))
    plate = hl.mindlin_plate(SHELL[0], SHELL[0], SHELL[1], METAL, hl.Supports(), highest_frequency=1e5)
    ours = struck(plate.at(SHELL[0] / 2.0, SHELL[0] / 2.0))
    print(f"shell: AR {theirs[0]:.5f} (CalculiX), {ours[0]:.5f} (Mindlin), difference {theirs[0] / ours[0] - 1.0:.1e}")
    for count in CELLS:
        write_box(folder / "fine.inp", (count,) * 3, BLOCK)
        files, point = solved(folder, "fine"), (BLOCK[0] / 2.0, BLOCK[1] / 2.0, BLOCK[2])
        spread = {"mesh": folder / "fine.inp", "point": point, "patch_radius": RADIUS}
        patch.append(compliance(hl.from_matrices(**files, material=METAL, **spread)))
        middle = 1 + count * (2 * count + 1) ** 2 + count * (2 * count + 1) + 2 * count
        node.append(compliance(hl.from_matrices(**files, material=METAL, node=middle)))
        print(f"block of {count}³ cells: {patch[-1]:.3f} nm/N on a patch, {node[-1]:.3f} nm/N on a node")
    if picture is None:
        return
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
    for colour, (name, (theirs, ours)) in zip(("C0", "C1"), runs.items(), strict=True):
        force = [run.contact_force.isel(contact=-1) for run in (ours, theirs)]
        left.plot(1e6 * ours.time, force[0], colour, lw=3.0, alpha=0.35, label=f"{name}, solid")
        left.plot(1e6 * theirs.time, force[1], colour, lw=1.0, label=f"{name}, CalculiX's matrices")
    left.set(xlabel="time, µs", ylabel="force on the body, N", xlim=(100.0, 700.0))
    left.legend(frameon=False, fontsize=8)
    right.plot([1e3 * BLOCK[0] / n for n in CELLS], patch, "o-", label="on a patch, its compliance taken away")
    right.plot([1e3 * BLOCK[0] / n for n in CELLS], node, "s-", label="on a node")
    right.set(xlabel="edges of the mesh, mm", ylabel="compliance of the block, nm/N")
    right.invert_xaxis()
    right.legend(frameon=False, fontsize=8)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
