"""Pieces of the compiled loops, called from Python: closed formulas, and laws and losses of a user's own."""

from dataclasses import dataclass
from math import fsum
from typing import Any, NamedTuple

import numpy as np
import pytest

import hertzlink as hl
from particles.kernels import laws
from particles.laws.law import kernel_table
from structures.structure import Vector

STEEL = hl.Sphere(4.76e-3, hl.STEEL_440C)
WALL = hl.half_space(hl.STEEL_316)
STIFFNESS = np.array([1e10, 3e9])
CURVE = hl.laws.PowerLaw(2e8, 1.3)
TABLE = kernel_table(CURVE)
TABULATED = laws.Mixed(
    laws.Tabulated(np.array([0.5, 3e9]), np.array([0, -1]), TABLE), laws.Hertz(STIFFNESS), np.array([True, False])
)
MIXED = laws.Mixed(laws.Hertz(STIFFNESS), TABULATED, np.array([False, True]))
LAWS: dict[str, tuple[Any, int, Any]] = {
    "Hertz": (laws.Hertz(STIFFNESS), 1, lambda d: 3e9 * d**1.5),
    "a table": (TABULATED, 0, lambda d: 0.5 * 2e8 * d**1.3),
    "Hertz among tables": (TABULATED, 1, lambda d: 3e9 * d**1.5),
    "a law of a user's own": (MIXED, 1, lambda d: 3e9 * d**1.5),
    "the law next to it": (MIXED, 0, lambda d: 0.5 * 2e8 * d**1.3),
}  # fmt: skip


class Cone(NamedTuple):
    """A user's piece: F = k δ²."""

    stiffness: Any

    @staticmethod
    def force(law, i, overlap):  # type: ignore[no-untyped-def]
        return law.stiffness[i] * overlap**2 if overlap > laws.NEGLIGIBLE else 0.0

    @staticmethod
    def slope(law, i, overlap):  # type: ignore[no-untyped-def]
        return 2.0 * law.stiffness[i] * overlap if overlap > laws.NEGLIGIBLE else 0.0

    @staticmethod
    def energy(law, i, overlap):  # type: ignore[no-untyped-def]
        return law.stiffness[i] * overlap**3 / 3.0 if overlap > laws.NEGLIGIBLE else 0.0


@dataclass(frozen=True)
class Conical(hl.laws.ContactLaw):
    stiffness: float
    piece = Cone

    def force(self, approach: Vector) -> Vector:
        return self.stiffness * np.maximum(approach, 0.0) ** 2


class Soft(NamedTuple):
    """A user's piece: a dashpot whose force saturates. One of its numbers has the name of a function of the kernels."""

    coefficient: Any
    drag: float

    @staticmethod
    def with_loss(loss, i, elastic, slope, overlap, rate):  # type: ignore[no-untyped-def]
        return max(elastic + loss.coefficient[i] * rate / (1.0 + abs(rate) / loss.drag), 0.0)


@dataclass(frozen=True)
class Saturating(hl.Dissipation):
    viscosity: float
    drag: float
    piece = Soft

    def coefficients(self, mass: Vector) -> Vector:
        return np.full_like(mass, self.viscosity)


@pytest.mark.thorough
def test_a_users_pieces_run_as_those_built_in() -> None:
    """In one run: a cone's law between beads, a table at one contact, Hertz's law at the wall; a saturating loss."""
    small, table = hl.Sphere(3e-3, hl.BRASS_360), hl.laws.PowerLaw(2e8, 1.3)

    def run(cone: hl.laws.ContactLaw, loss: hl.Dissipation) -> Any:
        def law(one: Any, other: Any) -> hl.laws.ContactLaw:
            if isinstance(other, hl.Surface):
                return hl.contact_law(one, other)
            return table if one is small else cone

        chain = hl.Chain([STEEL] * 3 + [small] + [STEEL] * 4, STEEL, 0.1, law=law, dissipation=loss)
        simulation = hl.CoSimulation(chain, WALL)
        return simulation, simulation.run(2e-4)

    own, found = run(Conical(2e14), Saturating(5.0, 1e12))
    _, expected = run(hl.laws.PowerLaw(2e14, 2.0), hl.LinearDashpot(5.0))
    assert isinstance(own.chain.model.law, laws.Mixed)
    assert isinstance(own.chain.model.law.own, Cone)
    assert own.chain.model.law.is_own.tolist() == [True] * 4 + [False] + [True] * 3 + [False]
    assert isinstance(own.chain.model.loss, Soft)
    assert found.contact_force.values == pytest.approx(
        expected.contact_force.values, abs=1e-6 * float(expected.contact_force.max())
    )
    assert hl.energy_error(found) < 1e-5
    assert float(found.dissipated_energy[-1]) == pytest.approx(float(expected.dissipated_energy[-1]), rel=1e-6)
    assert not any("table" in one for one in found.warnings.splitlines())


def wrong_law(**members: Any) -> hl.laws.ContactLaw:
    """Conical with other functions in its piece, or another piece."""
    if not {"force", "slope", "energy"} & set(members):
        return type("Own", (Conical,), members)(2e14)  # type: ignore[no-any-return]
    piece = type("Cut", (Cone,), {name: one and staticmethod(one) for name, one in members.items()})
    return type("Own", (Conical,), {"piece": piece})(2e14)  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (wrong_law(force=lambda law, i, d: law.stiffness[i] * d**2), r"law: Cut\.force at -1e-06 m = 200: must be 0"),
        (
            wrong_law(energy=lambda law, i, d: law.stiffness[i] * d**3 / 2.0 if d > 0.0 else 0.0),
            r"law: Cut\.energy at 1e-07 m = 1e-07: must be 6\.66\d*e-08",
        ),
    ],
)
def test_a_piece_that_contradicts_its_law_is_named(law: hl.laws.ContactLaw, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.Chain([STEEL] * 3, STEEL, 0.3, law=law)


@pytest.mark.thorough
def test_a_piece_that_numba_cannot_compile_is_named() -> None:
    law = wrong_law(force=lambda law, i, d: fsum([law.stiffness[i] * d**2]) if d > 0.0 else 0.0)
    with pytest.raises(ValueError, match=r"^Cut\.force: Numba cannot compile it: \S.*$"):
        hl.CoSimulation(hl.Chain([STEEL] * 3, STEEL, 0.3, law=law), None).run(1e-5)


def test_a_users_loss_is_that_of_all_chains() -> None:
    for other in (hl.LinearDashpot(5.0), Saturating(5.0, 2.0)):
        chains = [hl.Chain([STEEL] * 3, STEEL, 0.3, dissipation=loss) for loss in (Saturating(5.0, 1.0), other)]
        with pytest.raises(ValueError, match="dissipation: must be the same in all chains of a run"):
            hl.CoSimulation(chains, [None, None]).run(1e-5)
