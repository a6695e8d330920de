"""Rods: frequencies, bases that reflect or absorb a pulse, layers, bad input."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

import hertzlink as hl

STEEL_BAR = hl.Layer(hl.STEEL_440C, length=0.5, radius=0.01)


def frequencies(structure: hl.Structure) -> NDArray[np.float64]:
    square = eigh(structure.stiffness.toarray(), structure.mass.toarray(), eigvals_only=True)
    return np.sqrt(np.maximum(square, 0.0)) / (2.0 * np.pi)


@pytest.mark.parametrize(("base", "expected"), [("fixed", [0.25, 0.75, 1.25]), ("free", [0.0, 0.5, 1.0])])
def test_frequencies_of_a_uniform_rod(base: str, expected: list[float]) -> None:
    """f = (2n − 1) c/4L for fixed–free, n c/2L for free–free, to 1e-6."""
    unit = hl.STEEL_440C.bar_speed / STEEL_BAR.length
    found = frequencies(hl.rod([STEEL_BAR], base=base, elements=60))[:3] / unit
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_frequency_converges_with_order_four() -> None:
    """Quadratic elements: the error of a frequency falls with h⁴."""
    exact = 1.25 * hl.STEEL_440C.bar_speed / STEEL_BAR.length
    errors = [frequencies(hl.rod([STEEL_BAR], elements=n))[2] / exact - 1.0 for n in (4, 8, 16)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx([4.0, 4.0], abs=0.2)


def test_layered_rod_has_the_frequencies_of_the_transcendental_equation() -> None:
    """Steel on PTFE on a fixed base: tan(k₁L₁) tan(k₂L₂) = Z₂/Z₁ with Z = A √(Eρ)."""
    upper, lower = hl.Layer(hl.STEEL_440C, 0.05, 0.01), hl.Layer(hl.PTFE, 0.03, 0.015)
    impedance = [y.area * (y.material.youngs_modulus * y.material.density) ** 0.5 for y in (upper, lower)]
    omega = 2.0 * np.pi * frequencies(hl.rod([upper, lower], elements=60))[:4]
    phases = [omega * layer.length / layer.material.bar_speed for layer in (upper, lower)]
    sines, cosines = (np.prod(part(phases), axis=0) for part in (np.sin, np.cos))
    residual = impedance[0] * sines - impedance[1] * cosines
    assert residual / max(impedance) == pytest.approx(np.zeros(4), abs=1e-4)


def pulse_answer(structure: hl.Structure, window: float = 2e-7, steps: int = 1500) -> NDArray[np.float64]:
    """Displacement of the struck end after a raised-cosine pulse of 20 µs and 1 N."""
    moving = hl.stepping.MovingStructure(structure)
    state, answer = moving.start(), []
    for step in range(steps):
        time = (step + 0.5) * window
        force = 0.5 * (1.0 - np.cos(2.0 * np.pi * time / 20e-6)) if time < 20e-6 else 0.0
        state, surface = moving.advance(state, force, window)
        answer.append(surface)
    return np.array(answer)


def test_absorbing_base_equals_a_very_long_rod() -> None:
    long = hl.Layer(hl.STEEL_440C, length=1.5, radius=0.01)
    short, reference = pulse_answer(hl.rod([STEEL_BAR], base="absorbing")), pulse_answer(hl.rod([long]))
    assert short == pytest.approx(reference, abs=1e-3 * reference.max())
    top, lower = hl.Layer(hl.STEEL_440C, 0.05, 0.01), hl.Layer(hl.PTFE, 0.05, 0.012)
    short = pulse_answer(hl.rod([top, lower], base="absorbing"))
    reference = pulse_answer(hl.rod([top, hl.Layer(hl.PTFE, 0.3, 0.012)]))
    assert short == pytest.approx(reference, abs=2e-3 * reference.max())


def test_fixed_base_sends_the_pulse_back_with_its_sign_turned() -> None:
    answer = pulse_answer(hl.rod([STEEL_BAR]))
    assert answer[200] == pytest.approx(-answer[1300], rel=2e-3)
