"""Measures of a run, a sweep or a signal: forces, contact times, energies. `ar_and_tof` measures AR and TOF."""

from typing import Any

import numpy as np
import xarray as xr

from coupling.results.reading import Reading, at_end, number_or_array
from structures.structure import Vector


def sensor_force(run: xr.Dataset, sensor: int) -> xr.DataArray:
    """Return the force at the centre of a bead, above the preload (thesis, section 3.1).

    Parameters
    ----------
    run : Dataset
        A run, a sweep, a batch or a measured signal.
    sensor : int
        Number of the bead, 1 to N from the struck end. A chain that is too short for it has NaN, with a warning.

    Returns
    -------
    DataArray
        The force over time, N: the mean of the bead's two contact forces in a run, the measured force in a signal.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 12, bead, 0.44), hl.half_space(hl.PTFE)).run(until=4e-4)
    >>> print(f"{float(hl.sensor_force(run, sensor=6).max()):.0f} N")
    50 N
    """
    reading = Reading(run)
    if reading.is_signal:
        force = reading.measured(sensor)
    else:
        number, dynamic = reading.checked_sensor(sensor), reading.dynamic_force()
        above, below = (dynamic.sel(contact=n).reset_coords(drop=True) for n in (number, number + 1))
        force = 0.5 * (above + below)
    return force.assign_attrs(units="N", long_name=f"force at bead {int(sensor)}")


def contact_time(run: xr.Dataset) -> float | xr.DataArray:
    """Return the duration of the first contact between the last bead and the structure, s.

    Parameters
    ----------
    run : Dataset
        A run, a sweep or a batch that kept the last contact.

    Returns
    -------
    float or DataArray
        The time for which the force above the preload exceeds 1 % of its greatest value, between two linearly
        interpolated crossings; NaN if one is missing. A float for a run, an array over the axes of a sweep.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 12, bead, 0.44), hl.half_space(hl.STEEL_440C)).run(until=4e-4)
    >>> print(f"{1e6 * hl.contact_time(run):.0f} µs")
    59 µs
    """
    dynamic = Reading(run).dynamic_force().reset_coords(drop=True)
    time = run.time.values

    def one(forces: Vector) -> float:
        force = at_end(forces)
        level = 0.01 * force.max()
        above = force > level
        start = int(above.argmax())
        length = int((~above[start:]).argmax())
        if level <= 0.0 or start == 0 or length == 0:
            return float("nan")
        rise, fall = slice(start - 1, start + 1), slice(start + length - 1, start + length + 1)
        begin, end = np.interp(level, force[rise], time[rise]), np.interp(-level, -force[fall], time[fall])
        return float(end - begin)

    result = xr.apply_ufunc(one, dynamic, input_core_dims=[["contact", "time"]], vectorize=True)
    return number_or_array(result, "s", "contact of the last bead")


def energy_error(run: xr.Dataset) -> float | xr.DataArray:
    """Return the greatest change of the total energy in a run, in units of the impact energy.

    The total is the energy of beads, contacts, gravity and structures, plus the energy that losses and damping took,
    minus the work of force histories and pistons. The work done on a black box replaces its energy.

    Parameters
    ----------
    run : Dataset
        A run or a sweep of `CoSimulation`, with all its chains and structures.

    Returns
    -------
    float or DataArray
        A float for a run, an array over the axes of a sweep.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 12, bead, 0.44), hl.half_space(hl.PTFE)).run(until=4e-4)
    >>> hl.energy_error(run) < 1e-4
    True
    """
    total = sum(energies(run).values())
    change = abs(total - total.isel(time=0)).max("time") / _summed(run.impact_energy)
    return number_or_array(change.reset_coords(drop=True), "1", "energy error")


def energies(run: xr.Dataset) -> dict[str, Any]:
    """Return the parts of the total energy over time, J, for `energy_error`; driven: minus the work put in."""
    reading = Reading(run)
    reading.dynamic_force()
    reading.check_whole("chain", "structure")
    reading.check_holds(("kinetic_energy", "structure_work"))
    lost = run.structure_dissipated_energy.where(run.structure_energy.notnull(), 0.0)
    parts = {name: run[name] for name in ("kinetic_energy", "contact_energy", "dissipated_energy")}
    parts |= {"structure_energy": run.structure_energy.fillna(run.structure_work), "structure_dissipated_energy": lost}
    return {name: _summed(part) for name, part in {**parts, "driven": -run.excitation_work}.items()}


def _summed(values: xr.DataArray) -> xr.DataArray:
    """Return the sum over chains or structures, if a run has several."""
    return values.sum([axis for axis in ("chain", "structure") if axis in values.dims])
