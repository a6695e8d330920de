"""The chain as a participant of a preCICE coupling; optional: needs preCICE 3 and its Python bindings, pyprecice.

Written from the documented interface and tested with a substitute that follows it; never run against a live preCICE.
"""

from collections.abc import Mapping, Sequence
from math import ceil, inf
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import xarray as xr

from coupling.paths import path_of
from coupling.ports.guest import GuestState, advance, guest_chain, start
from coupling.results.provenance import provenance
from coupling.results.schema import variable
from particles.chain import Chain
from particles.moving import MovingChain
from structures.checks import each, finite, instance, one_of, positive, short
from structures.structure import Vector
from structures.surface import Surface

DEFAULT_NAMES = {"participant": "Chain", "mesh": "Chain-Mesh", "displacement": "Displacement", "force": "Force"}
"""Default names in the configuration: of the chain, its mesh, the data that it reads and the data that it writes."""


def run_in_precice(
    chain: Chain,
    surface: Surface,
    configuration: str | Path,
    names: Mapping[str, str] | None = None,
    direction: Sequence[float] | None = None,
    position: Sequence[float] | None = None,
    window: float | None = None,
    flexibility: float = 0.0,
    dt: float | None = None,
) -> xr.Dataset:
    """Run a chain as a participant of a preCICE coupling, to its end.

    The mesh of the chain has one vertex. The chain reads the displacement of the surface (m, from static equilibrium)
    and writes the mean force over preCICE's window so far (N, relative to the static one), both positive away from the
    chain. The force is constant over preCICE's window, so configure waveform-degree="0" and substeps="false". Then the
    interface creates no energy if the coupling is implicit.

    Parameters
    ----------
    chain : Chain
        The chain.
    surface : Surface
        The surface that the chain touches; `structure.surface` for a Structure.
    configuration : str or Path
        The configuration file of preCICE, with a fixed time-window-size.
    names : mapping, optional
        Names in the configuration that differ from "participant": "Chain", "mesh": "Chain-Mesh", "displacement":
        "Displacement", "force": "Force".
    direction : sequence of float, optional
        The direction in which the chain pushes, if the data are vectors; None if both are scalars.
    position : sequence of float, optional
        Position of the vertex, m; by default the origin.
    window : float, optional
        Longest step of the chain, s. The surface moves linearly over a step: preCICE's window, or an equal part of it
        no longer than `window`, which suits a displacement of waveform-degree 2 or more.
    flexibility : float
        Compliance in series with the contact, m/N; `structure.flexibility` for a Structure.
    dt : float, optional
        Time step of the chain, s; see MovingChain.

    Returns
    -------
    xarray.Dataset
        A Dataset for `reflections` and the other measures, without energies.

    Raises
    ------
    ImportError
        If pyprecice is missing.
    ValueError
        For bad input.
    FloatingPointError
        If the state of a bead is no longer finite. Errors of preCICE are passed on. The other participant notices an
        error when this process ends.

    References
    ----------
    preCICE 3 documentation, Python bindings and "coupling scheme configuration".

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 20, bead, impact_speed=0.31)
    >>> try:
    ...     run = hl.ports.run_in_precice(chain, hl.Surface(hl.ACRYLIC), "precice-config.xml")
    ... except (ImportError, ValueError) as error:  # pyprecice, or the configuration file, is missing
    ...     print("no coupling")
    no coupling
    """
    precice = _bindings()
    moving = guest_chain(chain, surface, flexibility, dt)
    longest = inf if window is None else positive("window", window, "s")
    called = DEFAULT_NAMES | _names(names or {})
    file = path_of("configuration", configuration, "name of a file")
    if not file.is_file():
        raise ValueError(f"configuration = {short(str(configuration))}: must be preCICE's configuration file")
    interface = _Interface(precice, str(file), called, direction, position)
    states = _exchange(moving, interface, longest)
    given = {"chain": chain.describe(), "configuration": str(configuration), "names": called}
    return _dataset(moving, states, {**given, "window": window})


def _exchange(moving: MovingChain, interface: "_Interface", longest: float) -> list[GuestState]:
    """The states at the ends of all accepted steps, the start first."""
    coupling, states, first = interface.participant, [start(moving)], 0
    interface.initialize()
    while coupling.is_coupling_ongoing():
        # All states are kept, so there is nothing to write; but preCICE stops a participant that does not ask.
        coupling.requires_writing_checkpoint()
        left = coupling.get_max_time_step_size()
        step = left / max(1, ceil(left / longest * (1.0 - 1e-9)))
        states.append(advance(moving, states[-1], interface.read(step), step))
        interface.write(_mean_force(states[first:]))
        coupling.advance(step)
        if coupling.requires_reading_checkpoint():
            del states[first + 1 :]
        elif coupling.is_time_window_complete():
            first = len(states) - 1
    coupling.finalize()
    return states


