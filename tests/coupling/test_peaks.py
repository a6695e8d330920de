"""The way back of a wave through the contacts that it passed."""

import numpy as np
import pytest

from coupling.results.peaks import traced

HOPS = np.full(3, 10e-6)
"""The incident wave takes 10 µs from contact to contact."""


@pytest.mark.parametrize("pace", [1.0, 1.3])
def test_a_wave_is_followed_through_every_contact(pace: float) -> None:
    """Back from contact to contact, also slower than the incident wave; peaks at other times are not taken."""
    peaks = [np.array([1e-4 - i * pace * 10e-6, 2e-4, 1e-5]) for i in range(4)]
    path = traced(peaks, HOPS, row=0, now=1e-4, left=1e-4, pace=1.0)
    assert path == pytest.approx([1e-4 - i * pace * 10e-6 for i in (1, 2, 3)])


def test_a_wave_that_began_in_the_chain_is_followed_to_its_beginning() -> None:
    peaks = [np.array([1e-4]), np.array([0.9e-4]), np.array([2e-4]), np.array([0.7e-4])]
    assert traced(peaks, HOPS, row=0, now=1e-4, left=1e-4, pace=1.0) == pytest.approx([0.9e-4])
