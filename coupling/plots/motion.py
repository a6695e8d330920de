"""The motion inside bodies: displacement and stress at chosen times of a run, computed after the run."""

from collections.abc import Sequence
from math import sqrt
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from coupling.results.provenance import as_text, differences, provenance, stored
from coupling.results.reading import Reading, contact_forces
from coupling.results.schema import FIRST, OF_RUNS
from particles.bead import surface_of
from particles.deformable.bead_field import BeadField, Push
from particles.deformable.deformable_chain import DeformableChain
from particles.kernels import drives
from structures.checks import each, finite, instance, listed, short, whole
from structures.field import Grid, von_mises
from structures.moving import MovingStructure
from structures.structure import Structure, Vector, known_field
from structures.surface import hertz_stiffness, relative_curvatures

LARGEST_CONTACT_ERROR = 0.05  # of the recomputed contact displacement, as a fraction of the run's greatest
ROUNDING = 1e-9  # relative, of times and of numbers that describe a chain
MOST_LISTED = 3  # differences that an error lists

STRESS_COMPONENTS = {"radial": 0, "hoop": 1, "axial": 2, "shear": 5}  # places in the stress of a body of revolution

BEAD_VARIABLES = ("displacement", "contact_force", "vibration_amplitude")


def motion(
    run: xr.Dataset, body: Structure | DeformableChain, times: ArrayLike, beads: Sequence[int] | int | None = None
) -> xr.Dataset:
    """Return displacement and stress inside a run's structure, or inside beads, at the saved times nearest to `times`.

    The motion of a structure is computed again, from rest, under the contact force of the run above the preload. In
    each saved interval the force is the mean of its two end values, so the run must be saved at least a dozen times per
    contact.

    A bead's field is the sum of its modes and of the static field of the contact forces (mode acceleration). Hertz's
    pressure acts on the contact circle. With 8 cells in its radius the error of the stress is 1 % of the largest
    pressure, and 7 % at the edge of the circle.

    Parameters
    ----------
    run : xarray.Dataset
        A whole run. If it has several, choose one structure, run.isel(structure=0), or one chain, run.isel(chain=0).
    body : Structure or DeformableChain
        The chain; or the structure, reduced or not, with a field: see reduce(..., keep_field=True).
    times : array_like
        Times, s.
    beads : int or sequence of int, optional
        Numbers of the beads of a chain; 0 is the striker. By default all. A bead that touches a structure is refused.

    Returns
    -------
    xarray.Dataset
        `displacement` (time, point, component), m, and `von_mises` (time, point), Pa, relative to static equilibrium;
        `position` (point, component), m; `cells` (cell, corner) in VTK's order, and the `part` of each cell: the number
        of its material or bead. A point where materials meet appears once for each material. Bodies of revolution are
        given in their half-plane (r, 0, −z). Closer to the contact than the patch radius, the stress is that of the
        patch, not Hertz's. The attribute contact_error is the largest difference between the contact displacement here
        and in the run, over its maximum.

        Beads also have `stress` (time, point, stress_component), Pa, positive in tension, preload included. They lie at
        their places along the chain, with z from its struck end; `bead` (point) is the number of the bead.

    Raises
    ------
    ValueError
        For times outside the run, a chain that was not in the run, structures without a field, and Datasets that are
        not a single whole run; and if contact_error exceeds 5 %: the structure is another one, or the run was saved too
        rarely.

    Notes
    -----
    A chain is compared with the input of the run. A point of a sweep holds the input of the first point, so only modes,
    places of bodies and energy are compared there.

    Examples
    --------
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_316)
    >>> chain = hl.DeformableChain([bead] * 2, bead, impact_speed=1.0, modes=2)
    >>> run = hl.CoSimulation(chain, None).run(until=10e-6)
    >>> motion = hl.plots.motion(run, chain, times=[5e-6], beads=[1])
    >>> float(motion.stress.sel(stress_component="axial").min()) < 0.0
    True
    """
    instance("body", body, Structure | DeformableChain, "the Structure or the DeformableChain that was run")  # type: ignore[arg-type]
    if isinstance(body, DeformableChain):
        return _motion_of_beads(run, body, times, beads)
    if beads is not None:
        raise ValueError(f"beads = {short(beads)}: must be None, because body is not a DeformableChain")
    return _motion_of_structure(run, body, times)


