"""Structures from the mass and stiffness matrices of other programs."""

from io import BytesIO
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy import io, sparse

from structures.checks import count_of, existing
from structures.described import described_as
from structures.linear_algebra.factor import numbers
from structures.material import Material
from structures.quantities import Curvature, InFile, Quantity, Scale
from structures.structure import Structure
from structures.surface import Surface

Residual = Annotated[float, Quantity("m/N", "a compliance", "2e-9 m/N", -np.inf)]

MEMORY = "in memory"
"""What an origin says of an argument that was no file."""


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
    """A body whose mass and stiffness come from another finite-element program.

    All motions that the matrices have are in it; `reduce` makes it small.

    Parameters
    ----------
    mass, stiffness : matrix, str or Path
        Sparse or dense, n × n, without the degrees of freedom that are held; or a Matrix Market file (.mtx).
    material : Material
        The material at the contact, for Hertz's law.
    contact : array, str or Path
        b, n numbers, or n × p for p contacts: the forces on the degrees of freedom of a unit contact force. Or a text
        file with a number on each line.
    damping : matrix, str or Path, optional
        The damping matrix; `damped` adds other losses.
    residual_flexibility : float
        Local compliance, m/N, that the matrices lack (positive), or that they have although Hertz's law contains it
        (negative).
    curvature : float
        Curvature of the surface at the contact, 1/m, for Hertz's law.
    scale : float
        m per unit of length of the matrices: 1e-3 for those in mm, N, s and t.

    Returns
    -------
    Structure
        The body.

    Raises
    ------
    ValueError
        If a file cannot be read, or the matrices and the contact do not fit each other.

    Notes
    -----
    A force on a single node of a solid indents it by an amount that grows as the mesh is refined, and that Hertz's law
    contains already: spread the force over a patch, and take the compliance of the patch away by
    `residual_flexibility`. A plate of shells has no such indentation. What frequencies the mesh resolves is not known,
    so no run checks it.

    Examples
    --------
    >>> import hertzlink as hl
    >>> spring = hl.from_matrices([[0.0141]], [[1.7e7]], hl.PTFE, contact=[1.0])
    >>> spring.size, spring.origin["kind"]
    (1, 'from_matrices')
    """
    matrices = {"mass": _matrix("mass", mass), "stiffness": _matrix("stiffness", stiffness)}
    if damping is not None:
        matrices["damping"] = _matrix("damping", damping)
    size = matrices["stiffness"].shape[0]
    for name, matrix in matrices.items():
        if matrix.shape != (size, size):
            raise ValueError(f"{name} has shape {matrix.shape}: must be square, n × n, and as large as the others")
    if not abs(matrices["mass"]).sum() > 0.0:
        raise ValueError("mass: all its numbers are zero; must be the mass matrix, kg")
    if isinstance(contact, str | Path):
        vector = table_in("contact", Path(contact)).ravel()
    else:
        vector = numbers("contact", contact)
    if vector.ndim not in (1, 2) or len(vector) != size:
        raise ValueError(f"contact has shape {vector.shape}: must have {count_of(size, 'row')}, as the stiffness has")
    largest = {name: abs(matrices[name]).max() for name in ("mass", "stiffness")}
    if 0.0 < largest["stiffness"] < largest["mass"]:  # a body whose fastest vibration takes seconds
        raise ValueError(
            f"mass: its largest number is {largest['mass']:.3g} kg, that of the stiffness {largest['stiffness']:.3g} "
            "N/m; must be the mass matrix first, then the stiffness matrix"
        )
    count, surface = vector.shape[1] if vector.ndim > 1 else 1, Surface(material, curvature)
    files = {"mass": mass, "stiffness": stiffness, "contact": contact}
    notes = {} if damping is None else {"damping_matrix": source_of_argument(damping)}
    return Structure(
        scale * matrices["mass"],
        scale * matrices["stiffness"],
        None if damping is None else scale * matrices["damping"],
        scale * (vector if count > 1 else vector.reshape(-1)),
        residual_flexibility if count == 1 else [residual_flexibility] * count,
        surface if count == 1 else [surface] * count,
        {**{name: source_of_argument(value) for name, value in files.items()}, "damping": None, **notes},
    )


def _matrix(name: str, value: Any) -> sparse.csr_array:
    """Return a matrix that is given, or that of a Matrix Market file."""
    if isinstance(value, str | Path):
        path = Path(value)
        if existing(f"{name} = {str(path)!r}", path).suffix.lower() != ".mtx":
            raise ValueError(f"{name} = {str(path)!r}: must be a Matrix Market file (.mtx), or a matrix")
        try:
            # SciPy's reader ends the process at a number that the end of the file cuts off; a line end prevents that.
            value = io.mmread(BytesIO(path.read_bytes() + b"\n"))
        except (ValueError, MemoryError) as error:
            raise ValueError(f"{name} = {str(path)!r}: {error}") from None
    try:
        matrix = value if sparse.issparse(value) else np.atleast_2d(value)
        if np.iscomplexobj(matrix):
            raise TypeError
        result = sparse.csr_array(matrix, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: must be a matrix of real numbers, sparse or dense, or a file of one") from None
    if not np.isfinite(result.data).all():
        raise ValueError(f"{name}: must hold finite numbers")
    return result


def table_in(name: str, path: Path, heads: tuple[str, ...] = ()) -> Any:
    """Return the numbers of a text file, rows × columns, with commas between them where a line of heads comes first.

    name: of the argument. heads: the lines of heads that are possible; none where the file holds numbers alone.
    """
    what = f"{name} = {str(path)!r}"
    with existing(what, path).open(encoding="utf-8-sig") as file:
        try:
            if heads and (line := file.readline().strip().replace(" ", "")) not in heads:
                raise ValueError(f"begins with {line[:80]!r}: must begin with {' or '.join(map(repr, heads))}")
            table = np.loadtxt(file, delimiter="," if heads else None, ndmin=2)
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None
    if heads and table.shape[1] != 1 + line.count(","):
        raise ValueError(f"{what}: has {count_of(table.shape[1], 'column')} of numbers below the heads {line}")
    if not table.size or not np.isfinite(table).all():
        raise ValueError(f"{what}: must hold finite numbers")
    return table


def source_of_argument(value: Any) -> str:
    """Return what an origin says of an argument: the file, or that it was in memory."""
    return str(Path(value).absolute()) if isinstance(value, str | Path) else MEMORY
