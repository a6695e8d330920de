"""Mesh files: gmsh reads its own files and those of Salome, meshio reads those of VTK and XDMF."""

import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from lzma import LZMAError
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from structures.checks import existing, instance

BY_GMSH = {".msh": "gmsh", ".med": "Salome"}
# Formats and the programs that write them
FORMATS = BY_GMSH | {".vtu": "VTK, ParaView", ".vtk": "VTK", ".xdmf": "XDMF", ".xmf": "XDMF"}

# The beginnings of files for gmsh, which would run any other text as a program.
STARTS = {".msh": ("$MeshFormat", "$Comments", "$NOD"), ".med": ("\x89HDF",)}

# What meshio's readers raise for damaged files, in addition to ReadError
DAMAGE = (
    *(ArithmeticError, AssertionError, AttributeError, LookupError, MemoryError, OSError, RuntimeError, SyntaxError),
    *(TypeError, ValueError, LZMAError, zlib.error),
)

GMSH = Lock()  # gmsh has one state for all threads

# Points of cells in meshio's order, as indices into gmsh's order
ORDER = {
    "tetra10": (0, 1, 2, 3, 4, 5, 6, 7, 9, 8),
    "hexahedron20": (0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15),
    "hexahedron27": (
        *(0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15),
        *(22, 23, 21, 24, 20, 25, 26),
    ),
}


def source_of(value: Any, otherwise: str = "meshio.Mesh") -> str:
    """Return the entry of an argument in the origin of a structure: the path of its file, or else a word."""
    return str(Path(value).absolute()) if isinstance(value, str | Path) else otherwise


def read_mesh(source: Any) -> Any:
    """Return the meshio.Mesh of a file, or the given one; raise a ValueError if the file cannot be read."""
    import meshio.vtk

    if isinstance(source, meshio.Mesh):
        return source
    instance("mesh", source, (str, Path), "the path of a file, or a meshio.Mesh")
    path, name = Path(source), f"mesh = {str(source)!r}"
    suffix = existing(name, path).suffix.lower()
    if suffix not in FORMATS:
        raise ValueError(
            f"{name}: must be one of {', '.join(FORMATS)}; convert others by 'meshio convert {path.name} "
            f"{path.stem}.msh', or give a meshio.Mesh"
        )
    if not path.read_bytes()[:20].decode("latin-1").startswith(STARTS.get(suffix, "")):
        raise ValueError(f"{name}: must be a {suffix} file of {FORMATS[suffix]}, beginning with {STARTS[suffix][0]!r}")
    read = {".vtu": meshio.vtu.read, ".vtk": meshio.vtk.read, ".xdmf": meshio.xdmf.read, ".xmf": meshio.xdmf.read}
    try:
        return read.get(suffix, _by_gmsh)(path)
    except (meshio.ReadError, meshio.vtu._vtu.CorruptionError, *DAMAGE) as error:
        reason = " ".join(f"{error}".split())[:200]
        raise ValueError(f"{name}: cannot be read as a {suffix} file of {FORMATS[suffix]} ({reason})") from error


@contextmanager
def gmsh_model(options: Mapping[str, float]) -> Iterator[Any]:
    """Yield gmsh with a new model and some options; afterwards restore the user's own models and options."""
    try:
        import gmsh
    except (ImportError, OSError) as error:  # OSError: a graphics library such as libGLU is missing
        raise ImportError(f"this needs gmsh ({error}): pip install hertzlink[mesh]") from error
    with GMSH:
        started = not gmsh.isInitialized()
        if started:
            gmsh.initialize(readConfigFiles=False, interruptible=False)
        options = {"General.Terminal": 0.0, "General.NumThreads": 1.0, **options}
        before = {name: gmsh.option.getNumber(name) for name in options}
        shown, models = gmsh.model.getCurrent(), gmsh.model.list()
        try:
            for option, value in options.items():
                gmsh.option.setNumber(option, value)
            gmsh.model.add("hertzlink")
            yield gmsh
        finally:
            if started:
                gmsh.finalize()
            else:
                for model in gmsh.model.list()[len(models) :]:  # a file of Salome adds models
                    gmsh.model.setCurrent(model)
                    gmsh.model.remove()
                gmsh.model.setCurrent(shown)
                for option, value in before.items():
                    gmsh.option.setNumber(option, value)


def _by_gmsh(path: Path) -> Any:
    """Return the mesh of a file, with its groups by name and by number."""
    import meshio
    from meshio.gmsh import gmsh_to_meshio_type

    with gmsh_model({}) as gmsh:
        try:
            gmsh.merge(str(path))
        except Exception as error:  # gmsh raises no narrower class
            raise ValueError(str(error)) from error
        tags, places, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(tags, kind="stable")
        cells: list[tuple[str, Any]] = []
        entities: list[tuple[int, int]] = []
        for dimension, entity in gmsh.model.getEntities():
            for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dimension, entity), strict=True):
                called, _, _, count, *_ = gmsh.model.mesh.getElementProperties(kind)
                at = np.searchsorted(tags, nodes, sorter=order)
                at = order[np.minimum(at, len(order) - 1)].reshape(-1, count)
                if int(kind) not in gmsh_to_meshio_type or len(tags) == 0 or (tags[at].ravel() != nodes).any():
                    raise ValueError(f"cells of type {called} are not supported, or have a point that is not defined")
                name = gmsh_to_meshio_type[int(kind)]
                cells.append((name, at[:, ORDER[name]] if name in ORDER else at))
                entities.append((dimension, entity))
        sets: dict[Any, list[Any]] = {}
        groups = {
            pair: [(pair[0], int(entity)) for entity in gmsh.model.getEntitiesForPhysicalGroup(*pair)]
            for pair in gmsh.model.getPhysicalGroups()
        }
        for (dimension, number), members in groups.items():
            holds = [np.arange(len(block[1]) * (pair in members)) for block, pair in zip(cells, entities, strict=True)]
            for tag in {number, gmsh.model.getPhysicalName(dimension, number).strip() or number}:
                before = sets.get(tag, holds)
                sets[tag] = [max(pair, key=len) for pair in zip(before, holds, strict=True)]
    none = {} if any(groups.values()) else {"gmsh:physical": [np.zeros(len(block), int) for _, block in cells]}
    return meshio.Mesh(places.reshape(-1, 3), cells, cell_sets=sets, cell_data=none)
