"""A chain of deformable beads by explicit finite elements: slow, and the reference for faster models of it."""

import logging
from math import ceil
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.recording.frames import Motion
from coupling.results.findings import warn, with_warnings
from coupling.results.provenance import provenance
from coupling.results.schema import VARIABLES, run_coordinates, variable
from coupling.run_checks import check_before
from coupling.yield_check import yields
from particles.bead import Bead
from particles.chain import Chain
from particles.deformable import explicit_kernels as kernels
from particles.deformable.explicit_beads import ExplicitBead, explicit_bead
from particles.excitation import Excitation
from particles.laws.axisymmetric_mesh import body_of
from particles.laws.formulas import SMALL_CONTACT, contact_law
from particles.laws.law import PowerLaw
from particles.moving import MovingChain
from structures.caution import caution
from structures.checks import instance, positive
from structures.structure import Vector
from structures.surface import hertz_stiffness, relative_curvatures
from structures.units import readable

CELLS = 4
"""Over the radius of a contact that holds all of the impact energy; three then lie over that of the wave's contacts."""

FEWEST = 3
"""Over that radius, below which a run warns: with 1.7 of them the thesis's wave has 7 % too little force."""

MARGIN = 1.2
"""How far the mesh lets bodies touch, over that radius; it widens where they touch beyond."""

WIDENING, TRIES = 1.4, 6
"""Factor on the reach where bodies touch beyond it, and how many times the chain is then computed again."""

WIDEST = 0.4
"""Part of a bead's radius beyond which a contact is no longer small."""

SAFETY = 0.9
"""Part of the longest stable step that is taken."""

SAVED_PER_CONTACT = 256
"""Saved times in a contact. Forces are means between them, which lowers a peak by 1e-5."""

MOST_SAVED = 1e8
"""Saved times × bodies."""

MANY_STEPS = 1e6
"""Steps of a run from which on it says how long it is."""

LATE = 1e-9
"""Times that differ by this part are one."""

ROUNDED = 0.99
"""Part of a step that counts as the whole: an error shows three digits of it."""

DESCRIPTIONS = {
    "displacement": "displacement of the centre of mass; bead 0 is the striker",
    "velocity": "velocity of the centre of mass; bead 0 is the striker",
    "contact_energy": "strain energy of striker and beads",
    "section_force": "force through the bead's central section, positive in compression",
    "vibration_energy": "kinetic and strain energy of the bead beyond its rigid motion",
}
"""Descriptions that differ from those of a CoSimulation's run."""

log = logging.getLogger("hertzlink.explicit_chain")


class _Frames(NamedTuple):
    """Times, s, what was saved at them, and what it took."""

    times: Any
    saved: kernels.Saved
    bead: ExplicitBead
    step: float
    seconds: float


