"""Loss parameters from sensor signals (thesis, section 4.2): least squares over batches of simulated chains."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from inspect import isclass
from math import exp, inf, log
from typing import Any, NamedTuple

import numpy as np
import scipy
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from coupling.results.ar_and_tof import reflections
from coupling.results.measures import sensor_force
from coupling.sweeps.batch import batch
from particles.chain import Chain
from particles.deformable.deformable_chain import DeformableChain
from particles.dissipation import FORMS, Dissipation, PowerDashpot
from particles.moving import MovingChain
from structures.caution import collected
from structures.checks import instance, listed, one_of, short, whole
from structures.described import description, of_family
from structures.html_table import html_table
from structures.structure import Structure, Vector

STEPS_PER_CONTACT = 200
"""Time steps in the duration of a contact; peaks are then within 1e-4 of those of a run with default steps."""

PULSE_WIDTHS = 1.2
"""A pulse is compared over this multiple of its width at half height on each side of its peak."""

MOST_EXPONENT_WIDTH = 0.25
"""If the half-width of the exponent's 95 % interval is larger, exponent and coefficient cannot be separated."""

STARTING_SIZES = tuple(np.geomspace(3e-4, 1.0, 11))
"""Starting values of the search: losses that would stop a contact in 1/size of its duration."""

STARTING_EXPONENTS = (1.2, 1.6, 2.0, 2.5)
"""Starting values of the exponent, over the range of the published laws."""

MOST_LOGARITHM_WIDTH = 1.0
"""If the half-width of the 95 % interval of a coefficient's logarithm is larger, the signals show hardly any loss."""

MOST_PEAK_RATIO = 1.5
"""If a measured peak exceeds the lossless one by this factor, the signal cannot belong to the chain."""

LARGEST_LOGARITHM = 200.0
"""Logarithms are kept within ± this number, so that their exponentials are finite."""

COMPARE = ("pulses", "peaks")


@dataclass(frozen=True)
class DissipationFit:
    """A fitted loss with its uncertainty; returned by `fit_dissipation`.

    Parameters
    ----------
    loss : Dissipation
        The fitted loss; can be used in a Chain.
    intervals : dict
        95 % confidence interval of each parameter, in its unit.
    amplitude_difference : float
        D of equation 4.2, equal to 4.6 (called RMSD in the thesis, although it is a mean absolute deviation).
    waveform_difference : dict
        Δₙ of equation 4.3 at each sensor, with the measured pulse scaled to the simulated peak.
    identifiable : bool
        Whether exponent and coefficient can be separated, which needs waves that decay strongly; otherwise `note` says
        what is known.
    correlation : float
        Correlation of the two parameters.
    note : str
        What the signals determine, if not all parameters.

    Examples
    --------
    >>> import hertzlink as hl
    >>> from coupling.inference.fitting import DissipationFit
    >>> fit = DissipationFit(hl.LinearDashpot(5.0), {"coefficient": (4.8, 5.2)}, 0.002, {10: 0.01})
    >>> fit
    DissipationFit(LinearDashpot(coefficient=5.0); coefficient (95 %): 4.8 to 5.2; amplitude difference: 0.002; ...)
    >>> fit.identifiable
    True
    """

    loss: Dissipation
    intervals: dict[str, tuple[float, float]]
    amplitude_difference: float
    waveform_difference: dict[int, float]
    identifiable: bool = True
    correlation: float = 0.0
    note: str = ""

    def __repr__(self) -> str:
        return f"DissipationFit({self.loss!r}; {'; '.join(f'{name}: {value}' for name, value in self._rows())})"

    def _repr_html_(self) -> str:
        return html_table("DissipationFit", [("loss", repr(self.loss)), *self._rows()])

    def _rows(self) -> list[tuple[str, str]]:
        """Return what a line or a short table shows, apart from the loss."""
        worst = max(self.waveform_difference.values(), default=0.0)
        return [
            *((f"{name} (95 %)", f"{low:.4g} to {high:.4g}") for name, (low, high) in self.intervals.items()),
            ("amplitude difference", f"{self.amplitude_difference:.3g}"),
            ("largest waveform difference", f"{worst:.3g}"),
            *([] if self.identifiable else [("not identifiable", self.note or "see note")]),
        ]


