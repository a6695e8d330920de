"""Lamb's waves against closed forms, limits, and a plate cut into polynomials through its thickness."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.polynomial import Legendre
from scipy.linalg import eigh

import hertzlink as hl
from structures.bodies.elasticity import pressure_speed, shear_speed

THICKNESS = 2.29e-3
RATIOS = (-0.3, 0.1, 0.33, 0.46)


def solid(poisson_ratio: float) -> hl.Material:
    return hl.Material(70.0e9, poisson_ratio, 2700.0)


def by_polynomials(material: hl.Material, wave_number: float, symmetric: bool) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies, Hz, and group speeds, m/s, at a wave number, rad/m: Galerkin's method (SAFE), Legendre polynomials.

    Along the plate u = U(z) sin kx and w = W(z) cos kx; of U and W one is even in z and the other odd. No boundary is
    imposed: free faces are natural. The group speed is that of the energy, φᵀ (∂K/∂k) φ / 2ω.
    """
    z, weights = np.polynomial.legendre.leggauss(28)
    half, k = THICKNESS / 2.0, wave_number
    shapes = [Legendre.basis(degree) for degree in range(24)]
    along, across = (shapes[::2], shapes[1::2]) if symmetric else (shapes[1::2], shapes[::2])
    u, w = (np.array([shape(z) for shape in family]) for family in (along, across))
    du, dw = (np.array([shape.deriv()(z) / half for shape in family]) for family in (along, across))
    rows = [(u, 0 * w), (0 * u, w), (k * u, 0 * w), (0 * u, dw), (du, -k * w), (u, 0 * w), (0 * u, -w)]
    u, w, stretch, squeeze, shear, more_stretch, more_shear = (np.vstack(row) for row in rows)

    def integral(one: np.ndarray, other: np.ndarray) -> np.ndarray:
        return half * (one * weights) @ other.T + half * (other * weights) @ one.T

    pressure = material.density * pressure_speed(material) ** 2
    rigid = material.density * shear_speed(material) ** 2
    lame = pressure - 2.0 * rigid
    stiffness = pressure * (integral(stretch, stretch) + integral(squeeze, squeeze)) / 2.0
    stiffness += lame * integral(stretch, squeeze) + rigid * integral(shear, shear) / 2.0
    slope = pressure * integral(more_stretch, stretch) + lame * integral(more_stretch, squeeze)
    slope += rigid * integral(more_shear, shear)
    square, modes = eigh(stiffness, material.density * (integral(u, u) + integral(w, w)) / 2.0)
    pulse = np.sqrt(np.maximum(square, 1e-300))
    return pulse / (2.0 * np.pi), np.einsum("ij,ik,kj->j", modes, slope, modes) / (2.0 * pulse)


@pytest.mark.parametrize("family", ["S", "A"])
@pytest.mark.parametrize("ratio", RATIOS)
def test_curves_by_polynomials(ratio: float, family: str) -> None:
    """The first five modes of either family, all labels, frequencies, phase and group speeds."""
    material, numbers = solid(ratio), np.array([1.0, 2.5, 5.0, 9.0]) / THICKNESS
    for wave_number in numbers:
        frequencies, speeds = by_polynomials(material, wave_number, family == "S")
        for number in range(5):
            mode, frequency = f"{family}{number}", float(frequencies[number])
            found = hl.theory.LambWaves(material, THICKNESS, mode).frequency(wave_number)
            assert found == pytest.approx(frequency, rel=1e-8), (mode, wave_number * THICKNESS)
            if speeds[number] > 100.0:
                speed = 2.0 * np.pi * frequency / wave_number
                assert hl.theory.LambWaves(material, THICKNESS, mode).phase_speed(frequency) == pytest.approx(
                    speed, rel=1e-6
                )
                found = hl.theory.LambWaves(material, THICKNESS, mode).group_speed(frequency)
                assert found == pytest.approx(speeds[number], rel=1e-5)


def test_rayleigh_speed() -> None:
    """ξ = (c_R/c_s)²: 3 − √5 at ν = 0, 2 − 2/√3 at 1/4, and the roots of the secular equation itself elsewhere."""
    for ratio, square in ((0.0, 3.0 - 5.0**0.5), (0.25, 2.0 - 2.0 / 3.0**0.5)):
        material = solid(ratio)
        assert (hl.theory.rayleigh_speed(material) / shear_speed(material)) ** 2 == pytest.approx(square, rel=1e-13)
    for ratio in (*RATIOS, -0.9, 0.499):
        material = solid(ratio)
        square = (hl.theory.rayleigh_speed(material) / shear_speed(material)) ** 2
        slow = square * (shear_speed(material) / pressure_speed(material)) ** 2
        assert (2.0 - square) ** 2 == pytest.approx(4.0 * np.sqrt((1.0 - square) * (1.0 - slow)), rel=1e-12)


