"""Uncertainty budgets: what the uncertainties of parameters do to AR and TOF (JCGM 100:2008 and 101:2008)."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from inspect import Parameter, signature
from math import isfinite, sqrt
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.identification import LINE
from coupling.inference.sensitivities import Build, as_measures, sensitivities, units_of, waves_at
from coupling.inference.settings import DIFFERENCES
from coupling.results.ar_and_tof import UNCERTAINTY, reflections
from coupling.results.findings import findings_of, kind, one_of_each, warn
from coupling.results.waves import NoWave
from coupling.sweeps.batch import Measure, batch
from structures.caution import collected
from structures.checks import finite, html_table, instance, short, whole
from structures.quantities import standard_uncertainty
from structures.structure import Vector
from structures.units import readable


@dataclass(frozen=True)
class Uncertainty:
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
        Mean and standard deviation of each measure over the sampled runs, if any, and all its values, NaN where none.
    units : dict
        Of the measures, and of parameters where they are known, as in a case.
    warnings : list of str
        What the user must know.
    """

    value: dict[str, float]
    standard: dict[str, float]
    shares: dict[str, dict[str, float]]
    inputs: dict[str, tuple[float, float]]
    sampled: dict[str, tuple[float, float]] = field(default_factory=dict)
    samples: dict[str, Vector] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def _shown(self, name: str, number: float, digits: int) -> str:
        return readable(number, self.units.get(name, ""), digits)

    def _with_spread(self, name: str) -> str:
        if not isfinite(self.value[name]):
            return "no value"
        return f"{self._shown(name, self.value[name], 4)} ± {self._shown(name, self.standard[name], 2)}"

    def _largest_first(self, name: str) -> list[str]:
        """Return the parameters by their share in the variance of a measure; none of a measure without a value."""
        return sorted(self.inputs, key=lambda part: -self.shares[part][name]) if isfinite(self.value[name]) else []

    def noted_in(self, run: xr.Dataset, sensor: int) -> xr.Dataset:
        """Return a run of the same simulation with this budget for a sensor, which reports then show."""
        instance("run", run, xr.Dataset, "a run")
        rows = [
            (
                f"bead {sensor}, {name.replace('_', ' ')}",
                self._with_spread(name),
                ", ".join(f"{part} {100.0 * self.shares[part][name]:.0f} %" for part in self._largest_first(name)),
            )
            for name in self.value
        ]
        noted = json.loads(run.attrs.get(UNCERTAINTY, "{}")) | {str(sensor): {"text": str(self), "rows": rows}}
        return run.assign_attrs({UNCERTAINTY: json.dumps(noted)})

    def __str__(self) -> str:
        lines = []
        for name in self.value:
            both = self.sampled.get(name)
            sampled = f"  (sampled: ± {self._shown(name, both[1], 2)})" if both else ""
            lines.append(f"{name} = {self._with_spread(name)}{sampled}")
            for part in self._largest_first(name):
                number, spread = (self._shown(part, x, n) for x, n in zip(self.inputs[part], (4, 2), strict=True))
                lines.append(f"  {100.0 * self.shares[part][name]:3.0f} %  {part} = {number} ± {spread}")
        lines += [fill(f"note: {warning}", LINE, subsequent_indent="  ") for warning in self.warnings]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return html_table("Uncertainty", [(name, self._with_spread(name)) for name in self.value])


