"""When the contacts between chains and structures open and close, placed between a run's saved times."""

from typing import TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from coupling.results.contact_forces import contact_forces
from coupling.results.schema import Contact
from structures.caution import caution
from structures.checks import positive
from structures.structure import Vector

SMALLEST_GAP = 1e-3
"""Gaps and contacts below this part of the greatest approach are not told: rounding makes them while all is at rest."""

OPENS, CLOSES = "opens", "closes"

Flags: TypeAlias = NDArray[np.bool_]


def contact_events(run: xr.Dataset, smallest: float = SMALLEST_GAP) -> xr.Dataset:
    """When each contact between a chain and a structure opens and closes, in one run.

    A contact is open where bead and surface are apart, the static indentation counted; with a dashpot, whose force is
    never a pull, the force ends before that. At time zero all contacts touch: one that is pressed first does not close.
    The gap is interpolated by a cubic through the two saved times before and the two after: with a dozen of them in a
    contact it is good to a ten-thousandth of that, and the error falls with save_every to the power of 3.5, as Hertz's
    force goes with δ^1.5; with its square where a dashpot closes.
    smallest: gaps and contacts that stay below this part of the contact's greatest approach are left out. Those that
    come and go between two saved times are not seen; of contacts the impulse still tells, and they are warned of.
    Dataset over the dimension event, in order of time: time (s), kind ("opens" or "closes") and the interface, and
    for several interfaces the chain, end, structure and point of each. The first opening is
    events.time[events.kind == "opens"][0].
    Raises ValueError for signals, sweeps, one chain of several, and runs without gaps.
    """
    _, force, static = contact_forces(run)
    level = positive("smallest", smallest)
    if level >= 1.0:
        raise ValueError(f"smallest = {smallest!r}: must be below 1, in units of the greatest approach")
    if "gap" not in run or "interface_impulse" not in run:
        raise ValueError("run: holds no gap and interface_impulse; must be the Dataset of CoSimulation")
    time = run.time.values
    gaps, impulses = (run[name].values.reshape(time.size, -1) for name in ("gap", "interface_impulse"))
    found: list[tuple[float, str, int]] = []
    for k, gap in enumerate(gaps.T):
        deepest = -float(gap.min(initial=0.0))
        if deepest > 0.0:
            found += [(at, kind, k) for at, kind in _crossings(time, gap, level * deepest)]
            mean = np.diff(impulses[:, k]) / np.diff(time) + static[k]
            _warn_of_hidden(time, gap > level * deepest, mean > level * force[:, k].max(), k)
    return _dataset(run, sorted(found))


def _crossings(time: Vector, gap: Vector, level: float) -> list[tuple[float, str]]:
    """Where a gap changes its sign on its way from beyond ∓ level to beyond ± level."""
    beyond = np.flatnonzero(abs(gap) > level)
    opened = np.append(gap[0] > level, gap[beyond] > 0.0)
    found = []
    for before, after, row in zip(opened, opened[1:], beyond, strict=False):
        if before != after:
            side = gap[: row + 1] > 0.0
            last = int(np.flatnonzero(side != after)[-1]) if (side != after).any() else 0
            found.append((_zero(time, gap, last), OPENS if after else CLOSES))
    return found


def _zero(time: Vector, gap: Vector, row: int) -> float:
    """The zero after a row, of a cubic through it and its neighbours."""
    near = slice(max(0, row - 1), row + 3)
    inside = CubicSpline(time[near], gap[near]).solve(0.0, extrapolate=False)
    inside = inside[(inside >= time[row]) & (inside <= time[row + 1])]
    return float(inside[0]) if inside.size else float(time[row])


def _warn_of_hidden(time: Vector, opened: Flags, pushed: Flags, interface: int) -> None:
    """Of pushes between two saved times at both of which a contact is open."""
    hidden = np.flatnonzero(opened[:-1] & opened[1:] & pushed)
    if hidden.size:
        caution(
            f"save_every: interface {interface} closes and opens again between saved times, first after "
            f"t = {time[hidden[0]]:.4g} s; save the run more often"
        )


def _dataset(run: xr.Dataset, found: list[tuple[float, str, int]]) -> xr.Dataset:
    numbers = np.array([k for _, _, k in found], dtype=int)
    kinds = np.array([kind for _, kind, _ in found], dtype=str)
    variables = {"kind": ("event", kinds), "interface": ("event", numbers)}
    if "interface" in run.dims:
        for name in Contact._fields:
            variables[name] = ("event", run[f"interface_{name}"].values[numbers])
    times = np.array([at for at, _, _ in found], dtype=float)
    return xr.Dataset(variables, {"time": ("event", times, {"units": "s"})}, run.attrs)
