"""The motion inside bodies: displacement and stress at chosen times of a run, computed after the run."""

from collections.abc import Mapping, Sequence
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from coupling.results.provenance import as_text, differences, provenance, stored
from coupling.results.reading import Reading, contact_forces
from coupling.results.schema import END_NAMES, OF_RUNS
from particles.bead import Bead
from particles.deformable.bead_field import BeadField, Push
from particles.deformable.deformable_chain import DeformableChain
from particles.kernels import drives
from structures.checks import count_of, instance, listed, short, whole
from structures.field import Grid, von_mises
from structures.moving import MovingStructure
from structures.structure import Structure, Vector, known_field
from structures.surface import Surface, hertz_stiffness, relative_curvatures

LARGEST_CONTACT_ERROR = 0.05
"""Largest difference between the recomputed contact displacement and that of the run, as a fraction of its maximum."""

TIME_ROUNDING = 1e-9
"""Relative. Times that differ by less are equal."""

STRESS_COMPONENTS = {"radial": 0, "hoop": 1, "axial": 2, "shear": 5}
"""Positions of the components in the stress of a body of revolution."""

BEAD_VARIABLES = ("displacement", "contact_force", "vibration_amplitude")

CIRCULAR_DIFFERENCE = 1e-6
"""A contact is not circular if the difference of its relative curvatures exceeds this fraction of their sum."""

MOST_LISTED = 3
"""Largest number of differences that an error lists."""


def motion(
    run: xr.Dataset,
    body: Structure | DeformableChain,
    times: ArrayLike,
    beads: Sequence[int] | int | None = None,
    structure: Structure | Surface | None = None,
    behind: Structure | Surface | None = None,
) -> xr.Dataset:
    """Return displacement and stress inside a run's structure, or inside beads, at the saved times nearest to `times`.

    A structure is moved again, from rest, under the contact force of the run relative to the preload: the mean of its
    two end values over each saved interval. The run itself needs no memory for the body, but must be saved at least a
    dozen times per contact.

    A bead's field is the sum of its modes and of the static field of the contact forces (mode acceleration, see
    `particles.deformable.bead_field`). The forces act as Hertz's pressure on the contact circle for this force, with 8
    cells in the radius of the widest circle. Stress is then accurate to 1 % of the largest pressure, and to 7 % at the
    edge of the circle.

    Parameters
    ----------
    run : xarray.Dataset
        A whole run. Of a run with several structures or chains choose one first: run.isel(structure=0), or
        run.isel(chain=0) for its beads.
    body : Structure or DeformableChain
        The structure of the run, or the one from which it was reduced. It must have a field, see reduce(...,
        keep_field=True). The full structure needs one solve for each saved interval. Or the chain of the run.
    times : array_like
        Times, s, increasing.
    beads : int or sequence of int, optional
        Numbers of the beads of a chain; 0 is the striker. By default all.
    structure, behind : Structure or Surface, optional
        The bodies that the last and the first bead of a chain face; needed if these beads touch them and are among
        `beads`.

    Returns
    -------
    xarray.Dataset
        `displacement` (time, point, component), m, and `von_mises` (time, point), Pa, relative to static equilibrium;
        `position` (point, component), m; `cells` (cell, corner) in VTK's order, and the `part` of each: the number of
        the material, or of the bead. A point where materials meet appears once for each material. Bodies of revolution
        are given in their half-plane (r, 0, −z). Closer to the contact than the patch radius, the stress is that of the
        patch, not Hertz's. Attributes: cell_type (meshio's), the input of the run, and of a structure contact_error
        (largest difference between the contact displacement here and in the run, over its maximum).

        Of beads also `stress` (time, point, stress_component), Pa, positive in tension: "radial", "hoop", "axial",
        "shear". Their stress contains that of the preload, as contact forces do. They lie at their places along the
        chain, z from its struck end; `bead` (point) is the number of the bead of each point.

    Raises
    ------
    ValueError
        For times outside the run, bodies other than those of the run, structures without a field, wrong numbers of
        beads, contacts that are not circular, Datasets that are not a single run, if contact_error exceeds 5 %, because
        the run was saved too rarely, and if structure or behind is needed.

    Notes
    -----
    Bodies are compared with the input of the run. A point of a sweep, recognised by the coordinates of its axes, holds
    the input of the first point; so of a chain only places of bodies, modes and energy are compared.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_316)
    >>> chain = hl.DeformableChain([bead] * 2, bead, impact_speed=1.0, modes=2)
    >>> run = hl.CoSimulation(chain, None).run(until=10e-6)
    >>> motion = hl.plots.motion(run, chain, times=[5e-6], beads=[1])
    >>> float(motion.stress.sel(stress_component="axial").min()) < 0.0
    True
    """
    instance("body", body, Structure | DeformableChain, "the Structure or the DeformableChain that was run")  # type: ignore[arg-type]
    if isinstance(body, DeformableChain):
        return _of_beads(run, body, times, beads, structure, behind)
    for name, value in (("beads", beads), ("structure", structure), ("behind", behind)):
        if value is not None:
            raise ValueError(f"{name} = {short(value)}: must be None where body is no DeformableChain")
    return _of_structure(run, body, times)