def _motion_of_structure(run: xr.Dataset, structure: Structure, times: ArrayLike) -> xr.Dataset:
    field = known_field(structure, "body")
    contacts, force, static = contact_forces(run)
    if "structure" in run.dims:
        raise ValueError("run: has several structures; choose one with run.isel(structure=0)")
    moments, steps = run.time.values, np.diff(run.time.values)
    whole_run = moments.size > 1 and moments[0] == 0.0 and np.ptp(steps) <= 1e-6 * steps[0]
    if not whole_run or not np.isfinite(force).all():
        raise ValueError("run: must be a whole run, from its start on, with every saved time")
    place = int(run.structure) if "structure" in run.coords else 0
    touching = [number for number, contact in enumerate(contacts) if contact.structure == place]
    points = [contacts[number].point for number in touching]
    if max(points, default=0) >= structure.contacts:
        raise ValueError(f"body: has {structure.contacts} contact points, fewer than in the run; give the run's body")
    if (until := float(moments[-1])) > structure.valid_until * (1.0 + ROUNDING):
        raise ValueError(f"body: was reduced for runs of at most {structure.valid_until} s, the run has {until} s")

    rows = _nearest_rows(run, times)
    pressed = np.zeros((moments.size, structure.contacts))
    pressed[:, points] = (force - static)[:, touching]
    moving = MovingStructure(structure)
    state = moving.start()
    contact, states = np.zeros((rows[-1] + 1, structure.contacts)), []
    for row in range(rows[-1] + 1):
        if row > 0:
            mean = 0.5 * (pressed[row - 1] + pressed[row])
            state, contact[row] = moving.move(state, mean, float(steps[0]))
        if row in rows:
            states.append(state.displacement)

    # The contact of another structure would move differently.
    expected = run.surface_displacement.values.reshape(moments.size, -1)[: rows[-1] + 1, touching]
    actual = contact[:, points]
    greatest = max(abs(actual).max(initial=0.0), abs(expected).max(initial=0.0))
    error = float(abs(actual - expected).max(initial=0.0) / greatest) if greatest > 0.0 else 0.0
    if error > LARGEST_CONTACT_ERROR:
        raise ValueError(
            f"run: the structure's contact moves differently, by {100.0 * error:.2g} % of its greatest displacement; "
            "give the structure that was run, and save the run more often (save_every)"
        )
    displacement, stress = (
        np.stack([of(u) for u in states]) for of in (field.displacement, lambda u: von_mises(field.stress(u)))
    )
    up = [float(x) for x in structure.origin.get("normal", (0.0, 0.0, 1.0))]
    return _dataset(run, field.grid, moments[rows], displacement, stress).assign_attrs(contact_error=error, up=up)


def _motion_of_beads(dataset: object, chain: DeformableChain, times: ArrayLike, beads: Any) -> xr.Dataset:
    reading = Reading(dataset, "the Dataset of a run of a DeformableChain")
    reading.check_holds(BEAD_VARIABLES, "a DeformableChain")
    reading.check_one("chain", *BEAD_VARIABLES)
    run, bodies = reading.data, list[Any]([chain.body, *chain.beads])
    own, count, first = int(run.coords.get("chain", 0)), len(bodies), 0 if chain.body is not None else 1
    _check_chain(reading, chain, own)
    given = [beads] if isinstance(beads, int | np.integer) else beads
    wanted = range(first, count) if given is None else listed("beads", given, object, "numbers")
    numbers = sorted({whole("beads", number, first, count - 1) for number in wanted})

    # The forces on the struck side of each bead and on the other side, at the times and, in the last row, at rest.
    rows = _nearest_rows(run, times)
    force = np.vstack([run.contact_force.values[rows, :count], run.static_force.values[:count]])
    # If nothing touches the first bead, contact 1 holds an external force, which acts on the bead as a whole.
    touched = any(contact.end == FIRST and contact.chain == own for contact in reading.contacts)
    if chain.excitation.drive.kind == drives.PUSHED and not touched:
        force[:, 0] = 0.0
    force = np.maximum(np.hstack([np.zeros((len(rows) + 1, 1)), force]), 0.0)  # nothing is behind the striker
    pushes = dict[int, list[tuple[Push, Push]]]()
    for number in numbers:
        sides = []
        for contact in (number - 1, number):
            pressed, radius = force[:, contact + 1], 0.0
            if pressed.any():
                neighbour = contact if contact < number else contact + 1
                other = bodies[neighbour] if neighbour < len(bodies) else None
                if other is None and neighbour == 0:
                    other = chain.excitation.faces(chain.beads[0])
                if other is None:
                    where = f"bead {number} touches no bead at contact {contact + 1}"
                    raise ValueError(f"beads: {where}, so its stress is not known")
                pair = bodies[number].surface, surface_of(other)
                # Hertz's radius of the contact at 1 N; it grows with the cube root of the force.
                radius = sqrt(hertz_stiffness(*pair) ** (-2.0 / 3.0) / relative_curvatures(*pair)[1])
            sides.append([Push(one, radius * one ** (1.0 / 3.0)) for one in pressed.tolist()])
        pushes[number] = list(zip(*sides, strict=True))
    fields = dict[Any, BeadField]()
    for bead in dict.fromkeys(bodies[number] for number in numbers):
        alike = [pushes[number] for number in numbers if bodies[number] == bead]
        largest = max(push.radius for one in alike for pair in one for push in pair)
        fields[bead] = BeadField(bead, chain.modes - 1, largest)

    # All beads form one grid; each bead is a part of it.
    points, cells, displacement, stress = list[Vector](), [], [], []
    for number in numbers:
        field = fields[bodies[number]]
        cells.append(field.grid.cells + sum(len(part) for part in points))
        points.append(field.grid.points - [0.0, 0.0, float(chain.centres[number])])
        *pairs, rest = pushes[number]
        unmoved = field.at(*rest, field.at_rest(*rest))[0]
        vibration = run.vibration_amplitude.values[rows, number, : chain.modes - 1]
        deformed, stressed = zip(*(field.at(*pair, q) for pair, q in zip(pairs, vibration, strict=True)), strict=True)
        moved = np.stack(deformed) - unmoved
        moved[..., 2] -= run.displacement.values[rows, number, None]
        displacement.append(moved)
        stress.append(np.stack(stressed))
    parts = np.repeat(numbers, [len(part) for part in cells])
    grid = Grid(np.concatenate(points), np.concatenate(cells), field.grid.kind, parts, True)
    tensor, moments = np.concatenate(stress, axis=1), run.time.values[rows]
    motion = _dataset(run, grid, moments, np.concatenate(displacement, axis=1), von_mises(tensor))
    components = tensor[..., list(STRESS_COMPONENTS.values())]
    about = {"units": "Pa", "long_name": "stress, positive in tension"}
    motion["stress"] = ("time", "point", "stress_component"), components, about
    of_points = np.repeat(numbers, [len(part) for part in points])
    motion = motion.assign_coords(bead=("point", of_points), stress_component=list(STRESS_COMPONENTS))
    return motion.assign_attrs(up=[0.0, 0.0, 1.0])


