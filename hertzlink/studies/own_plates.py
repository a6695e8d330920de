"""Rows of the study plate-boundary for plates and beads of a user's own: the critical distance, and the law for it."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from hertzlink.studies.on_plates import BEADS, SENSOR, OnPlate
from hertzlink.studies.table import Row, bracketed
from plates.critical_distance import critical_distance_law
from plates.theory.impact import amplitude_ratio as plate_amplitude_ratio
from plates.theory.impact import inelasticity_parameter


def rows(data: xr.Dataset, of: OnPlate, tolerances: Sequence[float]) -> list[Row]:
    """For each plate and bead; tolerances: of AR, the middle one counts."""
    found: list[Row] = []
    for diameter in data.diameter.values:
        for thickness in data.thickness.values:
            one = data.sel(diameter=diameter, thickness=thickness)
            found += [_critical(one, of, tolerances), *_echo(one, of, tolerances[1]), *_far(one, of)]
    return found


def printed(at: xr.Dataset) -> str:
    """Between which distances, mm, the critical one lies."""
    low, high = at.bracket.values * 1e3
    if at.lower_bound:
        return f"> {low:.0f}"
    return "no wave" if np.isnan(at.critical_distance) else bracketed(low, high)


def named(one: xr.Dataset) -> str:
    """The bead and the plate."""
    return f"D {float(one.diameter) * 1e3:.2f}, t {float(one.thickness) * 1e3:.2f}"


def tolerated(tolerances: Sequence[float], others: Sequence[str]) -> str:
    """The tolerance that defines a critical distance, the middle one, and what the least and the largest give."""
    low, usual, high = tolerances
    return f"AR within ± {usual:g} of its far value (± {low:g}: {others[0]}; ± {high:g}: {others[1]})"


def _critical(one: xr.Dataset, of: OnPlate, tolerances: Sequence[float]) -> Row:
    low, high = one.bound.values * 1e3
    others = [printed(one.sel(within=other)) for other in (tolerances[0], tolerances[-1])]
    reason = f"{tolerated(tolerances, others)}; equation 6.42: {low:.1f} to {high:.1f}"
    value, law = _law(one, of, tolerances[1])
    at = one.sel(within=tolerances[1])
    if at.lower_bound:
        reason = f"a lower bound: from farther away no wave is back within {of.until * 1e3:.3g} ms; {reason}"
    return Row(f"critical distance, {named(one)}", "", printed(at), "mm", f"{law}{reason}", value)


def _law(one: xr.Dataset, of: OnPlate, tolerance: float) -> tuple[float | str, str]:
    """The critical distance, mm, by the law, which is for 13 beads between sensor and plate, and its bounds."""
    if of.beads - of.sensor != BEADS - SENSOR:
        return "", f"the law of the study critical-distance is for {BEADS - SENSOR} beads behind the sensor; "
    bead, plate = of.sphere(float(one.diameter)), of.plate(float(one.thickness))
    try:
        law = critical_distance_law(bead, plate, of.impact_speed, of.support, tolerance)
    except ValueError:
        parameter = inelasticity_parameter(bead, plate, of.impact_speed)
        return "", f"outside the law of the study critical-distance (λ = {parameter:.3g}); "
    value, low, high = (1e3 * part for part in law)
    return value, f"theory: the law of the study critical-distance, {low:.1f} to {high:.1f}; "


def _echo(one: xr.Dataset, of: OnPlate, tolerance: float) -> list[Row]:
    """The criterion without a tolerance, which is for clamped edges."""
    if of.support != "clamped":
        return []
    lasts = (
        f"AR within ± {tolerance:g}; theory: half of the echo is back as the contact ends, "
        f"{float(one.contact_time) * 1e6:.0f} µs on the"
    )
    return [
        Row(f"by the echo alone, {named(one)}", "", printed(one.sel(within=tolerance)), "mm", f"{lasts} infinite plate",
            float(one.half_echo_distance) * 1e3),
    ]  # fmt: skip


def _far(one: xr.Dataset, of: OnPlate) -> list[Row]:
    bead, plate = of.sphere(float(one.diameter)), of.plate(float(one.thickness))
    parameter = float(inelasticity_parameter(bead, plate, of.impact_speed))
    far, inside = float(one.far_value.fillna(0.0)), float(one.infinite_amplitude_ratio.fillna(0.0))
    reason = (
        f"theory: Zener, e^(6/5) of one bead at the striker's speed, λ = {parameter:.3g}; a chain on the infinite "
        f"plate {inside:.4f}; T_c on a half-space {of.contact_time(float(one.diameter)) * 1e6:.4g} µs"
    )
    value = far if far > 0.0 else "no wave"
    return [Row(f"AR at the centre, {named(one)}", "", value, "", reason, float(plate_amplitude_ratio(parameter)))]
