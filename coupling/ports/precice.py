"""Chain and structure as participants of a preCICE coupling; optional: needs preCICE 3 and its bindings, pyprecice."""

import logging
import re
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import ceil, inf
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast

import numpy as np
import xarray as xr

from coupling.files.loading import path_of
from coupling.plan import SAME_TIME, coarse
from coupling.ports.guest import GuestState, advance, guest_chain, start
from coupling.results.findings import warn, with_warnings
from coupling.results.provenance import provenance, version_of
from coupling.results.schema import run_coordinates, variable
from coupling.run_checks import check_guest
from particles.chain import Chain
from particles.moving import MovingChain
from structures.checks import count_of, each, finite, instance, one_of, positive, short
from structures.moving import MovingStructure
from structures.structure import Structure, Vector
from structures.surface import Surface

DATA = {"displacement": "Displacement", "force": "Force"}

DEFAULT_NAMES = {"participant": "Chain", "mesh": "Chain-Mesh", **DATA}
"""Default names in the configuration: of the chain, its mesh, the data that it reads and the data that it writes."""

STRUCTURE_NAMES = {"participant": "Structure", "mesh": "Structure-Mesh", **DATA}
"""The same of the structure, which reads the force and writes the displacement."""

STEPS_PER_CONTACT = 64
"""Steps of the chain in a contact, where neither preCICE nor the user says how long they are."""

SCHEME = re.compile(r"<coupling-scheme:(?P<kind>[\w-]+)[^>]*>.*?</coupling-scheme:(?P=kind)>", re.DOTALL)
"""A coupling scheme of a configuration."""

MOST_ITERATIONS = re.compile(r"<max-iterations\b[^>]*\bvalue\s*=\s*[\"'](\d+)[\"']")

STILL, WEAK, RELATIVE = 2e-14, 1e-9, 1e-9
"""Limits of convergence: of the displacement (m) and of the force (N), and their relative limit. preCICE refuses
absolute limits of 1e-14 and less."""

CONFIGURATION = Path(__file__).with_name("precice-config.xml")
"""The template of a configuration."""

COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)

log = logging.getLogger("hertzlink.precice")

T = TypeVar("T")


def run_in_precice(
    body: Chain | Structure,
    configuration: str | Path,
    surface: Surface | None = None,
    names: Mapping[str, str] | None = None,
    direction: Sequence[float] | None = None,
    positions: Sequence[Sequence[float]] | None = None,
    window: float | None = None,
    flexibility: float = 0.0,
    dt: float | None = None,
) -> xr.Dataset:
    """Run a chain, or a structure, as a participant of a preCICE coupling, to its end.

    The mesh has a vertex for each contact, of a chain one. The chain reads the displacement of the surface (m, from
    static equilibrium) and writes the mean force over preCICE's window so far (N, relative to the static one); a
    structure reads the mean force and writes the displacement at the window's end. Both are positive away from the
    chain. The force is constant over preCICE's window, so configure waveform-degree="0" and substeps="false". Then the
    interface creates no energy if the coupling is implicit. The other participant may be a program of the user's.

    Parameters
    ----------
    body : Chain or Structure
        What to run; a large structure should be reduced, see `reduce`.
    configuration : str or Path
        The configuration file of preCICE, with a fixed time-window-size.
    surface : Surface
        The surface that a chain touches; `structure.surface` for a Structure.
    names : mapping, optional
        Names in the configuration that differ from "participant": "Chain" or "Structure", "mesh": "Chain-Mesh" or
        "Structure-Mesh", "displacement": "Displacement", "force": "Force".
    direction : sequence of float, optional
        The direction in which the chain pushes, if the data are vectors; None if both are scalars.
    positions : sequence, optional
        Position of the vertex of each contact, m; of a single one by default the origin.
    window : float, optional
        Longest step of a chain, s. The surface moves linearly over a step: preCICE's window, or an equal part of it
        no longer than `window`, which suits a displacement of waveform-degree 2 or more. By default preCICE's window;
        but 1/64 of a contact if that is longer than 1/8 of one, or left to the chain (method "first-participant").
    flexibility : float
        Compliance in series with a chain's contact, m/N; `structure.flexibility` for a Structure.
    dt : float, optional
        Time step of a chain, s; see MovingChain.

    Returns
    -------
    xarray.Dataset
        Of a chain, a Dataset for `reflections` and the other measures. Of the energies it holds the work on the surface
        alone. `evaluations` counts how often a window was tried, and `residual` is the last change of its force. The
        attribute `warnings` holds the findings: windows that took all iterations, windows that are coarse, and those of
        every run.

        Of a structure, over time and its contacts: `surface_displacement` (m), `mean_force` (N) over the window that
        ends there, and `interface_work` (J).

        The attribute `precice` names the version of preCICE.

    Raises
    ------
    ImportError
        If pyprecice is missing.
    ValueError
        For bad input.
    FloatingPointError
        If the state of a bead is no longer finite. Errors of preCICE are passed on.

    References
    ----------
    preCICE 3 documentation, Python bindings and "coupling scheme configuration".

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 20, bead, impact_speed=0.31)
    >>> try:
    ...     run = hl.run_in_precice(chain, "precice-config.xml", hl.Surface(hl.ACRYLIC))
    ... except (ImportError, ValueError) as error:  # pyprecice, or the configuration file, is missing
    ...     print("no coupling")
    no coupling
    """
    instance("body", body, Chain | Structure, "a Chain or a Structure")  # type: ignore[arg-type]
    if isinstance(body, Structure):
        return _run_structure(body, configuration, names, direction, positions)
    instance("surface", surface, Surface, "a Surface(material); of a structure structure.surface")
    return _run_chain(
        guest_chain(body, cast(Surface, surface), flexibility, dt), configuration, names, direction, positions, window
    )


