# ruff: noqa: T201 (a script that prints)
"""Mesh files of all formats, changed at random: each is read as a body or a plate, or refused by a line that names it.

A fault is any other exception, a message of several lines or without the file's name or "mesh", more than 10 s of the
processor, more than 3 GB of memory, and a body whose volume, area or sets cannot be. Files that are read by libraries
are read here in a fork with the same limits: it starts faster than the process that users start.

    python tests/fuzz_meshes.py 20000 [seed] [folder of other files]    reports all faults, each kind once
"""

import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import meshio
import numpy as np
from skfem import Basis, MeshHex, MeshTri
from skfem.io.meshio import to_meshio

from plates.shapes.mesh_from_file import FlatMesh
from structures import reading_process
from structures.bodies.body_mesh import BodyMesh
from structures.meshes import mesh_files, mesh_process

LONGEST = 10.0  # s of the processor
LARGEST_MEMORY = 3 * 1024**3
SIDE = 0.02
STRANGE = (
    "-1",
    "0",
    "nan",
    "inf",
    "1e308",
    "99999999999",
    "2000000000",
    "-5",
    "1e-320",
    "",
    "é",
    "*",
    "1.5",
    "a",
    "1 2",
)

Written = tuple[str, bytes]


class Seed(NamedTuple):
    """A file that is changed: its name in the folder of the tries, its bytes, the file that is read, body or plate."""

    name: str
    data: bytes
    read: str
    plate: bool


def seeds(folder: Path, only_text: bool = False) -> list[Written]:
    """Files of each format, small: a cube with sets, and a square; or those that no library reads alone."""
    line = np.linspace(0.0, SIDE, 3)
    cube, square = to_meshio(MeshHex.init_tensor(line, line, line)), to_meshio(MeshTri.init_tensor(line, line))
    square.points = np.column_stack([square.points, np.zeros(len(square.points))])
    files = []
    for name, mesh in (("cube", cube), ("square", square)):
        count = len(mesh.cells[0].data)
        base = np.flatnonzero(mesh.points[:, 1] == 0.0)
        files.append((f"{name}.inp", abaqus(mesh, base).encode()))
        if only_text:
            continue
        facet = ("quad", mesh.cells[0].data[:1, :4]) if name == "cube" else ("line", mesh.cells[0].data[:1, :2])
        tagged = meshio.Mesh(mesh.points, [*mesh.cells, facet])
        tagged.cell_data = {"part": [np.full(count, 1), np.full(1, 2)]}
        for suffix, kind in (
            (".vtu", "vtu"),
            (".vtk", "vtk42"),
            (".xdmf", "xdmf"),
            (".med", "med"),
            (".nas", "nastran"),
        ):
            path = folder / f"{name}{suffix}"
            meshio.write(path, tagged, file_format=kind, **({"data_format": "XML"} if kind == "xdmf" else {}))
            files.append((path.name, path.read_bytes()))
        path = folder / f"{name}-text.vtu"
        meshio.write(path, tagged, file_format="vtu", binary=False)
        files.append((path.name, path.read_bytes()))
        tagged.cell_data = {key: [np.full(count, 1), np.full(1, 2)] for key in ("gmsh:physical", "gmsh:geometrical")}
        for kind, binary in (("gmsh22", False), ("gmsh22", True)):
            path = folder / f"{name}-{kind}-{binary}.msh"
            meshio.write(path, tagged, file_format=kind, binary=binary)
            files.append((path.name, path.read_bytes()))
        files += converted(folder, name)
    return files


def abaqus(mesh: meshio.Mesh, base: Any) -> str:
    """A part that is placed twice, with a set of each kind."""
    cells = mesh.cells[0]
    kind = {"hexahedron": "C3D8", "triangle": "S3"}[cells.type]
    rows = "".join(f"{i}, {x}, {y}, {z}\n" for i, (x, y, z) in enumerate(mesh.points.tolist(), 1))
    elements = "".join(f"{i}, {', '.join(str(n + 1) for n in cell)}\n" for i, cell in enumerate(cells.data.tolist(), 1))
    return (
        f"*HEADING\nfuzz\n*PART, NAME=P\n*NODE, NSET=all\n{rows}*ELEMENT, TYPE={kind}, ELSET=cells\n{elements}"
        f"*NSET, NSET=base\n{', '.join(str(n + 1) for n in base)}\n*ELSET, ELSET=some, GENERATE\n1, 4, 1\n"
        "*SURFACE, NAME=low\nsome, S1\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n"
        "*END INSTANCE\n*NSET, NSET=held, INSTANCE=I\nbase\n*END ASSEMBLY\n"
    )


