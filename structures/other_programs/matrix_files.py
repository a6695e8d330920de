"""Files of matrices that other programs write, with the node and the direction of each row."""

import re
from pathlib import Path
from typing import Any, NamedTuple
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from structures.checks import MOST, count_of, existing
from structures.meshes.mesh_files import read_bounded, words_of
from structures.other_programs.foreign_files import FOREIGN, PROCESS, read_foreign
from structures.other_programs.foreign_process import MATRIX_MARKET, MOST_ROWS
from structures.reading_process import Unread

Numbers = NDArray[np.int64]
Vector = NDArray[np.float64]

FORMATS = {
    ".mtx": "Matrix Market, Abaqus", ".sti": "CalculiX", ".mas": "CalculiX", ".op4": "Nastran", ".pch": "Nastran",
    ".full": "Ansys",
}  # fmt: skip
"""The endings of files of matrices, and the programs that write them."""

LONGEST_HEAD = 1000
"""Characters of a line that are looked at before the numbers."""

DECIMAL_COMMA = r"[-+]?\d+(,\d+)?([eE][-+]?\d+)?"
THOUSANDS = r"[-+]?[1-9]\d{0,2}(,\d{3})+"

HELD = 1e36
"""Abaqus writes this number on the diagonal of a held degree of freedom."""


class LabelledMatrix(NamedTuple):
    """A matrix; and for each row its node and its direction (1 to 6), n × 2, or None where the file has none."""

    matrix: sparse.csr_array
    labels: Numbers | None


def read_matrix(name: str, path: Path) -> LabelledMatrix:
    """Return the matrix of a file; name: of the argument, "mass", "stiffness" or "damping".

    Raises ValueError for a file that cannot be read; time and memory are bounded by the size of the file.
    """
    what = f"{name} = {str(path)!r}"
    suffix = existing(what, path).suffix.lower()
    if suffix not in FORMATS:
        raise ValueError(f"{what}: must be one of {', '.join(FORMATS)}, or a matrix")
    if suffix in FOREIGN:
        read = read_foreign(path, what, name)
        rows, columns, values, size = read["rows"], read["columns"], read["values"], int(read["size"])
        return _assembled(what, rows, columns, values, size, read["labels"])
    with path.open("rb") as file:
        start = file.read(14)
    return _matrix_market(what, path) if start == b"%%MatrixMarket" else _triplets(what, path)


def numbers_in(what: str, path: Path, columns: tuple[int, ...]) -> tuple[list[str], Vector]:
    """Return the last lines before the first that begins with a number, and the table of a text file from there on.

    Lines that begin with "*" and "#" are comments. columns: the numbers of columns that the table may have. what: how
    messages begin. Raises ValueError.
    """
    before = list[str]()
    with existing(what, path).open(encoding="utf-8-sig", errors="replace") as file:
        for skipped, line in enumerate(file):  # noqa: B007
            first = line.strip()[:LONGEST_HEAD]
            if first[:1].isdigit() or (first[:1] in "+-." and first[1:2].isdigit()):
                break
            before = [*before, first.lstrip("*#%!/ ")][-3:] if first else before
        else:
            raise ValueError(f"{what}: holds no line of numbers")
        cells = re.split(r"\s+", first)
        with_decimals = len(cells) > 1 and all(re.fullmatch(DECIMAL_COMMA, cell) for cell in cells)
        delimiter = ";" if ";" in first else "," if "," in first and not with_decimals else None
        file.seek(0)
        may_have_commas = delimiter != "," and any(mark in first for mark in ",;\t")
        lines = _with_points(what, [*file]) if may_have_commas else file
        try:
            table = np.loadtxt(lines, comments=["*", "#"], delimiter=delimiter, skiprows=skipped, ndmin=2)
        except ValueError as error:
            reason = str(error).partition(";")[0].rstrip(".")
            raise ValueError(f"{what}: {reason}, counted from line {skipped + 1}; is it damaged?") from None
    if table.shape[1] not in columns:
        many = " or ".join(map(str, columns))
        raise ValueError(f"{what}: has {count_of(table.shape[1], 'column')} of numbers: must have {many}")
    if not np.isfinite(table).all():
        raise ValueError(f"{what}: must hold finite numbers")
    return before, table


def _with_points(what: str, lines: list[str]) -> list[str]:
    """Return lines with points for decimal commas, where no comma can stand between thousands."""
    samples = [line for line in lines if line.strip()[:1] in {*"+-.,0123456789"}]
    cells = [cell for line in samples for cell in re.split(r"[;\s]+", line) if "," in cell]
    if not cells:
        return lines
    if any("." in line for line in samples) or all(re.fullmatch(THOUSANDS, cell) for cell in cells):
        raise ValueError(
            f"{what}: {cells[0][:LONGEST_HEAD]!r} may have a decimal comma, or one between thousands; "
            "write decimal points, and no commas in numbers"
        )
    return [line.replace(",", ".") for line in lines]


