"""The chain as an FMU, for programs that support FMI 2.0 or 3.0; optional: `pip install "hertzlink[fmu]"`."""

import importlib.metadata
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields, replace
from importlib import import_module
from inspect import isclass
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from coupling.files import plain
from coupling.files.loading import file_to_write
from coupling.files.writing import whole_file_by_name
from coupling.ports.guest import GuestState, guest_chain
from particles.bead import Bead
from particles.chain import Chain
from particles.deformable.deformable_chain import DeformableChain
from particles.deformable.vibration import vibration
from particles.laws.law import ContactLaw
from particles.laws.yielding import YieldingLaw
from particles.moving import ChainState, MovingChain
from particles.overloads import overloads, weaker
from structures.caution import caution
from structures.checks import instance, short
from structures.described import registered
from structures.surface import Surface, hertz_stiffness

UNIT_MODULE = "hertzlink_chain_{version}"
"""Name of the unit in the FMU. All FMUs that a program opens share one namespace of modules, so the name must be
unique.
"""

UNIT_SCRIPT = """from ctypes import py_object, pythonapi

import hertzlink  # the front door comes before its rooms
import {kit}
from {kit} import Fmi{version}Slave

from coupling.ports.fmu_unit import ChainUnit

# pythonfmu runs this text for each unit, and each time releases its namespace once more than it holds it.
pythonapi.Py_IncRef(py_object(globals()))


class HertzlinkChain(ChainUnit, Fmi{version}Slave):
    kit, fmi = {kit}, {version}
"""
"""The script in the FMU: pythonfmu finds the class in its text. It runs in the program that opens the FMU, where this
version of hertzlink must be installed.
"""

OPTIONS = (
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "canGetAndSetFMUState",
    "canSerializeFMUState",
    "canHandleVariableCommunicationStepSize",
)
"""What the unit can do, in the words of FMI 2.0 and of FMI 3.0; a builder takes those of its version."""

KITS = {2: "pythonfmu", 3: "pythonfmu3"}
"""The packages that write an FMU, by the version of FMI."""

CONTENT_FILE = "chain.data"
"""File with the chain and the surface that it faces, next to the unit: plain data."""

DOCUMENTATION = Path(__file__).with_name("fmu.html")
"""The page that the standard foresees as documentation/index.html."""

TRUSTED_FILE = "chain.trusted"
"""The same, where classes of the user's own are in it as pickles."""


def write_fmu(
    chain: Chain,
    surface: Surface,
    path: str | Path,
    flexibility: float = 0.0,
    dt: float | None = None,
    trust: bool = False,
    fmi: int = 2,
) -> Path:
    """Write a chain, with its contact, as a co-simulation unit of FMI 2.0 or 3.0.

    Input: `surface_displacement`, m, at the end of the next step, to which the surface moves linearly. Outputs, N,
    relative to the static forces: `mean_contact_force` over the step, with which the interface creates no energy, and
    `contact_force` and `sensor_force[1…N]` at its end. Parameter: `impact_speed`, m/s, if the striker has one. The page
    on interoperability says which steps are refused.

    The FMU runs in the Python of the opening program, where this version of hertzlink must be installed. It holds the
    chain as plain data and hertzlink's script: like any FMU it is a program, so open only files that you trust. An
    existing file of that name is replaced, completely or not at all.

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
    trust : bool
        Whether beads, losses, excitations and laws of classes of your own may be pickled. Their modules must be
        installed where the FMU is opened.
    fmi : int
        Version of the standard: 2, which more programs open, or 3.

    Returns
    -------
    Path
        The path of the .fmu file.

    Raises
    ------
    ValueError
        For bad input.
    ImportError
        If pythonfmu, or pythonfmu3 for FMI 3.0, is missing.

    References
    ----------
    Functional Mock-up Interface 2.0 and 3.0, section 4 (co-simulation).

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 5, bead, impact_speed=0.31)
    >>> hl.write_fmu(chain, hl.Surface(hl.ACRYLIC), "chain.fmu").name
    'chain.fmu'
    """
    builder = _builder(fmi)
    _warn_of_yield(guest_chain(chain, surface, flexibility, dt))
    target = file_to_write("path", path, [".fmu"])
    _check_writable(target)
    if fmi == 2:
        _warn_of_folders(target.parent, Path(tempfile.gettempdir()))
    content = pack(chain, surface, flexibility, dt, instance("trust", trust, bool, "True or False"))
    content_file = TRUSTED_FILE if trust else CONTENT_FILE
    names = {"kit": KITS[fmi], "version": fmi}
    with whole_file_by_name(target) as part:
        script = part.with_name(f"{UNIT_MODULE.format(**names)}.py")
        script.write_text(UNIT_SCRIPT.format(**names))
        part.with_name(content_file).write_bytes(content)
        documentation = part.with_name("documentation")
        documentation.mkdir()
        shutil.copy(DOCUMENTATION, documentation / "index.html")
        with _imports_restored(script.stem):
            fmu = builder.build_FMU(
                script,
                dest=part.with_name("fmu"),
                project_files=[part.with_name(content_file)],
                documentation_folder=documentation,
                **dict.fromkeys(OPTIONS, True),
            )
        fmu.replace(part)
    return Path(path).expanduser()