def _run_chain(
    moving: MovingChain, configuration: str | Path, names: Any, direction: Any, positions: Any, window: float | None
) -> xr.Dataset:
    """Run a chain to the end of the coupling."""
    longest = None if window is None else positive("window", window, "s")
    called, file = _called(DEFAULT_NAMES, names), _file(configuration)

    def interface_of(participant: Any) -> _Interface:
        return _Interface(participant, called, ("displacement", "force"), direction, positions)

    windows, version = _coupled(called, file, interface_of, lambda interface: _exchange(moving, interface, longest))
    inputs = {"chain": moving.chain.describe(), "configuration": str(configuration), "names": called, "window": window}
    data = _dataset(moving, windows, inputs).assign_attrs(precice=version)
    findings = windows.findings(moving, _most_iterations(file, called["participant"]))
    findings += check_guest(moving, data.contact_force.values, data.interface_work.values, data.time.values)
    warn(findings)
    return with_warnings(data, findings)


def _run_structure(
    structure: Structure, configuration: str | Path, names: Any, direction: Any, positions: Any
) -> xr.Dataset:
    """Run a structure to the end of the coupling."""
    moving = MovingStructure(structure)
    called, file = _called(STRUCTURE_NAMES, names), _file(configuration)
    count = len(moving.surfaces)
    if positions is None and count > 1:
        raise ValueError(f"positions = None: must hold {count_of(count, 'position')}, one for each contact")

    def interface_of(participant: Any) -> _Interface:
        return _Interface(participant, called, ("force", "displacement"), direction, positions, count)

    def exchange(interface: _Interface) -> tuple[list[float], list[Vector], list[Vector]]:
        coupling, state = interface.participant, moving.start()
        times, forces, places = [0.0], [np.zeros(count)], [np.zeros(count)]
        interface.initialize()
        while coupling.is_coupling_ongoing():
            # The state before the window is kept until the window is accepted.
            coupling.requires_writing_checkpoint()
            window = coupling.get_max_time_step_size()
            force = interface.read(window)
            after, moved = moving.advance(state, force if count > 1 else float(force[0]), window)
            place = np.reshape(moved, count)
            interface.write(place)
            with _interruptible():
                coupling.advance(window)
            if not coupling.requires_reading_checkpoint():
                state = after
                times.append(times[-1] + window)
                forces.append(force)
                places.append(place)
        return times, forces, places

    (times, forces, places), version = _coupled(called, file, interface_of, exchange)
    surface, force = np.array(places), np.array(forces)
    work = np.cumsum(np.sum(force[1:] * np.diff(surface, axis=0), axis=1))
    inputs = {"structure": structure.origin, "configuration": str(configuration), "names": called}
    seat = ("time", "structure_contact")
    data = {
        "surface_displacement": (seat, surface, {"units": "m", "long_name": "displacement of the surface"}),
        "mean_force": (seat, force, {"units": "N", "long_name": "mean force over the window"}),
        "interface_work": ("time", np.array([0.0, *work]), {"units": "J", "long_name": "work on the structure"}),
    }
    return xr.Dataset(data, {"time": ("time", times, {"units": "s"})}, provenance(inputs) | {"precice": version})