def test_rayleigh_speed_of_the_thesis() -> None:
    """Section 6.2.2 takes 0.57 √(E/ρ), about 2900 m/s, in aluminium."""
    found = hl.theory.rayleigh_speed(hl.ALUMINIUM_6061)
    assert found / hl.ALUMINIUM_6061.bar_speed == pytest.approx(0.57, abs=5e-3)
    assert found == pytest.approx(2900.0, rel=5e-3)


@pytest.mark.parametrize("ratio", RATIOS)
def test_long_bending_waves(ratio: float) -> None:
    """A0: Kirchhoff's speed times 1 − (17 − 7ν)/(240(1 − ν)) (kt)², what is left of fourth order; group speed twice.

    The order of what is left checks the coefficient. Far below, Kirchhoff's speed alone.
    """
    material = solid(ratio)
    stiffness = np.sqrt(material.contact_modulus * THICKNESS**2 / (12.0 * material.density))
    waves = np.array([0.4, 0.2, 0.1, 1e-5]) / THICKNESS
    frequency = hl.theory.LambWaves(material, THICKNESS).frequency(waves)
    kirchhoff = np.sqrt(2.0 * np.pi * frequency * stiffness)
    phase = hl.theory.LambWaves(material, THICKNESS).phase_speed(frequency)
    assert phase == pytest.approx(2.0 * np.pi * frequency / waves, rel=1e-10)
    k = np.sqrt(2.0 * np.pi * frequency / stiffness) * THICKNESS
    rest = 1.0 - (17.0 - 7.0 * ratio) / (240.0 * (1.0 - ratio)) * k**2 - phase / kirchhoff
    assert np.log2(np.abs(rest[:2] / rest[1:3])) == pytest.approx([4.0, 4.0], abs=0.2)
    assert phase[3] == pytest.approx(kirchhoff[3], rel=1e-10)
    assert hl.theory.LambWaves(material, THICKNESS).group_speed(frequency)[3] == pytest.approx(
        2.0 * kirchhoff[3], rel=1e-9
    )


@pytest.mark.parametrize(
    ("mode", "near", "band"),
    [
        ("A0", 0.199, 2e-2),
        ("S0", 6.8746186, 1e-3),
        ("S0", 6.8746186, 1e-5),
        ("A1", 2.8827174, 1e-3),
        ("A1", 2.8827174, 1e-5),
    ],
)
def test_curves_have_no_seam(mode: str, near: float, band: float) -> None:
    """Where one formula hands over to another, d ln c / d ln ω = 1 − c/c_g holds over every small step.

    kt: A0's long waves end; S0 is as fast as shear waves, and A1 as pressure waves, where a quotient is 0/0.
    """
    waves = near * (1.0 + np.linspace(-band, band, 201)) / THICKNESS
    frequency = hl.theory.LambWaves(hl.ALUMINIUM_6061, THICKNESS, mode).frequency(waves)
    speed = np.log(hl.theory.LambWaves(hl.ALUMINIUM_6061, THICKNESS, mode).phase_speed(frequency))
    slope = 1.0 - np.exp(speed) / hl.theory.LambWaves(hl.ALUMINIUM_6061, THICKNESS, mode).group_speed(frequency)
    assert np.abs(np.diff(slope, 2)).max() < 1e-9
    step = np.diff(np.log(frequency))
    assert np.diff(speed) == pytest.approx(step * (slope[1:] + slope[:-1]) / 2.0, abs=1e-11)


@pytest.mark.parametrize("ratio", RATIOS)
def test_other_limits(ratio: float) -> None:
    """S0 of long waves as in a sheet, √(E/ρ(1−ν²)); A0 and S0 of short ones Rayleigh's; A2 and S2 shear waves."""
    material = solid(ratio)
    sheet = np.sqrt(material.contact_modulus / material.density)
    assert hl.theory.LambWaves(material, THICKNESS, "S0").phase_speed(10.0) == pytest.approx(sheet, rel=1e-9)
    assert hl.theory.LambWaves(material, THICKNESS, "S0").group_speed(10.0) == pytest.approx(sheet, rel=1e-9)
    for mode in ("A0", "S0"):
        waves = hl.theory.LambWaves(material, THICKNESS, mode)
        for speed in (waves.phase_speed, waves.group_speed):
            assert speed(1e9) == pytest.approx(hl.theory.rayleigh_speed(material), rel=1e-10)
    for mode in ("A2", "S2"):
        assert hl.theory.LambWaves(material, THICKNESS, mode).phase_speed(1e9) == pytest.approx(
            shear_speed(material), rel=1e-3
        )