def _of_structure(run: xr.Dataset, structure: Structure, times: ArrayLike) -> xr.Dataset:
    """Return the motion of a structure."""
    field = known_field(structure, "body")
    place, force, surface = _contacts_of(run, structure)
    moments = run.time.values
    _check_structure("body", structure, place, stored(run.attrs.get("input")), "give the one that was run")
    if (until := float(moments[-1])) > structure.valid_until * (1.0 + TIME_ROUNDING):
        raise ValueError(f"body: was reduced for runs of at most {structure.valid_until} s, the run has {until} s")
    rows = nearest_rows(moments, times)
    states, contact = _moved(structure, force[: rows.max()], float(moments[1] - moments[0]), rows)
    error = _contact_error(contact, surface[: len(contact)])
    if error > LARGEST_CONTACT_ERROR:
        raise ValueError(
            f"run: the structure's contact moves differently, by {100.0 * error:.2g} % of its greatest displacement; "
            "give the structure that was run, and save the run more often (save_every)"
        )
    up = [float(x) for x in structure.origin.get("normal", (0.0, 0.0, 1.0))]
    note = {**provenance({}), "input": run.attrs.get("input", ""), "contact_error": error, "up": up}
    displacement, stress = (np.stack([of(u) for u in states]) for of in (field.displacement, field.von_mises))
    return motion_dataset(field.grid, moments[rows], displacement, stress).assign_attrs(note)


def _of_beads(
    run: xr.Dataset, chain: DeformableChain, times: ArrayLike, beads: Any, structure: Any, behind: Any
) -> xr.Dataset:
    """Return the motion of the beads of a chain."""
    reading = _Run(run, chain, structure, behind)
    rows = nearest_rows(reading.time, times)
    numbers = reading.numbers(beads)
    pushes = [reading.pushes(number, rows) for number in numbers]
    fields: dict[Bead, BeadField] = {}
    for bead in dict.fromkeys(reading.bodies[number] for number in numbers):
        same = [pair for number, pair in zip(numbers, pushes, strict=True) if reading.bodies[number] == bead]
        widest = max(push.radius for pair in same for moments in pair for push in moments)
        fields[bead] = BeadField(bead, chain.modes - 1, widest)
    parts = [
        _moved_bead(fields[reading.bodies[number]], reading, number, rows, pair)
        for number, pair in zip(numbers, pushes, strict=True)
    ]
    grid = _joined([part.grid for part in parts], numbers)
    displacement, stress = (np.concatenate(values, axis=1) for values in list(zip(*parts, strict=True))[1:])
    motion = motion_dataset(grid, reading.time[rows], displacement, von_mises(stress))
    motion["stress"] = (
        ("time", "point", "stress_component"),
        stress[..., list(STRESS_COMPONENTS.values())],
        {"units": "Pa", "long_name": "stress, positive in tension"},
    )
    of_points = np.repeat(numbers, [len(part.grid.points) for part in parts])
    motion = motion.assign_coords(bead=("point", of_points), stress_component=list(STRESS_COMPONENTS))
    note = {**provenance({}), "input": run.attrs.get("input", ""), "up": [0.0, 0.0, 1.0], "depth": "along the chain"}
    return motion.assign_attrs(note)


