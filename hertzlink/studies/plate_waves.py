"""Thesis section 6.2.2: speeds of the Rayleigh wave and the A0 Lamb wave, and their travel to the edge and back."""

import hertzlink as hl
from hertzlink.studies.on_plates import DIAMETERS, SIDE, THICKNESSES, OnPlate
from hertzlink.studies.table import Row, Rows

row = Rows("plate_waves")


def impact_frequency(diameter: float) -> float:
    """Return the frequency, Hz, of a bead's impact: one half-period in its contact with a half-space, 1/(2T_c)."""
    return 0.5 / OnPlate().contact_time(diameter)


def group_speeds() -> dict[float, list[float]]:
    """Return group speed of A0, m/s, at the frequency of the impact: by diameter, m, one for each of THICKNESSES."""
    return {
        diameter: [
            hl.theory.LambWaves(hl.ALUMINIUM_6061, thickness).group_speed(impact_frequency(diameter))
            for thickness in THICKNESSES
        ]
        for diameter in DIAMETERS
    }


def table() -> list[Row]:
    """Return k, c and round trip that section 6.2.2 prints for both waves, compared with the exact equations."""
    bar, rayleigh = hl.ALUMINIUM_6061.bar_speed, hl.theory.rayleigh_speed(hl.ALUMINIUM_6061)
    by_bead = group_speeds()
    factors = "; ".join(
        f"{', '.join(f'{speed / bar:.2f}' for speed in speeds)} for D = {1e3 * diameter:.2f} mm"
        for diameter, speeds in by_bead.items()
    )
    slow, fast = (find(speed for speeds in by_bead.values() for speed in speeds) for find in (min, max))
    there = 1e6 * SIDE
    return [
        row("k of the Rayleigh wave", rayleigh / bar),
        row("speed of the Rayleigh wave", rayleigh),
        row("Rayleigh wave, centre to edge and back", there / rayleigh),
        row("k of the A0 Lamb wave", f"{slow / bar:.2f} to {fast / bar:.2f}", factors),
        row("speed of the A0 Lamb wave", f"{slow:.0f} to {fast:.0f}"),
        row("A0 Lamb wave, centre to edge and back", f"{there / fast:.0f} to {there / slow:.0f}"),
    ]
