"""Numerical errors of a run from windows and steps, the mesh, and the reduction, by runs with each of them refined."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from math import isnan, nan
from typing import Any, TypeAlias

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import Printed, as_text
from coupling.plan import Adaptive, Plan
from coupling.results.ar_and_tof import NUMERICAL_ERROR, amplitude_ratio, time_of_flight
from coupling.results.findings import findings_of, warn
from coupling.results.measures import contact_time
from coupling.sweeps.sweep import built_at, check_build
from structures.caution import collected
from structures.checks import positive, whole
from structures.fineness import finer
from structures.linear_algebra.one_thread import one_thread
from structures.structure import Vector
from structures.units import readable

TIME, MESH, REDUCTION = "time", "mesh", "reduction"
REFINED = {
    TIME: "windows, steps and saved intervals halved twice", MESH: "cells halved",
    REDUCTION: "to a hundredth of its tolerance",
}  # fmt: skip
# An error over its change is 1/(1 − n^−p) at order p, if lengths are n times as short. The order of cells is 2 or more.
# That of steps is 2, but 1 for times at which a force passes a level, and for losses that begin as a contact closes.
RICHARDSON = 4.0 / 3.0  # n = 2, p = 2
TIGHTER = 1e-2  # Factor of the tolerance of an exact reduction.

# A simulation with one source refined, its saved interval, s, and the error of the usual run over the change.
Finer: TypeAlias = tuple[CoSimulation, float | None, float]

# Measures of a run at a sensor: the name in tables, the unit there, and the function.
MEASURES: dict[str, tuple[str, float, Callable[[xr.Dataset, int], Any]]] = {
    "amplitude_ratio": ("AR", 1.0, amplitude_ratio),
    "time_of_flight": ("TOF, µs", 1e-6, time_of_flight),
    "secondary_amplitude_ratio": ("secondary AR", 1.0, partial(amplitude_ratio, wave="secondary")),
    "secondary_time_of_flight": ("secondary TOF, µs", 1e-6, partial(time_of_flight, wave="secondary")),
    "contact_time": ("contact time, µs", 1e-6, lambda run, sensor: contact_time(run)),
}


@dataclass(frozen=True, repr=False)
class NumericalError(Printed):
    """Measures of a run, and estimates of their errors by source; returned by `numerical_error`.

    Parameters
    ----------
    sensor : int
        The bead.
    values : dict
        The measures by name, as in `MEASURES`; measures that the run does not have are left out.
    parts : dict
        The errors, value minus true value, by source ("time", "mesh", "reduction") and measure; NaN if not estimated.
    notes : dict
        For each source what was refined, or why nothing was.
    warnings : list of str
        Warnings for the user.
    """

    sensor: int
    values: dict[str, float]
    parts: dict[str, dict[str, float]]
    notes: dict[str, str] = field(default_factory=dict, repr=False)
    warnings: list[str] = field(default_factory=list)

    @property
    def margins(self) -> dict[str, float]:
        """The sum of the sizes of the errors of each measure; a lower bound if a source is not estimated."""
        return {name: float(np.nansum(abs(self._errors(name)))) for name in self.values}

    def _errors(self, name: str) -> Vector:
        return np.array([part[name] for part in self.parts.values()])

    def noted_in(self, run: xr.Dataset) -> xr.Dataset:
        """Return a run of the same simulation with these margins, which `reflections` and reports then show."""
        noted = json.loads(run.attrs.get(NUMERICAL_ERROR, "{}"))
        margins = {name: margin for name, margin in self.margins.items() if np.isfinite(self._errors(name)).all()}
        noted[str(self.sensor)] = {"margins": margins, "text": str(self)}
        return run.assign_attrs({NUMERICAL_ERROR: json.dumps(noted)})

    def __str__(self) -> str:
        rows = [(f"bead {self.sensor}", "value", "±", *self.parts)]
        for name, value in self.values.items():
            label, unit, _ = MEASURES[name]
            errors = self._errors(name)
            shown = ["unknown" if isnan(error) else f"{error / unit:+.2g}" if error else "0" for error in errors]
            sign = "≥" if np.isnan(errors).any() else "±"
            rows.append((label, f"{value / unit:.7g}", f"{sign} {self.margins[name] / unit:.2g}", *shown))
        notes = [f"{source}: {note}" for source, note in self.notes.items()]
        notes += [f"note: {warning}" for warning in self.warnings if warning not in notes]
        return as_text(rows, notes, are_numbers=True)


@one_thread
def numerical_error(build: Callable[..., CoSimulation], until: float, sensor: int, **parameters: Any) -> NumericalError:
    """Estimate how wrong AR, TOF and contact time are because of windows and steps, the mesh, and the reduction.

    Runs the simulation again with half and a quarter of the window, step and saved interval; with cells half as long;
    and with a reduction to a hundredth of its tolerance. The errors are the changes by these, times the factor 2, 4/3,
    4/3 and 1. The larger one of the first two counts.

    Parameters
    ----------
    build : callable
        Returns the CoSimulation of one chain. It makes the structure and its reduction anew at each call.
    until : float
        Length of the record, s.
    sensor : int
        Number of the bead, 1 to N from the struck end.
    **parameters
        Arguments of build.

    Returns
    -------
    NumericalError
        Values, margins, and errors by source; ``print`` shows a table. The true value is that of the same model: the
        error does not include what the theory neglects.

    Warns
    -----
    HertzlinkWarning
        If a source cannot be estimated, for example a mesh from a file, given matrices, or a user's solver.

    Raises
    ------
    ValueError
        If build does not take the parameters, depends on chance, or does not return the CoSimulation of one chain.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(length):
    ...     rod = hl.rod([hl.Layer(hl.PTFE, length, radius=9.525e-3)])
    ...     return hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.3), hl.reduce(rod, until=1e-3))
    >>> error = hl.numerical_error(build, until=1e-3, sensor=8, length=0.05)
    >>> error.margins["amplitude_ratio"] < 1e-4
    True
    """
    until, sensor = positive("until", until, "s"), whole("sensor", sensor)
    check_build(build, parameters, "parameters")

    def built(**factors: Any) -> CoSimulation:
        with finer(**factors):
            return built_at(build, parameters).for_run(until)

    def measured(run: xr.Dataset) -> dict[str, float]:
        return {name: float(read(run, sensor)) for name, (_, _, read) in MEASURES.items()}

    usual = built()
    saved, plan = sorted({sensor, len(usual.chain.chain.beads)}), usual.plan(until)
    run = usual.run(until, sensors=saved)
    with collected() as said:
        values = {name: value for name, value in measured(run).items() if not isnan(value)}
    parts, notes, warnings = dict[str, dict[str, float]](), dict[str, str](), list(dict.fromkeys(said))
    with collected():
        again = measured(built().run(until, sensors=saved))
        for name, value in values.items():
            if not abs(again[name] - value) <= 1e-6 * abs(value):
                label, unit, _ = MEASURES[name]
                raise ValueError(
                    f"build(...): depends on chance; {label} = {value / unit:.9g} of one call and "
                    f"{again[name] / unit:.9g} of the next, with the same values; must return the same at each call"
                )
        for source, words in REFINED.items():
            try:
                fine = _finer_in_time(usual, plan) if source == TIME else _finer_structures(source, usual, built)
            except ValueError as error:
                notes[source], parts[source] = f"not estimated; {error}", dict.fromkeys(values, nan)
                warnings.append(f"{source}: {notes[source]}")
                continue
            notes[source] = words if fine else "none"
            refined = [(share, measured(one.run(until, interval, sensors=saved))) for one, interval, share in fine]
            parts[source] = {}
            for name, value in values.items():
                # Where a loss makes forces jump, one finer run may have the same error by chance, but hardly both.
                errors = [0.0, *(share * (value - found[name]) for share, found in refined)]
                parts[source][name] = float(errors[np.argmax(np.abs(errors))])
            if lost := [MEASURES[name][0] for name, error in parts[source].items() if isnan(error)]:
                why = "because the finer run does not have this wave"
                warnings.append(f"{source}: {', '.join(lost)} not estimated, {why}")
    if "amplitude_ratio" not in values:
        warnings.append(f"waves: no wave returns to bead {sensor} within {readable(until, 's')}; give a longer until")
    warn(warnings)
    return NumericalError(sensor, values, parts, notes, [*findings_of(run), *warnings])


def _finer_in_time(usual: CoSimulation, plan: Plan) -> list[Finer]:
    """Return a simulation with half, and one with a quarter, of the window, the step and the saved interval."""
    step, fine = plan.length / usual.chain.steps(plan.length), list[Finer]()
    for times in (2.0, 4.0):
        window: Any = plan.length / times
        if isinstance(usual.window, Adaptive):
            window = Adaptive(usual.window.tolerance / times**2)  # it grows with the square of the length
        fine.append((usual.replace(window=window, dt=step / times), plan.interval / times, times / (times - 1.0)))
    return fine


def _finer_structures(source: str, usual: CoSimulation, built: Callable[..., CoSimulation]) -> list[Finer]:
    """Return a simulation whose structures have a finer mesh or reduction, or none if they have neither. Raises a
    ValueError if they cannot be refined."""
    structures = [body.structure for body in usual.interface.structures]
    if source == MESH:
        # A mesh has mass; closed forms, such as the half-space, have none. A user's solver may have a mesh.
        having = [one is None or bool(one.mass.count_nonzero()) for one in structures]
    else:
        reports = [{} if one is None else one.origin.get("reduction") or {} for one in structures]
        having = [one.get("error_estimate", 0.0) / one.get("tolerance", 1.0) > TIGHTER for one in reports]
    if not any(having):
        return []

    factors, share = ({"cells": 2}, RICHARDSON) if source == MESH else ({"tolerance": TIGHTER}, 1.0)
    fine = built(**factors)  # fails if the user's mesh is near the limit of cells
    for old, body, has_it in zip(structures, fine.interface.structures, having, strict=True):
        new = body.structure
        same = old is not None and np.array_equal(old.contact, new.contact)
        if has_it and (old is None or (same and np.array_equal(old.stiffness.data, new.stiffness.data))):
            which = "solver" if old is None else old.origin.get("kind", "structure of a user")
            raise ValueError(f"build does not make the {which} anew, or it cannot be made finer")
    return [(fine, None, share)]