def converted(folder: Path, name: str) -> list[Written]:
    """What gmsh writes, where it is installed."""
    if not mesh_process._gmsh_works():
        return []
    import gmsh

    files = []
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0.0)
        gmsh.merge(str(folder / f"{name}-gmsh22-False.msh"))
        for suffix, version in ((".unv", 4.1), (".bdf", 4.1), (".med", 4.1), (".msh", 4.1), (".msh", 4.0)):
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            path = folder / f"{name}-{version}-gmsh{suffix}"
            gmsh.write(str(path))
            files.append((path.name, path.read_bytes()))
    finally:
        gmsh.finalize()
    return files


def of_folder(files: Path, folder: Path) -> list[Seed]:
    """Files of a folder, copied; the data of an .xdmf file lie in the .h5 file that has its name."""
    copies = [Path(shutil.copy(file, folder)) for file in sorted(files.iterdir()) if file.is_file()]
    for file in copies:
        file.chmod(0o644)
    read = {file.name: file.with_suffix(".xdmf") if file.suffix == ".h5" else file for file in copies}
    plates = {path: _is_plate(path) for path in set(read.values())}
    return [Seed(file.name, file.read_bytes(), read[file.name].name, plates[read[file.name]]) for file in copies]


def _is_plate(path: Path) -> bool:
    """Whether a panel can be made of a file as it stands; one that is refused counts as a body."""
    try:
        FlatMesh(path, 1e-3)
    except ValueError:
        return False
    return True


def mutated(draw: random.Random, data: bytes) -> bytes:
    """The file with one to four changes: bytes, numbers, lines, blocks that are cut, doubled, moved or exchanged."""
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        data = draw.choice(CHANGES)(draw, data)
    return data


def _flip(draw: random.Random, data: bytes) -> bytes:
    at = draw.randrange(max(len(data), 1))
    return data[:at] + bytes([draw.randrange(256)]) + data[at + 1 :]


def _cut(draw: random.Random, data: bytes) -> bytes:
    return data[: draw.randrange(len(data) + 1)]


def _lift(draw: random.Random, data: bytes) -> bytes:
    at, count = draw.randrange(len(data) + 1), draw.choice((1, 4, 40, 400))
    return data[:at] + data[at + count :]


def _double(draw: random.Random, data: bytes) -> bytes:
    at, count = draw.randrange(len(data) + 1), draw.choice((1, 4, 40, 400))
    return data[: at + count] + data[at:]


def _number(draw: random.Random, data: bytes) -> bytes:
    """Another number, or no number, in place of a word."""
    words = data.split(b" ")
    at = draw.randrange(len(words))
    ends = words[at].split(b"\n")
    ends[draw.randrange(len(ends))] = draw.choice(STRANGE).encode()
    words[at] = b"\n".join(ends)
    return b" ".join(words)


def _line(draw: random.Random, data: bytes) -> bytes:
    """Lines that are lost, doubled or exchanged."""
    lines = data.split(b"\n")
    one, other = draw.randrange(len(lines)), draw.randrange(len(lines))
    what = draw.randrange(3)
    if what == 0:
        del lines[one]
    elif what == 1:
        lines.insert(one, lines[other])
    else:
        lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


CHANGES: tuple[Callable[[random.Random, bytes], bytes], ...] = (
    _flip,
    _flip,
    _cut,
    _lift,
    _double,
    _number,
    _number,
    _line,
)


def in_a_fork(script: Path, function: str, path: Path, *, seconds: int, memory: int) -> Any:
    """What `reading_process.read_apart` gives."""
    with tempfile.TemporaryFile() as answer, tempfile.TemporaryFile() as errors:
        child = os.fork()
        if child == 0:
            os.dup2(answer.fileno(), 1)
            os.dup2(errors.fileno(), 2)
            held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            try:
                status = reading_process.main(str(script), function, str(seconds), str(memory + held), str(path))
            except BaseException:  # noqa: BLE001 (as the interpreter would)
                os.write(2, traceback.format_exc().encode())
                status = 1
            os._exit(status)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        answer.seek(0)
        errors.seek(0)
        return reading_process.answer_of(status, answer.read(), errors.read())