def _mean_force(states: list[GuestState]) -> float:
    """Over all steps from the first state to the last, N."""
    spans = np.diff([state.chain.time for state in states])
    return float(spans @ [state.mean_force for state in states[1:]] / spans.sum())


class _Interface:
    """One vertex that reads a displacement and writes a force, as scalars or along a direction."""

    def __init__(
        self,
        precice: ModuleType,
        configuration: str,
        names: Mapping[str, str],
        direction: Sequence[float] | None,
        position: Sequence[float] | None,
    ) -> None:
        self.names, self.participant = names, precice.Participant(names["participant"], configuration, 0, 1)
        dimensions = self.participant.get_mesh_dimensions(names["mesh"])
        vertex = np.zeros(dimensions) if position is None else _vector("position", position, dimensions)
        sizes = [
            self.participant.get_data_dimensions(names["mesh"], name)
            for name in (names["displacement"], names["force"])
        ]
        if direction is not None and max(sizes) == 1:
            raise ValueError(f"direction = {short(direction)}: must be None, since displacement and force are scalars")
        self.directions = [self._along(direction, size) for size in sizes]
        self.vertices = self.participant.set_mesh_vertices(names["mesh"], vertex[np.newaxis])

    def initialize(self) -> None:
        """The initial force, if preCICE requires it, is zero: everything is in static equilibrium."""
        if self.participant.requires_initial_data():
            self.write(0.0)
        self.participant.initialize()

    def read(self, step: float) -> float:
        """Displacement of the surface (m) at the end of the step (s)."""
        names = self.names
        data = self.participant.read_data(names["mesh"], names["displacement"], self.vertices, step)
        return float(np.ravel(data) @ self.directions[0])

    def write(self, force: float) -> None:
        """The mean force (N), as one row for the one vertex; scalars are plain numbers."""
        row = force * self.directions[1]
        values = row if row.size == 1 else row[np.newaxis]
        self.participant.write_data(self.names["mesh"], self.names["force"], self.vertices, values)

    @staticmethod
    def _along(direction: Sequence[float] | None, size: int) -> Vector:
        """The unit vector along which data of this size act; 1 for scalars."""
        if size == 1:
            return np.ones(1)
        if direction is None:
            raise ValueError(f"direction = None: must be given for data that are vectors, as {size} numbers")
        vector = _vector("direction", direction, size)
        length = float(np.linalg.norm(vector))
        if length == 0.0:
            raise ValueError(f"direction = {short(direction)}: must not be zero")
        return vector / length


def _names(given: Mapping[str, str]) -> dict[str, str]:
    instance("names", given, Mapping, "a mapping such as {'mesh': 'Chain-Mesh'}")  # type: ignore[type-abstract]
    for key, name in given.items():
        one_of("names", key, DEFAULT_NAMES)
        instance(f"names[{key!r}]", name, str, "a name in the configuration")
    return dict(given)


def _vector(name: str, value: Sequence[float], size: int) -> Vector:
    numbers = each(finite, name, np.asarray(value))
    if numbers.shape != (size,):
        raise ValueError(f"{name} = {short(value)}: must hold {size} numbers, as in the configuration")
    return numbers


def _bindings() -> Any:
    try:
        import precice
    except ImportError as error:
        raise ImportError(
            f'run_in_precice needs pyprecice ({error}): install preCICE 3, then pip install "hertzlink[precice]"'
        ) from error
    if not hasattr(precice, "Participant"):
        raise ImportError("run_in_precice needs version 3 of preCICE and pyprecice; an older one is installed")
    return precice


def _dataset(moving: MovingChain, states: list[GuestState], given: dict[str, Any]) -> xr.Dataset:
    force = np.array([state.contact_force for state in states]) + moving.static_force
    values = {
        "displacement": (np.array([state.chain.position for state in states]) - moving.rest)[:, : moving.mass.size],
        "velocity": np.array([state.chain.velocity for state in states])[:, : moving.mass.size],
        "contact_force": force,
        "surface_displacement": np.array([state.surface for state in states]),
    }
    variables = {name: variable(name, data) for name, data in values.items()}
    coordinates = {
        "time": ("time", np.array([state.chain.time for state in states]), {"units": "s"}),
        "bead": ("bead", np.arange(moving.mass.size)),
        "contact": ("contact", np.arange(1, moving.mass.size + 1)),
        "centre": ("bead", moving.chain.centres, {"units": "m", "long_name": "centre, from the struck end"}),
        "static_force": ("contact", moving.static_force, {"units": "N", "long_name": "preload"}),
    }
    return xr.Dataset(variables, coordinates, provenance(given))
