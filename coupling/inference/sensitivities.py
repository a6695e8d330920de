"""Derivatives of AR, TOF and traces by the parameters of the function that builds a run.

The runs of a difference have the windows, steps and saved times of the run between them, so that they differ by the
parameter alone.
"""

from collections.abc import Callable, Iterable, Mapping
from math import inf
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.engine import is_compiled
from coupling.inference.settings import DIFFERENCES
from coupling.plan import Adaptive, Plan
from coupling.recording.frames import kept_at
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import warn, with_warnings
from coupling.sweeps.batch import Measure, records
from coupling.sweeps.sweep import built_at, check_build
from structures.caution import collected
from structures.checks import finite, function, instance, positive
from structures.linear_algebra.one_thread import one_thread
from structures.structure import Vector
from structures.units import readable

Build: TypeAlias = Callable[..., CoSimulation]
"""A function of parameters; it may have `units`, the SI units of these by name, for messages."""

OF_RUNS = ["contact_force", "velocity", "static_force", "centre", "impact_energy"]
"""What measures use of runs, as the columns of `Records`."""


class Derivative(NamedTuple):
    """Derivatives by name; doubt: the part by which those of the force on either side differ, zero where they agree."""

    slopes: dict[str, Vector]
    doubt: float


@one_thread
def sensitivities(
    build: Build, until: float, sensors: Iterable[int], measure: Measure | None = None, save_every: float | None = None,
    **parameters: float,
) -> xr.Dataset:  # fmt: skip
    """Return a run with its derivatives by parameters of the function that builds it: central differences.

    Parameters
    ----------
    build : callable
        Takes the parameters by name and returns a CoSimulation, on linear structures that are small (see `reduce`).
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
        The parameters at which to differentiate, not zero, in SI units.

    Returns
    -------
    Dataset
        The run as `CoSimulation.run` returns it, and what `measure` gives; for each of these, `contact_force` and
        `velocity` a variable `…_derivative` over the dimension "parameter", in its unit per SI unit of the parameter.

    Warns
    -----
    HertzlinkWarning
        Where derivatives from both sides differ: at a kink or a jump, by chance, and with losses of contacts.

    Raises
    ------
    ValueError
        For parameters that are zero or near which build fails, adaptive windows, and structures of the user's own.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(modulus, impact_speed):
    ...     wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    ...     return hl.CoSimulation(hl.Chain([bead] * 12, bead, impact_speed), wall)
    >>> change = hl.sensitivities(build, until=6e-4, sensors=[6], modulus=3e9, impact_speed=0.3)
    >>> tof = change.time_of_flight_derivative.sel(parameter="impact_speed", sensor=6)
    >>> print(f"TOF changes by {1e6 * 0.01 * float(tof):.2f} µs for 0.01 m/s")
    TOF changes by -2.51 µs for 0.01 m/s
    """
    if not parameters:
        raise ValueError("parameters: name at least one argument of build, such as thickness=2e-3")
    check_build(build, parameters, "build", "parameters")
    values, until = {name: finite(name, value) for name, value in parameters.items()}, positive("until", until, "s")
    if zero := [name for name, value in values.items() if value == 0.0]:
        raise ValueError(f"{zero[0]} = 0: has no scale for a difference; must not be zero")
    function("measure", measure or waves_at, 1, "a function of a Dataset of runs")
    simulation = instance("build(...)", built_at(build, values), CoSimulation, "a CoSimulation").for_run(until)
    several, adaptive = len(simulation.interface.chains) > 1, isinstance(simulation.window, Adaptive)
    if several or adaptive or not is_compiled(simulation.interface, simulation.scheme):
        raise ValueError(
            f"build(...) = {simulation!r}: has no derivatives; it needs one chain, Condensed(), windows of a fixed "
            "length, and structures that are linear and small or reduced"
        )

    plan, loss = simulation.plan(until, save_every), simulation.chain.chain.dissipation
    jumps = loss is not None and loss.piece != "drag"
    with collected() as said:
        run = simulation.run(until, save_every, sensors=sensors)
    rates = differences(build, values, simulation, plan, run, jumps)
    measured, notes = _measured(run, rates, measure or waves_at(run.bead.values.tolist()))
    derivatives = dict[str, Any]()
    for key in ("contact_force", "velocity"):
        units = {"units": f"{run[key].units} per unit of the parameter"}
        slopes = np.stack([rate.slopes[key] for rate in rates.values()])
        derivatives[f"{key}_derivative"] = ("parameter", *run[key].dims), slopes, units
    value = "parameter", list(values.values()), {"long_name": "value at which the run is differentiated"}
    run = run.assign(derivatives | dict(measured.data_vars))
    run = run.assign_coords(parameter=list(values), parameter_value=value)

    findings = list(dict.fromkeys(said))
    for name, (changes, doubt) in rates.items():
        if doubt:
            findings.append(
                f"{name}: has no derivative here, or an inexact one; those of both sides differ by {200.0 * doubt:.1g} "
                "%. Perhaps build jumps, has a kink or depends on chance, a mesh or a reduction changes, or a loss "
                "begins as a contact closes"
            )
        elif not (changes["contact_force"].any() or changes["velocity"].any()):
            findings.append(f"{name}: changes nothing in this run")
    findings += notes
    if jumps:
        findings.append(
            "dissipation: losses begin at the first step after a contact closes, so that runs jump with a parameter; "
            "derivatives are slopes over 0.1 to 1 % of its value, exact to some per cent of the largest"
        )
    warn(findings)
    return with_warnings(run, findings)


