"""Structures from matrices or modes that other programs computed or tests measured."""

from collections.abc import Callable, Sequence
from inspect import signature
from io import BytesIO
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy import io, sparse

from structures.caution import caution
from structures.checks import each, existing, finite, not_negative
from structures.described import described_as
from structures.material import Material
from structures.meshes.mesh_files import source_of
from structures.quantities import Asks, Component, Curvature, InFile, Quantity, Scale
from structures.structure import Structure, oscillators
from structures.surface import Surface

Residual = Annotated[float, Quantity("m/N", "a compliance", "2e-9 m/N", -np.inf)]

HEADS = "frequency,shape", "frequency,shape,damping_ratio"  # The first line of a file of modes

# The result of mmread is a sparse array. SciPy before 1.15 has no choice and returns a matrix, which serves as well.
SPARSE_ARRAY = {"spmatrix": False} if "spmatrix" in signature(io.mmread).parameters else {}


@described_as(also=("matrices",))
def from_matrices(
    mass: Annotated[Any, InFile("a mass matrix", "mass.mtx")],
    stiffness: Annotated[Any, InFile("a stiffness matrix", "stiffness.mtx")],
    material: Material,
    contact: Annotated[Any, InFile("a contact vector", "contact.txt")],
    damping: Annotated[Any, InFile("a damping matrix", "damping.mtx")] | None = None,
    residual_flexibility: Residual = 0.0,
    curvature: Curvature = 0.0,
    scale: Scale = 1.0,
) -> Structure:
    """A body whose mass and stiffness come from another finite-element program; `reduce` makes it small.

    Parameters
    ----------
    mass, stiffness : matrix, str or Path
        Sparse or dense matrix, n × n, without degrees of freedom that are held; or a Matrix Market file (.mtx).
    material : Material
        The material at the contact, for Hertz's law.
    contact : array, str or Path
        b of `Structure`, n numbers, or n × p for p contacts; or a text file with a number on each line.
    damping : matrix, str or Path, optional
        The damping matrix; `damped` adds other losses.
    residual_flexibility : float
        Local compliance, m/N: positive if the matrices lack it, negative if Hertz's law contains it as well.
    curvature : float
        Curvature of the surface at the contact, 1/m, for Hertz's law.
    scale : float
        m per unit of length of the matrices: 1e-3 for matrices in mm, N, s and t.

    Returns
    -------
    Structure
        The body. The frequencies that its mesh resolves are unknown, so no run checks them.

    Notes
    -----
    The finer the mesh, the more a force on a single node indents a solid, and Hertz's law contains that indentation.
    Spread the force over a patch, and subtract the compliance of the patch by `residual_flexibility`.

    Examples
    --------
    >>> spring = hl.from_matrices([[0.0141]], [[1.7e7]], hl.PTFE, contact=[1.0])
    >>> spring.size, spring.origin["kind"]
    (1, 'from_matrices')
    """
    given = {"mass": mass, "stiffness": stiffness} | ({} if damping is None else {"damping": damping})
    matrices = {}
    for name, value in given.items():
        # A number cut off by the end of the file crashes SciPy's reader; an added line end prevents that.
        matrix = _read(name, value, lambda path: io.mmread(BytesIO(path.read_bytes() + b"\n"), **SPARSE_ARRAY))
        matrix = matrix if sparse.issparse(matrix) else np.atleast_2d(each(finite, name, matrix))
        matrices[name] = scale * sparse.csr_array(matrix)
    heaviest, stiffest = abs(matrices["mass"]).max(), abs(matrices["stiffness"]).max()
    if heaviest == 0.0 or 0.0 < stiffest < heaviest:  # the fastest vibration of such a body takes seconds
        what = "larger than the stiffness; the mass comes first" if heaviest else "zero everywhere"
        raise ValueError(f"mass: must be the mass matrix, but is {what}")
    vector = _read("contact", contact, lambda path: np.loadtxt(path, encoding="utf-8-sig").ravel())
    sources = {"mass": mass, "stiffness": stiffness, "contact": contact, "damping_matrix": damping}
    origin = {name: source_of(value, "in memory") for name, value in sources.items() if value is not None}
    return Structure(
        matrices["mass"],
        matrices["stiffness"],
        matrices.get("damping"),
        scale * each(finite, "contact", vector),
        residual_flexibility,
        Surface(material, curvature),
        {**origin, "damping": None},
    )