@pytest.mark.parametrize("ratio", [0.1, 0.33, 0.46])
@pytest.mark.parametrize(("mode", "order"), [("S0", 1), ("S1", 3), ("S2", 5), ("A1", 2), ("A2", 4), ("A3", 6)])
def test_lame_waves(ratio: float, mode: str, order: int) -> None:
    """Shear waves at 45° that no face turns into pressure: c = √2 c_s and c_g = c_s/√2 where kt = π order.

    For ν < 0, where c_p < √2 c_s, modes of other numbers have them.
    """
    material = solid(ratio)
    shear = shear_speed(material)
    frequency = order * shear / (np.sqrt(2.0) * THICKNESS)
    assert hl.theory.LambWaves(material, THICKNESS, mode).phase_speed(frequency) == pytest.approx(
        np.sqrt(2.0) * shear, rel=1e-11
    )
    assert hl.theory.LambWaves(material, THICKNESS, mode).group_speed(frequency) == pytest.approx(
        shear / np.sqrt(2.0), rel=1e-10
    )
    found = hl.theory.LambWaves(material, THICKNESS, mode).frequency(order * np.pi / THICKNESS)
    assert found == pytest.approx(frequency, rel=1e-11)


def test_without_poisson_effect_s0_has_the_speed_of_a_bar() -> None:
    """ν = 0: an even stretch needs no motion across, at any frequency, until S1 crosses it at kt = π."""
    material = solid(0.0)
    frequency = np.array([0.01, 0.5, 0.99]) * material.bar_speed / (2.0 * THICKNESS)
    waves = hl.theory.LambWaves(material, THICKNESS, "S0")
    for speed in (waves.phase_speed, waves.group_speed):
        assert speed(frequency) == pytest.approx(np.full(3, material.bar_speed), rel=1e-9)


@pytest.mark.parametrize("family", ["S", "A"])
@pytest.mark.parametrize("ratio", [*RATIOS, 1.0 / 3.0])
def test_cutoffs(ratio: float, family: str) -> None:
    """Half wavelengths through the thickness: those of the whole curves at k = 0, and of the polynomials there.

    At ν = 1/3 pressure is twice as fast as shear, and cut-offs meet in pairs.
    """
    material = solid(ratio)
    exact = [hl.theory.LambWaves(material, THICKNESS, f"{family}{number}").cutoff_frequency() for number in range(6)]
    assert exact[0] == 0.0
    # At k = 0 the polynomials hold one rigid motion of either family, whose frequency is zero but for rounding.
    assert by_polynomials(material, 0.0, family == "S")[0][1:6] == pytest.approx(exact[1:], rel=1e-9)
    for number in range(6):
        found = hl.theory.LambWaves(material, THICKNESS, f"{family}{number}").frequency(0.0)
        assert found == pytest.approx(exact[number], rel=1e-12, abs=1e-9)


def test_backward_waves() -> None:
    """S1 of aluminium runs backwards near its cut-off: two wave numbers at one frequency, of which the forward one."""
    waves = np.linspace(0.0, 4.0, 400) / THICKNESS
    frequency = hl.theory.LambWaves(hl.ALUMINIUM_6061, THICKNESS, "S1").frequency(waves)
    cutoff = hl.theory.LambWaves(hl.ALUMINIUM_6061, THICKNESS, "S1").cutoff_frequency()
    lowest = frequency.argmin()
    polynomials, speeds = by_polynomials(hl.ALUMINIUM_6061, waves[lowest], symmetric=True)
    assert frequency[lowest] == pytest.approx(polynomials[1], rel=1e-9)
    assert abs(speeds[1]) < 30.0
    assert frequency[lowest] < 0.95 * cutoff
    between = np.array([0.2, 0.5, 0.99]) * (cutoff - frequency[lowest]) + frequency[lowest]
    assert np.all(hl.theory.LambWaves(hl.ALUMINIUM_6061, THICKNESS, "S1").group_speed(between) > 0.0)
    found = 2.0 * np.pi * between / hl.theory.LambWaves(hl.ALUMINIUM_6061, THICKNESS, "S1").phase_speed(between)
    assert np.all(found > waves[lowest])
    assert hl.theory.LambWaves(hl.ALUMINIUM_6061, THICKNESS, "S1").frequency(found) == pytest.approx(between, rel=1e-11)
    with pytest.raises(ValueError, match="the cut-off of S1"):
        hl.theory.LambWaves(hl.ALUMINIUM_6061, THICKNESS, "S1").phase_speed(0.999 * frequency[lowest])