def _contacts_of(data: object, structure: Structure) -> tuple[int, Vector, Vector]:
    """Return the number of a structure in the run; and at each of its p contact points the force relative to the
    preload (N), the mean over each saved interval, and the displacement (m); intervals × p, times × p. NaN if nothing
    touches it."""
    contacts, force, static = contact_forces(data)
    run = instance("run", data, xr.Dataset, "the Dataset of a run")
    if "structure" in run.dims:
        raise ValueError("run: has several structures; choose that one with run.isel(structure=0)")
    place = int(run.structure) if "structure" in run.coords else 0
    moments = run.time.values
    if moments.size < 2:
        raise ValueError("run: holds one time only; must be a whole run")
    steps = np.diff(moments)
    if moments[0] != 0.0 or np.ptp(steps) > 1e-6 * steps[0] or not np.isfinite(force).all():
        raise ValueError("run: must be a whole run, from its start on, with every saved time")
    place_of = {contact.point: k for k, contact in enumerate(contacts) if contact.structure == place}
    if max(place_of, default=0) >= structure.contacts:
        raise ValueError(f"body: has {structure.contacts} contact points, that of the run more; give that one")
    dynamic, surface = force - static, run.surface_displacement.values.reshape(moments.size, -1)
    forces, places = np.full((2, moments.size, structure.contacts), np.nan)
    points, columns = list(place_of), list(place_of.values())
    forces[:, points], places[:, points] = dynamic[:, columns], surface[:, columns]
    return place, 0.5 * (forces[1:] + forces[:-1]), places


def nearest_rows(moments: Vector, times: ArrayLike) -> NDArray[np.intp]:
    """Return the rows of the saved times nearest to the requested ones, which must increase."""
    try:
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
    except (TypeError, ValueError):
        wanted = np.zeros(0)
    if wanted.ndim != 1 or not wanted.size or not np.isfinite(wanted).all():
        raise ValueError(f"times = {times!r}: must be one time in s, or several")
    first, last = float(moments[0]), float(moments[-1])
    late = TIME_ROUNDING * last
    if wanted.min() < first - late or wanted.max() > last + late:
        raise ValueError(f"times = {times!r}: must lie in the run, between {first:.6g} and {last:.6g} s")
    rows = np.rint(np.interp(wanted, moments, np.arange(moments.size))).astype(np.intp)
    if (np.diff(rows) <= 0).any():
        raise ValueError(
            f"times = {times!r}: must increase by the {moments[1] - first:.3g} s between saved times or more; "
            "take fewer"
        )
    return np.asarray(rows)


def _moved(structure: Structure, force: Vector, interval: float, rows: NDArray[np.intp]) -> tuple[list[Vector], Vector]:
    """Return the degrees of freedom at the rows, and the displacements of the contacts at all times up to the last
    row."""
    moving, wanted = MovingStructure(structure), set(rows.tolist())
    state, contact = moving.start(), np.zeros((len(force) + 1, structure.contacts))
    states = [state.displacement] if 0 in wanted else []
    for row, mean in enumerate(np.nan_to_num(force), start=1):
        state, contact[row] = moving.move(state, mean, interval)
        if row in wanted:
            states.append(state.displacement)
    return states, contact


