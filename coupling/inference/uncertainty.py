"""Uncertainty budgets: what the uncertainties of parameters do to AR and TOF.

References
----------
JCGM 100:2008, Guide to the Expression of Uncertainty in Measurement (GUM), equations 10 and 11a; JCGM 101:2008, its
supplement on the propagation of distributions by sampling.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from inspect import Parameter, signature
from math import isfinite, sqrt
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.differences import Build, units_of
from coupling.inference.identification import LINE
from coupling.inference.sensitivities import as_measures, sensitivities, waves_at
from coupling.results.ar_and_tof import UNCERTAINTY, reflections
from coupling.results.findings import findings_of, kind, one_of_each, warn
from coupling.results.waves import NoWave
from coupling.sweeps.batch import Measure, batch
from structures.caution import collected
from structures.checks import finite, html_table, instance, short, whole
from structures.quantities import standard_uncertainty
from structures.structure import Vector
from structures.units import readable

SEED = 0

BENT = 0.3
"""Part of the standard uncertainty by which a measure at the ends may differ from what derivatives predict."""

NONE = 1e-4
"""Part of a measure that counts as no change of it: numerical errors are as large."""

CURVED = 0.05
"""Part by which a sampled standard uncertainty differs from the propagated one where a measure is not linear."""

SURE = 2.0
"""Standard errors of the sampled standard uncertainty that such a difference must exceed."""


@dataclass(frozen=True)
class Uncertainty:
    """The uncertainty budget of AR, TOF or another measure; returned by `uncertainty`.

    Parameters
    ----------
    value : dict
        The measure at the values of the parameters, by name.
    standard : dict
        Its standard uncertainty by the law of propagation.
    shares : dict
        For each parameter its part of the variance of each measure, from 0 to 1.
    inputs : dict
        Value and standard uncertainty of each parameter, in SI units.
    sampled : dict
        Mean and standard deviation of each measure over the sampled runs; empty where none were asked for.
    samples : dict
        Each measure of the sampled runs, as an array; NaN where a run failed or has no such wave.
    units : dict
        Of the measures, and of parameters where they are known, as in a case.
    warnings : list of str
        What the user must know.

    Examples
    --------
    >>> from coupling.inference.uncertainty import Uncertainty
    >>> budget = Uncertainty({"AR": 0.5}, {"AR": 0.01}, {"radius": {"AR": 1.0}}, {"radius": (4.76e-3, 1e-5)})
    >>> print(budget)
    AR = 0.5 ± 0.01
      100 %  radius = 0.00476 ± 1e-05
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
        return sorted(
            self.inputs if isfinite(self.value[name]) else (), key=lambda parameter: -self.shares[parameter][name]
        )

    def _bent(self, ends: xr.Dataset) -> list[str]:
        """Return what the user must know where a measure at the ends is far from what its derivative predicts."""
        said = list[str]()
        for name, value in self.value.items():
            if not isfinite(value):
                continue
            standard = self.standard[name]
            for parameter, (below, above) in zip(self.inputs, ends[name].values.reshape(-1, 2), strict=True):
                predicted, change = standard * sqrt(self.shares[parameter][name]), 0.5 * abs(above - below)
                number, spread = (self._shown(parameter, size, 4) for size in self.inputs[parameter])
                if not isfinite(change):
                    said.append(
                        f"{name}: has no value where {parameter} = {number} moves by its uncertainty {spread}; is that "
                        "so large?"
                    )
                elif abs(change - predicted) > BENT * max(standard, NONE * abs(value)):
                    said.append(
                        f"{name}: where {parameter} moves by its uncertainty, it moves by "
                        f"{self._shown(name, change, 2)}, and by its derivative {self._shown(name, predicted, 2)}; in "
                        "Python hl.uncertainty(..., draws=200) needs no derivative"
                    )
        return said

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
            sampled = ""
            if name in self.sampled:
                sampled = f"  (sampled: ± {self._shown(name, self.sampled[name][1], 2)})"
            lines.append(f"{name} = {self._with_spread(name)}{sampled}")
            for parameter in self._largest_first(name):
                number, spread = self.inputs[parameter]
                share = f"{100.0 * self.shares[parameter][name]:3.0f} %"
                spread_text = self._shown(parameter, spread, 2)
                lines.append(f"  {share}  {parameter} = {self._shown(parameter, number, 4)} ± {spread_text}")
        lines += [fill(f"note: {warning}", LINE, subsequent_indent="  ") for warning in self.warnings]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return html_table("Uncertainty", [(name, self._with_spread(name)) for name in self.value])