def explicit_chain(
    chain: Chain, until: float, spacing: float | None = None, save_every: float | None = None, rigid_wall: bool = False
) -> xr.Dataset:
    """Return a chain of equal deformable beads, by explicit finite elements: slow, and the reference for faster models.

    Parameters
    ----------
    chain : Chain
        Equal bodies of revolution about the chain's axis, beads and striker (Sphere, HollowSphere, Ellipsoid along).
    until : float
        The time, s.
    spacing : float, optional
        Size of the cells at the contacts, m. By default a quarter of the radius of a contact that holds the whole
        impact energy: peak forces are then off by about 1 %, and do not converge evenly.
    save_every : float, optional
        The interval between saved times, s. By default 256 times in a contact.
    rigid_wall : bool
        Whether the last bead touches a rigid wall, or nothing.

    Returns
    -------
    Dataset
        The variables of a CoSimulation. Displacement and velocity are those of centres of mass, contact_energy is the
        strain energy, and forces are means over the saved interval around each saved time. Also section_force, N, and
        vibration_energy, J, over time and bead. Attributes: degrees_of_freedom, cells (of all bodies), step, s, spacing
        and reach of the contact's mesh, m, seconds (of the steps, without the set-up); and warnings, where a contact
        was so wide that strains were not small, or pressed beyond yield.

    Raises
    ------
    ValueError
        For unlike beads, gravity, preload, losses, laws and other strikers or integrators, for a save_every shorter
        than the step, and where contacts are wider than 0.4 of a radius.
    FloatingPointError
        If the state of a bead is no longer finite.

    Notes
    -----
    Quadratic elements on the true arc, lumped masses, small strains, no friction. Nodes that face each other close
    exactly: a multiplier removes the overlap that is predicted for the next step. This loses half the energy of the
    closing nodes' relative motion, `closing_loss`; nothing else is lost.

    References
    ----------
    Lumped masses: Hinton, Rock and Zienkiewicz, Earthquake Eng. Struct. Dyn. 4 (1976) 245.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.explicit_chain(hl.Chain([bead], bead, impact_speed=0.44), 2e-6, spacing=150e-6, save_every=1e-6)
    >>> dict(run.section_force.sizes)
    {'time': 3, 'bead': 2}
    """
    chain, until = _checked(chain), positive("until", until, "s")
    warn(check_before([MovingChain(chain, None)], until))
    bead: Any = chain.beads[0]
    instance("rigid_wall", rigid_wall, bool, "True or False")
    radius = _widest_contact(bead, chain.impact_energy, rigid_wall)
    size = radius / CELLS if spacing is None else positive("spacing", spacing, "m")
    if size * FEWEST > radius:
        caution(
            f"spacing = {readable(size, 'm')}: leaves contacts fewer than {FEWEST} cells; take "
            f"{readable(radius / CELLS, 'm')}"
        )
    interval, rows = _saved_times(chain, until, save_every)
    reach = max(MARGIN * radius, size)
    for _ in range(TRIES):
        cell_multiple = ceil(reach / size * (1.0 - 1e-9)) * size
        if cell_multiple > WIDEST * bead.radius:
            coarse = spacing is not None and MARGIN * radius <= WIDEST * bead.radius
            culprit = f"spacing = {spacing!r}" if coarse else f"impact_speed = {chain.impact_speed!r}"
            raise ValueError(f"{culprit}: contacts reach {cell_multiple:.3g} m, too wide for {bead!r}; take less")
        model = explicit_bead(bead, cell_multiple, size)
        step = SAFETY * model.stable_step
        if save_every is not None and interval < ROUNDED * step:
            raise ValueError(f"save_every = {interval!r}: must be no shorter than the step, {step:.3g} s")
        frames = _run(chain, model, interval, rows, rigid_wall)
        if frames is not None:
            inputs = {"chain": chain.describe(), "until": until, "save_every": interval, "rigid_wall": rigid_wall}
            return _dataset(chain, frames, {**inputs, "spacing": size}, {"spacing": size, "reach": cell_multiple})
        reach *= WIDENING
        log.info("bodies touch beyond the mesh's reach, which widens to %.3g m", reach)
    raise ValueError(
        f"impact_speed = {chain.impact_speed!r}: contacts are wider than {reach:.3g} m; take a lower speed"
    )


def _saved_times(chain: Chain, until: float, save_every: float | None) -> tuple[float, int]:
    """Return the time between them, s, and their number."""
    if save_every is None:
        interval, name = MovingChain(chain, None).contact_time / SAVED_PER_CONTACT, f"until = {until!r}"
    else:
        interval, name = positive("save_every", save_every, "s"), f"save_every = {save_every!r}"
    if save_every is not None and interval > until:
        raise ValueError(f"save_every = {save_every!r}: must not be longer than the run, until = {until!r} s")
    rows = int(until / interval * (1.0 + LATE)) + 1
    if rows * (len(chain.beads) + 1) > MOST_SAVED:
        raise ValueError(f"{name}: {rows} saved times of {len(chain.beads) + 1} bodies are too many")
    return interval, rows


def _run(chain: Chain, bead: ExplicitBead, interval: float, rows: int, wall: bool) -> _Frames | None:
    """Return the run on a mesh; None where bodies touch beyond its reach."""
    bodies, stride = len(chain.beads) + 1, ceil(interval / (SAFETY * bead.stable_step))
    stride += 1 - stride % 2
    step = interval / stride
    if rows * stride > MANY_STEPS:
        caution(f"until: the run takes {rows * stride:.2g} steps of {bodies} meshes")
    displacement, velocity = np.zeros((2, bead.mass.size, 2, bodies))
    velocity[:, 1, 0] = chain.speed
    saved = kernels.Saved(*(np.zeros((rows, bodies)) for _ in range(5)), *(np.zeros(rows) for _ in range(3)))
    model = kernels.Model(*(getattr(bead, name) for name in kernels.Model._fields))
    began = perf_counter()
    status = kernels.run(model, displacement, velocity, step, stride, bodies, wall, saved)
    seconds = perf_counter() - began
    if status == kernels.TOO_WIDE:
        return None
    if status == kernels.NON_FINITE:
        raise FloatingPointError("explicit_chain: the state of the beads is no longer finite")
    return _Frames(interval * np.arange(rows), saved, bead, step, seconds)


