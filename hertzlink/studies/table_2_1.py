"""Thesis Table 2.1, the materials of beads and specimens, compared with those of hertzlink."""

from hertzlink.studies.table import INPUT, Row
from structures.material import MATERIALS

PRINTED = {
    "steel 316": (8000.0, 193.0, 0.30),
    "steel 440C": (7800.0, 200.0, 0.28),
    "copper": (8960.0, 115.0, 0.35),
    "brass 360": (8550.0, 103.0, 0.34),
    "aluminium 6061": (2693.0, 68.9, 0.33),
    "nylon": (1140.0, 6.52, 0.40),
    "acrylic": (1186.0, 4.75, 0.35),
    "polycarbonate": (1196.0, 3.75, 0.35),
    "PTFE": (2151.0, 1.53, 0.46),
}
"""Density (kg/m³), Young's modulus (GPa) and Poisson's ratio, as printed."""

REMARKS = {
    "nylon": "as of all polymers here extrapolated from shock waves (Hugoniot), so of sudden loads",
    "PTFE": "1.46 in Table 4.1 of the thesis, which contradicts this one",
}
"""Remarks on Young's modulus."""


def table() -> list[Row]:
    """The 27 numbers of Table 2.1, and those of hertzlink."""
    rows = []
    for name, (density, modulus, ratio) in PRINTED.items():
        material = MATERIALS[name]
        rows += [
            Row(f"density, {name}", density, material.density, "kg/m³", within=INPUT),
            Row(
                f"Young's modulus, {name}",
                modulus,
                1e-9 * material.youngs_modulus,
                "GPa",
                REMARKS.get(name, ""),
                within=INPUT,
            ),
            Row(f"Poisson's ratio, {name}", ratio, material.poisson_ratio, within=INPUT),
        ]
    return rows