def uncertainty(
    build: Build, until: float, sensor: int, measure: Measure | None = None, draws: int = 0, seed: int = SEED,
    **spreads: float | str,
) -> Uncertainty:  # fmt: skip
    """Return the standard uncertainty of AR and TOF that follows from those of parameters, and the share of each.

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
        Runs with parameters drawn from normal distributions, which show whether the measure is linear over the
        uncertainties. By default none.
    seed : int
        Of the draws.
    **spreads : float or str
        Standard uncertainty of each parameter: in SI units, with a unit as "0.01 mm", or as part of the value, "2 %".

    Returns
    -------
    Uncertainty
        Value, standard uncertainty and shares; ``print`` shows the budget.

    Raises
    ------
    ValueError
        For a parameter without a default value, an uncertainty that is none, and as `sensitivities`.

    Warns
    -----
    HertzlinkWarning
        Where the sampled standard uncertainty differs from the propagated one, because the measure is not linear;
        without draws, where two runs at the ends of a parameter's uncertainty do; and as `sensitivities`.

    Notes
    -----
    Parameters are taken as independent: u² = Σ (∂f/∂xᵢ)² uᵢ². Which unit suits a parameter of your function is not
    known here: "1 N" is taken as 1 in SI units.

    References
    ----------
    JCGM 100:2008, equation 10.

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
    draws, seed = whole("draws", draws, 0), whole("seed", seed, 0)
    if draws == 1:
        raise ValueError("draws = 1: have no standard deviation; must be 2 or more, or 0 for none")
    sensor, values = whole("sensor", sensor), _defaults(build, spreads)
    inputs = {name: (value, standard_uncertainty(name, spreads[name], value)) for name, value in values.items()}
    return propagated(build, until, sensor, inputs, measure, draws, seed)


def propagated(
    build: Build, until: float, sensor: int, inputs: Mapping[str, tuple[float, float]], measure: Measure | None = None,
    draws: int = 0, seed: int = SEED,
) -> Uncertainty:  # fmt: skip
    """Return the budget of `uncertainty` for values and standard uncertainties in SI units."""
    measure, values = measure or _of_sensor(sensor), {name: value for name, (value, _) in inputs.items()}
    run = sensitivities(build, until, [sensor], measure=measure, **values)
    names = [
        str(name) for name in run.data_vars if f"{name}_derivative" in run and name not in ("contact_force", "velocity")
    ]
    deviations = np.array([spread for _, spread in inputs.values()])
    value, standard = dict[str, float](), dict[str, float]()
    shares: dict[str, dict[str, float]] = {name: {} for name in inputs}
    for name in names:
        parts = (_single(name, run[f"{name}_derivative"].values) * deviations) ** 2
        value[name], standard[name] = float(run[name].values.item()), sqrt(float(parts.sum()))
        for parameter, part in zip(inputs, parts, strict=True):
            shares[parameter][name] = float(part / parts.sum()) if parts.sum() > 0.0 else 0.0
    all_units = {name: str(run[name].attrs.get("units", "1")) for name in names} | units_of(build)
    notes = findings_of(run)
    budget = Uncertainty(value, standard, shares, dict(inputs), units=all_units, warnings=notes)
    sampled, samples = budget.sampled, budget.samples
    said, lacking = list[str](), [name for name in names if not isfinite(value[name])]
    if lacking:
        with collected():
            waves = reflections(build(**values).run(until), sensor)
        reasons = (f"there is no {wave.which} wave: {wave.reason}" for wave in waves if isinstance(wave, NoWave))
        said.append(f"{', '.join(lacking)}: no value; {next(reasons, 'the measure gives none')}")
    if not draws:
        said += budget._bent(_ends(build, until, sensor, measure, inputs))
    else:
        with collected() as heard:
            tables = _sampled(build, until, sensor, measure, inputs, draws, seed)
        said += [finding for finding in one_of_each(heard) if kind(finding) not in map(kind, notes)]
        for name in names:
            samples[name] = tables[name].values
            usable = samples[name][np.isfinite(samples[name])]
            if usable.size < draws and name not in lacking:
                said.append(f"{name}: {draws - usable.size} of {draws} sampled runs failed, or have no such wave")
            if usable.size > 1 and name not in lacking:
                sampled[name] = float(usable.mean()), float(usable.std(ddof=1))
                said += _curved(name, standard[name], sampled[name][1], usable.size)
    warn(said)
    notes += said
    return budget


def _of_sensor(sensor: int) -> Measure:
    measure = waves_at([sensor])
    return lambda runs: measure(runs).isel(sensor=0, drop=True)


def _defaults(build: Any, spreads: Mapping[str, Any]) -> dict[str, float]:
    """Return the values of the parameters that are uncertain: the defaults of the function."""
    if not spreads:
        raise ValueError('spreads: name the uncertainty of at least one parameter, such as thickness="0.02 mm"')
    if not callable(build):
        raise ValueError(f"build = {short(build)}: must be a function that returns a CoSimulation")
    parameters, values = signature(build).parameters, dict[str, float]()
    for name in spreads:
        if name not in parameters:
            raise ValueError(f"{name}: is no parameter of build, which takes {', '.join(parameters) or 'nothing'}")
        if parameters[name].default is Parameter.empty:
            raise ValueError(f"{name}: has no default value in build, such as def build({name}=2e-3)")
        values[name] = finite(name, parameters[name].default)
    return values


def _single(name: str, slopes: Vector) -> Vector:
    if slopes.ndim > 1:
        raise ValueError(f"measure(runs): {name} has the shape {slopes.shape[1:]} for each run; must be one number")
    return slopes


def _ends(
    build: Build, until: float, sensor: int, measure: Measure, inputs: Mapping[str, tuple[float, float]]
) -> xr.Dataset:
    """Return the measures of two runs for each parameter: a standard uncertainty below and above its value."""
    columns: dict[str, Any] = {name: [value] * (2 * len(inputs)) for name, (value, _) in inputs.items()}
    for place, (name, (value, spread)) in enumerate(inputs.items()):
        columns[name][2 * place : 2 * place + 2] = value - spread, value + spread
    with collected():  # such runs are not those of the user, who learns what they show
        return batch(build, until, sensors=[sensor], measure=lambda runs: as_measures(measure(runs), runs), **columns)


def _sampled(
    build: Build, until: float, sensor: int, measure: Measure, inputs: Mapping[str, tuple[float, float]], draws: int,
    seed: int,
) -> xr.Dataset:  # fmt: skip
    """Return the measures of runs with parameters drawn at random."""
    random = np.random.default_rng(seed)
    columns: dict[str, Any] = {
        name: (value + spread * random.standard_normal(draws)).tolist() for name, (value, spread) in inputs.items()
    }
    return batch(build, until, sensors=[sensor], measure=lambda runs: as_measures(measure(runs), runs), **columns)


def _curved(name: str, standard: float, sampled: float, draws: int) -> list[str]:
    """Return what the user must know where a measure is not linear over the uncertainties, else nothing."""
    away = abs(sampled / standard - 1.0) if standard > 0.0 else float(sampled > 0.0)
    if away < CURVED + SURE / sqrt(2.0 * draws):
        return []
    if standard == 0.0:
        return [f"{name}: moves in steps, so that its derivative is zero although {draws} sampled runs differ"]
    return [
        f"{name}: is not linear over these uncertainties; {draws} sampled runs give {sampled / standard:.2f} times the "
        "standard uncertainty of the law of propagation"
    ]
