"""Derivatives of AR, TOF and traces by parameters of the function that builds a run. The runs of a difference have the
windows, steps and saved times of the central run, so that they differ by the parameter alone."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from math import inf
from typing import NamedTuple, TypeAlias

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.engine import is_compiled
from coupling.plan import Adaptive, Plan
from coupling.recording.frames import kept_at
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import warn, with_warnings
from coupling.sweeps.batch import Measure, Records, as_measures
from coupling.sweeps.sweep import built_at, check_build
from structures.caution import collected
from structures.checks import finite, function, positive
from structures.linear_algebra.one_thread import one_thread
from structures.structure import Vector
from structures.units import readable

# A function of parameters. Its attribute `units`, if any, gives the SI units of the parameters by name, for messages.
Build: TypeAlias = Callable[..., CoSimulation]


class Derivative(NamedTuple):
    """The derivatives by a parameter."""

    slopes: dict[str, Vector]  # derivatives of force, velocity and measures
    doubt: float  # relative difference of the force's derivatives from both sides, zero if they agree
    bent: list[str]  # measures whose derivatives from both sides differ


@one_thread
def sensitivities(
    build: Build, until: float, sensors: Iterable[int], measure: Measure | None = None, save_every: float | None = None,
    **parameters: float,
) -> xr.Dataset:  # fmt: skip
    """Return a run with its derivatives by parameters of the function that builds it: central differences.

    Parameters
    ----------
    build : callable
        Takes the parameters by name and returns a CoSimulation on linear structures that are small (see `reduce`).
    until : float
        Length of the run, s.
    sensors : sequence of int
        Numbers of the beads to keep, each with its two contacts.
    measure : callable, optional
        Takes a Dataset of runs, with the dimension "run", and returns the Dataset or DataArray to differentiate, such
        as ``lambda runs: hl.time_of_flight(runs, sensor=7)``. By default AR and TOF of the primary wave at each sensor.
    save_every : float, optional
        Time between saved samples, s, as in `CoSimulation.run`.
    **parameters : float
        The values of the parameters at which to differentiate, in SI units; none of them may be zero.

    Returns
    -------
    Dataset
        The run that `CoSimulation.run` returns, and the measures. Each measure, `contact_force` and `velocity` has a
        variable `…_derivative` over the dimension "parameter", in its unit per SI unit of the parameter.

    Warns
    -----
    HertzlinkWarning
        If the derivatives from both sides differ: at a kink or jump, by chance, and with losses in contacts.

    Raises
    ------
    ValueError
        For parameters that are zero or near which build fails, adaptive windows, and participants, which are
        solvers of the user's own.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(modulus, impact_speed):
    ...     wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    ...     return hl.CoSimulation(hl.Chain([bead] * 12, bead, impact_speed), wall)
    >>> change = hl.sensitivities(build, until=6e-4, sensors=[6], modulus=3e9, impact_speed=0.3)
    >>> tof = change.time_of_flight_derivative.sel(parameter="impact_speed", sensor=6)
    >>> print(f"TOF changes by {1e6 * 0.01 * float(tof):.2f} µs for 0.01 m/s")
    TOF changes by -2.51 µs for 0.01 m/s
    """
    check_build(build, parameters, "parameters", "thickness=2e-3")
    values, until = {name: finite(name, value) for name, value in parameters.items()}, positive("until", until, "s")
    if zero := [name for name, value in values.items() if value == 0.0]:
        raise ValueError(f"{zero[0]} = 0: must not be zero, because the steps of a difference are parts of the value")
    simulation = built_at(build, values).for_run(until)
    if isinstance(simulation.window, Adaptive) or not is_compiled(simulation.interface, simulation.scheme):
        raise ValueError(
            f"build(...) = {simulation!r}: has no derivatives; it needs Condensed(), windows of a fixed length, and "
            "structures that are linear and small or reduced"
        )

    plan, loss = simulation.plan(until, save_every), simulation.chain.chain.dissipation
    jumps = loss is not None and loss.piece != "drag"
    with collected() as said:
        run = simulation.run(until, save_every, sensors=sensors)
    usual = partial(primary_waves, run.bead.values.tolist())
    read = function("measure", measure or usual, 1, "a function of a Dataset of runs")
    rates, data = differences(build, values, simulation, plan, run, read, jumps)
    with collected() as of_measure:
        here = as_measures(read(data.isel(run=[0])), 1, run.variables).isel(run=0, drop=True)

    findings = list(dict.fromkeys([*said, *of_measure]))
    for name, rate in rates.items():
        if rate.doubt:
            findings.append(
                f"{name}: has no derivative here, or an inexact one; the derivatives from both sides differ by "
                f"{readable(200.0 * rate.doubt, '', 1)} %. Perhaps build jumps, has a kink or depends on chance, a "
                "mesh or a reduction changes, or a loss begins as a contact closes"
            )
        elif not (rate.slopes["contact_force"].any() or rate.slopes["velocity"].any()):
            findings.append(f"{name}: changes nothing in this run")
        findings += [
            f"{measure}: has no derivative by {name} here; the derivatives from both sides differ, perhaps because "
            "another peak of a wave becomes the greatest"
            for measure in rate.bent
        ]
    if jumps:
        findings.append(
            "dissipation: losses begin at the first step after a contact closes, so that runs jump with a parameter; "
            "derivatives are slopes over 0.1 to 1 % of its value, with errors of a few per cent of the largest"
        )
    warn(findings)
    run = run.assign(here.data_vars)
    for name in ("contact_force", "velocity", *here.data_vars):
        units = {"units": f"{run[name].attrs.get('units', '1')} per unit of the parameter"}
        slopes = np.stack([rate.slopes[str(name)] for rate in rates.values()])
        run[f"{name}_derivative"] = ("parameter", *run[name].dims), slopes, units
    value = "parameter", list(values.values()), {"long_name": "value at which the run is differentiated"}
    return with_warnings(run.assign_coords(parameter=list(values), parameter_value=value), findings)


def differences(
    build: Build, values: Mapping[str, float], simulation: CoSimulation, plan: Plan, run: xr.Dataset, measure: Measure,
    jumps: bool,
) -> tuple[dict[str, Derivative], xr.Dataset]:  # fmt: skip
    """Return the derivatives of a run by each parameter, and the runs of the last differences; the first of them is the
    run itself. jumps: whether runs jump slightly with a parameter, as with losses in contacts."""
    settings = {"window": plan.length, "dt": plan.length / simulation.chain.steps(plan.length)}
    until, beads = plan.interval * (plan.rows - 1), len(simulation.chain.chain.beads)
    kept, left = kept_at(run.bead.values.tolist(), beads), list(values)
    found, failures = dict[str, Derivative](), dict[str, str]()
    # If the derivatives from both sides differ, perhaps by rounding, a larger step follows. Contacts that open bend
    # traces, so that the error grows with the step. With jumps, a large step averages over many of them.
    for step in (1e-2, 3e-3, 1e-3) if jumps else (1e-6, 1e-5, 1e-4, 1e-3, 1e-2):
        # The run at x, then for each parameter that is left those at x (1 + step) and x (1 − step).
        rows = [{**values}]
        for name in left:
            rows += [{**values, name: values[name] * (1.0 + side * step)} for side in (1.0, -1.0)]
        columns = {name: [row[name] for row in rows] for name in values}
        with collected():  # the user did not ask for these runs
            runs = Records(lambda **row: build(**row).replace(**settings), columns, until, plan.interval, kept, beads)
            runs.fill(1)
            data = runs.dataset().drop_vars(list(values)).assign_attrs(run.attrs)
            measures = as_measures(measure(data), len(rows), run.variables)
        quantities = {"contact_force": runs.force, "velocity": runs.velocity}
        for key, value in measures.data_vars.items():
            if {"run", "parameter"} & {*value.dims} != {"run"} or key in run.variables:
                raise ValueError(
                    f"measure(runs): {key} has the dimensions {dict(value.sizes)}; must keep run, have no dimension "
                    "parameter, and have a name that a run does not use"
                )
            quantities[str(key)] = value.transpose("run", ...).values

        for name, above in zip(left, range(1, len(rows), 2), strict=True):
            if reasons := [str(failure) for failure in runs.failures[above : above + 2] if failure]:
                shown = readable(values[name], getattr(build, "units", {}).get(name, ""), 6)
                failures.setdefault(
                    name,
                    f"{name}: build fails at {shown} ± {100.0 * step:g} %, where a difference needs it: {reasons[0]}",
                )
                continue
            at = {key: (part[above + 1], part[0], part[above]) for key, part in quantities.items()}
            derivative = _central(at, values[name], step, jumps)
            if name not in found or derivative.doubt < found[name].doubt:
                found[name] = derivative
        left = [name for name in left if name not in found or found[name].doubt]
        if not left:
            break
    if missing := [name for name in values if name not in found]:
        raise ValueError(failures[missing[0]])
    return {name: found[name] for name in values}, data


def _central(at: Mapping[str, tuple[Vector, Vector, Vector]], value: float, step: float, jumps: bool) -> Derivative:
    """Return the derivatives by central differences. at: each quantity f at x (1 − step), at x, and at x (1 + step)."""
    slopes, bends, bent = dict[str, Vector](), dict[str, Vector](), list[str]()
    for key, (below, here, above) in at.items():
        slopes[key] = (above - below) / (2.0 * step * value)  # df/dx
        bends[key] = abs(above - 2.0 * here + below) / (2.0 * step)  # half the difference of x df/dx from both sides
        small = 0.05 * abs(slopes[key] * value) + 1e-3 * abs(here)
        if key not in ("contact_force", "velocity") and np.any(bends[key] > small):
            bent.append(key)

    # A bend does not matter if it is below a thousandth of the force, scaled to a change by the whole value.
    slope, bend = abs(slopes["contact_force"] * value).mean(), bends["contact_force"].mean()
    force = abs(at["contact_force"][1]).mean()
    if bend <= max(1e-3 * force, (0.05 if jumps else 0.01) * slope):
        doubt = 0.0
    else:
        doubt = float(bend / slope) if slope else inf
    return Derivative(slopes, doubt, bent)


def primary_waves(sensors: Sequence[int], runs: xr.Dataset) -> xr.Dataset:
    """Return AR and TOF of the primary waves at sensors."""
    waves = [xr.merge([amplitude_ratio(runs, n), time_of_flight(runs, n)], join="exact") for n in sensors]
    return xr.concat(waves, xr.DataArray(sensors, dims="sensor", name="sensor"))
