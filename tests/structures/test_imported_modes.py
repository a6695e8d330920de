"""Structures from modes, against the bodies that they were taken from."""

from pathlib import Path

import numpy as np
import pytest

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)


@pytest.fixture(scope="module")
def plate() -> hl.Structure:
    """A clamped plate, reduced to oscillators without damping."""
    body = hl.kirchhoff_plate(0.2, 0.2, 4e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"), highest_frequency=6e4)
    return hl.reduce(body.at(0.1, 0.1), until=1e-3)


def ratio(structure: hl.Structure) -> float:
    """Return AR of a chain of 12 beads on it."""
    chain = hl.Chain([BEAD] * 12, BEAD, impact_speed=0.02)
    run = hl.CoSimulation(chain, structure).run(until=1e-3)
    return float(hl.reflections(run, sensor=5).primary.amplitude_ratio)


@pytest.mark.parametrize(
    ("text", "scale"),
    [
        ("\ufefffrequency,shape,damping_ratio\n0, 100.0, 0\n2000, 150.0, 0.01\n", 1e-3),
        ("frequency, shape, damping_ratio\n0,3.1622776602,0\n2000,4.7434164903,0.01\n", 1.0),
    ],
)
def test_files_of_modes(tmp_path: Path, text: str, scale: float) -> None:
    (tmp_path / "modes.csv").write_text(text, "utf-8")
    body = hl.from_modes(tmp_path / "modes.csv", hl.PTFE, residual_flexibility=0.0, scale=scale)
    np.testing.assert_allclose(body.contact**-2, [0.1, 0.1 / 1.5**2], rtol=1e-9)  # 1e-4 t
    np.testing.assert_allclose(body.damping.diagonal(), [0.0, 2.0 * 0.01 * 2.0 * np.pi * 2000.0], rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "begins with ''"),
        ("900, 1.0\n", "begins with '900,1.0': must begin with 'frequency,shape' or 'frequency,shape,damping_ratio'"),
        ("frequency (kHz),shape\n9, 1\n", "begins with"),
        ("frequency,shape\n9, 1, 0.1\n", "requires 2 columns but 3 were found at row 1"),
        ("frequency,shape\n9, x\n", "could not convert string"),
        ("frequency,shape\n-900, 1.0\n", "must be zero or a positive number"),
        ("frequency,shape\nnan, 1.0\n", "must be a (finite )?number"),
        ("\xff\xfe", "begins with|codec"),
    ],
)
def test_other_files_of_modes_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "modes.csv").write_text(text, "utf-8")
    with pytest.raises(ValueError, match=message) as caught:
        hl.from_modes(tmp_path / "modes.csv", hl.PTFE, residual_flexibility=0.0)
    assert str(caught.value).startswith("frequencies")


def test_shapes_beside_a_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "modes.csv").write_text("frequency,shape\n900, 1\n", "utf-8")
    with pytest.raises(ValueError, match="shapes: must be omitted, as the file of the modes holds them"):
        hl.from_modes(tmp_path / "modes.csv", hl.PTFE, shapes=[1.0])


def test_a_plate_of_its_lower_modes_reflects_as_the_plate(plate: hl.Structure) -> None:
    full, count = ratio(plate), 40
    square, shapes = plate.stiffness.diagonal(), plate.contact
    higher = float((shapes**2 / square)[count:].sum())
    lower = np.sqrt(square[:count]) / (2.0 * np.pi)

    def error(residual: float) -> float:
        body = hl.from_modes(lower, hl.ALUMINIUM_6061, shapes=shapes[:count], residual_flexibility=residual)
        return abs(ratio(body) / full - 1.0)

    assert error(higher) < 2e-3
    assert error(0.0) > 5.0 * error(higher)
    with pytest.warns(hl.HertzlinkWarning, match="lack the compliance of all higher modes"):
        hl.from_modes(lower, hl.ALUMINIUM_6061, shapes=shapes[:count])


def test_too_few_modes_are_warned_of(plate: hl.Structure) -> None:
    lower = np.sqrt(plate.stiffness.diagonal()[:6]) / (2.0 * np.pi)
    body = hl.from_modes(lower, hl.ALUMINIUM_6061, shapes=plate.contact[:6], residual_flexibility=0.0)
    with pytest.warns(hl.HertzlinkWarning, match="modes up to .* kHz suits this push"):
        hl.CoSimulation(hl.Chain([BEAD] * 12, BEAD, impact_speed=0.02), body).run(until=1e-3)
