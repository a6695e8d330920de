"""Thousands of chains in one compiled call: for parameter sweeps and fits that need no structure."""

from collections.abc import Iterable, Sequence
from typing import Any

import joblib
import numba
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.results.findings import warn
from coupling.results.provenance import provenance
from coupling.results.schema import variable
from coupling.run_checks import check_before
from particles import kernels
from particles.chain import Chain
from particles.deformable.chain import DeformableChain
from particles.moving import MovingChain
from structures.checks import instance, listed, positive, whole
from structures.structure import Structure, Vector

Kept = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Contacts and bodies whose forces and velocities are kept, counted from zero."""

FRAMES_PER_CONTACT = 32
"""Saved times in the shortest contact: half an interval off its peak, a half-sine is lower by 0.1 %."""

MOST_SAVED = 2e8
"""Upper limit for chains × saved times × contacts and beads: 1.6 GB."""


def batch(
    chains: Sequence[Chain],
    until: float,
    structure: Structure | None = None,
    save_every: float | None = None,
    sensors: Iterable[int] | None = None,
    dt: float | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Run many chains with equal numbers of beads in parallel, without structures.

    The result of a chain does not depend on the other chains.

    Parameters
    ----------
    chains : sequence of Chain
        The chains. All have the same number of beads.
    until : float
        Length of the record, s.
    structure : Structure, optional
        None, or a half-space that all chains face. For other structures use `sweep`.
    save_every : float, optional
        Time between saved samples, s; by default 1/32 of the shortest contact of all chains.
    sensors : sequence of int, optional
        Numbers of the beads to keep, each with its two contacts; by default all.
    dt : float, optional
        Time step, s; by default each chain has its own.
    threads : int, optional
        Number of threads; by default one for each core.

    Returns
    -------
    xarray.Dataset
        Contact forces (N) and velocities (m/s) as in the Dataset of a run, with a first dimension "chain". Measures
        that need only these, such as `amplitude_ratio`, work on it.

    Raises
    ------
    ValueError
        If the chains differ in length, are driven by a history or have deformable beads, or the result is too large.
    FloatingPointError
        If the state of a body is no longer finite.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_440C)
    >>> chains = [hl.Chain([bead] * 8, bead, impact_speed=speed) for speed in (0.1, 0.2, 0.4)]
    >>> runs = hl.batch(chains, until=150e-6, sensors=[5])
    >>> dict(runs.contact_force.sizes)["chain"]
    3
    """
    chains = listed("chains", chains, Chain, "one Chain or more")
    if any(isinstance(chain, DeformableChain) for chain in chains):
        raise ValueError("chains: of deformable beads must be run by CoSimulation or sweep")
    until = positive("until", until, "s")
    moving = [MovingChain(chain, _surface(structure), dt=dt) for chain in chains]
    warn(check_before(moving, until))
    lengths = {one.mass.size for one in moving}
    if len(lengths) > 1:
        raise ValueError(f"chains: hold {sorted(n - 1 for n in lengths)} beads; must have equally many")
    if any(one.constants.numbers.drive != kernels.FREE for one in moving):
        raise ValueError("chains: with a PushedBead, a Piston or no striker must be run by CoSimulation or sweep")
    beads = lengths.pop() - 1
    kept = _kept(sensors, beads)
    if save_every is None:
        save_every = min(one.contact_time for one in moving) / FRAMES_PER_CONTACT
    interval = positive("save_every", save_every, "s")
    if interval > until:
        raise ValueError(f"save_every = {save_every!r}: must not be longer than the run, until = {until!r} s")
    for one in moving:
        one.steps(until)
    frames = int(until / interval * (1.0 + 1e-9)) + 1
    size = len(chains) * frames * float(kept[0].size + kept[1].size)
    if size > MOST_SAVED:
        raise ValueError(f"until: {size:.3g} numbers are too many to keep; give sensors, or a longer save_every")
    force = np.empty((len(chains), frames, kept[0].size))
    velocity = np.empty((len(chains), frames, kept[1].size))
    _run(moving, interval, kept, force, velocity, threads)
    given = {"chains": [chain.describe() for chain in chains[:1]], "count": len(chains), "until": until, "dt": dt}
    return _dataset(moving, kept, interval, force, velocity).assign_attrs(provenance({"batch": given}), beads=beads)


