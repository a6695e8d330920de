"""Files that only the libraries of their programs read: which run in a process of limited time and memory."""

from pathlib import Path
from typing import Any

from structures.meshes.mesh_files import read_bounded, words_of
from structures.reading_process import Unread

FOREIGN = {
    ".op4": ("Nastran", "pyNastran", "nastran"), ".pch": ("Nastran", "pyNastran", "nastran"),
    ".op2": ("Nastran", "pyNastran", "nastran"), ".full": ("Ansys", "ansys-mapdl-reader", "ansys"),
    ".rst": ("Ansys", "ansys-mapdl-reader", "ansys"), ".unv": ("I-DEAS", "pyuff", "uff"),
    ".uff": ("I-DEAS", "pyuff", "uff"),
}  # fmt: skip
"""For each ending the program, the library that reads its files, and the extra of hertzlink that installs it."""

PROCESS = Path(__file__).with_name("foreign_process.py")


def read_foreign(path: Path, what: str, role: str) -> dict[str, Any]:
    """Return what a library reads of a file, as arrays by name; what: how messages begin; role: "mass", "modes" …"""
    program, library, extra = FOREIGN[path.suffix.lower()]
    try:
        read: dict[str, Any] = read_bounded(PROCESS, path, role)
    except Unread as error:
        if error.missing:
            raise ValueError(f"{what}: needs {library} to be read: pip install hertzlink[{extra}]") from None
        if "module 'numpy' has no attribute" in error.said:
            raise ValueError(
                f"{what}: {library} does not work with a numpy as new as this; install hertzlink[{extra}] in an "
                "environment of its own"
            ) from None
        raise ValueError(
            f"{what}: cannot be read as a {path.suffix.lower()} file of {program} by {library}; it is damaged, cut "
            f"short, or holds what is not understood{words_of(error)}"
        ) from None
    return read