def differences(
    build: Build, values: Mapping[str, float], simulation: CoSimulation, plan: Plan, run: xr.Dataset, jumps: bool
) -> dict[str, Derivative]:
    """Return the derivatives of a run by each parameter; jumps: whether it jumps with them, a little."""
    here, beads = run.contact_force.values, len(simulation.chain.chain.beads)
    settings = {"window": plan.length, "dt": plan.length / simulation.chain.steps(plan.length)}
    until, kept = plan.interval * (plan.rows - 1), kept_at(run.bead.values.tolist(), beads)
    found, failures, left = dict[str, Derivative](), dict[str, str](), list(values)
    steps = DIFFERENCES.steps_with_losses if jumps else DIFFERENCES.steps
    smooth = DIFFERENCES.smooth_with_losses if jumps else DIFFERENCES.smooth
    for step in steps:
        rows = [{**values, name: values[name] * (1.0 + part)} for name in left for part in (step, -step)]
        columns = {name: [row[name] for row in rows] for name in values}
        with collected():  # these runs are not those of the user
            runs = records(lambda **row: build(**row).replace(**settings), until, plan.interval, kept, beads, columns)
        for place, name in enumerate(left):
            pair = slice(2 * place, 2 * place + 2)
            both = {key: part[pair] for key, part in zip(OF_RUNS, runs.columns, strict=True)}
            above, below = both["contact_force"]
            if np.isnan(above + below).any():
                reason = next(str(end.failure) for end in runs.ends[pair] if end.failure)
                shown = readable(values[name], units_of(build).get(name, ""), 6)
                failures.setdefault(
                    name,
                    f"{name}: build fails at {shown} ± {100.0 * step:g} %, which a derivative by differences needs: "
                    f"{reason}",
                )
                continue
            slopes = {key: (part[0] - part[1]) / (2.0 * step * values[name]) for key, part in both.items()}
            bend = abs(above - 2.0 * here + below).mean() / (2.0 * step)
            size = abs(slopes["contact_force"] * values[name]).mean()
            least = max(DIFFERENCES.negligible * abs(here).mean(), smooth * size)
            doubt = 0.0 if bend <= least else bend / size if size else inf
            if name not in found or doubt < found[name].doubt:
                found[name] = Derivative(slopes, float(doubt))
        left = [name for name in left if name not in found or found[name].doubt]
        if not left:
            break
    if missing := [name for name in values if name not in found]:
        raise ValueError(failures[missing[0]])
    return {name: found[name] for name in values}


