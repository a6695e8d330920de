"""What yielding changes in chains: the numbers of docs/beads.md."""

from typing import Any

import pytest

import hertzlink as hl

STEEL, SOFT, ALUMINIUM = hl.STEEL_440C, hl.STEEL_316, hl.ALUMINIUM_6061


def chain(bead: hl.Material, speed: float, law: Any = None, radius: float = 4.76e-3) -> hl.Chain:
    sphere = hl.Sphere(radius, bead)
    return hl.Chain([sphere] * 20, sphere, speed, law=law)


@pytest.mark.parametrize(
    ("bead", "wall", "speed"),
    [
        (SOFT, SOFT, 1.535e-3), (STEEL, hl.BRASS_360, 4.195e-3), (STEEL, ALUMINIUM, 24.19e-3), (STEEL, STEEL, 0.3742),
    ],
)  # fmt: skip
def test_speeds_of_first_yield(bead: hl.Material, wall: hl.Material, speed: float) -> None:
    """They separate runs with a dent from runs without one, and follow from Hertz's forces, which go as v^(6/5)."""
    for factor in (0.98, 1.02):
        struck = chain(bead, factor * speed, hl.laws.Thornton())
        run = hl.CoSimulation(struck, hl.half_space(wall)).run(2e-3 if speed > 0.01 else 4e-3)
        assert (float(run.dent.max()) > 0.0) == (factor > 1.0)


@pytest.mark.parametrize(
    ("law", "ratios", "left"),
    [(hl.laws.Thornton(), [0.89, 0.54, 0.38], 0.11), (hl.laws.JacksonGreen(), [0.95, 0.75, 0.55], 0.17)],
)
def test_what_yielding_takes(law: Any, ratios: list[float], left: float) -> None:
    """AR on aluminium falls with the impact speed, where the elastic one stays 0.98; waves in soft beads fade."""
    for speed, expected in zip((0.05, 0.31, 1.0), ratios, strict=True):
        run = hl.CoSimulation(chain(STEEL, speed, law), hl.half_space(ALUMINIUM)).run(1.5e-3, 1e-6)
        assert float(hl.amplitude_ratio(run, 7)) == pytest.approx(expected, abs=0.006)
    incident = []
    for one in (None, law):
        run = hl.CoSimulation(chain(SOFT, 0.5, one, 2.38e-3), hl.half_space(SOFT)).run(1e-3, 1e-6)
        incident.append(hl.reflections(run, 7).incident.amplitude)  # type: ignore[union-attr]
    assert incident[1] / incident[0] == pytest.approx(left, abs=0.006)
