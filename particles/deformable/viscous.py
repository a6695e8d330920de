"""Losses inside beads that vibrate: what each mode of a bead loses.

The amplitude q of a mode obeys q″ + c q′ + ω² q + g ω² (q − z) = forces, with z′ = (q − z)/τ. The rate c is that of
Rayleigh and modal damping; the spring g ω² in series with a dashpot is the Maxwell arm of a standard linear solid.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from structures.checks import not_negative, one_of, positive
from structures.plausible import likely
from structures.structure import Vector


class ModeLoss(NamedTuple):
    """Of the modes of a bead, m numbers each.

    square: ω² of slow motions, 1/s². rate: c, 1/s. arm: g ω² of the arm, 1/s². relaxation: 1/τ, 1/s; zero without an
    arm.
    """

    square: Vector
    rate: Vector
    arm: Vector
    relaxation: Vector


class Viscous(ABC):
    """A loss inside deformable beads: the base of Modal, Rayleigh and StandardLinearSolid, and of your own.

    Examples
    --------
    >>> import hertzlink as hl
    >>> isinstance(hl.damping.Modal(0.02), hl.damping.Viscous)
    True
    """

    @abstractmethod
    def of_modes(self, frequencies: Vector) -> ModeLoss:
        """What modes lose whose angular frequencies, rad/s, are these without a loss.

        Four arrays: ω² of slow motions (1/s²), the rate c (1/s), the arm g ω² (1/s²) and its 1/τ (1/s).
        """


@dataclass(frozen=True)
class Modal(Viscous):
    """The same damping ratio for all modes of a bead: each vibration loses the part 4πζ of its energy in a period.

    Parameters
    ----------
    ratio : float
        Damping ratio ζ, zero or more and below 1.

    Raises
    ------
    ValueError
        For a ratio that is negative, or 1 and more: such a mode would not vibrate.

    References
    ----------
    Clough and Penzien, Dynamics of Structures (1993), section 12.3.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.PTFE)
    >>> hl.DeformableChain([bead] * 10, bead, 0.3, damping=hl.damping.Modal(ratio=0.02)).damping
    Modal(ratio=0.02)
    """

    ratio: float

    def __post_init__(self) -> None:
        if not_negative("ratio", self.ratio) >= 1.0:
            raise ValueError(f"ratio = {self.ratio!r}: must be below 1, which is critical damping")

    def of_modes(self, frequencies: Vector) -> ModeLoss:
        """c = 2 ζ ω."""
        none = np.zeros_like(frequencies)
        return ModeLoss(frequencies**2, 2.0 * self.ratio * frequencies, none, none)


@dataclass(frozen=True)
class Rayleigh(Viscous):
    """Damping in proportion to a bead's mass and stiffness, of its vibrations alone: C = a M + b K.

    A loss in proportion to the stiffness of the whole bead acts in its contacts too: add
    `dissipation=hl.KuwabaraKono(b)` with the same time.

    Parameters
    ----------
    mass_rate : float
        a, 1/s. The rigid motion of a bead stays undamped.
    stiffness_time : float
        b, s.

    Raises
    ------
    ValueError
        For a negative number.

    References
    ----------
    Clough and Penzien, Dynamics of Structures (1993), section 12.5; Khatri's thesis, chapter 7.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.PTFE)
    >>> loss = hl.damping.Rayleigh(stiffness_time=1e-7)
    >>> hl.DeformableChain([bead] * 10, bead, 0.3, damping=loss, dissipation=hl.KuwabaraKono(1e-7)).damping
    Rayleigh(mass_rate=0.0, stiffness_time=1e-07)
    """

    mass_rate: float = 0.0
    stiffness_time: float = 0.0

    def __post_init__(self) -> None:
        not_negative("mass_rate", self.mass_rate, "1/s")
        not_negative("stiffness_time", self.stiffness_time, "s")
        likely("time", "Rayleigh", "stiffness_time", self.stiffness_time)

    def of_modes(self, frequencies: Vector) -> ModeLoss:
        """c = a + b ω²."""
        none = np.zeros_like(frequencies)
        return ModeLoss(frequencies**2, self.mass_rate + self.stiffness_time * frequencies**2, none, none)


@dataclass(frozen=True)
class StandardLinearSolid(Viscous):
    """A viscoelastic bead: its modulus relaxes from E (1 + g) under sudden loads to E under slow ones, with a time τ.

    It acts on the vibrations. The contacts keep the modulus of the bead's material.

    Parameters
    ----------
    share : float
        g: the modulus of the arm in units of the material's modulus.
    time : float
        Relaxation time τ at constant strain, s.
    modulus : {"relaxed", "instantaneous"}
        Which modulus the bead's material has. "relaxed": that of slow loads. "instantaneous": that of sudden loads, of
        which the part `share` < 1 relaxes.

    Raises
    ------
    ValueError
        For a share or a time that is not positive, and for a share of 1 or more of the instantaneous modulus.

    References
    ----------
    Zener, Elasticity and Anelasticity of Metals (1948), chapter 5.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.PTFE)
    >>> hl.DeformableChain([bead] * 10, bead, 0.3, damping=hl.damping.StandardLinearSolid(share=0.1, time=2e-6)).damping
    StandardLinearSolid(share=0.1, time=2e-06, modulus='relaxed')
    """

    share: float
    time: float
    modulus: str = "relaxed"

    def __post_init__(self) -> None:
        positive("share", self.share)
        positive("time", self.time, "s")
        likely("time", "StandardLinearSolid", "time", self.time)
        likely("share", "StandardLinearSolid", "share", self.share)
        one_of("modulus", self.modulus, ("relaxed", "instantaneous"))
        if self.modulus == "instantaneous" and self.share >= 1.0:
            raise ValueError(f"share = {self.share!r}: must be below 1 of the instantaneous modulus")

    def of_modes(self, frequencies: Vector) -> ModeLoss:
        """An arm of g ω²."""
        arm = self.share * frequencies**2
        slow = frequencies**2 - (arm if self.modulus == "instantaneous" else 0.0)
        return ModeLoss(slow, np.zeros_like(arm), arm, np.full_like(arm, 1.0 / self.time))