class _Pulse(NamedTuple):
    """The incident wave at a sensor: its peak (N), and the samples (N) around it, at moments (s) relative
    to the peak.
    """

    peak: float
    moments: Vector
    force: Vector


def fit_dissipation(
    signals: xr.Dataset,
    chain: Chain,
    law: type[Dissipation] = PowerDashpot,
    form: str = "pairwise",
    sensors: Iterable[int] | None = None,
    structure: Structure | None = None,
    compare: str = "pulses",
) -> DissipationFit:
    """Fit a loss so that the simulated incident waves match the measured ones.

    Parameters
    ----------
    signals : xarray.Dataset
        Measured signals from `read_signal` or `as_signal`, or a run.
    chain : Chain
        The chain of the experiment; its own loss is not used.
    law : type
        The kind of loss. PowerDashpot: coefficient and exponent are fitted. A described loss of a single number from
        zero (no loss) upwards, such as LinearDashpot or one of your own: that number is fitted.
    form : str
        The form of a PowerDashpot.
    sensors : sequence of int, optional
        Beads to compare, two or more; by default all sensors of a signal.
    structure : Structure, optional
        None, or a half-space behind the chain.
    compare : {"pulses", "peaks"}
        "pulses": squared differences of the forces around the peak of each sensor, shifted in time to their minimum,
        over the mean peak. They contain the difference of the amplitudes (D, equation 4.2) and of the shapes (Δₙ, 4.3).
        "peaks": squared differences of the amplitudes alone (4.6), each taken as the scale of the whole pulse.

    Returns
    -------
    DissipationFit
        The loss, confidence intervals (for white noise), and the remaining differences.

    Raises
    ------
    ValueError
        If a sensor recorded no wave, there are fewer than two sensors, or, with "peaks", no more sensors than
        parameters.

    References
    ----------
    Thesis, section 4.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 20, bead, impact_speed=0.1, dissipation=hl.LinearDashpot(5.0))
    >>> run = hl.CoSimulation(chain, None).run(until=0.5e-3)
    >>> fit = hl.fit_dissipation(run, chain, law=hl.LinearDashpot, sensors=[6, 12], compare="peaks")
    >>> round(fit.loss.coefficient, 2)  # N s/m
    5.0
    """
    if isinstance(instance("chain", chain, Chain, "a Chain"), DeformableChain):
        raise ValueError(f"chain = {short(chain)}: must be a Chain of point masses, not of deformable beads")
    if law is not PowerDashpot and not _single(law):
        names = ", ".join(entry.name for entry in of_family(Dissipation) if _single(entry.target))
        raise ValueError(f"law = {short(law)}: must be one of PowerDashpot, {names}")
    if structure is not None:
        instance("structure", structure, Structure, "a Structure or None")
    one_of("form", form, FORMS)
    one_of("compare", compare, COMPARE)
    numbers = _sensors(signals, sensors)
    measured = {n: _measured(signals, n) for n in numbers}
    if compare == "peaks" and len(numbers) <= 1 + (law is PowerDashpot):
        raise ValueError(f"sensors = {numbers!r}: must be more than parameters to compare peaks")
    if chain.body is None:
        kind = "none" if chain.striker is None else type(chain.striker).__name__
        raise ValueError(f"chain: its striker is {kind}; must be a bead, or a SpringLoaded one")
    record = _record(signals, numbers)
    model = _Model(replace(chain, dissipation=None), law, form, structure, measured, record, compare)
    with collected():  # the user is warned of the run with what was found, not of those of the search
        model.check_amplitudes()
        best = least_squares(
            model.residual, model.nearest_start(), jac=model.jacobian, bounds=model.bounds, x_scale="jac", xtol=1e-7
        )
    return _fit(model, best.x, best.jac, best.fun)


