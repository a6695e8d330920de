"""Chain and structure as participants of a preCICE coupling; optional: needs preCICE 3 and its bindings, pyprecice."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import ceil, inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.plan import SAME_TIME, coarse
from coupling.results.findings import warn, with_warnings
from coupling.results.provenance import provenance, version_of
from coupling.results.schema import run_coordinates, variable
from coupling.run_checks import check_guest
from particles.chain import Chain
from particles.deformable.deformable_chain import moving_chain
from particles.kernels.motion import forces_of_chains
from particles.moving import ChainState, MovingChain
from structures.checks import count_of, each, finite, instance, one_of, positive, short
from structures.moving import MovingStructure
from structures.structure import Structure, Vector
from structures.surface import Surface

DATA = {"displacement": "Displacement", "force": "Force"}

# Default names in the configuration. The chain reads the displacement, the structure reads the force.
CHAIN_NAMES = {"participant": "Chain", "mesh": "Chain-Mesh", **DATA}
STRUCTURE_NAMES = {"participant": "Structure", "mesh": "Structure-Mesh", **DATA}

STEPS_PER_CONTACT = 64  # Steps of the chain in a contact, where neither preCICE nor the user says how long they are.
# A force below this part of the chain's force scale is rounding, and exactly zero: relative measures of convergence
# divide by its change.
ROUNDING = 1e-12
# Limits of convergence: of the displacement (m) and of the force (N), and their relative limit. preCICE refuses
# absolute limits of 1e-14 and less.
STILL, WEAK, RELATIVE = 2e-14, 1e-9, 1e-9


class Side(NamedTuple):
    """A participant: the configuration, its names there, and how its contacts lie in the mesh."""

    file: Path
    names: Mapping[str, str]
    direction: Sequence[float] | None
    positions: Sequence[Sequence[float]] | None


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

    The chain reads the displacement of the surface (m, from static equilibrium) and writes the mean force over
    preCICE's window so far (N, relative to the static one); a structure reads that force and writes the displacement.
    Both are positive away from the chain. docs/coupling.md has the configuration.

    Parameters
    ----------
    body : Chain or Structure
        What to run; a large structure should be reduced, see `reduce`.
    configuration : str or Path
        The configuration file of preCICE, with a fixed time-window-size.
    surface, flexibility : Surface and float
        Of a chain: the surface that it touches, and the compliance in series with its contact, m/N; of a Structure its
        `surface` and its `flexibility`.
    names : mapping, optional
        Names in the configuration for "participant", "mesh", "displacement" and "force"; by default "Chain" or
        "Structure", "Chain-Mesh" or "Structure-Mesh", "Displacement" and "Force".
    direction : sequence of float, optional
        The direction in which the chain pushes, if the data are vectors; None if both are scalars.
    positions : sequence, optional
        Position of the vertex of each contact, m; of a single one by default the origin.
    window : float, optional
        Longest step of a chain, s. By default preCICE's window; but 1/64 of a contact if that is longer than 1/8 of
        one.
    dt : float, optional
        Time step of a chain, s; see MovingChain.

    Returns
    -------
    Dataset
        Of a chain, a run for `reflections` and other measures, with the work on the surface as the only energy;
        `evaluations` counts how often a window was tried, and `residual` is the last change of its force. Of a
        structure `surface_displacement` (m), `mean_force` (N) and `interface_work` (J).

    Raises
    ------
    ImportError, ValueError, FloatingPointError
        If pyprecice is missing, for bad input, and if the state of a bead is no longer finite. Errors of preCICE are
        passed on.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 20, bead, impact_speed=0.31)
    >>> try:
    ...     run = hl.run_in_precice(chain, "precice-config.xml", hl.Surface(hl.ACRYLIC))
    ... except (ImportError, ValueError) as error:  # pyprecice, or the configuration file, is missing
    ...     print("no coupling")
    no coupling
    """
    instance("body", body, Chain | Structure, "a Chain or a Structure")  # type: ignore[arg-type]
    names = {} if names is None else instance("names", names, Mapping, "a mapping such as {'mesh': 'Chain-Mesh'}")
    called = STRUCTURE_NAMES if isinstance(body, Structure) else CHAIN_NAMES
    for key, name in names.items():
        one_of("names", key, called)
        instance(f"names[{key!r}]", name, str, "a name in the configuration")
    file = Path(instance("configuration", configuration, str | Path, "the name of a file"))  # type: ignore[arg-type]
    if not file.is_file():
        raise ValueError(f"configuration = {short(str(configuration))}: must be preCICE's configuration file")
    side = Side(file.absolute(), {**called, **names}, direction, positions)
    inputs = {"configuration": str(configuration), "names": side.names}
    if isinstance(body, Structure):
        return _run_structure(body, side, inputs)
    moving = moving_chain(body, instance("surface", surface, Surface, "a Surface(material)"), flexibility, dt)
    return _run_chain(moving, None if window is None else positive("window", window, "s"), side, inputs)


