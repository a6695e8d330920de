"""Uncertainty budgets: what the uncertainties of parameters do to AR and TOF (JCGM 100:2008 and 101:2008)."""

import json
from dataclasses import dataclass, field
from inspect import Parameter, signature
from math import isfinite, sqrt

import numpy as np
import xarray as xr

from coupling.inference.identification import Printed, as_text
from coupling.inference.sensitivities import Build, primary_waves, sensitivities
from coupling.results.ar_and_tof import UNCERTAINTY, reflections
from coupling.results.findings import findings_of, kind, one_of_each, warn
from coupling.results.waves import NoWave
from coupling.sweeps.batch import Measure, as_measures, batch
from coupling.sweeps.sweep import check_build
from structures.caution import collected
from structures.checks import finite, whole
from structures.quantities import standard_uncertainty
from structures.structure import Vector
from structures.units import readable


@dataclass(frozen=True, repr=False)
class Uncertainty(Printed):
    """The uncertainty budget of AR, TOF or another measure; returned by `uncertainty`.

    Parameters
    ----------
    value, standard : dict
        Each measure at the values of the parameters, and its standard uncertainty by the law of propagation.
    shares : dict
        For each parameter its part of the variance of each measure, from 0 to 1.
    inputs : dict
        Value and standard uncertainty of each parameter, in SI units.
    sampled, samples : dict
        Mean and standard deviation of each measure over the sampled runs, if any, and all its values, NaN if missing.
    units : dict
        Units of the measures, and of the parameters if they are known, as in a case.
    warnings : list of str
        Warnings for the user.
    """

    value: dict[str, float]
    standard: dict[str, float]
    shares: dict[str, dict[str, float]]
    inputs: dict[str, tuple[float, float]]
    units: dict[str, str]
    sampled: dict[str, tuple[float, float]] = field(default_factory=dict)
    samples: dict[str, Vector] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def _rows(self, name: str) -> tuple[str, list[tuple[str, str]]]:
        """Return a measure with its uncertainty, and the parameters with their shares, the largest first."""
        if not isfinite(self.value[name]):
            return "no value", []
        both = readable(self.value[name], self.units[name], 4), readable(self.standard[name], self.units[name], 2)
        parts = sorted(self.inputs, key=lambda part: -self.shares[part][name])
        return " ± ".join(both), [(part, f"{100.0 * self.shares[part][name]:3.0f} %") for part in parts]

    def noted_in(self, run: xr.Dataset, sensor: int) -> xr.Dataset:
        """Return a run of the same simulation with this budget for a sensor; reports then show it."""
        rows = []
        for name in self.value:
            size, parts = self._rows(name)
            shares = ", ".join(f"{part} {share.strip()}" for part, share in parts)
            rows.append((f"bead {sensor}, {name.replace('_', ' ')}", size, shares))
        noted = json.loads(run.attrs.get(UNCERTAINTY, "{}")) | {str(sensor): {"text": str(self), "rows": rows}}
        return run.assign_attrs({UNCERTAINTY: json.dumps(noted)})

    def __str__(self) -> str:
        lines = list[str]()
        for name in self.value:
            size, parts = self._rows(name)
            if name in self.sampled:
                size += f"  (sampled: ± {readable(self.sampled[name][1], self.units[name], 2)})"
            lines.append(f"{name} = {size}")
            for part, share in parts:
                unit, (value, spread) = self.units.get(part, ""), self.inputs[part]
                lines.append(f"  {share}  {part} = {readable(value, unit, 4)} ± {readable(spread, unit, 2)}")
        return as_text([(line,) for line in lines], [f"note: {warning}" for warning in self.warnings])