def precice_configuration(chain: Chain, surface: Surface, until: float, flexibility: float = 0.0) -> str:
    """Return the text of a configuration of preCICE 3 for a chain on a surface, by docs/interoperability.md.

    until: length of the record, s. flexibility: in series with the contact, m/N. Participants "Chain" and "Structure",
    serial-implicit, with Aitken's relaxation; a window is 1/64 of a contact.
    """
    return CONFIGURATION.read_text("utf-8").format(
        chain=DEFAULT_NAMES["participant"], chain_mesh=DEFAULT_NAMES["mesh"],
        structure=STRUCTURE_NAMES["participant"], structure_mesh=STRUCTURE_NAMES["mesh"],
        force=DEFAULT_NAMES["force"], displacement=DEFAULT_NAMES["displacement"], STILL=STILL, WEAK=WEAK,
        RELATIVE=RELATIVE, until=positive("until", until, "s"),
        window=guest_chain(chain, surface, flexibility).contact_time / STEPS_PER_CONTACT,
    )  # fmt: skip


def _called(usual: Mapping[str, str], names: Mapping[str, str] | None) -> dict[str, str]:
    """Return the names in the configuration."""
    names = {} if names is None else names
    instance("names", names, Mapping, "a mapping such as {'mesh': 'Chain-Mesh'}")  # type: ignore[type-abstract]
    for key, name in names.items():
        one_of("names", key, usual)
        instance(f"names[{key!r}]", name, str, "a name in the configuration")
    return {**usual, **names}


def _file(configuration: str | Path) -> Path:
    file = path_of("configuration", configuration, "name of a file")
    if not file.is_file():
        raise ValueError(f"configuration = {short(str(configuration))}: must be preCICE's configuration file")
    return file


def _coupled(
    called: Mapping[str, str],
    file: Path,
    interface_of: Callable[[Any], "_Interface"],
    exchange: Callable[["_Interface"], T],
) -> tuple[T, str]:
    """Return what an exchange of data gives, and the version of preCICE; after an error the other participant ends."""
    precice = _bindings()
    participant = precice.Participant(called["participant"], str(file), 0, 1)
    try:
        interface = interface_of(participant)
    except (ValueError, RuntimeError) as error:
        _release(participant, called["mesh"], error)
        raise
    try:
        result = exchange(interface)
    except BaseException:
        # Otherwise the other participant waits until this one is deleted.
        _finalize(participant)
        raise
    participant.finalize()
    return result, _version(precice)


