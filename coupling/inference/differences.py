"""Derivatives of runs: central differences, over steps of several sizes where one does not tell them from a kink.

The runs of a difference have the windows, steps and saved times of the run between them, so that they differ by the
parameter alone.
"""

from collections.abc import Callable, Mapping
from itertools import chain as joined
from math import inf
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.plan import Plan
from coupling.recording.frames import kept_at
from coupling.sweeps.batch import records
from structures.caution import collected
from structures.structure import Vector
from structures.units import readable

Build: TypeAlias = Callable[..., CoSimulation]
"""A function of parameters; it may have `units`, the SI units of these by name, for messages."""

STEPS, SMOOTH = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2), 0.01
"""Of a parameter, in parts of its value; and the part of a derivative by which those of both sides may differ from it:
where they differ more, as by rounding, a larger step is taken. Contacts that open bend traces, so that the error grows
with the step."""

STEPS_WITH_LOSSES, SMOOTH_WITH_LOSSES = (1e-2, 3e-3, 1e-3), 0.05
"""The same of a chain with losses. These begin at the first step after a contact closes, so that traces jump by what
they do in a part of a step; a large difference contains many such jumps, and their mean. Its error is of second order
in by how much the sides differ."""

NEGLIGIBLE = 1e-3
"""Part of a quantity: less of it does not matter, for a parameter that changes by as much as it is."""


OF_RUNS = ["contact_force", "velocity", "static_force", "centre", "impact_energy"]
"""What measures use of runs, as the first of `Records`."""


class Derivative(NamedTuple):
    """Derivatives of what measures use, by its name.

    doubt: the part by which those of the force on either side differ from it, zero where they hardly do.
    """

    slopes: dict[str, Vector]
    doubt: float


def differences(
    build: Build, values: Mapping[str, float], simulation: CoSimulation, plan: Plan, run: xr.Dataset
) -> dict[str, Derivative]:
    """Return the derivatives of a run by each parameter of the function that builds it.

    values: at which the function returned `simulation`, which gave `run` by `plan`. Raises a ValueError where one of
    the other runs fails.
    """
    chain, here = simulation.chain, run.contact_force.values
    settings = {"window": plan.length, "dt": plan.length / chain.steps(plan.length)}
    until, beads = plan.interval * (plan.rows - 1), len(chain.chain.beads)
    kept = kept_at(run.bead.values.tolist(), beads)
    found, failures, left = dict[str, Derivative](), dict[str, str](), list(values)
    steps, smooth = (STEPS_WITH_LOSSES, SMOOTH_WITH_LOSSES) if jumps(simulation) else (STEPS, SMOOTH)
    for step in steps:
        pairs = dict[str, list[CoSimulation]]()
        for name in left:
            try:
                pairs[name] = [_near(build, values, name, part, settings) for part in (step, -step)]
            except ValueError as error:
                failures.setdefault(name, str(error))
        if not pairs:
            continue
        rows = list(joined(*pairs.values()))
        with collected():  # these runs are not those of the user
            runs = records(lambda run: run, until, plan.interval, kept, beads, {"run": rows})
        for place, name in enumerate(pairs):
            pair = {key: part[2 * place : 2 * place + 2] for key, part in zip(OF_RUNS, runs.columns, strict=True)}
            above, below = pair["contact_force"]
            if np.isnan(above + below).any():
                failures[name] = f"{name}: a run near its value fails: {runs.failures[0]}"
                continue
            slopes = {key: (part[0] - part[1]) / (2.0 * step * values[name]) for key, part in pair.items()}
            bend = abs(above - 2.0 * here + below).mean() / (2.0 * step)
            size = abs(slopes["contact_force"] * values[name]).mean()
            doubt = 0.0 if bend <= max(NEGLIGIBLE * abs(here).mean(), smooth * size) else bend / size if size else inf
            if name not in found or doubt < found[name].doubt:
                found[name] = Derivative(slopes, float(doubt))
        left = [name for name in left if name not in found or found[name].doubt]
        if not left:
            break
    for name in values:
        if name not in found:
            raise ValueError(failures[name])
    return {name: found[name] for name in values}


def jumps(simulation: CoSimulation) -> bool:
    """Return whether a run jumps with a parameter, as losses begin at the first step after a contact closes."""
    loss = simulation.chain.chain.dissipation
    return loss is not None and loss.piece != "drag"


def _near(
    build: Build, values: Mapping[str, float], name: str, part: float, settings: Mapping[str, Any]
) -> CoSimulation:
    """Return the run whose parameter of this name is larger by a part of its value; errors say at which value."""
    try:
        return build(**{**values, name: values[name] * (1.0 + part)}).replace(**settings)
    except (ArithmeticError, ValueError) as error:
        shown = readable(values[name], units_of(build).get(name, ""), 6)
        needs = f"fails at {shown} {100.0 * part:+g} %, which a derivative by differences needs"
        raise ValueError(f"{name}: build {needs}: {error}") from None


def units_of(build: Build) -> dict[str, str]:
    """Return the SI units of a builder's parameters, by name, as far as it states them."""
    return dict(getattr(build, "units", {}))
