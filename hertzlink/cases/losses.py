"""The losses of a chain of a case: at contacts, on beads, and inside beads that deform."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator

from hertzlink.cases.parts import Duration, Number, Part, World
from hertzlink.cases.units import Unit
from particles.dissipation import (
    Dissipation,
    KuwabaraKono,
    LinearDashpot,
    MassProportional,
    PowerDashpot,
    Restitution,
    Tsuji,
)
from structures.damping import Modal, Rayleigh, StandardLinearSolid, Viscous


class Loss(Part):
    """A loss at contacts, on beads, or inside beads that deform."""

    makes: ClassVar[Any]

    def make(self, world: World) -> Dissipation | Viscous:
        loss: Dissipation | Viscous = self.makes(**self.given("kind"))
        return loss


class Dashpot(Loss):
    """A linear dashpot at each contact."""

    makes = LinearDashpot
    kind: Literal["linear_dashpot"]
    coefficient: Annotated[float, Unit("N s/m", "a coefficient", "5 N s/m")]


class PowerLoss(Loss):
    """A dashpot whose force grows as a power of the rate."""

    makes = PowerDashpot
    kind: Literal["power_dashpot"]
    coefficient: Number
    exponent: Number = 1.0
    form: Literal["pairwise", "thesis"] = "pairwise"


class Drag(Loss):
    """A drag on each bead."""

    makes = MassProportional
    kind: Literal["mass_proportional"]
    rate: Annotated[float, Unit("1/s", "a rate", "6900 1/s")]


class Viscoelastic(Loss):
    """Viscoelastic spheres."""

    makes = KuwabaraKono
    kind: Literal["kuwabara_kono"]
    time: Duration


class TsujiLoss(Loss):
    """Tsuji's law."""

    makes = Tsuji
    kind: Literal["tsuji"]
    coefficient: Number


class RestitutionLoss(Loss):
    """The coefficient of restitution of a collision."""

    makes = Restitution
    kind: Literal["restitution"]
    coefficient: Number


OneLoss = Annotated[Dashpot | PowerLoss | Drag | Viscoelastic | TsujiLoss | RestitutionLoss, Discriminator("kind")]


class ModalInBeads(Loss):
    """The same damping ratio for all vibrations."""

    makes = Modal
    kind: Literal["modal"]
    ratio: Number


class RayleighInBeads(Loss):
    """In proportion to mass and stiffness."""

    makes = Rayleigh
    kind: Literal["rayleigh"]
    mass_rate: Annotated[float, Unit("1/s", "a rate", "100 1/s")] = 0.0
    stiffness_time: Duration = 0.0


class SolidInBeads(Loss):
    """Zener's standard linear solid."""

    makes = StandardLinearSolid
    kind: Literal["standard_linear_solid"]
    share: Number
    time: Duration
    modulus: Literal["relaxed", "instantaneous"] = "relaxed"


OneLossInBeads = Annotated[ModalInBeads | RayleighInBeads | SolidInBeads, Discriminator("kind")]