def _warn_of_yield(moving: MovingChain) -> None:
    """Warns where a bead of the impact's speed would dent the surface: other programs show no findings of a run."""
    bead, surface = moving.chain.beads[-1], moving.pairs[-1]
    if surface is None or moving.laws[-1] is None or not moving.chain.speed > 0.0:
        return
    forces = np.zeros(len(moving.pairs))
    with suppress(ValueError):  # bodies that touch in no point
        stiffness = hertz_stiffness(bead.surface, cast(Surface, surface[1]))
        forces[-1] = stiffness**0.4 * (1.25 * bead.mass * moving.chain.speed**2) ** 0.6  # of Hertz's impact
    ratio = float(overloads(moving, forces)[-1])
    if ratio > 1.0:
        name = weaker(moving, len(forces) - 1).name or "the softer body"
        caution(
            f"yield: the last bead presses {name} to about {ratio:.2g} times the pressure at which it yields; its dent "
            "is left out; law=hl.laws.JacksonGreen() in Chain computes it"
        )


def _builder(fmi: int) -> Any:
    kit = KITS.get(fmi) if isinstance(fmi, int) else None
    if kit is None:
        raise ValueError(f"fmi = {short(fmi)}: must be 2 or 3, for FMI 2.0 or 3.0")
    try:
        return import_module(kit).FmuBuilder
    except ImportError as error:
        raise ImportError(f'write_fmu needs {kit} ({error}): pip install "hertzlink[fmu]"') from error


def _check_writable(target: Path) -> None:
    """Raise a ValueError where no file can be made next to a target, before the unit is built."""
    try:
        with tempfile.TemporaryFile(dir=target.parent):
            pass
    except OSError as error:
        raise ValueError(f"path = {str(target)!r}: its folder cannot be written; {error.strerror}") from error


def _warn_of_folders(*folders: Path) -> None:
    """Warn of folders in which an FMU may be unpacked, and which its library cannot find."""
    for folder in folders:
        if "%" in folder.resolve().as_uri().replace("%20", ""):
            caution(
                f"{str(folder)!r}: a program that unpacks the FMU in this folder crashes, because pythonfmu's library "
                "cannot find it; use a path of letters from A to Z, digits, blanks and -._~ alone"
            )


@contextmanager
def _imports_restored(module: str) -> Iterator[None]:
    """Restore sys.path: pythonfmu imports the unit from its folder, and would leave that folder in it."""
    path, loaded = sys.path.copy(), module in sys.modules
    try:
        yield
    finally:
        sys.path[:] = path
        if not loaded:
            sys.modules.pop(module, None)


@dataclass(frozen=True)
class KnownLaws:
    """The laws that a user's function gave to the pairs of bodies of a chain, in its place."""

    pairs: tuple[tuple[Bead, Bead | Surface, ContactLaw], ...]

    def __call__(self, bead: Bead, facing: Bead | Surface) -> ContactLaw:
        """Return the law of a pair. Raises ValueError for one that the chain does not have."""
        for first, second, law in self.pairs:
            if (first, second) == (bead, facing):
                return law
        raise ValueError(f"law: knows no contact of {bead!r} with {facing!r}")


