"""The model of a sensor bead: loss of charge, limited bandwidth, and the gauge's resonance."""

from collections.abc import Callable, Iterable
from functools import reduce
from math import pi
from typing import Annotated

import numpy as np
import scipy
import xarray as xr
from numpy.typing import ArrayLike

from coupling.results.measures import sensor_force
from coupling.results.reading import Reading
from coupling.results.schema import SIGNAL, kind_of
from coupling.results.sensor_trace import checked_trace
from coupling.signals.conditioning import checked_signal
from coupling.signals.signals import as_signal
from structures.checks import instance, listed, whole
from structures.described import described
from structures.quantities import Interval, Quantity
from structures.structure import Vector


@described
class SensorModel:
    """A sensor bead: the gauge's resonance, the bandwidth of the electronics, and the loss of charge of a piezo gauge.

    The three act in series: ω²/(s² + 2ζωs + ω²), 1/(1 + s/2πf) and τs/(1 + τs). The response is exact for forces that
    are linear between samples, and starts at rest.

    Parameters
    ----------
    time_constant : float, optional
        RC of gauge and amplifier, s; they act as a high-pass. None: no charge is lost.
    bandwidth : float, optional
        Frequency, Hz, at which the electronics, a first-order low-pass, pass 1/√2 (−3 dB). None: unlimited.
    stiffness : float, optional
        Stiffness of the gauge, N/m; with `mass` it has a resonance at √(k/m)/2π. None: the gauge is rigid.
    mass : float, optional
        Mass that rests on the gauge, kg.
    damping : float
        Damping of the resonance, as a part of the critical damping.

    Examples
    --------
    >>> import numpy as np
    >>> seen = hl.SensorModel(time_constant=1e-3).response(np.linspace(0.0, 1e-3, 1001), np.full(1001, 10.0))
    >>> print(f"{seen[0]:.2f} N, {seen[-1]:.2f} N")
    10.00 N, 3.68 N
    """

    time_constant: Interval | None = None
    bandwidth: Annotated[float, Quantity("Hz", "a frequency", "100 kHz")] | None = None
    stiffness: Annotated[float, Quantity("N/m", "a stiffness", "200 N/m")] | None = None
    mass: Annotated[float, Quantity("kg", "a mass", "2 g")] | None = None
    damping: Annotated[float, Quantity()] = 0.02

    def __post_init__(self) -> None:
        resonance, others = [self.stiffness, self.mass], [self.time_constant, self.bandwidth]
        if resonance.count(None) == 1 or not any([*resonance, *others]):
            raise ValueError(
                f"stiffness = {self.stiffness}, mass = {self.mass}: give both, or else a time_constant or a bandwidth"
            )

    def response(self, time: ArrayLike, force: ArrayLike) -> Vector:
        """Return the force that the sensor reports, N, for a force at equal time steps (s, N)."""
        moments = checked_trace("time", time, "s")
        signal, steps = checked_trace("force", force, "N", moments.size), np.diff(moments)
        if not (steps > 0.0).all() or np.ptp(steps) > 1e-3 * steps.mean():
            raise ValueError("time: must have equal steps; resample the force first, for instance with numpy.interp")

        # The states of each stage have the unit of the force, which is zero before the first sample.
        frequencies, stages = dict[str, float](), []
        if self.stiffness is not None and self.mass is not None:
            w = float(np.sqrt(self.stiffness / self.mass))
            frequencies["resonance of stiffness and mass"] = w / (2.0 * pi)
            stages.append(([[0.0, w], [-w, -2.0 * self.damping * w]], [[0.0], [w]], [[1.0, 0.0]], [[0.0]]))
        if self.bandwidth is not None:
            w = 2.0 * pi * self.bandwidth
            frequencies["bandwidth"] = self.bandwidth
            stages.append(([[-w]], [[w]], [[1.0]], [[0.0]]))
        if self.time_constant is not None:
            w = 1.0 / self.time_constant
            stages.append(([[-w]], [[w]], [[-1.0]], [[1.0]]))
        nyquist = 0.5 / float(moments[1] - moments[0])
        for name, frequency in frequencies.items():
            if frequency > nyquist:
                raise ValueError(
                    f"{name} = {frequency:.4g} Hz: must be at most half the sampling rate, {nyquist:.4g} Hz; leave it "
                    "out, or sample more finely"
                )
        # In a product of scipy's systems, the right factor acts first.
        system = reduce(lambda first, then: then * first, (scipy.signal.StateSpace(*stage) for stage in stages))
        return np.asarray(scipy.signal.lsim(system, signal, moments - moments[0], interp=True)[1])

    def apply(self, signal: xr.Dataset, sensors: Iterable[int] | None = None) -> xr.Dataset:
        """Return the measured signal of sensors like this one. `sensors`: by default all sensors of a signal."""
        instance("signal", signal, xr.Dataset, "a run, or a signal of read_signal or as_signal")
        return self._each(signal, sensors, self.response, "Seen by")

    def correct(self, signal: xr.Dataset) -> xr.Dataset:
        """Return a measured signal without the loss of charge. Remove the offset first: it would grow with time."""
        checked_signal("signal", signal)
        if self.time_constant is None:
            raise ValueError("time_constant = None: must be given, because `correct` restores the charge lost with it")
        # The seen force is v[k] = z[k] − w[k], with the lost part w[k+1] = a w[k] + first z[k] + second z[k+1] for a
        # force z that is linear over a step, and a + first + second = 1.
        ratio = float(signal.time[1] - signal.time[0]) / self.time_constant
        mean = -np.expm1(-ratio) / ratio
        first, second = mean - np.exp(-ratio), 1.0 - mean

        return self._each(
            signal, None,
            lambda _, seen: seen + np.append(0.0, np.cumsum(first * seen[:-1] + second * seen[1:]) / (1.0 - second)),
            "Loss of charge restored for",
        )  # fmt: skip

    def _each(
        self, signal: xr.Dataset, sensors: Iterable[int] | None, change: Callable[[Vector, Vector], Vector], how: str
    ) -> xr.Dataset:
        forces, beads = dict[int, Vector](), sensors
        if sensors is None and kind_of(signal) == SIGNAL:
            beads = signal.sensor.values.tolist()
        for sensor in listed("sensors", beads, object, "one bead number or more"):
            number = whole("sensors", sensor)
            force = sensor_force(signal, number)
            if force.dims != ("time",):
                raise ValueError("signal: must be one run or signal of one chain; choose it with signal.isel(chain=0)")
            if gone := int((~np.isfinite(force.values)).sum()):
                raise ValueError(f"signal: sensor {number} has {gone} clipped samples (NaN); must have none")
            forces[number] = change(signal.time.values, force.values)
        places = {n: Reading(signal).position(n) for n in forces} if "centre" in signal.coords else None
        text = "\n".join([*str(signal.attrs.get("conditioning", "")).splitlines(), f"{how} {self!r}."])
        return as_signal(signal.time.values, forces, places).assign_attrs(conditioning=text)