def uncertainty(
    build: Build, until: float, sensor: int, measure: Measure | None = None, draws: int = 0, seed: int = 0,
    **spreads: float | str | tuple[float, float],
) -> Uncertainty:  # fmt: skip
    """Return the standard uncertainty of AR and TOF that follows from uncertain parameters, and each parameter's share.

    Parameters are taken as independent: u² = Σ (∂f/∂xᵢ)² uᵢ² (JCGM 100:2008, equation 10).

    Parameters
    ----------
    build : callable
        Takes the parameters by name, each with its value as default, and returns a CoSimulation; see `sensitivities`.
    until, measure
        As in `sensitivities`; the measure returns one number for each run.
    sensor : int
        Number of the bead at which AR and TOF are measured.
    draws : int
        Number of runs with parameters from normal distributions, which show whether the measure is linear; by default
        none.
    seed : int
        Seed of the draws.
    **spreads : float, str or tuple
        Standard uncertainty of each parameter: in SI units, with a unit such as "0.01 mm", or as a part of the value,
        "2 %"; or (value, standard uncertainty) in SI units, for a parameter without a default.

    Returns
    -------
    Uncertainty
        Value, standard uncertainty and shares; ``print`` shows the budget. Draws, or else two runs for each parameter,
        show whether the measure is linear over the uncertainties; a warning says if it is not.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(modulus=3e9, impact_speed=0.3):
    ...     wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    ...     return hl.CoSimulation(hl.Chain([bead] * 12, bead, impact_speed), wall)
    >>> print(hl.uncertainty(build, until=6e-4, sensor=6, modulus="5 %", impact_speed="0.01 m/s"))
    amplitude_ratio = 0.9165 ± 0.00063
      100 %  modulus = 3e+09 ± 1.5e+08
        0 %  impact_speed = 0.3 ± 0.01
    time_of_flight = 376.8 µs ± 4.3 µs
       66 %  modulus = 3e+09 ± 1.5e+08
       34 %  impact_speed = 0.3 ± 0.01
    """
    draws, seed, sensor = whole("draws", draws, 0), whole("seed", seed, 0), whole("sensor", sensor)
    if draws == 1:
        raise ValueError("draws = 1: must be 0, or 2 or more for a standard deviation")
    check_build(build, spreads, "parameters", 'thickness="0.02 mm"')
    inputs = dict[str, tuple[float, float]]()
    for name, spread in spreads.items():
        if isinstance(spread, tuple):
            inputs[name] = spread
            continue
        default = signature(build).parameters[name].default
        if default is Parameter.empty:
            raise ValueError(f"{name}: has no default value in build, such as def build({name}=2e-3)")
        centre = finite(name, default)
        inputs[name] = centre, standard_uncertainty(name, spread, centre)

    said = [
        f"{name}: its uncertainty, {spread:g}, is {abs(spread / centre):.1g} times its value, {centre:g}, in "
        'SI units; write "5 %" for a part of the value'
        for name, (centre, spread) in inputs.items() if centre != 0.0 and not 1e-8 < abs(spread / centre) < 1.0
    ]  # fmt: skip
    centres, deviations = np.array([*inputs.values()]).T
    values = dict(zip(inputs, centres.tolist(), strict=True))
    read = measure or (lambda runs: primary_waves([sensor], runs).isel(sensor=0, drop=True))
    run = sensitivities(build, until, [sensor], measure=read, **values)
    names = [name for name in map(str, run.data_vars) if f"{name}_derivative" in run]
    names = [name for name in names if name not in ("contact_force", "velocity")]
    if wide := [name for name in names if run[name].ndim]:
        shape = run[wide[0]].shape
        raise ValueError(f"measure(runs): {wide[0]} has the shape {shape} for each run; must be one number")

    # The law of propagation: u² = Σ (∂f/∂xᵢ)² uᵢ².
    value, standard = {name: float(run[name]) for name in names}, dict[str, float]()
    shares: dict[str, dict[str, float]] = {parameter: {} for parameter in inputs}
    for name in names:
        parts = (run[f"{name}_derivative"].values * deviations) ** 2
        variance = float(parts.sum())
        rounding = 1e-10 * abs(value[name])
        standard[name] = sqrt(variance) if sqrt(variance) > rounding else 0.0
        for parameter, part in zip(inputs, parts.tolist(), strict=True):
            shares[parameter][name] = part / variance if variance > 0.0 else 0.0
    units = {name: str(run[name].attrs.get("units", "1")) for name in names} | getattr(build, "units", {})
    budget = Uncertainty(value, standard, shares, inputs, units, warnings=findings_of(run))
    if lacking := [name for name in names if not isfinite(value[name])]:
        with collected():
            waves = reflections(build(**values).run(until), sensor)
        reasons = (f"there is no {wave.which} wave: {wave.reason}" for wave in waves if isinstance(wave, NoWave))
        said.append(f"{', '.join(lacking)}: no value; {next(reasons, 'the measure gives none')}")

    # Two runs for each parameter, one standard uncertainty below and above its value; or draws of all parameters.
    moves: Vector = np.asarray(np.kron(np.eye(len(inputs)), [-1.0, 1.0]), dtype=float)
    if draws:
        moves = np.random.default_rng(seed).standard_normal((len(inputs), draws))
    rows = centres[:, None] + deviations[:, None] * moves
    with collected() as heard:
        tables = batch(
            build, until, sensors=[sensor],
            measure=lambda runs: as_measures(read(runs), runs.sizes["run"], runs.variables),
            **dict(zip(inputs, rows.tolist(), strict=True)),
        )  # fmt: skip
    if draws:
        said += [finding for finding in one_of_each(heard) if kind(finding) not in map(kind, budget.warnings)]
        budget.samples.update({name: tables[name].values for name in names})
    said += _not_linear(budget, {name: tables[name].values for name in names}, draws)
    warn(said)
    budget.warnings.extend(said)
    return budget


def _not_linear(budget: Uncertainty, runs: dict[str, Vector], draws: int) -> list[str]:
    """Return notes on measures that are not linear over the uncertainties, and add mean and deviation of draws to the
    budget. runs: each measure over the draws or, if there are none, over both ends of each parameter."""
    notes = list[str]()
    for name, found in runs.items():
        value, standard, there = budget.value[name], budget.standard[name], found[np.isfinite(found)]
        if not isfinite(value):
            continue
        if there.size < found.size:
            which = "sampled runs" if draws else "runs at the ends of the uncertainties"
            notes.append(f"{name}: {found.size - there.size} of {found.size} {which} failed, or have no such wave")
        if draws and there.size > 1:
            budget.sampled[name] = float(there.mean()), float(there.std(ddof=1))
        if draws:
            # The standard deviation of n draws has the relative standard error 1/√(2 n); it may differ by two, and 5 %.
            spread, limit = float(there.std(ddof=1)), 0.05 + 2.0 / sqrt(2.0 * draws)
        else:
            # To second order u² = Σ aᵢ² + 2 bᵢ² for f(xᵢ ± uᵢ) = f + bᵢ ± aᵢ (JCGM 100:2008, note to 5.1.2).
            below, above = found.reshape(-1, 2).T
            odd, even = 0.5 * (above - below), 0.5 * (above + below) - value
            spread, limit = sqrt(float((odd**2 + 2.0 * even**2).sum())), 0.3
        # Less than 1e-4 of a measure is a numerical error.
        if abs(spread - standard) > limit * max(standard, 1e-4 * abs(value)):
            both = [readable(size, budget.units[name], 2) for size in (spread, standard)]
            notes.append(
                f"{name}: is not linear over these uncertainties, or moves in steps; runs over them give the standard "
                f"uncertainty {both[0]}, and the derivatives {both[1]}"
            )
    return notes