def _surface(structure: Structure | None) -> Any:
    if structure is None:
        return None
    instance("structure", structure, Structure, "None or half_space(material)")
    if structure.size or structure.contacts > 1 or structure.flexibilities.any():
        raise ValueError("structure: a batch faces nothing or a half-space; use sweep for a structure that moves")
    return structure.surfaces[0]


def _kept(sensors: Iterable[int] | None, beads: int) -> Kept:
    """Contacts and bodies to keep, counted from zero."""
    if sensors is None:
        return np.arange(beads + 1), np.arange(beads + 1)
    numbers = sorted({whole("sensors", n) for n in listed("sensors", sensors, object, "one bead number or more")})
    if numbers[-1] > beads:
        raise ValueError(f"sensors = {numbers!r}: must be beads from 1 to {beads}, counted from the struck end")
    contacts = sorted({n - 1 for n in numbers} | set(numbers))
    return np.array(contacts, dtype=np.int64), np.array(numbers, dtype=np.int64)


def _run(
    moving: list[MovingChain],
    interval: float,
    kept: Kept,
    force: Vector,
    velocity: Vector,
    threads: int | None,
) -> None:
    """Fill force and velocity."""
    constants = [one.constants for one in moving]
    tables, rows = _tables(moving, constants)
    scalars = [
        (c.numbers.exponent, c.numbers.gravity, c.numbers.preload, c.numbers.spring, c.numbers.spring_end)
        for c in constants
    ]
    starts = [one.start() for one in moving]
    before = numba.get_num_threads()
    numba.set_num_threads(before if threads is None else min(whole("threads", threads), joblib.cpu_count()))
    try:
        bad = kernels.run_batch(
            np.array([start.position for start in starts]),
            np.array([start.velocity for start in starts]),
            np.array([c.inverse_mass for c in constants]),
            np.array([c.stiffness for c in constants]),
            tables,
            rows,
            np.array([c.damping for c in constants]),
            np.array([(one.method, c.numbers.loss) for one, c in zip(moving, constants, strict=True)]),
            np.array(scalars),
            np.array([one.steps(interval) for one in moving]),
            interval,
            kept,
            force,
            velocity,
        )
    finally:
        numba.set_num_threads(before)
    lost = np.flatnonzero(bad >= 0)
    if lost.size:
        raise FloatingPointError(f"chain {lost[0]}: body {bad[lost[0]]} is no longer finite at the end; check dt")


def _tables(moving: list[MovingChain], constants: list[kernels.Constants]) -> tuple[Vector, Vector]:
    """The first rows of each chain in the tables of all chains; chains with the same laws share theirs."""
    starts: dict[tuple[int, ...], int] = {}
    rows: list[Vector] = [np.zeros((1, 6))]
    first = []
    for one, numbers in zip(moving, constants, strict=True):
        key = tuple(map(id, one.tables))
        if key and key not in starts:
            starts[key] = sum(map(len, rows))
            rows.append(numbers.rows)
        first.append(np.where(numbers.table >= 0, numbers.table + starts.get(key, 0), -1))
    return np.array(first), np.concatenate(rows)


def _dataset(moving: list[MovingChain], kept: Kept, interval: float, force: Vector, velocity: Vector) -> xr.Dataset:
    contacts, bodies = kept
    coordinates = {
        "time": ("time", interval * np.arange(force.shape[1]), {"units": "s"}),
        "bead": ("bead", bodies),
        "contact": ("contact", contacts + 1),
        "centre": (("chain", "bead"), np.array([one.chain.centres[bodies] for one in moving]), {"units": "m"}),
        "static_force": (
            ("chain", "contact"),
            np.array([one.static_force[contacts] for one in moving]),
            {"units": "N"},
        ),
        "impact_energy": ("chain", np.array([one.chain.impact_energy for one in moving]), {"units": "J"}),
    }
    data = xr.Dataset(
        {
            "contact_force": variable("contact_force", force.swapaxes(0, 1), "chain"),
            "velocity": variable("velocity", velocity.swapaxes(0, 1), "chain"),
        },
        coordinates,
    )
    return data.transpose("chain", "time", ...)
