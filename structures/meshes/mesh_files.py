"""Mesh files: which formats are read, by what, and what is checked before."""

import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from structures.checks import existing
from structures.meshes.hdf5 import check_hdf5
from structures.meshes.mesh_process import BY_GMSH
from structures.reading_process import Unread, read_apart

FORMATS = {
    ".msh": "gmsh",
    ".unv": "I-DEAS, Salome",
    ".med": "Salome, Code_Aster",
    ".bdf": "Nastran",
    ".nas": "Nastran",
    ".vtu": "VTK, ParaView",
    ".vtk": "VTK",
    ".xdmf": "XDMF",
    ".xmf": "XDMF",
}
"""The formats that are read, and the programs that write them."""

PROCESS = Path(__file__).with_name("mesh_process.py")

SHORTEST_READING, READING_PER_BYTE = 8.0, 5e-6
"""Processor time, s, that the reading of a file may take, and what each byte adds."""

LEAST_MEMORY, MEMORY_PER_BYTE = 2 * 1024**3, 60
"""Memory, B, that the reading of a file may take, and what each byte adds."""

HDF5 = b"\x89HDF\r\n\x1a\n"
"""The first bytes of every HDF5 file."""

GMSH_STARTS = (b"$MeshFormat", b"$Comments", b"$NOD")
"""How a file of gmsh begins. gmsh takes other text for a program, and runs it."""

DATA_ITEM = re.compile(rb"""<DataItem(?=[^>]*Format\s*=\s*["'](?:HDF|Binary))[^>]*>([^<:]+)""")

BULK_LINE = re.compile(rb"[ ]*(?:(GRID\*?)[ ,]|(GRDSET|INCLUDE))", re.IGNORECASE)
"""Nastran's lines that say where nodes lie, or in which file."""


def source_of(mesh: Any) -> str:
    """Return what a structure's origin says of its mesh: the file, wherever it is read again from, or "meshio.Mesh"."""
    return str(Path(mesh).absolute()) if isinstance(mesh, str | Path) else "meshio.Mesh"


def read_mesh(source: Any) -> Any:
    """Return the meshio.Mesh of a file, or the one that is given. Raises ValueError for a file that cannot be read."""
    import meshio  # type: ignore[import-untyped]

    if isinstance(source, meshio.Mesh):
        return source
    if not isinstance(source, str | Path):
        raise ValueError(f"mesh = {source!r}: must be the path of a file, or a meshio.Mesh")
    path, name = Path(source), str(source)
    suffix = existing(f"mesh = {name!r}", path).suffix.lower()
    if suffix == ".inp":
        raise ValueError(
            f"mesh = {name!r}: .inp is not read, as meshio loses its sets; convert it by 'meshio convert "
            f"{path.name} {path.stem}.msh', and name bodies and faces in gmsh"
        )
    if suffix not in FORMATS:
        raise ValueError(
            f"mesh = {name!r}: must be one of {', '.join(FORMATS)}; a meshio.Mesh of another format may be given itself"
        )
    _check_start(path, suffix, name)
    return meshio.Mesh(**in_a_process(path, name))


def in_a_process(path: Path, name: str) -> dict[str, Any]:
    """Return the parts of the mesh, read by a process that cannot take this one with it."""
    suffix, size = path.suffix.lower(), path.stat().st_size
    seconds, memory = int(SHORTEST_READING + READING_PER_BYTE * size), int(LEAST_MEMORY + MEMORY_PER_BYTE * size)
    try:
        mesh: dict[str, Any] = read_apart(PROCESS, "read", path, seconds=seconds, memory=memory)
    except Unread as error:
        if error.missing:
            reason = f"a {suffix} file needs gmsh to be read: pip install hertzlink[mesh]"
        else:
            reason = (
                f"cannot be read as a {suffix} file of {FORMATS[suffix]}; it is damaged, cut short, or "
                f"holds what is not understood{_words_of(error) or _hint(suffix)}"
            )
        raise ValueError(f"mesh = {name!r}: {reason}") from None
    if not mesh["cells"]:
        raise ValueError(f"mesh = {name!r}: holds no cells that are read from a {suffix} file of {FORMATS[suffix]}")
    return mesh


