"""How wrong a run is because of its windows and steps, its mesh and its reduction: runs with each of them refined."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from math import isnan, nan
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import LINE
from coupling.plan import Adaptive, Plan
from coupling.results.ar_and_tof import NUMERICAL_ERROR, amplitude_ratio, time_of_flight
from coupling.results.findings import findings_of, warn
from coupling.results.measures import contact_time
from coupling.sweeps.sweep import check_build
from structures.caution import collected
from structures.checks import html_table, instance, positive, whole
from structures.fineness import finer
from structures.linear_algebra.one_thread import one_thread
from structures.structure import Structure
from structures.units import readable

TIME, MESH, REDUCTION = "time", "mesh", "reduction"

RICHARDSON = 4.0 / 3.0
"""An error over its change when lengths are halved, by Richardson's extrapolation: at order 2 it falls to a quarter."""

REPEATED = 1e-6
"""Part by which measures of two runs of the same parameters may differ, by rounding."""

TIGHTER = 1e-2
"""Factor of the tolerance with which a reduction counts as exact."""


class Measure(NamedTuple):
    """What is read from a run at a sensor: its name in tables, the unit there in its SI unit, and the function."""

    label: str
    unit: float
    read: Callable[[xr.Dataset, int], Any]


MEASURES = {
    "amplitude_ratio": Measure("AR", 1.0, amplitude_ratio),
    "time_of_flight": Measure("TOF, µs", 1e-6, time_of_flight),
    "secondary_amplitude_ratio": Measure("secondary AR", 1.0, partial(amplitude_ratio, wave="secondary")),
    "secondary_time_of_flight": Measure("secondary TOF, µs", 1e-6, partial(time_of_flight, wave="secondary")),
    "contact_time": Measure("contact time, µs", 1e-6, lambda run, sensor: contact_time(run)),
}


@dataclass(frozen=True)
class NumericalError:
    """Measures of a run, and estimates of their errors by source; returned by `numerical_error`.

    Parameters
    ----------
    sensor : int
        The bead.
    values : dict
        "amplitude_ratio", "time_of_flight" (s), both also of the secondary wave as "secondary_amplitude_ratio", and
        "contact_time" (s); what the run does not have is left out.
    parts : dict
        The errors, value less true value, by source and then by measure: "time" of windows, steps and saved times,
        "mesh", "reduction". NaN where a source is not estimated, zero where there is none.
    notes : dict
        What was refined, by source, or why it was not.
    warnings : list of str
        What the user must know.

    Examples
    --------
    >>> from coupling.inference.numerical_error import NumericalError
    >>> parts = {"time": {"amplitude_ratio": 1e-5}, "mesh": {"amplitude_ratio": -3e-4}}
    >>> print(NumericalError(7, {"amplitude_ratio": 0.5}, parts))
    bead 7  value         ±    time     mesh       sum
    AR        0.5  ± 0.0003  +1e-05  -0.0003  -0.00029
    """

    sensor: int
    values: dict[str, float]
    parts: dict[str, dict[str, float]]
    notes: dict[str, str] = field(default_factory=dict, repr=False)
    warnings: list[str] = field(default_factory=list)

    @property
    def sums(self) -> dict[str, float]:
        """The sums of the errors of all sources, by measure; what is not estimated counts as zero."""
        return {name: float(np.nansum([part[name] for part in self.parts.values()])) for name in self.values}

    @property
    def margins(self) -> dict[str, float]:
        """The roots of the sums of their squares, by measure: that errors may cancel is not relied on.

        Where a source is not estimated a margin is the least that the error may be.
        """
        squares = {name: [part[name] ** 2 for part in self.parts.values()] for name in self.values}
        return {name: float(np.nansum(square) ** 0.5) for name, square in squares.items()}

    def noted_in(self, run: xr.Dataset) -> xr.Dataset:
        """Return a run of the same simulation with these margins, which `reflections` and reports then show."""
        instance("run", run, xr.Dataset, "a run")
        noted = json.loads(run.attrs.get(NUMERICAL_ERROR, "{}"))
        margins = {name: margin for name, margin in self.margins.items() if not self._lacks(name)}
        noted[str(self.sensor)] = {"margins": margins, "text": str(self)}
        return run.assign_attrs({NUMERICAL_ERROR: json.dumps(noted)})

    def __str__(self) -> str:
        rows = [(f"bead {self.sensor}", "value", "±", *self.parts, "sum"), *self._rows()]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in rows]
        notes = [f"{source}: {note}" for source, note in self.notes.items()]
        notes += [f"note: {warning}" for warning in self.warnings if warning not in notes]
        return "\n".join(lines + [fill(note, LINE, subsequent_indent="  ") for note in notes])

    def _repr_html_(self) -> str:
        rows = [(label, f"{value} {margin}") for label, value, margin, *_ in self._rows()]
        return html_table(f"Numerical error at bead {self.sensor}", rows)

    def _rows(self) -> list[tuple[str, ...]]:
        """Return the measures as text: name, value, margin, errors by source, and their sum."""
        rows = list[tuple[str, ...]]()
        for name, value in self.values.items():
            label, unit, _ = MEASURES[name]
            errors = [*(part[name] for part in self.parts.values()), self.sums[name]]
            shown = ["unknown" if isnan(error) else f"{error / unit:+.2g}" if error else "0" for error in errors]
            sign = "≥" if self._lacks(name) else "±"
            rows.append((label, f"{value / unit:.7g}", f"{sign} {self.margins[name] / unit:.2g}", *shown))
        return rows

    def _lacks(self, name: str) -> bool:
        """Return whether a source of a measure's error is not estimated."""
        return any(isnan(part[name]) for part in self.parts.values())