@contextmanager
def bounded() -> Iterator[None]:
    """Raises TimeoutError after LONGEST seconds of the processor in this process."""

    def late(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def fault_of(path: Path, plate: bool) -> str | None:
    """What is wrong with the way a file is read as a body or a plate, or None."""
    began = time.process_time(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    try:
        with bounded(), warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            found = _measured(path, plate)
    except ValueError as error:
        text = str(error)
        last = traceback.extract_tb(error.__traceback__)[-1]
        line = (last.line or "").strip()
        if not line.startswith("raise"):
            return f"raw ValueError [{Path(last.filename).name}:{last.lineno}] {text[:150]}"
        if "\n" in text or "mesh" not in text or "Traceback" in text:
            return f"unnamed ValueError {text[:150]}"
        found = None
    except TimeoutError:
        return "hangs"
    except BaseException as error:  # noqa: BLE001 (whatever is raised is examined)
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} [{Path(last.filename).name}:{last.lineno}] {str(error)[:150]}"
    taken = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - began[1]
    if max(taken, time.process_time() - began[0]) > LONGEST:
        return f"takes {taken:.1f} s"
    # A fork holds what this process does, which by then may have run hundreds of other tests.
    here, fork = (resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    if (fork - here) * 1024 > LARGEST_MEMORY:
        return "memory"
    raw = [one for one in said if not isinstance(one.message, UserWarning)]
    return f"raw warning {raw[0].message}" if raw else found


def _measured(path: Path, plate: bool) -> str | None:
    """Whether the volume or area is positive and fits the box, and each set lies within the body."""
    if not plate:
        body = BodyMesh(path)
        size = float(Basis(body.mesh, body.element(), intorder=body.order).dx.sum())
        box, sets = float(np.ptp(body.mesh.p, axis=1).prod()), body.cells.groups
        whole = body.area(body.mesh.boundary_facets())
        areas = [body.area(facets) for facets in body.facets.groups.values() if facets.size]
        if any(area > whole * (1.0 + 1e-9) for area in areas):
            return "a set has more area than the body"
        if any(cells.max() >= body.mesh.nelements for cells in sets.values()):
            return "a set has cells that do not exist"
    else:
        flat = FlatMesh(path, 1e-3)
        left, right, low, high = flat.box
        size, box = flat.area, (right - left) * (high - low)
    # Cells that lie apart may overlap in space; a body of one piece mostly does not.
    return None if np.isfinite(size) and 0.0 < size <= 2.0 * box else f"size {size:.3g} in a box of {box:.3g}"


@contextmanager
def by_forks() -> Iterator[None]:
    """Reads files of libraries in forks inside this context."""
    before = mesh_files.read_apart
    mesh_files.read_apart = in_a_fork
    try:
        yield
    finally:
        mesh_files.read_apart = before


def tries(
    folder: Path, count: int, seed: int, only_text: bool = False, files: Path | None = None
) -> Iterator[tuple[Seed, bytes, str | None]]:
    """The file that was changed, its bytes as changed, and the fault, for each try."""
    draw = random.Random(seed)
    written = [] if files else seeds(folder, only_text)
    chosen = [Seed(name, data, name, name.startswith("square")) for name, data in written]
    chosen += of_folder(files, folder) if files else []
    for _ in range(count):
        file = draw.choice(chosen)
        changed = mutated(draw, file.data)
        (folder / file.name).write_bytes(changed)
        yield file, changed, fault_of(folder / file.read, file.plate)
        (folder / file.name).write_bytes(file.data)


def main(count: int, seed: int, files: Path | None) -> int:
    """Reports each kind of fault once, with the file that shows it."""
    folder, found, slowest = Path(tempfile.mkdtemp(prefix="fuzz_meshes")), Counter[tuple[str, str]](), 0.0
    began = time.process_time(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    with by_forks():
        for i, (file, changed, fault) in enumerate(tries(folder, count, seed, files=files), 1):
            ended = time.process_time(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            slowest, began = max(slowest, ended[0] - began[0] + ended[1] - began[1]), ended
            key = (Path(file.name).suffix, (fault or "")[:60])
            found[key] += bool(fault)
            if found[key] == 1:
                shown = folder / f"fault{i}-{file.name}"
                shown.write_bytes(changed)
                print(f"{i} {shown}: {fault}", flush=True)
            if i % 1000 == 0:
                print(f"{i} files, {sum(found.values())} faults, slowest {slowest:.1f} s", flush=True)
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024**2
    print(f"{count} files, faults {dict(+found)}, slowest {slowest:.1f} s, at most {memory:.2f} GB")
    return 1 if +found else 0


if __name__ == "__main__":
    others = Path(sys.argv[3]) if len(sys.argv) > 3 else None
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0, others))
