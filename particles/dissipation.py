"""How contacts lose energy."""

from dataclasses import dataclass

from structures.checks import not_negative


@dataclass(frozen=True)
class LinearDashpot:
    """A force γ dδ/dt beside Hertz's while beads touch; the sum never pulls (thesis, section 6.1, equation 6.1).

    coefficient γ in N s/m. The thesis gives none; 4 to 6 reproduces its amplitude ratios on steel.
    """

    coefficient: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", not_negative("coefficient", self.coefficient, "N s/m"))