@described_as(also=("modes",))
def from_modes(
    frequencies: Annotated[Any, InFile("modes", "modes.csv")],
    material: Material,
    shapes: Annotated[Any, Asks("the shapes at the contact")] | None = None,
    damping_ratios: float | Sequence[Component] | None = None,
    residual_flexibility: Residual | None = None,
    curvature: Curvature = 0.0,
    scale: Scale = 1.0,
) -> Structure:
    """A body whose modes come from another program or from a test.

    Parameters
    ----------
    frequencies : array, str or Path
        Natural frequencies, Hz, n; zero for rigid motions. Or a file of comma-separated numbers whose first line is
        `frequency,shape` or `frequency,shape,damping_ratio`: Hz, 1/√kg, and damping ratios.
    material, curvature, scale
        As in `from_matrices`.
    shapes : array, optional
        Displacement of the contact along the force in each mode of unit modal mass, 1/√kg: n, or n × p for p contacts.
    damping_ratios : float or sequence of float, optional
        Damping ratio, one for all modes or one for each; by default those of the file, or zero.
    residual_flexibility : float, optional
        Compliance at the contact, m/N, that the modes lack. If it is omitted, a warning asks for it.

    Returns
    -------
    Structure
        One oscillator for each mode. A run warns if its contacts are too short for the highest frequency.

    Examples
    --------
    >>> plate = hl.from_modes([900.0, 2500.0], hl.PTFE, shapes=[2.1, 1.8], residual_flexibility=2e-8)
    >>> plate.size, plate.origin["highest_frequency"]
    (2, 2500.0)
    """
    in_file, stated = isinstance(frequencies, str | Path), 0.0 if damping_ratios is None else damping_ratios
    if in_file:
        if shapes is not None:
            raise ValueError("shapes: must be omitted, as the file of the modes holds them")
        table = _read("frequencies", frequencies, _modes)
        hertz, vector = table["frequency"], table["shape"]
        if damping_ratios is None and "damping_ratio" in table.dtype.names:
            stated = table["damping_ratio"]
    else:
        hertz, vector = np.atleast_1d(each(finite, "frequencies", frequencies)), [] if shapes is None else shapes
    vector = each(finite, "shapes", vector)
    count, ratios = hertz.size, np.atleast_1d(each(finite, "damping_ratios", stated)).ravel()
    if hertz.ndim != 1 or not count or vector.shape[:1] != (count,) or ratios.size not in (1, count):
        raise ValueError(
            f"shapes, damping_ratios have shapes {vector.shape} and {np.shape(stated)}: must have a row for each of "
            f"{count} frequencies; one damping ratio serves all"
        )
    if residual_flexibility is None:
        caution("frequencies: the modes lack the compliance of all higher modes; state residual_flexibility")
    origin = {
        "frequencies": source_of(frequencies, "in memory"),
        "shapes": None if in_file else "in memory",
        "modes": count,
        "damping_ratios": None if damping_ratios is None else np.asarray(damping_ratios).tolist(),
        "highest_frequency": float(hertz.max()),
    }
    omega = 2.0 * np.pi * each(not_negative, "frequencies", hertz, "Hz")
    damping = 2.0 * each(not_negative, "damping_ratios", ratios) * omega
    contact, surface = np.sqrt(scale) * vector, Surface(material, curvature)
    losses = damping if damping.any() else None
    return oscillators(omega**2, losses, contact, residual_flexibility or 0.0, surface, origin)


def _modes(path: Path) -> Any:
    """Return the table of a file of modes, with names of columns."""
    with path.open(encoding="utf-8-sig") as file:
        head = file.readline().strip().replace(" ", "")
        if head not in HEADS:
            raise ValueError(f"begins with {head[:80]!r}: must begin with {' or '.join(map(repr, HEADS))}")
        return np.loadtxt(file, [(name, float) for name in head.split(",")], delimiter=",", ndmin=1)


def _read(name: str, value: Any, read: Callable[[Path], Any]) -> Any:
    """Return what `read` finds in a file, or the value itself if it is not the path of one."""
    if not isinstance(value, str | Path):
        return value
    what = f"{name} = {str(value)!r}"
    path = existing(what, Path(value))
    try:
        return read(path)
    except (ValueError, MemoryError) as error:
        raise ValueError(f"{what}: {error}") from None
