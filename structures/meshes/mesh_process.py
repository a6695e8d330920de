"""Reads a mesh file by gmsh or meshio, in a process of its own (`reading_process`)."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

BY_GMSH = (".msh", ".unv", ".med", ".bdf", ".nas")
"""Formats that gmsh reads, where it is installed."""

BY_MESHIO = {
    ".msh": "gmsh", ".med": "med", ".bdf": "nastran", ".nas": "nastran",
    ".vtu": "vtu", ".vtk": "vtk", ".xdmf": "xdmf", ".xmf": "xdmf",
}  # fmt: skip
"""Formats that meshio reads, and its names for them."""

ORDER = {
    "tetra10": (0, 1, 2, 3, 4, 5, 6, 7, 9, 8),
    "hexahedron20": (0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15),
    "hexahedron27": (
        *(0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15),
        *(22, 23, 21, 24, 20, 25, 26),
    ),
}
"""Points of cells in meshio's order, as indices into gmsh's order."""


def read(path: str) -> dict[str, Any]:
    """Return the parts of the mesh. Raises ModuleNotFoundError where only gmsh reads it, which is missing."""
    suffix = Path(path).suffix.lower()
    if suffix in BY_GMSH and _gmsh_works():
        return by_gmsh(path)
    if suffix in BY_MESHIO:
        return by_meshio(path, BY_MESHIO[suffix])
    raise ModuleNotFoundError(name="gmsh")


def _gmsh_works() -> bool:
    if find_spec("gmsh") is None:
        return False
    try:
        import gmsh  # noqa: F401
    except OSError:  # a library that gmsh draws with, such as libGLU, is missing
        return False
    return True


def by_gmsh(path: str) -> dict[str, Any]:
    """Return the points, cells and groups; where the file has no groups, the numbers of its bodies and faces."""
    import gmsh
    import numpy as np
    from meshio.gmsh import gmsh_to_meshio_type  # type: ignore[import-untyped]

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    for option, value in (("General.Terminal", 0.0), ("General.NumThreads", 1.0)):
        gmsh.option.setNumber(option, value)
    gmsh.logger.start()
    gmsh.merge(path)
    wrong = [line for line in gmsh.logger.get() if line.startswith("Error")]
    if wrong:
        raise ValueError(wrong[0])
    tags, places, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags, kind="stable")
    cells: list[tuple[str, Any]] = []
    block_of: dict[tuple[int, int], list[int]] = {}
    for dimension, entity in gmsh.model.getEntities():
        for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dimension, entity), strict=True):
            called, _, _, count, *_ = gmsh.model.mesh.getElementProperties(kind)
            at = np.searchsorted(tags, nodes, sorter=order)
            at = order[np.minimum(at, len(order) - 1)].reshape(-1, count)
            if len(tags) == 0 or (tags[at].ravel() != nodes).any():
                raise ValueError("a cell has a point that is not defined")
            if int(kind) not in gmsh_to_meshio_type:
                raise ValueError(f"cells of type {called}, which no body here is made of")
            name = gmsh_to_meshio_type[int(kind)]
            cells.append((name, at[:, ORDER[name]] if name in ORDER else at))
            block_of.setdefault((dimension, entity), []).append(len(cells) - 1)
    groups = [
        (dimension, number, gmsh.model.getEntitiesForPhysicalGroup(dimension, number))
        for dimension, number in gmsh.model.getPhysicalGroups()
    ]
    named = [
        (gmsh.model.getPhysicalName(dimension, number).strip(), dimension, members)
        for dimension, number, members in groups
    ]
    sets: dict[Any, set[int]] = {}
    for tag, dimension, members in (
        *((number, dimension, members) for dimension, number, members in groups),
        *((name, dimension, members) for name, dimension, members in named if name),
        *(() if groups else ((entity, dimension, [entity]) for dimension, entity in block_of)),
    ):
        sets.setdefault(tag, set()).update(
            i for element in members for i in block_of.get((dimension, int(element)), ())
        )
    return {
        "points": places.reshape(-1, 3),
        "cells": cells,
        "cell_sets": {
            tag: [np.arange(len(block) if i in blocks else 0) for i, (_, block) in enumerate(cells)]
            for tag, blocks in sets.items()
        },
    }


def by_meshio(path: str, kind: str) -> dict[str, Any]:
    """Return the points, cells, sets and fields of cells."""
    import meshio  # type: ignore[import-untyped]
    import numpy as np

    if kind == "gmsh":
        _check_groups(Path(path).read_bytes())
    mesh = meshio.read(path, file_format=kind)
    cells = [(block.type, np.asarray(block.data)) for block in mesh.cells]
    cell_sets = {name: list(parts) for name, parts in mesh.cell_sets.items()}
    point_sets = dict(mesh.point_sets)
    # Families of MED, which are groups' names by number.
    for family, names in getattr(mesh, "cell_tags", {}).items():
        for name in names:
            parts = [np.flatnonzero(np.asarray(part) == family) for part in mesh.cell_data["cell_tags"]]
            before = cell_sets.setdefault(name, [np.zeros(0, dtype=int)] * len(parts))
            cell_sets[name] = [np.concatenate(both) for both in zip(before, parts, strict=True)]
    for family, names in getattr(mesh, "point_tags", {}).items():
        for name in names:
            part = np.flatnonzero(np.asarray(mesh.point_data["point_tags"]) == family)
            point_sets[name] = np.concatenate([point_sets.get(name, np.zeros(0, dtype=int)), part])
    fields = {
        name: [np.asarray(part) for part in parts] for name, parts in mesh.cell_data.items() if name != "cell_tags"
    }
    return {
        "points": np.asarray(mesh.points),
        "cells": cells,
        "cell_sets": cell_sets,
        "point_sets": point_sets,
        "cell_data": fields,
        "field_data": {name: np.asarray(pair) for name, pair in mesh.field_data.items()},
    }


def _check_groups(data: bytes) -> None:
    """Raise a ValueError for a file of gmsh's version 4 with an entity of several groups: meshio takes the first of
    them.

    $Entities counts points, curves, surfaces and volumes, and lists for each its number, its place or box, the number
    of its groups, and the groups.
    """
    version, kind = data.split(b"\n", 2)[1].split()[:2]
    if not version.startswith(b"4"):
        return
    if kind != b"0":
        raise ValueError("a binary file of version 4, which gmsh reads: pip install hertzlink[mesh]")
    lines = data.partition(b"$Entities")[2].partition(b"$EndEntities")[0].split(b"\n")[1:-1]
    points = int(lines[0].split()[0]) if lines and version != b"4" else 0
    for i, line in enumerate(lines[1:]):
        if int(line.split()[4 if i < points else 7]) > 1:
            raise ValueError("a body or face in several groups, which gmsh reads: pip install hertzlink[mesh]")