def _run_chain(moving: MovingChain, longest: float | None, side: Side, inputs: dict[str, Any]) -> xr.Dataset:
    """Run a chain to the end of the coupling. longest: step that it may take, s."""
    past, most = History(moving), longest
    with _coupled(side, ("displacement", "force"), 1) as interface:
        coupling = interface.participant
        while coupling.is_coupling_ongoing():
            # All states are kept, so there is nothing to write; but preCICE stops a participant that does not ask.
            coupling.requires_writing_checkpoint()
            left = coupling.get_max_time_step_size()
            if most is None:
                too_long = coarse("time-window-size", left, moving.contact_time)
                most = moving.contact_time / STEPS_PER_CONTACT if too_long else inf
            step = left / max(1, ceil(left / most * (1.0 - SAME_TIME)))
            past.advance(float(interface.read(step)[0]), step)
            interface.write(np.array([past.mean_force()]))
            coupling.advance(step)
            if coupling.requires_reading_checkpoint():
                past.repeat()
            elif coupling.is_time_window_complete():
                past.accept()

    chains, surfaces, mean_forces, forces = zip(*past.states, strict=True)
    surface, times = np.array(surfaces), np.array([chain.time for chain in chains])
    force, size = np.array(forces) + moving.static_force, moving.mass.size
    values = {
        "displacement": (np.array([chain.position for chain in chains]) - moving.rest)[:, :size],
        "velocity": np.array([chain.velocity for chain in chains])[:, :size],
        "contact_force": force,
        "surface_displacement": surface,
        "interface_work": np.cumsum([0.0, *(mean_forces[1:] * np.diff(surface))]),
        "interface_impulse": np.cumsum([0.0, *(mean_forces[1:] * np.diff(times))]),
        "evaluations": np.array(past.evaluations, float),
        "residual": np.array(past.residual),
    }
    coordinates = run_coordinates(times, range(size), range(size), moving.chain.centres, moving.static_force)
    inputs = {"chain": moving.chain.describe(), **inputs, "window": longest}
    variables = {name: variable(name, data) for name, data in values.items()}
    data = xr.Dataset(variables, coordinates, _origin(inputs))

    # Windows that are coarse, or took as many iterations as they may; and what is checked after every run.
    findings = coarse("time-window-size", past.longest, moving.contact_time)
    text = re.sub(r"<!--.*?-->", "", side.file.read_text(encoding="utf-8", errors="replace"), flags=re.DOTALL)
    schemes = re.findall(r"<coupling-scheme:([\w-]+)([^>]*>.*?)</coupling-scheme:\1>", text, re.DOTALL)
    ours = [scheme for _, scheme in schemes if re.search(rf"[\"']{re.escape(side.names['participant'])}[\"']", scheme)]
    limits = re.findall(r"<max-iterations\b[^>]*\bvalue\s*=\s*[\"'](\d+)[\"']", " ".join(ours))
    most = min(map(int, limits), default=inf)
    if last := sum(tries >= most for tries in past.evaluations):
        findings.append(
            f"max-iterations = {most}: {last} of {sum(tries > 0 for tries in past.evaluations)} windows took them "
            "all and may not have converged, which preCICE accepts; raise it, or change the acceleration"
        )
    findings += check_guest(moving, force, values["interface_work"], times)
    warn(findings)
    return with_warnings(data, findings)


