"""The thesis's Table 2.1, densities and elastic constants, compared with those of hertzlink."""

import hertzlink as hl
from hertzlink.studies.table import Row, Rows

row = Rows("table_2_1")


def table() -> list[Row]:
    """Return the 27 numbers of Table 2.1, and those of hertzlink."""
    rows = []
    for name in row.entries:
        constant, _, material = name.partition(", ")
        constants = hl.MATERIALS[material]
        ours = {"density": constants.density, "Young's modulus": 1e-9 * constants.youngs_modulus}
        rows.append(row(name, ours.get(constant, constants.poisson_ratio)))
    return rows