def units_of(build: Build) -> dict[str, str]:
    """Return the SI units of a builder's parameters, by name, as far as it states them."""
    return dict(getattr(build, "units", {}))


def waves_at(sensors: list[int]) -> Measure:
    """Return the measure of AR and TOF of the primary waves at sensors."""

    def measure(runs: xr.Dataset) -> xr.Dataset:
        waves = [xr.merge([amplitude_ratio(runs, n), time_of_flight(runs, n)], join="exact") for n in sensors]
        return xr.concat(waves, xr.DataArray(sensors, dims="sensor", name="sensor"))

    return measure


def as_measures(values: Any, run: xr.Dataset) -> xr.Dataset:
    """Return what a measure gave as a Dataset."""
    if isinstance(values, xr.DataArray):
        # A force's greatest value is still called contact_force, and is another quantity.
        name = "measure" if values.name is None or values.name in run.variables else str(values.name)
        return values.to_dataset(name=name)
    measures: xr.Dataset = instance("measure(runs)", values, xr.Dataset, "a Dataset or a DataArray")
    return measures


def _measured(run: xr.Dataset, rates: Mapping[str, Derivative], measure: Measure) -> tuple[xr.Dataset, list[str]]:
    """Return a measure of a run with its derivatives, and what to know of these: all that a measure can use of the run
    is shifted along its derivatives, a little to both sides."""
    names, here, shifted = list(rates), run[OF_RUNS], dict[str, Any]()
    largest = np.array([abs(rate.slopes["contact_force"]).max() for rate in rates.values()])
    steps = DIFFERENCES.shift * run.contact_force.values.max() / np.maximum(largest, 1e-300)
    shifts = np.concatenate([np.zeros((1, len(names))), np.diag(steps), -np.diag(steps)])
    for key in OF_RUNS:
        moved = here[key].values + np.tensordot(shifts, np.array([rate.slopes[key] for rate in rates.values()]), 1)
        shifted[key] = ("run", *here[key].dims), moved, here[key].attrs
    coordinates = {key: shifted.pop(key) for key in list(shifted) if key in here.coords}
    runs = here.assign(shifted).assign_coords(coordinates)
    with collected() as said:
        values = as_measures(measure(runs), run)
    if said:  # what it says of the run itself; shifted runs are no runs of the user
        with collected() as said:
            measure(runs.isel(run=[0]))
    data, notes = dict[str, Any](), list(dict.fromkeys(said))
    for name, value in values.data_vars.items():
        if value.sizes.get("run") != len(shifts) or "parameter" in value.dims or name in run.variables:
            raise ValueError(
                f"measure(runs): {name} has the dimensions {dict(value.sizes)}; must keep run: {len(shifts)}, have "
                "none that is called parameter, and a name that a run does not use"
            )
        table = value.transpose("run", ...)
        usual, above, below = np.split(table.values.astype(float), [1, 1 + len(names)])
        step = steps.reshape(-1, *[1] * (table.ndim - 1))
        slope, sides = (above - below) / (2.0 * step), (above - 2.0 * usual + below) / step
        rough = 1e-6 * abs(usual / step).reshape(len(names), -1).max(axis=1, initial=0.0)
        limit = DIFFERENCES.jump * abs(slope) + rough.reshape(step.shape)
        notes += [
            f"{name}: has no derivative by {parameter} here; those of both sides differ, as where a wave changes its "
            "peak"
            for place, parameter in enumerate(names)
            if np.any(abs(sides[place]) > limit[place])
        ]
        data[str(name)] = table.isel(run=0, drop=True)
        units = {"units": f"{value.attrs.get('units', '1')} per unit of the parameter"}
        data[f"{name}_derivative"] = (("parameter", *table.dims[1:]), slope, units)
    return values.isel(run=0, drop=True).drop_vars(list(values.data_vars)).assign(data), notes