def _contact_error(actual: Vector, expected: Vector) -> float:
    """Return the largest relative difference at the contacts that something touches."""
    touched = ~np.isnan(expected[0])
    actual, expected = actual[:, touched], expected[:, touched]
    greatest = float(max(abs(actual).max(), abs(expected).max()))
    return float(abs(actual - expected).max()) / greatest if greatest > 0.0 else 0.0


def motion_dataset(grid: Grid, moments: Vector, displacement: Vector, von_mises: Vector) -> xr.Dataset:
    """Return a Dataset of `motion` without attributes: fields at t times, t × p × 3 in m, t × p in Pa."""
    counted = {"units": "1"}
    variables: dict[str, Any] = {
        "displacement": (
            ("time", "point", "component"),
            displacement,
            {"units": "m", "long_name": "displacement from static equilibrium"},
        ),
        "von_mises": (("time", "point"), von_mises, {"units": "Pa", "long_name": "von Mises stress"}),
        "cells": (("cell", "corner"), grid.cells, {**counted, "long_name": "points of each cell, in VTK's order"}),
        "part": (("cell",), grid.part, {**counted, "long_name": "number of the cell's material"}),
    }
    coordinates: dict[str, Any] = {
        "time": ("time", moments, {"units": "s"}),
        "component": ("component", ["x", "y", "z"]),
        "position": (("point", "component"), grid.points, {"units": "m", "long_name": "place at rest"}),
    }
    shape = "revolution" if grid.revolution else "solid"
    return xr.Dataset(variables, coordinates, {"cell_type": grid.kind, "shape": shape})


def known_motion(data: object) -> None:
    """Raise a ValueError if this is not a Dataset of `motion`."""
    motion = instance("motion", data, xr.Dataset, "the Dataset of plots.motion(...)")
    missing = {"displacement", "von_mises", "cells", "part"} - set(motion.data_vars)
    if motion.sizes.get("time") == 0:
        raise ValueError("motion: holds no time")
    if missing or motion.displacement.dims != ("time", "point", "component"):
        what = ", ".join(sorted(missing)) or "one dimension of displacement (take times by isel(time=[...]))"
        raise ValueError(f"motion: lacks {what}; must be the Dataset of plots.motion(...)")


class _Part(NamedTuple):
    """One bead: its grid, displacement, t × p × 3, m, and stress, t × p × 6, Pa, at t times."""

    grid: Grid
    displacement: Vector
    stress: Vector


Pair = tuple[list[Push], list[Push]]
"""The pressures on the struck side of a bead and on the other side: at the chosen times, and last at rest."""