class _Windows:
    """States at the ends of all accepted steps, the start first; and how each window of preCICE went.

    At the end of a window, zero at that of other steps: how often the window was tried, and the residual, N, which is
    the last change of its mean force.
    """

    def __init__(self, begin: GuestState) -> None:
        self.states, self.evaluations, self.residual = [begin], [0], [0.0]
        self.longest, self.first, self.tries, self.force = 0.0, 0, 1, 0.0

    def mean_force(self) -> float:
        """Return the mean force over the window so far, N."""
        states = self.states[self.first :]
        spans = np.diff([state.chain.time for state in states])
        return float(spans @ [state.mean_force for state in states[1:]] / spans.sum())

    def repeat(self) -> None:
        """Go back to the beginning of the window."""
        self.tries, self.force = self.tries + 1, self.mean_force()
        del self.states[self.first + 1 :]

    def accept(self) -> None:
        """Begin the next window."""
        force, inner = self.mean_force(), [0] * (len(self.states) - self.first - 2)
        self.longest = max(self.longest, self.states[-1].chain.time - self.states[self.first].chain.time)
        self.evaluations += [*inner, self.tries]
        self.residual += [*inner, abs(force - self.force)]
        self.first, self.tries, self.force = len(self.states) - 1, 1, force

    def findings(self, moving: MovingChain, most: float) -> list[str]:
        """Return the windows that are coarse, or took as many iterations as they may."""
        findings = coarse("time-window-size", self.longest, moving.contact_time)
        if last := sum(tries >= most for tries in self.evaluations):
            count = sum(tries > 0 for tries in self.evaluations)
            findings.append(
                f"max-iterations = {most}: {last} of {count} windows took them all and may not have converged, which "
                "preCICE accepts; raise it, or change the acceleration or the convergence measures"
            )
        return findings


def _most_iterations(configuration: Path, participant: str) -> float:
    """Return the max-iterations of the participant's coupling scheme, infinite where none are given."""
    text = COMMENT.sub("", configuration.read_text(encoding="utf-8", errors="replace"))
    schemes = [
        match[0] for match in SCHEME.finditer(text) if re.search(rf"[\"']{re.escape(participant)}[\"']", match[0])
    ]
    return min((int(most) for scheme in schemes for most in MOST_ITERATIONS.findall(scheme)), default=inf)


def _exchange(moving: MovingChain, interface: "_Interface", longest: float | None) -> _Windows:
    """Run to the end."""
    coupling, windows = interface.participant, _Windows(start(moving))
    interface.initialize()
    while coupling.is_coupling_ongoing():
        # All states are kept, so there is nothing to write; but preCICE stops a participant that does not ask.
        coupling.requires_writing_checkpoint()
        left = coupling.get_max_time_step_size()
        if longest is None:
            too_long = coarse("time-window-size", left, moving.contact_time)
            longest = moving.contact_time / STEPS_PER_CONTACT if too_long else inf
        step = left / max(1, ceil(left / longest * (1.0 - SAME_TIME)))
        windows.states.append(advance(moving, windows.states[-1], float(interface.read(step)[0]), step))
        interface.write(np.array([windows.mean_force()]))
        with _interruptible():
            coupling.advance(step)
        if coupling.requires_reading_checkpoint():
            windows.repeat()
        elif coupling.is_time_window_complete():
            windows.accept()
    return windows


def _release(participant: Any, mesh: str, error: Exception) -> None:
    """End the other participant after an error before the coupling began: it waits for this one, in vain."""
    log.warning("%s; waiting for the other participant, to end it", error)
    with suppress(RuntimeError):
        participant.set_mesh_vertices(mesh, np.zeros((1, participant.get_mesh_dimensions(mesh))))
    with suppress(RuntimeError), _interruptible():
        participant.requires_initial_data()
        participant.initialize()
    _finalize(participant)


def _finalize(participant: Any) -> None:
    """End the coupling after an error, which must not be hidden by another."""
    with suppress(RuntimeError), _interruptible():
        participant.finalize()


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C end the process within this context: Python itself would see it only when preCICE returns."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handler = signal.getsignal(signal.SIGINT)
    if handler is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        if handler is signal.default_int_handler:
            signal.signal(signal.SIGINT, handler)