@one_thread
def numerical_error(build: Callable[..., CoSimulation], until: float, sensor: int, **parameters: Any) -> NumericalError:
    """Estimate how wrong AR, TOF and contact time are because of windows and steps, the mesh, and the reduction.

    Runs the simulation again with half the window, step and saved interval; with cells half as long; and with a
    reduction to a hundredth of its tolerance. The changes are the errors, times 4/3 where halving leaves a quarter.

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
        Values, margins, and errors by source; ``print`` shows a table. The true value is that of the same model: what
        a theory neglects is no part of the error.

    Raises
    ------
    ValueError
        If build does not take the parameters, depends on chance or returns something else, and for what
        `CoSimulation.run` refuses.

    Warns
    -----
    HertzlinkWarning
        If a source is not estimated: meshes of files, matrices and solvers of a user, and structures that build does
        not make itself. Of what the run itself warns of.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(length):
    ...     rod = hl.rod([hl.Layer(hl.PTFE, length, radius=9.525e-3)])
    ...     return hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.3), hl.reduce(rod, until=1e-3))
    >>> error = hl.numerical_error(build, until=1e-3, sensor=8, length=0.05)
    >>> error.margins["amplitude_ratio"] < 1e-4
    True
    """
    until, sensor = positive("until", until, "s"), whole("sensor", sensor)
    check_build(build, parameters, names="parameters")
    usual = _built(build, until, parameters)
    last = len(usual.chain.chain.beads)
    if sensor > last:
        raise ValueError(f"sensor = {sensor}: must be a bead from 1 to {last}, counted from the struck end")
    saved = sorted({sensor, last})
    run = usual.run(until, sensors=saved)
    with collected() as said:
        values = _measured(run, sensor)
    with collected():
        finer_reduction, reduction_factor, of_reduction = _finer(REDUCTION, usual, build, until, parameters)
        finer_mesh, mesh_factor, of_mesh = _finer(MESH, usual, build, until, parameters)
        plan = usual.plan(until)
        shorter = _measured(halved(usual, plan).run(until, plan.interval / 2.0, sensors=saved), sensor)
        again = usual if finer_mesh is finer_reduction else _built(build, until, parameters)
        *of_finer, repeated = (
            values if other is usual else _measured(other.run(until, sensors=saved), sensor)
            for other in (finer_mesh, finer_reduction, again)
        )
    changes = {
        TIME: (RICHARDSON, shorter),
        MESH: (mesh_factor, of_finer[0]),
        REDUCTION: (reduction_factor, of_finer[1]),
    }
    present = {name: value for name, value in values.items() if not isnan(value)}
    for name, value in present.items():
        if not abs(repeated[name] - value) <= REPEATED * abs(value):
            label, unit, _ = MEASURES[name]
            raise ValueError(
                f"build(...): depends on chance; {label} = {value / unit:.9g} of one call and "
                f"{repeated[name] / unit:.9g} of the next, with the same values; must return the same at each call"
            )
    parts = {
        source: {name: factor * (values[name] - refined[name]) for name in present}
        for source, (factor, refined) in changes.items()
    }
    notes = {TIME: "windows, steps and saved intervals halved", MESH: of_mesh, REDUCTION: of_reduction}
    warnings = list(dict.fromkeys(said))
    warnings += [f"{source}: {notes[source]}" for source, (factor, _) in changes.items() if isnan(factor)]
    warnings += [
        f"{source}: {MEASURES[name].label} has no error, as the finer run does not have this wave"
        for source, part in parts.items()
        for name, error in part.items()
        if isnan(error) and not isnan(changes[source][0])
    ]
    if "amplitude_ratio" not in present:
        warnings.append(f"waves: none returns to bead {sensor} until {readable(until, 's')}")
    warn(warnings)
    return NumericalError(sensor, present, parts, notes, [*findings_of(run), *warnings])