HOMES = "particles.", "structures.damping", "structures.material", "structures.surface"
TYPES = plain.own_types(
    KnownLaws, *(of.target for of in registered() if isclass(of.target) and of.target.__module__.startswith(HOMES))
)
"""Everything that a chain consists of, unless a user defines a class of his own."""


class UnitState(NamedTuple):
    """The complete state of a unit: of its chain, its input, its parameter (None without one), its start time, s, and
    whether it is initialised.
    """

    guest: GuestState
    surface_displacement: float
    impact_speed: float | None
    begin: float
    initialised: bool


STATE_TYPES = plain.own_types(UnitState, GuestState, ChainState)


def pack(chain: Chain, surface: Surface, flexibility: float, dt: float | None, trust: bool) -> bytes:
    """Return the content as bytes. Raises ValueError where a part of it is no plain data, or another Python cannot find
    it."""
    content = {
        "kind": type(chain).__name__,
        "chain": _fields_of(chain, surface, flexibility, dt),
        "facing": {"surface": surface, "flexibility": flexibility, "dt": dt},
    }
    try:
        data = plain.to_bytes(content, TYPES, trust)
    except plain.NotPlain as error:
        hint = "define it in a module" if trust else "with trust=True it is pickled, if it is defined in a module"
        raise ValueError(f"chain: does not fit into an FMU: it {error}; {hint}") from error
    if trust and b"__main__" in data:
        raise ValueError(
            "chain: a class of your own must be defined in a module that the FMU's Python can import, not here"
        )
    return importlib.metadata.version("hertzlink").encode() + b"\n" + data


def unpack(data: bytes, trust: bool) -> tuple[Chain, dict[str, Any]]:
    """Return the chain, checked as any input, and what it faces. Raises ValueError for anything else."""
    written, _, rest = data.partition(b"\n")
    here = importlib.metadata.version("hertzlink")
    if written != here.encode():
        raise ValueError(f"the FMU's chain was written by hertzlink {short(written)}, not {here}: write the FMU again")
    try:
        content = plain.from_bytes(rest, TYPES, trust, checked=True)
        chain_fields, facing, kind = dict(content["chain"]), dict(content["facing"]), content["kind"]
    except (plain.Unreadable, KeyError, TypeError) as error:
        raise ValueError(f"the FMU's chain is no plain data of hertzlink ({error})") from error
    return {"Chain": Chain, "DeformableChain": DeformableChain}[kind](**chain_fields), facing


def state_bytes(state: UnitState) -> bytes:
    """Return the state of a unit as bytes."""
    return plain.to_bytes(state, STATE_TYPES)


def state_from(data: bytes) -> UnitState:
    """Return the state in bytes. Raises ValueError for anything else."""
    state = plain.from_bytes(data, STATE_TYPES)
    if not (isinstance(state, UnitState) and isinstance(state.guest, GuestState)):
        raise ValueError("state: is none of this unit")
    speed = state.impact_speed
    numbers = (state.surface_displacement, state.begin, *([] if speed is None else [speed]))
    if not all(isinstance(number, int | float) and isfinite(number) for number in numbers):
        raise ValueError("state: holds no finite displacement, start time or impact speed")
    return state


def _fields_of(chain: Chain, surface: Surface, flexibility: float, dt: float | None) -> Mapping[str, Any]:
    """Return what builds the chain, with a function as a law replaced by the laws that it gives."""
    chain_fields = {field.name: getattr(chain, field.name) for field in fields(chain) if field.init}
    if chain_fields.get("vibrations") is vibration:
        del chain_fields["vibrations"]
    law = chain.law
    if law is not None and not isinstance(law, ContactLaw | YieldingLaw):
        laws: dict[tuple[Any, Any], ContactLaw] = {}

        def noted(bead: Bead, facing: Bead | Surface) -> ContactLaw:
            return laws.setdefault((bead, facing), law(bead, facing))

        guest_chain(replace(chain, law=noted), surface, flexibility, dt)
        chain_fields["law"] = KnownLaws(tuple((*pair, item) for pair, item in laws.items()))
    return chain_fields
