"""The chain as an FMU, for co-simulation programs that know FMI 2.0; optional: `pip install "hertzlink[fmu]"`."""

import os
import pickle
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from coupling.paths import path_of
from coupling.ports.guest import guest_chain
from particles.chain import Chain
from structures.checks import short
from structures.surface import Surface

UNIT = Path(__file__).with_name("fmu_unit.py")

MODULE = "hertzlink_chain"
"""The unit's name in the FMU. The program that opens it may hold other FMUs, whose modules share one space of names."""

CONTENT = "chain.pickle"
"""The chain and what it faces, beside the unit."""


def write_fmu(
    chain: Chain, surface: Surface, path: str | Path, flexibility: float = 0.0, dt: float | None = None
) -> Path:
    """Write the chain, with its contact, as an FMI 2.0 co-simulation unit; returns the path of the .fmu.

    surface, flexibility (m/N) and dt (s): see MovingChain; of a Structure structure.surface and structure.flexibility.
    Input: surface_displacement, m, at the end of the step that comes, from static equilibrium; the surface moves there
    linearly. Outputs, N, above the static ones: mean_contact_force over the step, which drives a structure so that the
    interface creates no energy; contact_force and sensor_force[1…N] at its end. Parameter: impact_speed, m/s, where
    the striker has one. Steps may be of any length and be repeated from a saved state. A step that cannot be is refused
    (fmi2Discard) and changes nothing; the reason goes to the log, which the program that opens the FMU must turn on.
    The FMU runs in the Python of the program that opens it, where this version of hertzlink must be installed. It
    holds the chain as a pickle: open only what you trust. A file of that name is replaced, whole or not at all.
    Raises ValueError for bad input, ImportError where pythonfmu is missing.
    """
    builder = _builder()
    guest_chain(chain, surface, flexibility, dt)
    target = _target(path)
    content = _pickled(
        {"version": version("hertzlink"), "chain": chain, "surface": surface, "flexibility": flexibility, "dt": dt}
    )
    with _beside(path, target) as name:
        folder = Path(name)
        script = Path(shutil.copy(UNIT, folder / f"{MODULE}.py"))
        (folder / CONTENT).write_bytes(content)
        with _imports_restored():
            whole = builder.build_FMU(
                script,
                dest=folder / target.name,
                project_files=[folder / CONTENT],
                canGetAndSetFMUstate=True,
                canSerializeFMUstate=True,
            )
        os.replace(whole, target)
    return Path(path).expanduser()


def _builder() -> Any:
    try:
        from pythonfmu import FmuBuilder
    except ImportError as error:
        raise ImportError(f'write_fmu needs pythonfmu ({error}): pip install "hertzlink[fmu]"') from error
    return FmuBuilder


def _target(path: str | Path) -> Path:
    """The file to write, or a ValueError."""
    what = "name of a file that ends in .fmu"
    named = path_of("path", path, what)
    if named.suffix != ".fmu":
        raise ValueError(f"path = {short(path)}: must be the {what}")
    whole = named.resolve()
    if whole.is_dir():
        raise ValueError(f"path = {str(path)!r}: is a folder; name a file")
    if not whole.parent.is_dir():
        raise ValueError(f"path = {str(path)!r}: its folder does not exist")
    return whole


def _beside(path: str | Path, target: Path) -> tempfile.TemporaryDirectory[str]:
    """A hidden folder next to the target, to be filled; a ValueError where there can be none."""
    try:
        return tempfile.TemporaryDirectory(prefix=f".{target.stem}-", dir=target.parent)
    except OSError as error:
        raise ValueError(f"path = {str(path)!r}: its folder cannot be written; {error.strerror}") from error


def _pickled(content: dict[str, Any]) -> bytes:
    """The content, or a ValueError where another Python could not find a part of it by its name."""
    try:
        data = pickle.dumps(content)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ValueError(f"chain: cannot be put into an FMU ({error}); a law of your own must stand in a module") from (
            error
        )
    if b"__main__" in data:
        raise ValueError("chain: a law of your own must stand in a module that the FMU's Python can import, not here")
    return data


@contextmanager
def _imports_restored() -> Iterator[None]:
    """pythonfmu imports the unit from where it lies, and would leave that folder on Python's path."""
    path, known = sys.path.copy(), MODULE in sys.modules
    try:
        yield
    finally:
        sys.path[:] = path
        if not known:
            sys.modules.pop(MODULE, None)