def _built(
    build: Callable[..., CoSimulation], until: float, parameters: Mapping[str, Any], **factors: Any
) -> CoSimulation:
    """Return what a builder makes for a run up to `until`, s, with finer cells or reductions."""
    with finer(**factors):
        built = instance("build(...)", build(**parameters), CoSimulation, "a CoSimulation").for_run(until)
    if len(built.interface.chains) > 1:
        raise ValueError(f"build(...) = {built!r}: must be the CoSimulation of one chain")
    return built


def _measured(run: xr.Dataset, sensor: int) -> dict[str, float]:
    return {name: float(measure.read(run, sensor)) for name, measure in MEASURES.items()}


def halved(simulation: CoSimulation, plan: Plan) -> CoSimulation:
    """Return a simulation with windows and steps of half the length."""
    windows: dict[str, Any] = {"window": plan.length / 2.0}
    if isinstance(simulation.window, Adaptive):
        # A window's error, of a chord to a parabola, grows as its length squared: a quarter is half the window.
        windows = {"window": Adaptive(simulation.window.tolerance / 4.0)}
    return simulation.replace(**windows, dt=plan.length / simulation.chain.steps(plan.length) / 2.0)


def _finer(
    source: str, usual: CoSimulation, build: Callable[..., CoSimulation], until: float, parameters: Mapping[str, Any]
) -> tuple[CoSimulation, float, str]:
    """Return a simulation with one source refined, the factor that makes the change an error, and what was refined.

    The factor is zero where there is nothing to refine, and NaN where something was not refined.
    """
    having = [i for i, body in enumerate(usual.interface.structures) if _has(source, body.structure)]
    if not having:
        return usual, 0.0, "none"
    factors: dict[str, Any] = {"cells": 2} if source == MESH else {"tolerance": TIGHTER}
    try:
        fine = _built(build, until, parameters, **factors)
    except ValueError as error:  # too many cells: those of the user are near the limit
        return usual, nan, f"not estimated; {error}"
    for i in having:
        old, new = (simulation.interface.structures[i].structure for simulation in (usual, fine))
        if old is None or _same(old, new):
            which = "solver" if old is None else old.origin.get("kind", "structure of a user")
            return usual, nan, f"not estimated; build does not make the {which} anew, or it cannot be made finer"
    return (fine, RICHARDSON, "cells halved") if source == MESH else (fine, 1.0, "to a hundredth of its tolerance")


def _has(source: str, structure: Structure | None) -> bool:
    """Return whether a structure has a mesh, or a reduction that may be wrong; of a user's solver nobody knows."""
    if structure is None:
        return source == MESH
    if source == MESH:
        return bool(structure.mass.count_nonzero())  # a mesh has mass; closed forms, as of the half-space, have none
    report: Any = structure.origin.get("reduction")
    return report is not None and report["error_estimate"] > TIGHTER * report["tolerance"]


def _same(one: Structure, other: Structure) -> bool:
    """Return whether two structures have the same matrices."""
    return np.array_equal(one.contact, other.contact) and np.array_equal(one.stiffness.data, other.stiffness.data)
