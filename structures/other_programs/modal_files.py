"""Files of modes that other programs write: frequencies, and shapes at the nodes that are struck."""

from collections.abc import Sequence
from math import isclose, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np

from structures.checks import existing
from structures.other_programs.foreign_files import FOREIGN, read_foreign
from structures.other_programs.matrix_files import Numbers, Vector
from structures.other_programs.table_heads import FREQUENCY, Head, table_in

FORMATS = {
    ".csv": "a table", ".txt": "a table", ".frd": "CalculiX", ".unv": "I-DEAS", ".uff": "I-DEAS", ".op2": "Nastran",
    ".rst": "Ansys",
}  # fmt: skip
"""The endings of files of modes, and the programs that write them."""

PROGRAMS = ", ".join(ending for ending, program in FORMATS.items() if program != "a table")

SHAPE = Head("shape", r"shape|phi|φ|ϕ|displ|√", {"1/√kg": 1.0, "1/√t": sqrt(1e-3)})
RATIO = "damping ratio"
DAMPING = (
    Head(RATIO, r"loss|\beta\b|η|decrement|quality|^q$", {}),
    Head(RATIO, r"damp|ratio|zeta|ζ|\bxi\b|ξ|%", {"": 1.0, "1": 1.0, "-": 1.0, "%": 1e-2}),
)
"""The columns of a table of modes beside the frequency."""

LARGEST_RATIO = 0.2
"""A larger damping ratio without a unit may be in percent."""

FRD_KEY, FRD_NODE, FRD_WIDTH = slice(0, 5), slice(3, 13), 12
"""Columns of lines of .frd files: the key, the node, and how wide a number is."""


class Modes(NamedTuple):
    """Modes: frequencies, Hz; shapes, modes × nodes × directions (1 to 6), normalised to unit modal mass; and the
    damping ratios, where the file has them."""

    frequencies: Vector
    shapes: Vector
    ratios: Vector | None


def read_modes(name: str, path: Path, nodes: Sequence[int], scale: float) -> Modes:
    """Return the modes of a file at some nodes; those of a table belong to its only point, along direction 3.

    scale: m per unit of length, in systems whose unit of mass is that of N and s. Raises ValueError for a file that
    cannot be read or lacks a node; time and memory are bounded by its size.
    """
    what = f"{name} = {str(path)!r}"
    suffix = existing(what, path).suffix.lower()
    if suffix not in FORMATS:
        raise ValueError(f"{what}: must be one of {', '.join(FORMATS)}, or numbers of Hz")
    if FORMATS[suffix] == "a table":
        return _table(what, path, nodes, scale)
    if not nodes:
        raise ValueError(f"node: {path.name} has shapes of many nodes; state the one that is struck")
    if suffix not in FOREIGN:
        return _frd(what, path, nodes, scale)
    read = read_foreign(path, what, "modes")
    rows = [_place(what, np.asarray(read["nodes"], dtype=np.int64), node) for node in nodes]
    masses = np.asarray(read["masses"], dtype=float)
    if not (masses > 0.0).all():
        raise ValueError(f"{what}: has a modal mass of {masses.min()}: must be positive")
    shapes = np.asarray(read["shapes"], dtype=float)[:, rows] * np.sqrt(scale / masses)[:, None, None]
    return Modes(np.asarray(read["frequencies"], dtype=float), shapes, read["ratios"])


def _table(what: str, path: Path, nodes: Sequence[int], scale: float) -> Modes:
    """Return the modes of a table, of one point."""
    if nodes:
        raise ValueError(f"node = {nodes[0]}: a table is of one point; leave node out, or give {PROGRAMS}")
    shapes_of = SHAPE._replace(units={"": sqrt(scale), **SHAPE.units})
    table = table_in(what, path, [*FREQUENCY, shapes_of, *DAMPING], [RATIO])
    frequency, shape, ratio = table["frequency"], table["shape"], table.get(RATIO)
    if shape.unit and scale != 1.0 and not isclose(scale, SHAPE.units[shape.unit] ** 2):
        raise ValueError(f"scale = {scale}: {path.name} states shapes in {shape.unit}; leave scale out")
    if ratio is not None and not ratio.unit and ratio.values.max() > LARGEST_RATIO:
        raise ValueError(
            f"{what}: has a damping ratio of {ratio.values.max():g}; write the head damping (%) or damping (1)"
        )
    shapes = np.zeros((shape.values.size, 1, 6))
    shapes[:, 0, 2] = shape.values
    return Modes(frequency.values, shapes, None if ratio is None else ratio.values)


def _place(what: str, numbers: Numbers, node: int) -> int:
    at = np.flatnonzero(numbers == node)
    if not at.size:
        raise ValueError(f"{what}: has no node {node} among its {numbers.size}")
    return int(at[0])


def _frd(what: str, path: Path, nodes: Sequence[int], scale: float) -> Modes:
    """Return the modes of a .frd file in text; CalculiX normalises them to unit modal mass."""
    wanted = {f"{node:10d}": i for i, node in enumerate(nodes)}
    frequencies, shapes, modal, inside = list[float](), list[Vector](), False, False
    with path.open(encoding="latin-1") as file:
        try:
            for line in file:
                key = line[FRD_KEY]
                if key == "  100":
                    modal, inside = "MODAL" in line, False
                    value = line[12:24]
                elif key == " -4  ":
                    inside = modal and line.split()[1] == "DISP"
                    if inside:
                        frequencies.append(float(value))
                        shapes.append(np.full((len(nodes), 6), np.nan))
                        shapes[-1][:, 3:] = 0.0
                elif inside and line.startswith(" -1") and line[FRD_NODE] in wanted:
                    starts = range(13, 13 + 3 * FRD_WIDTH, FRD_WIDTH)
                    shapes[-1][wanted[line[FRD_NODE]], :3] = [float(line[i : i + FRD_WIDTH]) for i in starts]
        except (ValueError, IndexError, UnboundLocalError):
            raise ValueError(f"{what}: is damaged near {line[:60].strip()!r}") from None
    if not shapes:
        raise ValueError(f"{what}: holds no displacements of modes in text; ask for *NODE FILE and U after *FREQUENCY")
    missing = np.isnan(np.array(shapes)).any(axis=(0, 2))
    if missing.any():
        raise ValueError(f"{what}: has no node {nodes[int(np.argmax(missing))]} in each of its {len(shapes)} modes")
    return Modes(np.array(frequencies), np.sqrt(scale) * np.array(shapes), None)