class _Run:
    """The data of a chain's run about its beads; body 0 is the striker. Checks the run, see `motion`."""

    def __init__(self, dataset: object, chain: DeformableChain, structure: object, behind: object) -> None:
        self.chain = chain
        reading = Reading(dataset, "the Dataset of a run of a DeformableChain")
        run = reading.data
        reading.check_holds(BEAD_VARIABLES, "a DeformableChain")
        reading.check_one_chain(*BEAD_VARIABLES)
        if "time" not in run.dims or not run.time.size:
            raise ValueError("run: holds no time")
        given_input: dict[str, Any] = {} if set(run.coords) - OF_RUNS else stored(run.attrs.get("input"))
        _check_chain(run, chain, given_input)
        self.ends = {"behind": _surface("behind", behind), "structure": _surface("structure", structure)}
        faced = _faced(run)
        _check_end("structure", structure, faced.get("last bead"), given_input)
        _check_end("behind", behind, faced.get("first bead"), given_input)
        count, elastic = len(chain.beads) + 1, chain.modes - 1
        self.time = run.time.values
        self.displacement = run.displacement.values[:, :count]
        self.force, self.static = run.contact_force.values[:, :count], run.static_force.values[:count]
        self.amplitude = run.vibration_amplitude.values[:, :count, :elastic]
        self.bodies: tuple[Any, ...] = (chain.body, *chain.beads)
        # If nothing touches the first bead, contact 1 holds an external force, which acts on the bead as a whole.
        if chain.excitation.drive.kind == drives.PUSHED and "first bead" not in faced:
            self.force, self.static = self.force.copy(), self.static.copy()
            self.force[:, 0] = self.static[0] = 0.0

    def numbers(self, beads: Sequence[int] | int | None) -> list[int]:
        """Return the numbers of the requested beads."""
        first, last = 0 if self.bodies[0] is not None else 1, len(self.bodies) - 1
        if beads is None:
            return list(range(first, last + 1))
        wanted = [beads] if isinstance(beads, int | np.integer) else listed("beads", beads, int | np.integer, "numbers")  # type: ignore[arg-type]
        listed_numbers = [whole("beads", number, 0) for number in wanted]
        if min(listed_numbers) < first or max(listed_numbers) > last or len(set(listed_numbers)) < len(listed_numbers):
            raise ValueError(f"beads = {beads!r}: must be different numbers from {first} to {last}")
        return sorted(listed_numbers)

    def pushes(self, number: int, rows: Any) -> Pair:
        """Return the pressures on a bead at the rows, and at rest."""
        forces = np.vstack([self.force[rows], self.static])
        bead = self.bodies[number]
        sides = []
        for contact in (number - 1, number):
            along = np.maximum(forces[:, contact], 0.0) if contact >= 0 else np.zeros(len(forces))
            scale = self._radius_at_one_newton(bead, number, contact) if along.any() else 0.0
            sides.append([Push(force, scale * force ** (1.0 / 3.0)) for force in along.tolist()])
        return sides[0], sides[1]

    def _radius_at_one_newton(self, bead: Bead, number: int, contact: int) -> float:
        """Return the radius of a contact circle, m, by Hertz; it grows with the cube root of the force."""
        surface, facing = bead.surface, self._other(number, contact)
        flat, sharp = relative_curvatures(surface, facing)
        if sharp - flat > CIRCULAR_DIFFERENCE * (sharp + flat):
            raise ValueError(f"contact {contact + 1}: is not circular, so the stress of the bead is not axisymmetric")
        return sqrt(hertz_stiffness(surface, facing) ** (-2.0 / 3.0) / sharp)

    def _other(self, number: int, contact: int) -> Surface:
        """Return the surface that the bead touches there."""
        neighbour = contact if contact < number else contact + 1
        body: Bead | None = self.bodies[neighbour] if neighbour < len(self.bodies) else None
        if body is not None:
            return body.surface
        pressed = self.chain.excitation.faces(self.chain.beads[0])
        if neighbour == 0 and pressed is not None:
            return pressed
        name = "behind" if neighbour == 0 else "structure"
        surface = self.ends[name]
        if surface is None:
            raise ValueError(f"{name} = None: must be what bead {number} touches, a Structure or a Surface")
        return surface


def _moved_bead(field: BeadField, run: _Run, number: int, rows: Any, pushes: Pair) -> _Part:
    """Return one bead at the chosen times."""
    grid = field.grid
    points = grid.points - [0.0, 0.0, float(run.chain.centres[number])]
    *moments, rest = zip(*pushes, strict=True)
    unmoved = field.at(*rest, field.at_rest(*rest))[0]
    displacement, stress = [], []
    for row, pair in zip(rows, moments, strict=True):
        deformed, stressed = field.at(*pair, run.amplitude[row, number])
        displacement.append(deformed - unmoved - [0.0, 0.0, run.displacement[row, number]])
        stress.append(stressed)
    return _Part(grid._replace(points=points), np.stack(displacement), np.stack(stress))


def _joined(grids: list[Grid], numbers: list[int]) -> Grid:
    """Return all beads in one grid, each as a separate part."""
    starts = np.cumsum([0, *(len(grid.points) for grid in grids)])
    cells = [grid.cells + start for grid, start in zip(grids, starts, strict=False)]
    return Grid(
        np.concatenate([grid.points for grid in grids]),
        np.concatenate(cells),
        grids[0].kind,
        np.repeat(numbers, [len(part) for part in cells]),
        True,
    )


