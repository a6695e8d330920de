"""Opening and closing of the contacts between chains and structures, placed between a run's saved times."""

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from coupling.results.reading import Reading, contact_forces
from coupling.results.schema import Contact
from structures.caution import caution
from structures.checks import positive
from structures.structure import Vector
from structures.units import readable

# Gaps and contacts below this part of the greatest approach are not reported: rounding makes them at rest.
SMALLEST_GAP = 1e-3


def contact_events(run: xr.Dataset, smallest: float = SMALLEST_GAP) -> xr.Dataset:
    """Return when each contact between a chain and a structure opens and closes.

    A contact is open where bead and surface are apart, the static indentation included. All contacts touch at time
    zero; one that is pressed first does not close. A cubic through the saved times before and after interpolates the
    gap: with twelve saved times in a contact the error is 1e-4 of its duration.

    Parameters
    ----------
    run : Dataset
        One run of `CoSimulation`, with all its chains.
    smallest : float
        Gaps and contacts that stay below this part of the contact's greatest approach are left out.

    Returns
    -------
    Dataset
        Over the dimension "event", in order of time: time (s), kind ("opens" or "closes") and interface; for several
        interfaces also the chain, end, structure and point of each.

    Warns
    -----
    HertzlinkWarning
        If a contact closes and opens again between two saved times: its impulse shows it.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 12, striker=bead, impact_speed=0.44)
    >>> events = hl.contact_events(hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=4e-4))
    >>> print(f"{1e6 * float(events.time[events.kind == 'opens'][0]):.0f} µs")
    253 µs
    """
    _, force, static = contact_forces(run)
    if not (level := positive("smallest", smallest)) < 1.0:
        raise ValueError(f"smallest = {smallest!r}: must be below 1, in units of the greatest approach")
    reading = Reading(run)
    reading.check_holds(["gap", "interface_impulse"], "CoSimulation")
    time = reading.time
    gaps, impulses = (run[name].values.reshape(time.size, -1) for name in ("gap", "interface_impulse"))
    events = list[tuple[float, str, int]]()
    for k, gap in enumerate(gaps.T):
        deepest = -float(gap.min(initial=0.0))
        if not deepest > 0.0:
            continue
        events += [(at, kind, k) for at, kind in _crossings(time, gap, level * deepest)]
        # A push between two saved times at both of which the contact is open.
        mean, opened = np.diff(impulses[:, k]) / np.diff(time) + static[k], gap > level * deepest
        hidden = np.flatnonzero(opened[:-1] & opened[1:] & (mean > level * force[:, k].max()))
        if hidden.size:
            caution(
                f"save_every: interface {k} closes and opens again between saved times, first after "
                f"t = {readable(float(time[hidden[0]]), 's', 4)}; save the run more often"
            )
    times, kinds, places = zip(*sorted(events), strict=True) if events else ((), (), ())
    interfaces = np.array(places, dtype=int)
    variables = {"kind": ("event", np.array(kinds, dtype=str)), "interface": ("event", interfaces)}
    if "interface" in run.dims:
        variables |= {name: ("event", run[f"interface_{name}"].values[interfaces]) for name in Contact._fields}
    return xr.Dataset(variables, {"time": ("event", np.array(times, dtype=float), {"units": "s"})}, run.attrs)


def _crossings(time: Vector, gap: Vector, level: float) -> list[tuple[float, str]]:
    """Return where a gap changes its sign on its way from beyond ∓ level to beyond ± level, and how."""
    beyond = np.flatnonzero(abs(gap) > level)
    opened = np.append(gap[0] > level, gap[beyond] > 0.0)
    crossings = []
    for before, after, row in zip(opened, opened[1:], beyond, strict=False):
        if before != after:
            side = gap[: row + 1] > 0.0
            last = int(np.flatnonzero(side != after)[-1]) if (side != after).any() else 0
            near = slice(max(0, last - 1), last + 3)
            zeros = CubicSpline(time[near], gap[near]).solve(0.0, extrapolate=False)
            inside = zeros[(zeros >= time[last]) & (zeros <= time[last + 1])]
            crossings.append((float(inside[0] if inside.size else time[last]), "opens" if after else "closes"))
    return crossings
