"""The chain as an FMU, for co-simulation programs that support FMI 2.0; optional: `pip install "hertzlink[fmu]"`."""

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

UNIT_SCRIPT = Path(__file__).with_name("fmu_unit.py")

UNIT_MODULE = "hertzlink_chain"
"""Name of the unit in the FMU. All FMUs that a program opens share one namespace of modules, so the name must be
unique.
"""

CONTENT_FILE = "chain.pickle"
"""File with the chain and the surface that it faces, next to the unit."""


def write_fmu(
    chain: Chain, surface: Surface, path: str | Path, flexibility: float = 0.0, dt: float | None = None
) -> Path:
    """Write a chain, with its contact, as an FMI 2.0 co-simulation unit.

    Input: `surface_displacement`, m, at the end of the next step, from static equilibrium; the surface moves linearly
    during the step. Outputs, N, relative to the static forces: `mean_contact_force` over the step, with which the
    interface creates no energy, and `contact_force` and `sensor_force[1…N]` at its end. Parameter: `impact_speed`, m/s,
    if the striker has one. Steps may have any length, and may be repeated from a saved state. An impossible step is
    refused (fmi2Discard) and changes nothing; its reason is written to the log, which the opening program must enable.

    The FMU runs in the Python of the opening program, where this version of hertzlink must be installed. It holds the
    chain as a pickle: open only files that you trust. An existing file of that name is replaced, completely or not at
    all.

    Parameters
    ----------
    chain : Chain
        The chain.
    surface : Surface
        The surface that the chain touches; `structure.surface` for a Structure.
    path : str or Path
        Name of the .fmu file.
    flexibility : float
        Compliance in series with the contact, m/N; `structure.flexibility` for a Structure.
    dt : float, optional
        Time step of the chain, s; see MovingChain.

    Returns
    -------
    Path
        The path of the .fmu file.

    Raises
    ------
    ValueError
        For bad input.
    ImportError
        If pythonfmu is missing.

    References
    ----------
    Functional Mock-up Interface 2.0, section 4 (co-simulation).

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 5, bead, impact_speed=0.31)
    >>> hl.ports.write_fmu(chain, hl.Surface(hl.ACRYLIC), "chain.fmu").name
    'chain.fmu'
    """
    builder = _builder()
    guest_chain(chain, surface, flexibility, dt)
    target = _target(path)
    content = _pickled(
        {"version": version("hertzlink"), "chain": chain, "surface": surface, "flexibility": flexibility, "dt": dt}
    )
    with _beside(path, target) as name:
        folder = Path(name)
        script = Path(shutil.copy(UNIT_SCRIPT, folder / f"{UNIT_MODULE}.py"))
        (folder / CONTENT_FILE).write_bytes(content)
        with _imports_restored():
            whole = builder.build_FMU(
                script,
                dest=folder / target.name,
                project_files=[folder / CONTENT_FILE],
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
    """A hidden folder next to the target, to be filled; a ValueError if it cannot be created."""
    try:
        return tempfile.TemporaryDirectory(prefix=f".{target.stem}-", dir=target.parent)
    except OSError as error:
        raise ValueError(f"path = {str(path)!r}: its folder cannot be written; {error.strerror}") from error


def _pickled(content: dict[str, Any]) -> bytes:
    """The content as bytes; a ValueError if another Python could not import a part of it."""
    try:
        data = pickle.dumps(content)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ValueError(f"chain: does not fit into an FMU ({error}); define a law of your own in a module") from (
            error
        )
    if b"__main__" in data:
        raise ValueError(
            "chain: a law of your own must be defined in a module that the FMU's Python can import, not here"
        )
    return data


@contextmanager
def _imports_restored() -> Iterator[None]:
    """pythonfmu imports the unit from its folder, and would leave that folder in sys.path; this context restores it."""
    path, known = sys.path.copy(), UNIT_MODULE in sys.modules
    try:
        yield
    finally:
        sys.path[:] = path
        if not known:
            sys.modules.pop(UNIT_MODULE, None)
