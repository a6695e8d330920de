"""Materials and surfaces: Table 2.1, look-up by name, Hertz's stiffness, bad input."""

import pytest

import hertzlink as hl

# Density, kg/m³, Young's modulus, GPa, and Poisson's ratio, as the thesis prints them.
TABLE_2_1 = {
    "steel 316": (8000, 193, 0.3), "steel 440C": (7800, 200, 0.28), "copper": (8960, 115, 0.35),
    "brass 360": (8550, 103, 0.34), "aluminium 6061": (2693, 68.9, 0.33), "nylon": (1140, 6.52, 0.4),
    "acrylic": (1186, 4.75, 0.35), "polycarbonate": (1196, 3.75, 0.35), "PTFE": (2151, 1.53, 0.46),
}  # fmt: skip


def test_table_2_1_by_name_and_constant() -> None:
    for name, (density, modulus, ratio) in TABLE_2_1.items():
        of = hl.MATERIALS[name]
        assert (of.density, 1e-9 * of.youngs_modulus, of.poisson_ratio) == pytest.approx((density, modulus, ratio))
    assert hl.MATERIALS["steel 440C"] is hl.STEEL_440C
    assert hl.MATERIALS["Aluminium_6061"] is hl.ALUMINIUM_6061
    assert len(hl.MATERIALS) == len(TABLE_2_1)
    assert hl.MATERIALS["ptfe"] is hl.PTFE


def test_unknown_material_names_the_nearest() -> None:
    with pytest.raises(ValueError, match=r"material = 'steel 440': must be in MATERIALS; nearest: 'steel 440C'"):
        hl.MATERIALS["steel 440"]
    assert "granite" not in hl.MATERIALS
