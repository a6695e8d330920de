"""Chain and structure as participants of a preCICE coupling; optional: needs preCICE 3 and its bindings, pyprecice."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
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
from particles.kernels.motion import WORK_ROWS, forces_of_chains
from particles.moving import ChainState, MovingChain
from structures.checks import count_of, each, existing, finite, instance, one_of, positive, short
from structures.moving import MovingStructure
from structures.structure import Structure, Vector
from structures.surface import Surface

STEPS_PER_CONTACT = 64  # Steps of the chain in a contact, if neither preCICE nor the user determines their length.
# A force below this part of the chain's force scale is a rounding error and set to zero: relative convergence measures
# divide by its change.
ROUNDING = 1e-12


class Side(NamedTuple):
    """A participant of the coupling."""

    file: Path  # the configuration
    names: Mapping[str, str]  # its names in the configuration
    direction: Sequence[float] | None  # of the contacts
    positions: Sequence[Sequence[float]] | None  # of the contacts, m


class Step(NamedTuple):
    """A chain at the end of a step."""

    chain: ChainState
    surface: float  # displacement of the surface, m
    span: float  # length of the step, s
    mean_force: float  # mean force of the last contact over the step, above the static force, N


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
        For a chain: the surface that it touches, and the compliance in series with its contact, m/N. If the other
        participant is a Structure, these are its `surface` and `flexibility`.
    names : mapping, optional
        Names in the configuration for "participant", "mesh", "displacement" and "force"; by default "Chain" or
        "Structure", "Chain-Mesh" or "Structure-Mesh", "Displacement" and "Force".
    direction : sequence of float, optional
        The direction in which the chain pushes, if the data are vectors; None if both are scalars.
    positions : sequence, optional
        Position of the vertex of each contact, m; for a single contact by default the origin.
    window : float, optional
        Longest step of a chain, s. By default preCICE's window; but 1/64 of a contact if the window is longer than 1/8
        of a contact.
    dt : float, optional
        Time step of a chain, s; see MovingChain.

    Returns
    -------
    Dataset
        For a chain, a run for `reflections` and other measures, with the work on the surface as the only energy;
        `evaluations` counts how often a window was tried, and `residual` is the last change of its force. For a
        structure, `surface_displacement` (m), `mean_force` (N) and `interface_work` (J).

    Raises
    ------
    ImportError, ValueError, FloatingPointError
        If pyprecice is missing, for wrong input, and if the state of a bead is no longer finite. Errors of preCICE are
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
    end = "Structure" if isinstance(body, Structure) else "Chain"
    called = {"participant": end, "mesh": f"{end}-Mesh", "displacement": "Displacement", "force": "Force"}
    for key, name in names.items():
        one_of("names", key, called)
        instance(f"names[{key!r}]", name, str, "a name in the configuration")
    file = Path(instance("configuration", configuration, str | Path, "the name of a file"))  # type: ignore[arg-type]
    existing(f"configuration = {short(str(configuration))}", file)
    side = Side(file.absolute(), {**called, **names}, direction, positions)
    inputs = {"configuration": str(configuration), "names": side.names}
    if isinstance(body, Structure):
        return _run_structure(body, side, inputs)
    moving = moving_chain(body, instance("surface", surface, Surface, "a Surface(material)"), flexibility, dt)
    return _run_chain(moving, None if window is None else positive("window", window, "s"), side, inputs)


def _run_chain(moving: MovingChain, longest: float | None, side: Side, inputs: dict[str, Any]) -> xr.Dataset:
    """Run a chain to the end of the coupling. longest: the longest step, s. All steps of the accepted windows are kept.
    `evaluations` and `residual` hold, at the last step of a window, how often it was tried and the last change of its
    mean force, N; they are zero at other steps."""
    steps, evaluations, residual = [Step(moving.start(), 0.0, 1.0, 0.0)], [0], [0.0]
    first, tries, before, most, weak = 0, 1, 0.0, longest, ROUNDING * moving.scales[0]
    with _coupled(side, ("displacement", "force"), 1) as (coupling, read, write):
        while coupling.is_coupling_ongoing():
            # All states are kept, so there is nothing to write, but preCICE requires this call.
            coupling.requires_writing_checkpoint()
            left = coupling.get_max_time_step_size()
            if most is None:
                too_long = coarse("time-window-size", left, moving.contact_time)
                most = moving.contact_time / STEPS_PER_CONTACT if too_long else inf
            span = left / max(1, ceil(left / most * (1.0 - SAME_TIME)))
            end = finite("surface displacement", float(read(span)[0]), "m")
            chain, force = moving.advance(steps[-1].chain, (steps[-1].surface, end), span)
            bad = ~(np.isfinite(chain.position) & np.isfinite(chain.velocity))
            if bad.any():
                raise FloatingPointError(
                    f"bead {int(bad.argmax())} is no longer finite at t = {chain.time:.6g} s; check dt"
                )
            steps.append(Step(chain, end, span, force if abs(force) > weak else 0.0))
            inside = steps[first + 1 :]
            mean = float(np.average([step.mean_force for step in inside], weights=[step.span for step in inside]))
            write(np.array([mean]))
            coupling.advance(span)
            if coupling.requires_reading_checkpoint():
                tries, before = tries + 1, mean
                del steps[first + 1 :]
            elif coupling.is_time_window_complete():
                inner = [0] * (len(steps) - first - 2)
                evaluations += [*inner, tries]
                residual += [*inner, abs(mean - before)]
                first, tries, before = len(steps) - 1, 1, mean

    chains, surfaces, spans, mean_forces = zip(*steps, strict=True)
    position, velocity = (np.array([getattr(chain, name) for chain in chains]) for name in ("position", "velocity"))
    surface, times = np.array(surfaces), np.array([chain.time for chain in chains])
    moved, size = np.diff(surface, prepend=0.0), moving.mass.size
    force, work = np.zeros((len(steps), size)), np.zeros((WORK_ROWS, moving.rest.size))
    for row, (at, rate) in enumerate(zip(surface, moved / spans, strict=True)):
        state = moving.model, position[row], velocity[row], times[row]
        forces_of_chains(*state, np.array([at]), np.array([rate]), np.arange(size), force[row], work)
    force -= moving.static_force
    force[abs(force) <= weak] = 0.0
    values = {
        "displacement": (position - moving.rest)[:, :size],
        "velocity": velocity[:, :size],
        "contact_force": force + moving.static_force,
        "surface_displacement": surface,
        "interface_work": np.cumsum(mean_forces * moved),
        "interface_impulse": np.cumsum(mean_forces * np.diff(times, prepend=0.0)),
        "evaluations": np.array(evaluations, float),
        "residual": np.array(residual),
    }
    coordinates = run_coordinates(times, range(size), range(size), moving.chain.centres, moving.static_force)
    inputs = {"chain": moving.chain.describe(), **inputs, "window": longest}
    variables = {name: variable(name, data) for name, data in values.items()}
    data = xr.Dataset(variables, coordinates, _origin(inputs))

    # Findings: coarse windows, windows that took all their iterations, and the checks after every run.
    windows = np.diff(times[values["evaluations"] > 0.0], prepend=0.0)
    findings = coarse("time-window-size", float(windows.max(initial=0.0)), moving.contact_time)
    text = re.sub(r"<!--.*?-->", "", side.file.read_text(encoding="utf-8", errors="replace"), flags=re.DOTALL)
    schemes = re.findall(r"<coupling-scheme:([\w-]+)([^>]*>.*?)</coupling-scheme:\1>", text, re.DOTALL)
    ours = [scheme for _, scheme in schemes if re.search(rf"[\"']{re.escape(side.names['participant'])}[\"']", scheme)]
    limits = re.findall(r"<max-iterations\b[^>]*\bvalue\s*=\s*[\"'](\d+)[\"']", " ".join(ours))
    limit = min(map(int, limits), default=inf)
    if last := sum(tries >= limit for tries in evaluations):
        findings.append(
            f"max-iterations = {limit}: {last} of {windows.size} windows used all of them and may not have converged,  "
            "which preCICE accepts; raise it, or change the acceleration"
        )
    findings += check_guest(moving, values["contact_force"], values["interface_work"], times)
    warn(findings)
    return with_warnings(data, findings)


def _run_structure(structure: Structure, side: Side, inputs: dict[str, Any]) -> xr.Dataset:
    """Run a structure to the end of the coupling."""
    moving = MovingStructure(structure)
    count = len(moving.surfaces)
    times, forces, places = [0.0], [np.zeros(count)], [np.zeros(count)]
    with _coupled(side, ("force", "displacement"), count) as (coupling, read, write):
        state = moving.start()
        while coupling.is_coupling_ongoing():
            # The state before the window is kept until the window is accepted.
            coupling.requires_writing_checkpoint()
            window = coupling.get_max_time_step_size()
            force = read(window)
            after, moved = moving.advance(state, force if count > 1 else float(force[0]), window)
            write(np.reshape(moved, count))
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
    text = Path(__file__).with_name("precice-config.xml").read_text("utf-8")
    return text.format(until=positive("until", until, "s"), window=window)


@contextmanager
def _coupled(
    side: Side, data: tuple[str, str], count: int
) -> Iterator[tuple[Any, Callable[[float], Vector], Callable[[Vector], None]]]:
    """Begin a coupling and end it; after an error the other participant ends, too. Yields the participant; a function
    that reads a number for each vertex at the end of a step (s); and one that writes a number for each vertex. Each
    contact is a vertex. data: the names of what is read and of what is written."""
    if len(side.positions or ()) != count and (side.positions is not None or count > 1):
        raise ValueError(
            f"positions = {short(side.positions)}: must hold {count_of(count, 'position')}, one for each contact"
        )
    try:
        from precice import Participant
    except ImportError as error:
        raise ImportError(
            f"hertzlink needs version 3 of preCICE and pyprecice ({error}): install preCICE 3, then pip install "
            '"hertzlink[precice]"'
        ) from error
    mesh, (read_name, written_name) = side.names["mesh"], (side.names[name] for name in data)
    participant = Participant(side.names["participant"], str(side.file), 0, 1)
    dimensions = participant.get_mesh_dimensions(mesh)
    try:
        try:
            sizes, given = [participant.get_data_dimensions(mesh, side.names[name]) for name in data], side.direction
            if (given is None) == (max(sizes) > 1) or (given is not None and not np.any(given)):
                vectors = f"{max(sizes)} numbers, not all zero, because the data are vectors"
                must = vectors if max(sizes) > 1 else "None, since displacement and force are scalars"
                raise ValueError(f"direction = {short(given)}: must be {must}")
            directions = [np.ones(1) if size == 1 else _vector("direction", given, size) for size in sizes]
            directions = [one / np.linalg.norm(one) for one in directions]
            places = np.zeros((count, dimensions))
            for k, position in enumerate(side.positions or ()):
                places[k] = _vector(f"positions[{k}]", position, dimensions)
            vertices = participant.set_mesh_vertices(mesh, places)
        except (ValueError, RuntimeError):
            # The other participant waits for this one, which must therefore begin before it ends.
            with suppress(RuntimeError):
                participant.set_mesh_vertices(mesh, np.zeros((1, dimensions)))
                participant.requires_initial_data()
                participant.initialize()
            raise

        def read(span: float) -> Vector:
            numbers = participant.read_data(mesh, read_name, vertices, span)
            return np.asarray(np.reshape(numbers, (count, -1)) @ directions[0])

        def write(values: Vector) -> None:
            rows = np.outer(values, directions[1])
            participant.write_data(mesh, written_name, vertices, rows.ravel() if rows.shape[1] == 1 else rows)

        if participant.requires_initial_data():
            write(np.zeros(count))
        participant.initialize()
        yield participant, read, write
    except BaseException:
        with suppress(RuntimeError):  # another error must not hide the first one
            participant.finalize()
        raise
    participant.finalize()


def _vector(name: str, value: Any, size: int) -> Vector:
    numbers = each(finite, name, np.asarray(value))
    if numbers.shape != (size,):
        raise ValueError(f"{name} = {short(value)}: must hold {count_of(size, 'number')}, as in the configuration")
    return numbers


def _origin(inputs: Mapping[str, Any]) -> dict[str, str]:
    """Return the attributes of a result: its input and all versions, that of preCICE included."""
    import precice

    information = getattr(precice, "get_version_information", str)()
    text = information.decode() if isinstance(information, bytes) else str(information)
    versions = f"preCICE {text.split(';')[0] or 'unknown'}, pyprecice {version_of('pyprecice')}"
    return provenance(inputs) | {"precice": versions}