def _single(law: Any) -> str:
    """Return the name of the single parameter of a loss, a number from zero upwards; empty where there is none."""
    of = description(law) if isclass(law) and issubclass(law, Dissipation) else None
    numbers = list(of.parameters.values()) if of else []
    scale = numbers[0].quantity if len(numbers) == 1 else None
    return numbers[0].name if scale and scale.or_zero and scale.high == inf else ""


def _sensors(signals: xr.Dataset, sensors: Iterable[int] | None) -> list[int]:
    instance("signals", signals, xr.Dataset, "the Dataset of a signal or a run")
    if sensors is None:
        if "sensor" not in signals.coords:
            raise ValueError("sensors = None: must be given for a run, such as [9, 16, 24]")
        sensors = signals.sensor.values.tolist()
    numbers = sorted({whole("sensors", n) for n in listed("sensors", sensors, object, "two bead numbers or more")})
    if len(numbers) < 2:
        raise ValueError(f"sensors = {numbers!r}: must be two or more: the decay shows between them")
    return numbers


def _incident(signals: xr.Dataset, sensor: int) -> Any:
    """Return the incident wave; a fit does not need those that come back, so it warns of none that is missing."""
    with collected():
        return reflections(signals, sensor).incident


def _measured(signals: xr.Dataset, sensor: int) -> _Pulse:
    incident = _incident(signals, sensor)
    if not incident:
        raise ValueError(f"signals: sensor {sensor} recorded no wave")
    time, force = signals.time.values, sensor_force(signals, sensor).values
    low = np.flatnonzero(force < 0.5 * incident.amplitude)
    before, after = low[time[low] < incident.arrival], low[time[low] > incident.arrival]
    start = time[before[-1]] if before.size else time[0]
    end = time[after[0]] if after.size else time[-1]
    near = np.abs(time - incident.arrival) <= PULSE_WIDTHS * (end - start)
    return _Pulse(incident.amplitude, time[near] - incident.arrival, force[near])


def _record(signals: xr.Dataset, numbers: Sequence[int]) -> float:
    """Return the time, s, that the wave needs from the striker past the last sensor, with a margin."""
    waves = [_incident(signals, n) for n in (numbers[0], numbers[-1])]
    passing = waves[1].arrival - waves[0].arrival if waves[0] and waves[1] else 0.0
    if passing <= 0.0:
        raise ValueError(f"signals: the wave reaches sensor {numbers[-1]} before sensor {numbers[0]}")
    return 1.2 * passing * (numbers[-1] + 6) / (numbers[-1] - numbers[0])


def _aligned(time: Vector, force: Vector, measured: _Pulse) -> _Pulse:
    """Return the largest pulse of a simulated force at the moments of a measured one, shifted in time to match it best.

    Noise displaces the measured peak in time. If the peaks alone were aligned, this shift would look like a loss. The
    shift is found by the Gauss-Newton method.
    """
    curve = CubicSpline(time, force)
    slope = curve.derivative()
    around = time[int(force.argmax())] + np.linspace(-1.0, 1.0, 65) * (time[1] - time[0])
    arrival = around[int(curve(around).argmax())]
    peak, shift = float(curve(arrival)), 0.0
    for _ in range(4):
        at = np.clip(arrival + measured.moments + shift, time[0], time[-1])
        rate = slope(at)
        steepness = float(rate @ rate)
        if steepness == 0.0:  # The wave does not reach this sensor.
            break
        shift += float(rate @ (measured.force * peak / measured.peak - curve(at))) / steepness
    return _Pulse(peak, measured.moments, curve(np.clip(arrival + measured.moments + shift, time[0], time[-1])))