@pytest.mark.parametrize("mode", ["A0", "S0", "A1", "S2", "A7"])
def test_group_speed_is_the_slope_of_the_curve(mode: str) -> None:
    """Against central differences of the frequency, whose error falls with the square of the step."""
    wave_number = 4.0 / THICKNESS
    frequency = hl.theory.LambWaves(hl.STEEL_440C, THICKNESS, mode).frequency(wave_number)
    exact = hl.theory.LambWaves(hl.STEEL_440C, THICKNESS, mode).group_speed(frequency)
    steps = wave_number * np.array([0.04, 0.02, 0.01])
    above = hl.theory.LambWaves(hl.STEEL_440C, THICKNESS, mode).frequency(wave_number + steps)
    below = hl.theory.LambWaves(hl.STEEL_440C, THICKNESS, mode).frequency(wave_number - steps)
    errors = np.pi * (above - below) / steps / exact - 1.0
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx([2.0, 2.0], abs=0.2)


def test_arrays_keep_their_shape() -> None:
    frequency = np.array([[1e4, 3e5, 2e6], [4e6, 8e6, 3e7]])
    waves = hl.theory.LambWaves(hl.PTFE, THICKNESS)
    for of in (waves.phase_speed, waves.group_speed, waves.frequency):
        together = of(frequency / 1e3)
        one_by_one = [[of(float(item) / 1e3) for item in row] for row in frequency]
        assert together == pytest.approx(np.array(one_by_one), rel=1e-12)
        assert of(np.zeros((0, 2))).shape == (0, 2)
        assert isinstance(of(1e3), float)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: hl.theory.LambWaves(hl.PTFE, THICKNESS, "B0").phase_speed(1e3),
            r"mode = 'B0': must be 'A' or 'S' and a number",
        ),
        (lambda: hl.theory.LambWaves(hl.PTFE, THICKNESS, "A").phase_speed(1e3), "mode = 'A'"),
        (lambda: hl.theory.LambWaves(hl.PTFE, THICKNESS, "s0").group_speed(1e3), "mode = 's0'"),
        (lambda: hl.theory.LambWaves(hl.PTFE, THICKNESS, 0).frequency(1e3), "mode = 0"),  # type: ignore[arg-type]
        (lambda: hl.theory.LambWaves(hl.PTFE, THICKNESS, "A-1").cutoff_frequency(), "mode = 'A-1'"),
        (lambda: hl.theory.LambWaves("PTFE", THICKNESS).phase_speed(1e3), "material = 'PTFE'"),  # type: ignore[arg-type]
        (lambda: hl.theory.rayleigh_speed(None), "material = None"),  # type: ignore[arg-type]
        (
            lambda: hl.theory.LambWaves(hl.PTFE, 0.0).phase_speed(1e3),
            r"thickness = 0\.0: must be a positive number of m",
        ),
        (lambda: hl.theory.LambWaves(hl.PTFE, -1.0, "A1").cutoff_frequency(), r"thickness = -1\.0"),
        (lambda: hl.theory.LambWaves(hl.PTFE, float("nan"), "S0").cutoff_frequency(), "thickness = nan"),
        (
            lambda: hl.theory.LambWaves(hl.PTFE, THICKNESS).group_speed(0.0),
            r"frequency = 0\.0: must be a positive number of Hz",
        ),
        (lambda: hl.theory.LambWaves(hl.PTFE, THICKNESS).group_speed(np.array([1.0, np.nan])), "frequency = nan"),
        (lambda: hl.theory.LambWaves(hl.PTFE, THICKNESS).frequency(-1.0), r"wave_number = -1\.0"),
        (lambda: hl.theory.LambWaves(hl.PTFE, float("inf")).frequency(1.0), "thickness = inf"),
        (
            lambda: hl.theory.LambWaves(hl.PTFE, THICKNESS, "A1").phase_speed(np.array([1e7, 1e3])),
            r"frequency = 1000\.0: must be ab",
        ),
    ],
)
def test_bad_input(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
