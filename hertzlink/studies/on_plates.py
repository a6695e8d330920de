"""The studies of section 6.2: the chain, and the plate that it strikes."""

import xarray as xr

import hertzlink as hl
from hertzlink.studies import waves
from plates.impact import THESIS_IMPACT

SIDE, IMPACT_SPEED, MATERIAL = 0.914, 0.31, hl.ALUMINIUM_6061
THICKNESSES = (2.29e-3, 3.18e-3, 4.83e-3)
DIAMETERS = (4.76e-3, 9.53e-3, 19.05e-3)
BEADS, SENSOR = 20, 7
# Length of the record, s. Chains of the largest beads on the two thinner plates send a wave back only when the echo of
# the edge pushes them; the larger the distance of the edge, the later this is. Records of up to 15 ms do not settle
# these cases (docs/numerics.md).
UNTIL = 3.5e-3
# Hz, resolved by the mesh. Where AR above 0.03 was sampled, it is within 0.3 % of AR on a mesh for 100 kHz. The default
# of 40 kHz is equally close and takes 50 % longer (benchmarks/plate_meshes.py).
HIGHEST_FREQUENCY = 30.0e3


def sphere(diameter: float) -> hl.Sphere:
    """Return a bead."""
    return hl.Sphere(diameter / 2.0, hl.STEEL_440C)


def chain(diameter: float) -> hl.Chain:
    """Return the chain and its striker, undamped and without gravity."""
    return hl.Chain([sphere(diameter)] * BEADS, striker=sphere(diameter), impact_speed=IMPACT_SPEED)


def plate(thickness: float) -> hl.Plate:
    """Return the square plate, clamped at two opposite edges."""
    supports = hl.Supports(left="clamped", right="clamped")
    return hl.kirchhoff_plate(SIDE, SIDE, thickness, MATERIAL, supports, highest_frequency=HIGHEST_FREQUENCY)


def contact_time(diameter: float) -> float:
    """Return T_c, s: of one bead on a half-space at the striker's speed."""
    return waves.contact_time(sphere(diameter), MATERIAL, IMPACT_SPEED)


def theirs(diameter: float) -> hl.Sphere:
    """Return the bead with the data of section 6.2.1: 8000 kg/m³, and 19.1 mm for the 19.05 mm of 6.2.2."""
    return hl.Sphere({19.05e-3: 19.1e-3}.get(round(float(diameter), 5), diameter) / 2.0, THESIS_IMPACT.material)


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return AR at the thesis's sensor."""
    return xr.Dataset({"amplitude_ratio": hl.amplitude_ratio(run, SENSOR)})
