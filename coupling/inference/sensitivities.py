"""Derivatives of AR, TOF and traces by the parameters of the function that builds a run."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.derivatives import Build, Derivatives, check_differentiable, differentiate
from coupling.recording.dataset import dataset
from coupling.recording.frames import Kept, kept_at
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import warn, with_warnings
from coupling.run_checks import check_before, checked
from coupling.sweeps.batch import Measure, forces_of_runs
from coupling.sweeps.sweep import built_at, check_build
from particles.kernels.losses import Drag, NoLoss
from particles.kernels.motion import ChainModel, Verlet
from structures.caution import collected
from structures.checks import finite, function, instance, positive
from structures.linear_algebra.one_thread import one_thread

DOUBTFUL, NONE = 1e-3, 0.1
"""Part of a derivative that is in doubt from which the user is warned, and from which there is none."""

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

    The derivatives are exact: the run carries them along in dual numbers, through all its steps and contacts.

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
        For parameters that are zero or that `build` does not take, adaptive windows, structures of the user's own,
        and where a mesh or a reduction changes its size near a parameter.

    Warns
    -----
    HertzlinkWarning
        Where a derivative is doubtful, because what the run is made of does not vary smoothly; and where a measure has
        none, because its derivatives from both sides differ.

    Notes
    -----
    Forward mode suits up to some twenty parameters; one takes as long as 2.2 to 2.5 runs, twenty as 7. Where a
    contact just opens, or yields further, the derivative is that of the side on which the run is.

    References
    ----------
    Griewank and Walther, Evaluating Derivatives, 2nd ed. (SIAM 2008), chapter 3.

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
    simulation = built_at(build, values)
    check_differentiable(simulation)
    interface, until = simulation.interface, positive("until", until, "s")
    if len(interface.chains) > 1:
        raise ValueError(f"build(...) = {simulation!r}: has several chains; must have one")
    if sensors is None:
        raise ValueError("sensors = None: must be numbers of beads, such as [7]")
    kept = kept_at(sensors, len(interface.chains[0].chain.beads))
    findings = check_before(interface.chains, until)
    plan = simulation.plan(until, save_every)
    frames, rates = differentiate(simulation, build, values, plan, kept)
    with collected():  # of which the user is warned with the others
        findings += checked([interface], [frames], plan.interval)[0]
    findings += [_doubt(name, part) for name, part in rates.doubt.items() if part > DOUBTFUL]
    moves = {name: rates.force[name].any() or rates.velocity[name].any() or rates.doubt[name] for name in values}
    still = [name for name in values if not moves[name]]
    findings += [f"{name}: changes nothing in this run" for name in still]
    findings += _unfollowed(interface.chains[0].model)
    inputs = {**simulation.describe(), "until": until, **plan.describe(interface, simulation.window)}
    run = dataset(interface, frames, plan.interval, inputs, findings)
    derivatives: dict[str, Any] = {}
    for name, (slopes, count) in {
        "contact_force": (rates.force, len(kept.contacts)),
        "velocity": (rates.velocity, len(kept.bodies)),
    }.items():
        stacked = np.stack([slope[:, :count] for slope in slopes.values()])
        units = {"units": f"{run[name].units} per unit of the parameter"}
        derivatives[f"{name}_derivative"] = ("parameter", *run[name].dims), stacked, units
    value = "parameter", list(values.values()), {"long_name": "value at which the run is differentiated"}
    run = run.assign_coords(parameter=list(values), parameter_value=value).assign(derivatives)
    measured, jumps = _measured(run, rates, kept, plan.interval, measure or waves_at(kept.bodies))
    warn(findings + jumps)
    return with_warnings(run.assign(measured.data_vars), findings + jumps)


def _unfollowed(chain: ChainModel) -> list[str]:
    """Return what the user must know of losses that begin at other times where a parameter changes."""
    if isinstance(chain.loss, NoLoss | Drag) or isinstance(chain.scheme, Verlet):
        return []
    return [
        "dissipation: the loss begins as a contact closes, and these derivatives do not follow when; they do "
        "for rigid beads and losses of contacts. Compare them with differences of runs of a "
        "hundredth of each value"
    ]


def _doubt(name: str, part: float) -> str:
    """Return what the user must know of a derivative that is doubtful by a part of its size."""
    if part > NONE:
        return (
            f"{name}: has no derivative here; what the run is made of jumps, as a reduction may on a line of symmetry, "
            "has a kink, or depends on chance"
        )
    return (
        f"{name}: derivatives are doubtful by {100.0 * part:.1g} %, because a mesh, a reduction or modes do not vary "
        "smoothly near this value"
    )


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


def _measured(
    run: xr.Dataset, rates: Derivatives, kept: Kept, interval: float, measure: Measure
) -> tuple[xr.Dataset, list[str]]:
    """Return a measure of a run with its derivatives, and what to know of these.

    All that a measure can use of a run is shifted along its derivatives, a little to both sides.
    """
    function("measure", measure, 1, "a function of a Dataset of runs")
    names = run.parameter.values.tolist()
    force, velocity = run.contact_force.values, run.velocity.values
    by_force, by_velocity = run.contact_force_derivative.values, run.velocity_derivative.values
    steps = SHIFT * force.max() / np.maximum(abs(by_force).max(axis=(1, 2)), TINY)
    shifts = np.concatenate([np.zeros((1, len(names))), np.diag(steps), -np.diag(steps)])
    coordinates = dict[str, Any]()
    for fact in ("static_force", "centre", "impact_energy"):
        slope = np.array([rates.facts[name][fact] for name in names])
        coordinates[fact] = ("run", *run[fact].dims), run[fact].values + np.tensordot(shifts, slope, 1), run[fact].attrs
    runs = forces_of_runs(
        kept, interval, force + np.tensordot(shifts, by_force, 1), velocity + np.tensordot(shifts, by_velocity, 1),
        coordinates,
    ).assign_attrs(beads=run.attrs["beads"])  # fmt: skip
    with collected():
        values = _checked_measure(measure(runs), run, len(shifts))
    with collected() as said:
        measure(runs.isel(run=[0]))
    # What the measure says of the run itself; shifted runs are no runs of the user.
    data, notes = dict[str, Any](), list(dict.fromkeys(said))
    for name, value in values.data_vars.items():
        table = value.transpose("run", ...)
        here, above, below = table.values[0], table.values[1 : 1 + len(names)], table.values[1 + len(names) :]
        step = steps.reshape(-1, *[1] * here.ndim)
        slope, sides = (above - below) / (2.0 * step), (above - 2.0 * here + below) / step
        for place, parameter in enumerate(names):
            limit = JUMP * abs(slope[place]) + 1e-6 * abs(here / step[place]).max(initial=0.0)
            if np.any(abs(sides[place]) > limit):
                notes.append(
                    f"{name}: has no derivative by {parameter} here; those of both sides differ, as where a wave "
                    "changes its peak"
                )
        data[str(name)] = table.isel(run=0, drop=True)
        units = {"units": f"{value.attrs.get('units', '1')} per unit of the parameter"}
        data[f"{name}_derivative"] = (("parameter", *table.dims[1:]), slope, units)
    return values.isel(run=0, drop=True).drop_vars(list(values.data_vars)).assign(data), notes


def as_measures(values: Any, run: xr.Dataset) -> xr.Dataset:
    """Return what a measure gave as a Dataset, or raise a ValueError."""
    if isinstance(values, xr.DataArray):
        # A force's greatest value is still called contact_force, and is another quantity.
        name = "measure" if values.name is None or values.name in run.variables else str(values.name)
        return values.to_dataset(name=name)
    measures: xr.Dataset = instance("measure(runs)", values, xr.Dataset, "a Dataset or a DataArray")
    return measures


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