def _run_structure(structure: Structure, side: Side, inputs: dict[str, Any]) -> xr.Dataset:
    """Run a structure to the end of the coupling."""
    moving = MovingStructure(structure)
    count = len(moving.surfaces)
    times, forces, places = [0.0], [np.zeros(count)], [np.zeros(count)]
    with _coupled(side, ("force", "displacement"), count) as interface:
        coupling, state = interface.participant, moving.start()
        while coupling.is_coupling_ongoing():
            # The state before the window is kept until the window is accepted.
            coupling.requires_writing_checkpoint()
            window = coupling.get_max_time_step_size()
            force = interface.read(window)
            after, moved = moving.advance(state, force if count > 1 else float(force[0]), window)
            interface.write(np.reshape(moved, count))
            coupling.advance(window)
            if not coupling.requires_reading_checkpoint():
                state = after
                times.append(times[-1] + window)
                forces.append(force)
                places.append(np.reshape(moved, count))

    surface, force, seat = np.array(places), np.array(forces), ("time", "structure_contact")
    work = np.cumsum([0.0, *np.sum(force[1:] * np.diff(surface, axis=0), axis=1)])
    data = {
        "surface_displacement": (seat, surface, {"units": "m", "long_name": "displacement of the surface"}),
        "mean_force": (seat, force, {"units": "N", "long_name": "mean force over the window"}),
        "interface_work": ("time", work, {"units": "J", "long_name": "work on the structure"}),
    }
    attrs = _origin({"structure": structure.origin, **inputs})
    return xr.Dataset(data, {"time": ("time", times, {"units": "s"})}, attrs)


def precice_configuration(chain: Chain, surface: Surface, until: float, flexibility: float = 0.0) -> str:
    """Return the text of a configuration of preCICE 3 for a chain on a surface, by docs/coupling.md.

    until: length of the record, s. flexibility: in series with the contact, m/N. Participants "Chain" and "Structure",
    serial-implicit, with Aitken's relaxation; a window is 1/64 of a contact.
    """
    window = moving_chain(chain, surface, flexibility, None).contact_time / STEPS_PER_CONTACT
    return Path(__file__).with_name("precice-config.xml").read_text("utf-8").format(
        chain=CHAIN_NAMES["participant"], chain_mesh=CHAIN_NAMES["mesh"],
        structure=STRUCTURE_NAMES["participant"], structure_mesh=STRUCTURE_NAMES["mesh"], **DATA,
        STILL=STILL, WEAK=WEAK, RELATIVE=RELATIVE, until=positive("until", until, "s"), window=window,
    )  # fmt: skip


class State(NamedTuple):
    """A chain at the end of a step; the displacement of the surface, m; the mean force of the last contact over the
    step, and the forces of all contacts at its end, N, relative to the static ones."""

    chain: ChainState
    surface: float
    mean_force: float
    contact_force: Vector


class History:
    """States of a chain at the ends of all accepted steps, the start first; and how each window of preCICE went.

    At the end of a window, zero at that of other steps: how often the window was tried, and the residual, N, which is
    the last change of its mean force.
    """

    def __init__(self, moving: MovingChain) -> None:
        self.moving, start = moving, moving.start()
        self.states = [State(start, 0.0, 0.0, self._contact_force(start, 0.0, 0.0))]
        self.evaluations, self.residual = [0], [0.0]
        self.longest, self.first, self.tries, self.force = 0.0, 0, 1, 0.0

    def advance(self, surface: float, step: float) -> None:
        """Take a step, s, while the surface moves linearly to the displacement `surface`, m."""
        before = self.states[-1]
        motion = before.surface, finite("surface displacement", surface, "m")
        chain, force = self.moving.advance(before.chain, motion, step)
        bad = ~(np.isfinite(chain.position) & np.isfinite(chain.velocity))
        if bad.any():
            raise FloatingPointError(
                f"bead {int(bad.argmax())} is no longer finite at t = {chain.time:.6g} s; check dt"
            )
        mean_force = force if abs(force) > ROUNDING * self.moving.scales[0] else 0.0
        contact_force = self._contact_force(chain, surface, (surface - before.surface) / step)
        self.states.append(State(chain, surface, mean_force, contact_force))

    def _contact_force(self, state: ChainState, surface: float, rate: float) -> Vector:
        moving, position, velocity, time = self.moving, state.position, state.velocity, state.time
        force = np.zeros(moving.mass.size)
        contacts, places = np.arange(force.size), np.array([[surface], [rate]])
        forces_of_chains(moving.model, position, velocity, time, *places, contacts, force, moving.work_space())
        dynamic: Vector = force - moving.static_force
        dynamic[abs(dynamic) <= ROUNDING * moving.scales[0]] = 0.0
        return dynamic

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


