"""Files of Python with parts of a user's own, which a case uses. Their code runs, so the case does not name them."""

import sys
from collections.abc import Iterable
from hashlib import sha256
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec
from pathlib import Path

from structures.described import registered

_LOADED: dict[str, bytes] = {}
"""What was run, by the name of its module: a file that did not change runs once in each process."""


def load(files: Iterable[Path]) -> None:
    """Run files, which describe parts; a ValueError for a file that cannot be read or that describes none."""
    for file in files:
        place = str(file.absolute())
        try:
            content = file.read_bytes()
        except OSError as error:
            raise ValueError(f"--with {file}: cannot be read ({error.strerror})") from None
        if _LOADED.get(place) == content:
            continue
        # Without dots it is no package: pickles, and kernels that are kept in files, find their classes by this name.
        name = place.replace(".", "_")
        module = module_from_spec(ModuleSpec(name, SourceFileLoader(name, place), origin=place))
        module.__file__ = place
        # Annotations that are texts are looked up there.
        sys.modules[name] = module
        try:
            exec(compile(content, place, "exec"), vars(module))
        except SyntaxError as error:
            raise ValueError(f"--with {file}:{error.lineno}: {error.msg}") from None
        if not any(entry.target.__module__ == name for entry in registered()):
            raise ValueError(f"--with {file}: describes no part; write @hl.described above a class or a function")
        _LOADED[place] = content


def names_of(files: Iterable[Path]) -> list[str]:
    """Return the names of files that were run, each with a checksum: results say which code they come from."""
    return [f"{file.name}, SHA-256 {sha256(_LOADED[str(file.absolute())]).hexdigest()}" for file in files]
