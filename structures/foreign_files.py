"""Files that only the libraries of their programs read: which run in a process of limited time and memory."""

import pickle
from pathlib import Path
from typing import Any

from structures.mesh_files import reader_process, words_of

FOREIGN = {
    ".op4": ("Nastran", "pyNastran", "nastran"), ".pch": ("Nastran", "pyNastran", "nastran"),
    ".op2": ("Nastran", "pyNastran", "nastran"), ".full": ("Ansys", "ansys-mapdl-reader", "ansys"),
    ".rst": ("Ansys", "ansys-mapdl-reader", "ansys"), ".unv": ("I-DEAS", "pyuff", "uff"),
    ".uff": ("I-DEAS", "pyuff", "uff"),
}  # fmt: skip
"""For each ending the program, the library that reads its files, and the extra of hertzlink that installs it."""

PROCESS = Path(__file__).with_name("foreign_process.py")

MISSING = 3
"""Exit status where the library is missing."""


def read_foreign(path: Path, what: str, role: str) -> dict[str, Any]:
    """Return what a library reads of a file, as arrays by name; what: how messages begin; role: "mass", "modes" …"""
    program, library, extra = FOREIGN[path.suffix.lower()]
    done = reader_process(PROCESS, path, what, role)
    if done.returncode == MISSING:
        raise ValueError(f"{what}: needs {library} to be read: pip install hertzlink[{extra}]")
    if done.returncode != 0:
        raise ValueError(
            f"{what}: cannot be read as a {path.suffix.lower()} file of {program} by {library}; it is damaged, cut "
            f"short, or holds what is not understood{words_of(done.stderr)}"
        )
    read: dict[str, Any] = pickle.loads(done.stdout)
    return read
