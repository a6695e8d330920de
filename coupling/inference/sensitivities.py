"""Derivatives of AR, TOF and traces by the parameters of the function that builds a run."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.engine import is_compiled
from coupling.inference.differences import OF_RUNS, Build, Derivative, differences, jumps
from coupling.plan import Adaptive
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import warn, with_warnings
from coupling.sweeps.batch import Measure
from coupling.sweeps.sweep import built_at, check_build
from structures.caution import collected
from structures.checks import finite, function, instance, positive
from structures.linear_algebra.one_thread import one_thread

SHIFT = 1e-5
"""Of the peak: how far traces are shifted along their derivatives to differentiate a measure of them."""

TINY = 1e-300
"""In place of zero, where it would be divided by."""

JUMP = 0.1
"""Part of a derivative by which those of both sides differ where a measure has none."""


@one_thread
def sensitivities(
    build: Build, until: float, sensors: Iterable[int], measure: Measure | None = None, save_every: float | None = None,
    **parameters: float,
) -> xr.Dataset:  # fmt: skip
    """Return a run with its derivatives by parameters of the function that builds it.

    They are central differences of runs whose windows, steps and saved times are those of the run itself.

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

    Raises
    ------
    ValueError
        For parameters that are zero or that `build` does not take, near which it fails, adaptive windows, and
        structures of the user's own.

    Warns
    -----
    HertzlinkWarning
        Where derivatives from both sides differ, because the function has a kink, jumps or depends on chance.

    Notes
    -----
    Each parameter takes two runs; where their difference does not tell a derivative from a kink or from chance, two
    for each of several larger steps. Losses begin at the first step after a contact closes, so that traces jump a
    little with a parameter: differences of chains with losses are large ones, which smooth these jumps.

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
    values = _checked_parameters(build, parameters)
    function("measure", measure or waves_at, 1, "a function of a Dataset of runs")
    simulation = instance("build(...)", built_at(build, values), CoSimulation, "a CoSimulation")
    until = positive("until", until, "s")
    simulation = simulation.for_run(until)
    check_differentiable(simulation)
    if sensors is None:
        raise ValueError("sensors = None: must be numbers of beads, such as [7]")
    plan = simulation.plan(until, save_every)
    with collected() as said:
        run = simulation.run(until, save_every, sensors=sensors)
    rates = differences(build, values, simulation, plan, run)
    measured, notes = _measured(run, rates, measure or waves_at(run.bead.values.tolist()))
    derivatives = dict[str, Any]()
    for key in ("contact_force", "velocity"):
        units = {"units": f"{run[key].units} per unit of the parameter"}
        slopes = np.stack([rate.slopes[key] for rate in rates.values()])
        derivatives[f"{key}_derivative"] = ("parameter", *run[key].dims), slopes, units
    value = "parameter", list(values.values()), {"long_name": "value at which the run is differentiated"}
    run = run.assign(derivatives | dict(measured.data_vars))
    run = run.assign_coords(parameter=list(values), parameter_value=value)
    findings = [*dict.fromkeys(said), *_doubts(rates), *notes]
    if jumps(simulation):
        findings.append(
            "dissipation: losses begin at the first step after a contact closes, so that runs jump with a parameter; "
            "derivatives are slopes over 0.1 to 1 % of its value, exact to some per cent of the largest"
        )
    warn(findings)
    return with_warnings(run, findings)


def check_differentiable(simulation: CoSimulation) -> None:
    """Raise a ValueError for a co-simulation that a batch does not do, or that has no windows to hold fixed."""
    if isinstance(simulation.window, Adaptive):
        raise ValueError("build(...): has adaptive windows, which jump with a parameter; give a window in s, or none")
    if not is_compiled(simulation.interface, simulation.scheme):
        raise ValueError(
            f"build(...) = {simulation!r}: has no derivatives; it needs Condensed(), and structures that are "
            "linear and small or reduced"
        )
    if len(simulation.interface.chains) > 1:
        raise ValueError(f"build(...) = {simulation!r}: has several chains; must have one")


def _doubts(rates: Mapping[str, Derivative]) -> list[str]:
    """Return what the user must know of derivatives: which are doubtful, and which parameters have no effect."""
    findings = list[str]()
    for name, (slopes, doubt) in rates.items():
        if doubt:
            findings.append(
                f"{name}: has no derivative here, or an inexact one; those of both sides differ by {200.0 * doubt:.1g} "
                "%. Perhaps build jumps, has a kink or depends on chance, a mesh or a reduction changes, or a loss "
                "begins as a contact closes"
            )
        elif not (slopes["contact_force"].any() or slopes["velocity"].any()):
            findings.append(f"{name}: changes nothing in this run")
    return findings