def _surface(name: str, facing: object) -> Surface | None:
    """Return the surface that an end of the chain faces."""
    what = "a Structure, a Surface or None"
    thing = instance(name, facing, Structure | Surface | None, what)  # type: ignore[arg-type]
    surface: Any = thing.surfaces[0] if isinstance(thing, Structure) else thing
    if isinstance(thing, Structure) and thing.contacts > 1:
        raise ValueError(f"{name}: has several contact points; give the Surface of the one that this chain touches")
    return surface  # type: ignore[no-any-return]


def _faced(run: xr.Dataset) -> dict[str, int]:
    """Return the ends of this chain that face something, and the numbers of the structures there."""
    here = ~np.isnan(np.atleast_1d(run.gap.values[0])) if "gap" in run else [True]
    number = int(run.chain) if "chain" in run.coords else 0
    contacts = zip(Reading(run).contacts, here, strict=True)
    return {END_NAMES[contact.end]: contact.structure for contact, some in contacts if some and contact.chain == number}


def _check_chain(run: xr.Dataset, chain: DeformableChain, stated: Mapping[str, Any]) -> None:
    """Raise a ValueError if the run is of another chain."""
    bodies = Reading(run).beads[0] + 1
    if bodies != len(chain.beads) + 1:
        raise ValueError(
            f"body: has {count_of(len(chain.beads), 'bead')}, that of the run {bodies - 1}; give the one that was run"
        )
    modes = 1 + np.count_nonzero(~np.isnan(run.vibration_amplitude.values[0, 1]))
    if modes != chain.modes:
        raise ValueError(f"body: has modes = {chain.modes}, that of the run {modes}; give the one that was run")
    place = int(run.chain) if "chain" in run.coords else 0
    described = stated["chains"][place] if "chains" in stated else stated.get("chain")
    if described is not None:
        _refuse("body", described, chain.describe(), "give the one that was run")
    if not np.allclose(run.centre.values[:bodies], chain.centres, rtol=1e-9, atol=0.0):
        raise ValueError("body: has other bodies than that of the run; give the one that was run")
    energy = float(run.impact_energy)
    if not np.isclose(energy, chain.impact_energy, rtol=1e-9, atol=0.0):
        raise ValueError(
            f"body: is struck with {chain.impact_energy:.6g} J, that of the run with {energy:.6g} J; give the one "
            "that was run"
        )


def _check_end(name: str, facing: object, place: int | None, stated: Mapping[str, Any]) -> None:
    """Raise a ValueError if nothing, or another structure, was there."""
    if facing is None:
        return
    if place is None:
        raise ValueError(f"{name} = {short(facing)}: must be None, as nothing was there in the run")
    if isinstance(facing, Structure):
        _check_structure(name, facing, place, stated, "give the one that was run, or its Surface")


def _check_structure(name: str, structure: Structure, place: int, stated: Mapping[str, Any], advice: str) -> None:
    """Raise a ValueError if another structure was at a place of the run. Its reduction may differ."""
    described = stated["structures"][place] if "structures" in stated else stated.get("structure")
    if isinstance(described, dict):
        theirs, mine = (
            {key: value for key, value in origin.items() if key != "reduction"}
            for origin in (described, structure.origin)
        )
        _refuse(name, theirs, mine, advice)


def _refuse(name: str, theirs: Mapping[str, Any], mine: Mapping[str, Any], advice: str) -> None:
    """Raise a ValueError if this differs from the input of the run, as plain data."""
    if differing := list(differences(theirs, stored(as_text(mine)))):
        more = f" and {len(differing) - MOST_LISTED} more" if len(differing) > MOST_LISTED else ""
        raise ValueError(f"{name}: is not that of the run: {', '.join(differing[:MOST_LISTED])}{more}; {advice}")