def _matrix_market(what: str, path: Path) -> LabelledMatrix:
    try:  # scipy's reader ends the process at a number that is cut off
        read = read_bounded(PROCESS, path, MATRIX_MARKET)
    except Unread as error:
        said = words_of(error) or " (it is damaged or cut short)"
        raise ValueError(f"{what}: is no Matrix Market file that can be read{said}") from None
    matrix = sparse.csr_array((read["values"], (read["rows"], read["columns"])), read["shape"], dtype=float)
    return LabelledMatrix(matrix, _labels_beside(path, matrix.shape[0]))


def _triplets(what: str, path: Path) -> LabelledMatrix:
    """Return a matrix of lines "row column value", or "node, direction, node, direction, value"."""
    _, table = numbers_in(what, path, (3, 5))
    places, values = table[:, :-1], table[:, -1]
    if (np.abs(places) > MOST).any() or (places != np.floor(places)).any():
        raise ValueError(f"{what}: numbers of rows and nodes must be whole")
    indices = places.astype(np.int64)
    if table.shape[1] == 3:
        if indices.min() < 1:
            raise ValueError(f"{what}: rows are counted from 1, but there is a row {indices.min()}")
        size = int(indices.max())
        rows, columns = indices.T - 1
        return _assembled(what, rows, columns, values, size, _labels_beside(path, size))
    labels, place = np.unique(indices.reshape(-1, 2), axis=0, return_inverse=True)
    rows, columns = place.reshape(-1, 2).T
    return _assembled(what, rows, columns, values, len(labels), labels)


def _assembled(
    what: str, rows: Numbers, columns: Numbers, values: Vector, size: int, labels: Numbers | None
) -> LabelledMatrix:
    """Return the matrix of triplets; where they fill one triangle, the other one mirrors it."""
    if size > MOST_ROWS:
        raise ValueError(f"{what}: has {size} rows; at most {MOST_ROWS} fit")
    if (rows <= columns).all() or (rows >= columns).all():
        apart = rows != columns
        rows, columns = np.concatenate([rows, columns[apart]]), np.concatenate([columns, rows[apart]])
        values = np.concatenate([values, values[apart]])
    return LabelledMatrix(sparse.csr_array(sparse.coo_array((values, (rows, columns)), (size, size))), labels)


def _labels_beside(path: Path, size: int) -> Numbers | None:
    """Return the labels in the file of the same name with the ending .dof, lines "node.direction", as CalculiX writes
    it."""
    beside = path.with_suffix(".dof")
    if not beside.is_file():
        return None
    try:
        with catch_warnings():
            simplefilter("ignore")  # numpy's, of a file without lines
            labels = np.loadtxt(beside, dtype=np.int64, delimiter=".", ndmin=2, max_rows=MOST_ROWS + 1)
    except ValueError:
        labels = np.zeros((0, 2), dtype=np.int64)
    if labels.shape[1:] != (2,) or len(labels) < size:
        raise ValueError(
            f"stiffness: {str(beside)!r} must have {count_of(size, 'line')} node.direction, one for each row of "
            f"{path.name}"
        )
    return labels[:size]


def in_order_of(what: str, other: LabelledMatrix, first: LabelledMatrix, of_file: bool) -> sparse.csr_array:
    """Return a matrix with the rows of another one; rows that a file lacks are zero. what: how messages begin."""
    size = first.matrix.shape[0]
    if other.labels is None or first.labels is None or np.array_equal(other.labels, first.labels):
        place = np.arange(other.matrix.shape[0])
    else:
        row_of = {label: row for row, label in enumerate(map(tuple, first.labels.tolist()))}
        try:
            place = np.array([row_of[label] for label in map(tuple, other.labels.tolist())], dtype=np.int64)
        except KeyError as error:
            node, direction = error.args[0]
            raise ValueError(f"{what}: has direction {direction} of node {node}, which the stiffness lacks") from None
    if place.size > size or (place.size < size and not of_file):
        raise ValueError(f"{what}: has {count_of(place.size, 'row')}, and the stiffness {size}")
    spread = sparse.csr_array((np.ones(place.size), (place, np.arange(place.size))), (size, place.size))
    return sparse.csr_array(spread @ other.matrix @ spread.T)


def matrix_of(name: str, value: Any) -> LabelledMatrix:
    """Return a matrix that is given, or that of a file; raise a ValueError where it is not square."""
    read = _given_or_read(name, value)
    rows, columns = read.matrix.shape
    if rows != columns or not rows:
        raise ValueError(f"{name} has shape ({rows}, {columns}): must be square, n × n")
    if (wrong := np.flatnonzero(~np.isfinite(read.matrix.data))).size:
        entries = read.matrix.tocoo()
        row, column, number = (part[wrong[0]] for part in (entries.row, entries.col, entries.data))
        raise ValueError(f"{name}: must hold finite numbers; row {row + 1}, column {column + 1} has {number}")
    return read


def _given_or_read(name: str, value: Any) -> LabelledMatrix:
    if isinstance(value, str | Path):
        return read_matrix(name, Path(value))
    try:
        matrix = value if sparse.issparse(value) else np.atleast_2d(value)
        if np.iscomplexobj(matrix):
            raise TypeError
        return LabelledMatrix(sparse.csr_array(matrix, dtype=float), None)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: must be a matrix of real numbers, sparse or dense, or a file of one") from None