@dataclass(frozen=True)
class _Model:
    """Simulated pulses as functions of the parameters p: the logarithm of the size of the loss, and the exponent if
    any.

    The size of a power law is its force at the reference speed, which is best separated from the exponent.
    """

    chain: Chain
    law: type[Dissipation]
    form: str
    structure: Structure | None
    measured: dict[int, _Pulse]
    until: float
    compare: str

    @property
    def speed(self) -> float:
        """A typical approach speed, m/s, as reference."""
        return 0.3 * self._moving(self.chain).speed

    @property
    def bounds(self) -> tuple[list[float], list[float]]:
        """Lower and upper bounds of p."""
        return ([-np.inf, 1.0], [np.inf, 5.0]) if self.law is PowerDashpot else ([-np.inf], [np.inf])

    def _moving(self, chain: Chain) -> MovingChain:
        return MovingChain(chain, self.structure.surface if self.structure else None)

    def loss(self, p: Vector) -> Dissipation:
        """Return the loss of these parameters."""
        if self.law is PowerDashpot:
            exponent = min(max(float(p[1]), 1.0), 5.0)
            return PowerDashpot(exp(p[0]) / self.speed**exponent, exponent, self.form)
        return self.law(exp(p[0]))  # type: ignore[call-arg]

    def pulses(self, parameters: Sequence[Vector]) -> list[list[_Pulse]]:
        """Return the simulated pulses at the measured moments, for all parameters at once."""
        chains = [replace(self.chain, dissipation=self.loss(p)) for p in parameters]
        moving = [self._moving(chain) for chain in chains]
        longest = min(chain.contact_time for chain in moving) / STEPS_PER_CONTACT
        dt = min([longest, *(chain.damping_time / 20.0 for chain in moving)])
        runs = batch(chains, self.until, self.structure, save_every=8.0 * longest, sensors=self.measured, dt=dt)
        dynamic = runs.contact_force - runs.static_force
        forces = [0.5 * (dynamic.sel(contact=n) + dynamic.sel(contact=n + 1)).values for n in self.measured]
        return [
            [
                _aligned(runs.time.values, force[j], pulse)
                for force, pulse in zip(forces, self.measured.values(), strict=True)
            ]
            for j in range(len(chains))
        ]

    def residuals(self, parameters: Sequence[Vector]) -> Vector:
        """Return the differences of the forces over the mean measured peak, one row for each set of parameters."""
        mean = np.mean([pulse.peak for pulse in self.measured.values()])
        rows: Vector = np.array([self._differences(pulses) for pulses in self.pulses(parameters)]) / mean
        return rows

    def _differences(self, pulses: Sequence[_Pulse]) -> Vector:
        """Return the differences of all samples, or of each amplitude: the factor with which the simulated pulse
        matches the measured one."""
        pairs = list(zip(pulses, self.measured.values(), strict=True))
        if self.compare == "pulses":
            return np.concatenate([pulse.force - measured.force for pulse, measured in pairs])
        scales = [
            float(measured.force @ pulse.force) / max(float(pulse.force @ pulse.force), 1e-300)
            for pulse, measured in pairs
        ]
        return np.array([pulse.peak * (1.0 - scale) for (pulse, _), scale in zip(pairs, scales, strict=True)])

    def check_amplitudes(self) -> None:
        """Raise a ValueError if a measured wave is larger than without losses, because no loss makes waves grow."""
        lossless = self.pulses([np.array([-LARGEST_LOGARITHM, 1.0])])[0]
        for (sensor, measured), simulated in zip(self.measured.items(), lossless, strict=True):
            if measured.peak > MOST_PEAK_RATIO * simulated.peak:
                raise ValueError(
                    f"signals: sensor {sensor} recorded {measured.peak:.4g} N, but the chain without losses has "
                    f"{simulated.peak:.4g} N; check the calibration and the impact speed"
                )

    def residual(self, p: Vector) -> Vector:
        """Return the residual for the optimiser."""
        row: Vector = self.residuals([p])[0]
        return row

    def jacobian(self, p: Vector) -> Vector:
        """Return the derivatives by central differences, all in one batch."""
        steps = 1e-3 * np.eye(p.size)
        rows = self.residuals([*(p + steps), *(p - steps)])
        slopes: Vector = (rows[: p.size] - rows[p.size :]).T / 2e-3
        return slopes

    def nearest_start(self) -> Vector:
        """Return the best of a coarse grid."""
        grid: list[Vector] = []
        for exponent in STARTING_EXPONENTS if self.law is PowerDashpot else (1.0,):
            unit = self._moving(replace(self.chain, dissipation=self.loss(np.array([0.0, exponent]))))
            scale = unit.damping_time / unit.contact_time
            grid.extend(np.array([log(size * scale), exponent]) for size in STARTING_SIZES)
        starts = [p if self.law is PowerDashpot else p[:1] for p in grid]
        errors = (self.residuals(starts) ** 2).sum(axis=1)
        return starts[int(errors.argmin())]