def _hint(suffix: str) -> str:
    return "; gmsh reads more: pip install hertzlink[mesh]" if suffix in BY_GMSH and find_spec("gmsh") is None else ""


def _words_of(error: Unread) -> str:
    """Return what a library said of the file, where it is a sentence for users and no internal error."""
    match = re.match(r"(?:Exception|ValueError|meshio\._exceptions\.ReadError): (.+)", error.said)
    return f" ({match[1]})" if match else ""


def _check_start(path: Path, suffix: str, name: str) -> None:
    """Raise a ValueError for a file of another kind, for one that reads others, and for coordinates that would be
    misread."""
    with path.open("rb") as file:
        start = file.read(64)
    if start.startswith(HDF5) or suffix == ".med":
        check_hdf5(path, f"mesh = {name!r}")
    elif suffix == ".msh" and not start.startswith(GMSH_STARTS):
        raise ValueError(f"mesh = {name!r}: is no .msh file of gmsh, which begins with $MeshFormat")
    elif suffix in (".bdf", ".nas"):
        _check_bulk(path, name)
    elif suffix == ".unv":
        _check_systems(path, name)
    elif suffix in (".xdmf", ".xmf"):
        for match in DATA_ITEM.findall(path.read_bytes()):
            _check_beside(path, match.decode("utf-8", errors="replace").strip(), name)


def _check_beside(path: Path, other: str, name: str) -> None:
    """Raise a ValueError for a file outside the mesh's folder, and for an HDF5 file that leads there."""
    folder = path.resolve().parent
    place = (folder / other).resolve()
    if not place.is_relative_to(folder):
        raise ValueError(f"mesh = {name!r}: names {other!r}, which lies outside its folder; it was not read")
    if place.is_file():
        with place.open("rb") as file:
            start = file.read(len(HDF5))
        if start == HDF5:
            check_hdf5(place, f"mesh = {name!r}")


def _check_bulk(path: Path, name: str) -> None:
    """Raise a ValueError for Nastran's nodes in systems of their own, and for included files: none is read."""
    for number, line in enumerate(path.read_bytes().splitlines(), 1):
        match = BULK_LINE.match(line)
        if match is None:
            continue
        text = line.decode("latin-1")
        fields = text.split(",") if "," in text else [text[:8], text[8:16], text[16:24]]
        if match[1] and "*" in fields[0] and "," not in text:
            fields = [text[:8], text[8:24], text[24:40]]
        system = fields[2].strip() if len(fields) > 2 else ""
        if match[1] and system in ("", "0"):
            continue
        what = f"{fields[0].strip()} in the coordinate system {system}" if match[1] else match[2].decode().upper()
        raise ValueError(
            f"mesh = {name!r}, line {number}: {what} is not read; write all nodes in the basic system, in one file"
        )


def _check_systems(path: Path, name: str) -> None:
    """Raise a ValueError for a universal file whose nodes may lie in other coordinate systems than the global one.

    Dataset 2420: after two lines, for each system its number and type, its name, and its axes and origin on four lines.
    """
    lines = path.read_bytes().decode("latin-1").replace("D", "E").splitlines()
    for start in (
        i + 2 for i, line in enumerate(lines[:-1]) if line.strip() == "-1" and lines[i + 1].strip() == "2420"
    ):
        end = next((i for i in range(start, len(lines)) if lines[i].strip() == "-1"), len(lines))
        for i in range(start + 2, end, 6):
            numbers = " ".join(lines[i + 2 : min(i + 6, end)]).split()
            straight = [float(row == other) for row in range(4) for other in range(3)]
            try:
                same = lines[i].split()[1] == "0" and [float(number) for number in numbers] == straight
            except (ValueError, IndexError):
                same = False
            if not same:
                raise ValueError(
                    f"mesh = {name!r}, line {i + 1}: has a coordinate system of its own, which is not read; write "
                    "all nodes in the global one"
                )
