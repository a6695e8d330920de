"""The motion of a struck body: its displacement and stress at chosen times of a run, computed after the run."""

import json
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from coupling.results.contact_forces import contact_forces
from coupling.results.provenance import provenance, stored
from structures.checks import instance
from structures.field import Grid
from structures.moving import MovingStructure
from structures.structure import Structure, Vector, known_field

LARGEST_CONTACT_ERROR = 0.05
"""Largest difference between the recomputed contact displacement and that of the run, as a fraction of its maximum."""

TIME_ROUNDING = 1e-9
"""Relative. Times that differ by less are equal."""


def structure_motion(run: xr.Dataset, structure: Structure, times: ArrayLike) -> xr.Dataset:
    """Return the displacement and von Mises stress of a run's structure at the saved times nearest to `times`.

    The structure is moved again, from rest, under the contact force of the run relative to the preload: the mean of its
    two end values over each saved interval. The run itself needs no memory for the body, but must be saved at least a
    dozen times per contact.

    Parameters
    ----------
    run : xarray.Dataset
        A whole run. Of a run with several structures choose one first: run.isel(structure=0).
    structure : Structure
        The structure of the run, or the one from which it was reduced. It must have a field, see reduce(...,
        keep_field=True). The full structure needs one solve for each saved interval.
    times : array_like
        Times, s, increasing.

    Returns
    -------
    xarray.Dataset
        `displacement` (time, point, component), m, and `von_mises` (time, point), Pa, both relative to static
        equilibrium; `position` (point, component), m; `cells` (cell, corner) in VTK's order, and the `part` (number of
        the material) of each. A point where materials meet appears once for each material. Bodies of revolution are
        given in their half-plane (r, 0, −z). Closer to the contact than the patch radius, the stress is that of the
        patch, not Hertz's. Attributes: cell_type (meshio's), contact_error (largest difference between the contact
        displacement here and in the run, over its maximum), and the input of the run.

    Raises
    ------
    ValueError
        For times outside the run, structures without a field, Datasets that are not a single run, a structure other
        than that of the run, and if contact_error exceeds 5 %, because the run was saved too rarely.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 3, bead, impact_speed=0.1)
    >>> body = hl.layered_cylinder([hl.Layer(hl.STEEL_440C, 20e-3, 9.5e-3)], patch_radius=2e-3, cells=2)
    >>> body = hl.reduce(body, until=0.2e-3, keep_field=True)
    >>> run = hl.CoSimulation(chain, body).run(until=0.2e-3)
    >>> motion = hl.plots.structure_motion(run, body, times=[100e-6, 110e-6])
    >>> motion.attrs["contact_error"] < 0.05, motion.sizes["time"]
    (True, 2)
    """
    field = known_field(structure)
    place, force, surface = _contacts_of(run, structure)
    moments = run.time.values
    _check_same(run, structure, place)
    _check_length(structure, float(moments[-1]))
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
        raise ValueError(f"structure: has {structure.contacts} contact points, that of the run more; give that one")
    dynamic, surface = force - static, run.surface_displacement.values.reshape(moments.size, -1)
    points = [place_of.get(point) for point in range(structure.contacts)]
    nothing = np.full(moments.size, np.nan)
    forces = np.stack([nothing if k is None else dynamic[:, k] for k in points], axis=-1)
    places = np.stack([nothing if k is None else surface[:, k] for k in points], axis=-1)
    return place, 0.5 * (forces[1:] + forces[:-1]), places


def _check_same(run: xr.Dataset, structure: Structure, place: int) -> None:
    """Raise a ValueError if the input of the run describes another structure."""
    stated = stored(run.attrs.get("input"))
    theirs = stated["structures"][place] if "structures" in stated else stated.get("structure")
    mine = json.loads(json.dumps(dict(structure.origin), default=repr))
    if not isinstance(theirs, dict):
        return
    for key in sorted((theirs.keys() | mine.keys()) - {"reduction", "stepper"}):
        if theirs.get(key) != mine.get(key):
            raise ValueError(f"structure: is not that of the run, whose {key} is another; give the one that was run")


def _check_length(structure: Structure, until: float) -> None:
    if until > structure.valid_until * (1.0 + TIME_ROUNDING):
        raise ValueError(f"structure: was reduced for runs of at most {structure.valid_until} s, the run has {until} s")


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
    """Return degrees of freedom at the rows, and the displacements of the contacts at all times up to the last row."""
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
    """Return a Dataset of `structure_motion` without attributes: fields at t times, t × p × 3 in m, t × p in Pa."""
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
    """Raise a ValueError if this is not a Dataset of `structure_motion` or `bead_motion`."""
    motion = instance("motion", data, xr.Dataset, "the Dataset of structure_motion(...) or bead_motion(...)")
    missing = {"displacement", "von_mises", "cells", "part"} - set(motion.data_vars)
    if motion.sizes.get("time") == 0:
        raise ValueError("motion: holds no time")
    if missing or motion.displacement.dims != ("time", "point", "component"):
        what = ", ".join(sorted(missing)) or "one dimension of displacement (take times by isel(time=[...]))"
        raise ValueError(f"motion: lacks {what}; must be the Dataset of structure_motion(...) or bead_motion(...)")
