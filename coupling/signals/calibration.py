"""The calibration of a sensor bead by the impact of a striker of known momentum (thesis, section 2.2)."""

from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike

from coupling.results.sensor_trace import checked_trace, quiet_lead, smoothed
from structures.checks import one_of, positive

FOOT = 0.01  # An impact begins where the trace last exceeds this part of its greatest value.


def calibration_factor(
    time: ArrayLike,
    voltage: ArrayLike,
    mass: float,
    impact_speed: float,
    backing: Literal["immobile", "free"] = "immobile",
) -> float:
    """Return the calibration factor κ of a sensor bead, N/V, from the impact of a striker of known momentum.

    κ = m v / ∫ V dt (thesis, equation 2.1) up to the greatest voltage, where the striker rests. Against a free bead
    both move together there, and the impulse is half the momentum.

    Parameters
    ----------
    time, voltage : array_like
        One impact, s and V; the zero is the median of the quiet lead before it.
    mass : float
        Mass of the striker, kg.
    impact_speed : float
        Speed of the striker, m/s; `drop_speed(height)` gives √(2gh).
    backing : {"immobile", "free"}
        What the sensor lies on: a massive block, where the force at its centre is the contact force, or nothing: a free
        bead equal to the striker.

    Returns
    -------
    float
        κ, the contact force per volt. The force at the centre of a free bead is half of that: halve κ for it.

    Examples
    --------
    >>> import numpy as np
    >>> from coupling.signals.calibration import calibration_factor
    >>> time = np.linspace(-1e-4, 1e-4, 2001)
    >>> voltage = np.where(abs(time) < 2e-5, np.cos(np.pi * time / 4e-5), 0.0)
    >>> print(f"{calibration_factor(time, voltage, mass=3.5e-3, impact_speed=0.44):.0f} N/V")
    121 N/V
    """
    share = {"immobile": 1.0, "free": 0.5}[one_of("backing", backing, ("immobile", "free"))]
    momentum = share * positive("mass", mass, "kg") * positive("impact_speed", impact_speed, "m/s")
    t = checked_trace("time", time, "s")
    v = checked_trace("voltage", voltage, "V", t.size)
    if not (np.diff(t) > 0.0).all():
        raise ValueError("time: must increase from sample to sample")
    if not (lead := quiet_lead(v)):
        raise ValueError("voltage: has no quiet lead to take the zero from, must begin before the impact")
    v = v - np.median(v[:lead])
    smooth, _, width = smoothed(v)
    peak = int(smooth.argmax())
    if not smooth[peak] > -smooth.min():
        raise ValueError(f"voltage: its greatest deflection is negative, {smooth.min():.3g} V: must be a pulse")
    if not 0 < peak < v.size - 1:
        raise ValueError("voltage: must hold the whole compression, from a quiet lead to beyond its greatest value")

    # From the foot of the pulse to the vertex of a parabola through its top.
    reach = max(1, round(width / 4.0))
    near = slice(max(0, peak - reach), peak + reach + 1)
    vertex = np.polynomial.Polynomial.fit(t[near], v[near], 2).deriv().roots()[0]
    end = float(np.clip(vertex, t[near][0], t[near][-1]))
    start = int(np.flatnonzero(smooth[:peak] < FOOT * smooth[peak])[-1:].sum())
    until = np.append(t[start:][t[start:] < end], end)
    return momentum / float(scipy.integrate.trapezoid(np.interp(until, t, v), until))