def _check_chain(reading: Reading, chain: DeformableChain, own: int) -> None:
    """Raise a ValueError if the chain is not that of the run. own: the number of the chain in the run."""
    run = reading.data
    # A point of a sweep holds the input of the first point, so only a few facts are compared.
    inputs: dict[str, Any] = {} if set(run.coords) - OF_RUNS else stored(run.attrs.get("input"))
    there: Any = inputs["chains"][own] if "chains" in inputs else inputs.get("chain")
    here: Any = stored(as_text(chain.describe()))
    if there is None:
        modes = 1 + int(np.isfinite(run.vibration_amplitude.values[0, 1]).sum())
        length = np.ptp(run.centre.values[: len(chain.beads) + 1])
        pairs = {"modes": (modes, chain.modes), "length": (length, np.ptp(chain.centres))}
        pairs["impact energy"] = float(run.impact_energy), chain.impact_energy
        there, here = ({name: float(f"{pair[k]:.9g}") for name, pair in pairs.items()} for k in (0, 1))
    if unlike := list(differences(there, here)):
        more = f" and {len(unlike) - MOST_LISTED} more" if len(unlike) > MOST_LISTED else ""
        raise ValueError(
            f"body: is not that of the run: {', '.join(unlike[:MOST_LISTED])}{more}; give the one that was run"
        )


def _nearest_rows(run: xr.Dataset, times: ArrayLike) -> NDArray[np.intp]:
    """Return the rows of the saved times nearest to the requested ones, in their order."""
    moments, wanted = run.time.values, each(finite, "times", times, "s").ravel()  # type: ignore[arg-type]
    first, last = float(moments[0]), float(moments[-1])
    spare = ROUNDING * last
    if not wanted.size or wanted.min() < first - spare or wanted.max() > last + spare:
        raise ValueError(f"times = {short(times)}: must be in the run, between {first:.6g} and {last:.6g} s")
    return np.unique(np.rint(np.interp(wanted, moments, np.arange(moments.size))).astype(np.intp))


def _dataset(run: xr.Dataset, grid: Grid, moments: Vector, displacement: Vector, von_mises: Vector) -> xr.Dataset:
    """Return a Dataset of `motion`: fields at t times, t × p × 3 in m, t × p in Pa."""
    moved = {"units": "m", "long_name": "displacement from static equilibrium"}
    corners = {"units": "1", "long_name": "points of each cell, in VTK's order"}
    variables: dict[str, Any] = {
        "displacement": (("time", "point", "component"), displacement, moved),
        "von_mises": (("time", "point"), von_mises, {"units": "Pa", "long_name": "von Mises stress"}),
        "cells": (("cell", "corner"), grid.cells, corners),
        "part": (("cell",), grid.part, {"units": "1", "long_name": "number of the cell's material"}),
    }
    coordinates: dict[str, Any] = {
        "time": ("time", moments, {"units": "s"}),
        "component": ("component", ["x", "y", "z"]),
        "position": (("point", "component"), grid.points, {"units": "m", "long_name": "place at rest"}),
    }
    shape = "revolution" if grid.revolution else "solid"
    attributes = {**provenance({}), "input": run.attrs.get("input", ""), "cell_type": grid.kind, "shape": shape}
    return xr.Dataset(variables, coordinates, attributes)


def known_motion(data: object) -> xr.Dataset:
    """Return a Dataset of `motion`; a ValueError for anything else."""
    motion = instance("motion", data, xr.Dataset, "the Dataset of plots.motion(...)")
    missing = {"displacement", "von_mises", "cells", "part"} - set(motion.data_vars)
    if missing or motion.displacement.dims != ("time", "point", "component") or not motion.sizes["time"]:
        what = ", ".join(sorted(missing)) or "a time, or the dimension time (take times by isel(time=[...]))"
        raise ValueError(f"motion: lacks {what}; must be the Dataset of plots.motion(...)")
    return motion