class _Interface:
    """The vertices of a participant, one for each contact, which read one of displacement and force and write the
    other one, as scalars or along a direction."""

    def __init__(
        self,
        participant: Any,
        names: Mapping[str, str],
        data: tuple[str, str],
        direction: Sequence[float] | None,
        positions: Sequence[Sequence[float]] | None,
        count: int = 1,
    ) -> None:
        self.participant, self.mesh, self.count = participant, names["mesh"], count
        self.read_name, self.written_name = (names[name] for name in data)
        dimensions = participant.get_mesh_dimensions(self.mesh)
        places = np.zeros((count, dimensions))
        if positions is not None and len(positions) != count:
            raise ValueError(
                f"positions = {short(positions)}: must hold {count_of(count, 'position')}, one for each contact"
            )
        for k, position in enumerate([] if positions is None else positions):
            places[k] = _vector(f"positions[{k}]", position, dimensions)
        sizes = [participant.get_data_dimensions(self.mesh, names[name]) for name in data]
        if direction is not None and max(sizes) == 1:
            raise ValueError(f"direction = {short(direction)}: must be None, since displacement and force are scalars")
        self.directions = [self._along(direction, size) for size in sizes]
        self.vertices = participant.set_mesh_vertices(self.mesh, places)

    def initialize(self) -> None:
        """Write zeros, if preCICE requires initial data: everything is in static equilibrium."""
        if self.participant.requires_initial_data():
            self.write(np.zeros(self.count))
        with _interruptible():
            self.participant.initialize()

    def read(self, step: float) -> Vector:
        """Return what acts at each vertex at the end of the step (s)."""
        data = self.participant.read_data(self.mesh, self.read_name, self.vertices, step)
        return np.asarray(np.reshape(data, (self.count, -1)) @ self.directions[0])

    def write(self, values: Vector) -> None:
        """Write a number for each vertex; vectors are rows."""
        rows = np.outer(values, self.directions[1])
        self.participant.write_data(
            self.mesh, self.written_name, self.vertices, rows.ravel() if rows.shape[1] == 1 else rows
        )

    @staticmethod
    def _along(direction: Sequence[float] | None, size: int) -> Vector:
        """Return the unit vector along which data of this size act; 1 for scalars."""
        if size == 1:
            return np.ones(1)
        if direction is None:
            raise ValueError(f"direction = None: must be given for data that are vectors, as {size} numbers")
        vector = _vector("direction", direction, size)
        length = float(np.linalg.norm(vector))
        if length == 0.0:
            raise ValueError(f"direction = {short(direction)}: must not be zero")
        return vector / length


def _vector(name: str, value: Sequence[float], size: int) -> Vector:
    numbers = each(finite, name, np.asarray(value))
    if numbers.shape != (size,):
        raise ValueError(f"{name} = {short(value)}: must hold {count_of(size, 'number')}, as in the configuration")
    return numbers


def _bindings() -> Any:
    try:
        import precice
    except ImportError as error:
        raise ImportError(
            f'preCICE needs pyprecice ({error}): install preCICE 3, then pip install "hertzlink[precice]"'
        ) from error
    if not hasattr(precice, "Participant"):
        raise ImportError("hertzlink needs version 3 of preCICE and pyprecice; an older one is installed")
    return precice


def _version(precice: ModuleType) -> str:
    """Return the version of preCICE, as far as it is known, and of its bindings."""
    information = getattr(precice, "get_version_information", str)()
    text = information.decode() if isinstance(information, bytes) else str(information)
    return f"preCICE {text.split(';')[0] or 'unknown'}, pyprecice {version_of('pyprecice')}"


def _dataset(moving: MovingChain, windows: _Windows, inputs: dict[str, Any]) -> xr.Dataset:
    states = windows.states
    force = np.array([state.contact_force for state in states]) + moving.static_force
    surface, times = (np.array(columns) for columns in zip(*((s.surface, s.chain.time) for s in states), strict=True))
    mean_force = np.array([state.mean_force for state in states])[1:]
    values = {
        "displacement": (np.array([state.chain.position for state in states]) - moving.rest)[:, : moving.mass.size],
        "velocity": np.array([state.chain.velocity for state in states])[:, : moving.mass.size],
        "contact_force": force,
        "surface_displacement": surface,
        "interface_work": np.cumsum([0.0, *(mean_force * np.diff(surface))]),
        "interface_impulse": np.cumsum([0.0, *(mean_force * np.diff(times))]),
        "evaluations": np.array(windows.evaluations, float),
        "residual": np.array(windows.residual),
    }
    variables = {name: variable(name, data) for name, data in values.items()}
    bodies = range(moving.mass.size)
    coordinates = run_coordinates(times, bodies, bodies, moving.chain.centres, moving.static_force)
    return xr.Dataset(variables, coordinates, provenance(inputs))
