"""Materials and surfaces: Table 2.1, look-up by name, Hertz's stiffness, bad input."""

import pytest

import hertzlink as hl


def test_table_2_1_by_name_and_constant() -> None:
    assert hl.MATERIALS["steel 440C"] is hl.STEEL_440C
    assert hl.MATERIALS["Aluminium_6061"] is hl.ALUMINIUM_6061
    assert len(hl.MATERIALS) == 9
    assert hl.MATERIALS["ptfe"].youngs_modulus == 1.53e9


def test_unknown_material_names_the_nearest() -> None:
    with pytest.raises(ValueError, match=r"material = 'steel 440': unknown.*'steel 440C'"):
        hl.MATERIALS["steel 440"]
    assert "granite" not in hl.MATERIALS