def uncertainty(
    build: Build, until: float, sensor: int, measure: Measure | None = None, draws: int = 0, seed: int = 0,
    **spreads: float | str,
) -> Uncertainty:  # fmt: skip
    """Return the standard uncertainty of AR and TOF that follows from those of parameters, and the share of each.

    Parameters are taken as independent: u² = Σ (∂f/∂xᵢ)² uᵢ² (JCGM 100:2008, equation 10).

    Parameters
    ----------
    build : callable
        Takes the parameters by name, each with its value as default, and returns a CoSimulation; see `sensitivities`.
    until : float
        Length of the run, s.
    sensor : int
        Number of the bead whose AR and TOF are asked for.
    measure : callable, optional
        Another measure, as for `sensitivities`; it returns one number for each run.
    draws : int
        Runs with parameters from normal distributions, which show whether the measure is linear; by default none.
    seed : int
        Of the draws.
    **spreads : float or str
        Standard uncertainty of each parameter: in SI units, with a unit as "0.01 mm", or as part of the value, "2 %".

    Returns
    -------
    Uncertainty
        Value, standard uncertainty and shares; ``print`` shows the budget.

    Warns
    -----
    HertzlinkWarning
        Where the measure is not linear over the uncertainties, by the draws or by two runs for each parameter.

    Raises
    ------
    ValueError
        For a parameter without a default value, an uncertainty that is none, and as `sensitivities`.

    Examples
    --------
    >>> import hertzlink as hl
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
        raise ValueError("draws = 1: have no standard deviation; must be 2 or more, or 0 for none")
    if not spreads:
        raise ValueError('spreads: name the uncertainty of at least one parameter, such as thickness="0.02 mm"')
    if not callable(build):
        raise ValueError(f"build = {short(build)}: must be a function that returns a CoSimulation")
    parameters, inputs = signature(build).parameters, dict[str, tuple[float, float]]()
    for name, spread in spreads.items():
        if name not in parameters:
            raise ValueError(f"{name}: is no parameter of build, which takes {', '.join(parameters) or 'nothing'}")
        if parameters[name].default is Parameter.empty:
            raise ValueError(f"{name}: has no default value in build, such as def build({name}=2e-3)")
        value = finite(name, parameters[name].default)
        inputs[name] = value, standard_uncertainty(name, spread, value)
    return propagated(build, until, sensor, inputs, measure, draws, seed)


def propagated(
    build: Build, until: float, sensor: int, inputs: Mapping[str, tuple[float, float]], measure: Measure | None = None,
    draws: int = 0, seed: int = 0,
) -> Uncertainty:  # fmt: skip
    """Return the budget of `uncertainty` for values and standard uncertainties in SI units."""
    of_sensor, values = waves_at([sensor]), {name: value for name, (value, _) in inputs.items()}
    read = measure or (lambda runs: of_sensor(runs).isel(sensor=0, drop=True))
    run = sensitivities(build, until, [sensor], measure=read, **values)
    traces = ("contact_force", "velocity")
    names = [str(name) for name in run.data_vars if f"{name}_derivative" in run and name not in traces]
    value, standard = dict[str, float](), dict[str, float]()
    shares: dict[str, dict[str, float]] = {name: {} for name in inputs}
    for name in names:
        slopes = run[f"{name}_derivative"].values
        if slopes.ndim > 1:
            raise ValueError(f"measure(runs): {name} has the shape {slopes.shape[1:]} for each run; must be one number")
        parts = (slopes * np.array([spread for _, spread in inputs.values()])) ** 2
        value[name], standard[name] = float(run[name].values.item()), sqrt(float(parts.sum()))
        for parameter, part in zip(inputs, parts, strict=True):
            shares[parameter][name] = float(part / parts.sum()) if parts.sum() > 0.0 else 0.0
    units = {name: str(run[name].attrs.get("units", "1")) for name in names} | units_of(build)
    notes, said = findings_of(run), list[str]()
    budget = Uncertainty(value, standard, shares, dict(inputs), units=units, warnings=notes)
    if lacking := [name for name in names if not isfinite(value[name])]:
        with collected():
            waves = reflections(build(**values).run(until), sensor)
        reasons = (f"there is no {wave.which} wave: {wave.reason}" for wave in waves if isinstance(wave, NoWave))
        said.append(f"{', '.join(lacking)}: no value; {next(reasons, 'the measure gives none')}")

    def measured(columns: dict[str, Any]) -> xr.Dataset:
        return batch(build, until, sensors=[sensor], measure=lambda runs: as_measures(read(runs), runs), **columns)

    def is_bent(name: str, parameter: str, change: float) -> str:
        """Return what to say where a change between the ends is far from what the derivative predicts, else nothing."""
        predicted = standard[name] * sqrt(shares[parameter][name])
        number, spread = (budget._shown(parameter, size, 4) for size in inputs[parameter])
        if not isfinite(change):
            moved = f"where {parameter} = {number} moves by its uncertainty {spread}"
            return f"{name}: has no value {moved}; is that so large?"
        if abs(change - predicted) <= DIFFERENCES.bent * max(standard[name], DIFFERENCES.rounding * abs(value[name])):
            return ""
        return (
            f"{name}: where {parameter} moves by its uncertainty, it moves by {budget._shown(name, change, 2)}, and by "
            f"its derivative {budget._shown(name, predicted, 2)}; in Python hl.uncertainty(..., draws=200) needs no "
            "derivative"
        )

    usable = [name for name in names if name not in lacking]
    if draws:
        random = np.random.default_rng(seed)
        columns = {name: (x + spread * random.standard_normal(draws)).tolist() for name, (x, spread) in inputs.items()}
        with collected() as heard:
            tables = measured(columns)
        said += [finding for finding in one_of_each(heard) if kind(finding) not in map(kind, notes)]
        budget.samples.update({name: tables[name].values for name in names})
        for name in usable:
            drawn = budget.samples[name][np.isfinite(budget.samples[name])]
            if drawn.size < draws:
                said.append(f"{name}: {draws - drawn.size} of {draws} sampled runs failed, or have no such wave")
            if drawn.size > 1:
                budget.sampled[name] = float(drawn.mean()), float(drawn.std(ddof=1))
                said += _curved(name, standard[name], budget.sampled[name][1], drawn.size)
    else:
        # Two runs for each parameter: a standard uncertainty below and above its value.
        columns = {name: [x] * (2 * len(inputs)) for name, (x, _) in inputs.items()}
        for place, (name, (x, spread)) in enumerate(inputs.items()):
            columns[name][2 * place : 2 * place + 2] = x - spread, x + spread
        with collected():  # such runs are not those of the user, who learns what they show
            ends = measured(columns)
        for name in usable:
            below, above = ends[name].values.reshape(-1, 2).T
            changes = zip(inputs, 0.5 * abs(above - below), strict=True)
            said += [line for parameter, change in changes if (line := is_bent(name, parameter, float(change)))]
    warn(said)
    notes += said
    return budget


def _curved(name: str, standard: float, sampled: float, draws: int) -> list[str]:
    """Return what the user must know where a measure is not linear over the uncertainties, else nothing."""
    away = abs(sampled / standard - 1.0) if standard > 0.0 else float(sampled > 0.0)
    if away < DIFFERENCES.curved + 2.0 / sqrt(2.0 * draws):
        return []
    if standard == 0.0:
        return [f"{name}: moves in steps, so that its derivative is zero although {draws} sampled runs differ"]
    return [
        f"{name}: is not linear over these uncertainties; {draws} sampled runs give {sampled / standard:.2f} times the "
        "standard uncertainty of the law of propagation"
    ]