def _checked_parameters(build: Build, parameters: Mapping[str, float]) -> dict[str, float]:
    """Return the values of the parameters, or raise a ValueError that names the one that is wrong."""
    if not parameters:
        raise ValueError("parameters: name at least one argument of build, such as thickness=2e-3")
    check_build(build, parameters, "build", "parameters")
    values = {name: finite(name, value) for name, value in parameters.items()}
    if zero := [name for name, value in values.items() if value == 0.0]:
        raise ValueError(f"{zero[0]} = 0: has no scale for a difference; must not be zero")
    return values


def waves_at(sensors: list[int]) -> Measure:
    """Return the measure of AR and TOF of the primary waves at sensors."""

    def measure(runs: xr.Dataset) -> xr.Dataset:
        waves = [xr.merge([amplitude_ratio(runs, n), time_of_flight(runs, n)], join="exact") for n in sensors]
        return xr.concat(waves, xr.DataArray(sensors, dims="sensor", name="sensor"))

    return measure


def as_measures(values: Any, run: xr.Dataset) -> xr.Dataset:
    """Return what a measure gave as a Dataset, or raise a ValueError."""
    if isinstance(values, xr.DataArray):
        # A force's greatest value is still called contact_force, and is another quantity.
        name = "measure" if values.name is None or values.name in run.variables else str(values.name)
        return values.to_dataset(name=name)
    measures: xr.Dataset = instance("measure(runs)", values, xr.Dataset, "a Dataset or a DataArray")
    return measures


def _measured(run: xr.Dataset, rates: Mapping[str, Derivative], measure: Measure) -> tuple[xr.Dataset, list[str]]:
    """Return a measure of a run with its derivatives, and what to know of these.

    All that a measure can use of a run is shifted along its derivatives, a little to both sides.
    """
    names = list(rates)
    largest = np.array([abs(rate.slopes["contact_force"]).max() for rate in rates.values()])
    steps = SHIFT * run.contact_force.values.max() / np.maximum(largest, TINY)
    shifts = np.concatenate([np.zeros((1, len(names))), np.diag(steps), -np.diag(steps)])
    here, shifted = run[OF_RUNS], dict[str, Any]()
    for key in OF_RUNS:
        slopes = np.array([rates[name].slopes[key] for name in names])
        moved = here[key].values + np.tensordot(shifts, slopes, 1)
        shifted[key] = ("run", *here[key].dims), moved, here[key].attrs
    coordinates = {key: shifted.pop(key) for key in list(shifted) if key in here.coords}
    runs = here.assign(shifted).assign_coords(coordinates)
    with collected() as said:
        values = _checked_measure(measure(runs), run, len(shifts))
    if said:  # what it says of the run itself; shifted runs are no runs of the user
        with collected() as said:
            measure(runs.isel(run=[0]))
    data, notes = dict[str, Any](), list(dict.fromkeys(said))
    for name, value in values.data_vars.items():
        table = value.transpose("run", ...)
        usual, above, below = table.values[0], table.values[1 : 1 + len(names)], table.values[1 + len(names) :]
        step = steps.reshape(-1, *[1] * usual.ndim)
        slope, sides = (above - below) / (2.0 * step), (above - 2.0 * usual + below) / step
        for place, parameter in enumerate(names):
            limit = JUMP * abs(slope[place]) + 1e-6 * abs(usual / step[place]).max(initial=0.0)
            if np.any(abs(sides[place]) > limit):
                notes.append(
                    f"{name}: has no derivative by {parameter} here; those of both sides differ, as where a wave "
                    "changes its peak"
                )
        data[str(name)] = table.isel(run=0, drop=True)
        units = {"units": f"{value.attrs.get('units', '1')} per unit of the parameter"}
        data[f"{name}_derivative"] = (("parameter", *table.dims[1:]), slope, units)
    return values.isel(run=0, drop=True).drop_vars(list(values.data_vars)).assign(data), notes


def _checked_measure(values: Any, run: xr.Dataset, count: int) -> xr.Dataset:
    """Return what a measure gave for each run as a Dataset of numbers, or raise a ValueError."""
    measures = as_measures(values, run)
    for name, value in measures.data_vars.items():
        if value.sizes.get("run") != count or "parameter" in value.dims:
            raise ValueError(
                f"measure(runs): {name} has the dimensions {dict(value.sizes)}; must keep run: {count}, and none that "
                "is called parameter"
            )
        if name in run.variables:
            raise ValueError(f"measure(runs): {name} is a name that every run uses; must have another one")
        if value.dtype.kind not in "fiu":
            raise ValueError(f"measure(runs): {name} holds {value.dtype}; must be real numbers")
    if not measures.data_vars:
        raise ValueError("measure(runs): is empty; must hold at least one variable")
    return measures