def _checked(chain: Chain) -> Chain:
    """Return the chain, or raise a ValueError that names what an explicit chain cannot have."""
    instance("chain", chain, Chain, "a Chain")
    if chain.striker is None or isinstance(chain.striker, Excitation):
        raise ValueError(f"striker = {chain.striker!r}: must be a bead like the others in an explicit chain")
    for name, bead in [("striker", chain.striker), *(("beads", bead) for bead in chain.beads)]:
        if bead != chain.beads[0]:
            raise ValueError(f"{name} = {bead!r}: must be equal to the first bead in an explicit chain")
    body_of(chain.beads[0], 1.0, "beads")
    for name, usual in (("gravity", 0.0), ("preload", 0.0), ("dissipation", None), ("law", None), ("damping", None)):
        if getattr(chain, name, usual) != usual:
            raise ValueError(f"{name} = {getattr(chain, name)!r}: must be {usual!r} in an explicit chain")
    if chain.integrator != "verlet":
        raise ValueError(f"integrator = {chain.integrator!r}: must be 'verlet', the central difference, here")
    return chain


def _widest_contact(bead: Bead, energy: float, wall: bool) -> float:
    """Return radius, m, of a contact that holds this energy (J), by Hertz's law at the force of the analytic one."""
    law = contact_law(bead, bead)
    # At a rigid wall half the compliance and twice the radius raise the force by 8^(1/5).
    return float(_radius(bead, law.force(law.overlap(np.array(energy))))) * (8.0 ** (1.0 / 15.0) if wall else 1.0)


def _radius(bead: Bead, force: Vector) -> Vector:
    """Return the radius of contacts, m, by Hertz's law; at a rigid wall it is the same."""
    hertz = PowerLaw(hertz_stiffness(bead.surface, bead.surface))
    return np.sqrt(np.asarray(hertz.approach(force)) / _curvature(bead))


def _curvature(bead: Bead) -> float:
    """Return the curvature of two beads against each other, 1/m."""
    return relative_curvatures(bead.surface, bead.surface)[1]


def _findings(bead: Bead, force: Vector, wall: bool) -> list[str]:
    """Return where strains were not small. force: saved times × contacts, N."""
    radius = _radius(bead, np.maximum(force, 0.0).max(axis=0))
    part = radius * _curvature(bead)
    if wall:
        part[-1] *= 0.5
    worst = int(part.argmax())
    if part[worst] <= SMALL_CONTACT:
        return []
    return [
        f"strains: contact {worst + 1} has a radius of {readable(float(radius[worst]), 'm')}, so wide that "
        "strains are not small"
    ]


def _dataset(chain: Chain, frames: _Frames, inputs: dict[str, Any], mesh: dict[str, float]) -> xr.Dataset:
    """Return the result of a run, with the variables that CoSimulation's has where they mean something here."""
    saved, bodies = frames.saved, len(chain.beads) + 1
    nothing = np.zeros(frames.times.size)
    values = {
        "displacement": saved.displacement, "velocity": saved.velocity, "contact_force": saved.contact_force,
        "kinetic_energy": saved.kinetic, "contact_energy": saved.strain, "dissipated_energy": nothing,
        "excitation_work": nothing, "structure_work": nothing, "structure_energy": nothing,
        "structure_dissipated_energy": nothing, "section_force": saved.section_force,
        "vibration_energy": saved.vibration, "closing_loss": saved.closing,
    }  # fmt: skip
    variables = {}
    for name, value in values.items():
        variables[name] = variable(name, value, description=DESCRIPTIONS.get(name, VARIABLES[name].description))
    coordinates = run_coordinates(frames.times, bodies, chain.centres, np.zeros(bodies), chain.impact_energy)
    free = 2 * frames.bead.mass.size - int(frames.bead.held.sum())
    attributes: dict[str, Any] = {
        "degrees_of_freedom": bodies * free, "cells": bodies * frames.bead.cells, "step": frames.step, **mesh,
        "seconds": frames.seconds,
    }  # fmt: skip
    findings = _findings(chain.beads[0], saved.contact_force, inputs["rigid_wall"])
    moving, peaks = MovingChain(chain, None), saved.contact_force.max(axis=0)
    motion = Motion(range(peaks.size), saved.contact_force.T[None], None, peaks[None], moving.approach(peaks)[None])
    findings += [words for _, words in yields([[moving]], [motion], np.empty(0))]
    warn(findings)
    return with_warnings(xr.Dataset(variables, coordinates, {**provenance(inputs), **attributes}), findings)