def _fit(model: _Model, p: Vector, jacobian: Vector, residual: Vector) -> DissipationFit:
    """Return the loss, its intervals, and what the signals determine."""
    pairs = list(zip(model.measured.items(), model.pulses([p])[0], strict=True))
    mean = np.mean([pulse.peak for (_, pulse), _ in pairs])
    amplitude = float(np.mean([abs(pulse.peak - simulated.peak) for (_, pulse), simulated in pairs]) / mean)
    shapes = {
        sensor: float(
            np.abs(pulse.force * simulated.peak / pulse.peak - simulated.force).mean() / np.abs(pulse.force).mean()
        )
        for (sensor, pulse), simulated in pairs
    }
    # A tiny number keeps a matrix of insensitive parameters invertible; their intervals then become very wide.
    information = jacobian.T @ jacobian + 1e-30 * np.eye(p.size)
    covariance = np.linalg.inv(information) * float(residual @ residual) / (residual.size - p.size)
    reach = float(scipy.stats.t.ppf(0.975, residual.size - p.size))
    half = np.minimum(reach * np.sqrt(np.diag(covariance)), LARGEST_LOGARITHM)
    loss = model.loss(p)
    if not isinstance(loss, PowerDashpot):
        name = _single(model.law)
        value = getattr(loss, name)
        interval = {name: (value * exp(-half[0]), value * exp(half[0]))}
        note = (
            ""
            if half[0] < MOST_LOGARITHM_WIDTH
            else f"the {name} is known within a factor of {exp(half[0]):.3g} only: the signals show hardly any loss"
        )
        return DissipationFit(loss, interval, amplitude, shapes, not note, 0.0, note)
    # ln γ = p₀ − α ln v: its variance from those of p₀ and α.
    direction = np.array([1.0, -log(model.speed)])
    spread = float(direction @ covariance @ direction)
    correlation = float(direction @ covariance[:, 1] / np.sqrt(spread * covariance[1, 1]))
    factor = exp(min(reach * spread**0.5, LARGEST_LOGARITHM))
    intervals = {
        "coefficient": (loss.coefficient / factor, loss.coefficient * factor),
        "exponent": (max(loss.exponent - float(half[1]), 1.0), min(loss.exponent + float(half[1]), 5.0)),
    }
    identifiable = bool(half[1] <= MOST_EXPONENT_WIDTH)
    note = "" if identifiable else (
        f"exponent and coefficient cannot be separated: the exponent is {loss.exponent:.2f} ± {half[1]:.2f}; known is "
        f"the force at {model.speed:.3g} m/s, {exp(p[0]):.3g} N within a factor of {exp(half[0]):.3g}"
    )  # fmt: skip
    return DissipationFit(loss, intervals, amplitude, shapes, identifiable, correlation, note)