class Interface:
    """The vertices of a participant, one for each contact, which read one of displacement and force and write the
    other one, as scalars or along a direction."""

    def __init__(self, participant: Any, side: Side, data: tuple[str, str], count: int) -> None:
        _, names, direction, positions = side
        self.participant, self.mesh, self.count = participant, names["mesh"], count
        self.read_name, self.written_name = (names[name] for name in data)

        def vector(name: str, value: Any, size: int) -> Vector:
            numbers = each(finite, name, np.asarray(value))
            if numbers.shape != (size,):
                must = f"must hold {count_of(size, 'number')}, as in the configuration"
                raise ValueError(f"{name} = {short(value)}: {must}")
            return numbers

        dimensions = participant.get_mesh_dimensions(self.mesh)
        places = np.zeros((count, dimensions))
        for k, position in enumerate(positions or ()):
            places[k] = vector(f"positions[{k}]", position, dimensions)
        sizes = [participant.get_data_dimensions(self.mesh, names[name]) for name in data]
        if direction is not None and max(sizes) == 1:
            raise ValueError(f"direction = {short(direction)}: must be None, since displacement and force are scalars")
        if direction is None and max(sizes) > 1:
            raise ValueError(f"direction = None: must be given for data that are vectors, as {max(sizes)} numbers")
        directions = [np.ones(1) if size == 1 else vector("direction", direction, size) for size in sizes]
        if not all(map(np.any, directions)):
            raise ValueError(f"direction = {short(direction)}: must not be zero")
        self.directions = [one / np.linalg.norm(one) for one in directions]
        self.vertices = participant.set_mesh_vertices(self.mesh, places)

    def read(self, step: float) -> Vector:
        """Return what acts at each vertex at the end of the step (s)."""
        data = self.participant.read_data(self.mesh, self.read_name, self.vertices, step)
        return np.asarray(np.reshape(data, (self.count, -1)) @ self.directions[0])

    def write(self, values: Vector) -> None:
        """Write a number for each vertex; vectors are rows."""
        rows = np.outer(values, self.directions[1])
        data = rows.ravel() if rows.shape[1] == 1 else rows
        self.participant.write_data(self.mesh, self.written_name, self.vertices, data)


@contextmanager
def _coupled(side: Side, data: tuple[str, str], count: int) -> Iterator[Interface]:
    """Begin a coupling and end it; after an error the other participant ends, too."""
    if len(side.positions or ()) != count and (side.positions is not None or count > 1):
        raise ValueError(
            f"positions = {short(side.positions)}: must hold {count_of(count, 'position')}, one for each contact"
        )
    try:
        import precice
    except ImportError as error:
        raise ImportError(
            f'preCICE needs pyprecice ({error}): install preCICE 3, then pip install "hertzlink[precice]"'
        ) from error
    if not hasattr(precice, "Participant"):
        raise ImportError("hertzlink needs version 3 of preCICE and pyprecice; an older one is installed")
    mesh = side.names["mesh"]
    participant = precice.Participant(side.names["participant"], str(side.file), 0, 1)
    try:
        try:
            interface = Interface(participant, side, data, count)
        except (ValueError, RuntimeError):
            # The other participant waits for this one: it must begin before it can end.
            with suppress(RuntimeError):
                participant.set_mesh_vertices(mesh, np.zeros((1, participant.get_mesh_dimensions(mesh))))
                participant.requires_initial_data()
                participant.initialize()
            raise
        if participant.requires_initial_data():
            interface.write(np.zeros(count))
        participant.initialize()
        yield interface
    except BaseException:
        with suppress(RuntimeError):  # the first error must not be hidden by another
            participant.finalize()
        raise
    participant.finalize()


def _origin(inputs: Mapping[str, Any]) -> dict[str, str]:
    """Return the attributes of a result: its input, and the versions of all that took part."""
    import precice

    information = getattr(precice, "get_version_information", str)()
    text = information.decode() if isinstance(information, bytes) else str(information)
    versions = f"preCICE {text.split(';')[0] or 'unknown'}, pyprecice {version_of('pyprecice')}"
    return provenance(inputs) | {"precice": versions}
