"""A chain of beads and what sets it in motion, as data; `MovingChain` moves it."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import fields, replace
from functools import cached_property
from math import inf, pi, sin
from typing import Annotated, Any, Self

import numpy as np

from particles.bead import Bead, check_bead, plain_data
from particles.dissipation import Dissipation, coefficients_of
from particles.excitation import Excitation, Impact
from particles.kernels.drives import FREE, MOVED
from particles.laws.law import ContactLaw, check_contact_law
from particles.laws.yielding import YieldingLaw
from structures.checks import function, html_table, listed, short
from structures.described import Described, described
from structures.quantities import Angle, Likely
from structures.structure import Vector
from structures.surface import Surface

LawOfPair = Callable[[Bead, Bead | Surface], ContactLaw]
"""A function of two bodies, or of a body and a surface, that returns the law of their contact."""


@described
class Chain:
    """Beads in a row, the first one struck, the last one facing a structure.

    The static forces of gravity and preload are solved first, and motions are measured from static equilibrium.

    Parameters
    ----------
    beads : sequence of Bead
        The bodies from the struck end on, of any kind and mixed.
    striker : Bead or Excitation or None
        What sets the chain in motion at time zero. A bead arrives freely at the impact speed. A SpringLoaded striker, a
        PushedBead or a Piston bring their own motion. None: the first bead itself starts at the impact speed.
    impact_speed : float, optional
        Speed of the striker, m/s; or of the first bead where there is none, by default 0. Left out with an Excitation.
    gravity : float
        Gravity, m/s², which acts along the chain with the sine of the inclination.
    dissipation : Dissipation or None
        A loss, such as LinearDashpot, at every contact.
    preload : float
        Static force along the chain, N. A dead load on the first bead keeps it constant. With a Piston or a structure
        behind the chain there is no dead load: the Piston or the structure holds that end of the chain in place.
    inclination : float
        Angle to the horizontal, rad, at which the axis falls from the striker to the structure; by default π/2, with
        the striker on top.
    law : ContactLaw or callable or YieldingLaw or None
        One law for all contacts between bodies, or a function law(body, next body or Surface) that returns one; by
        default `contact_law`. A YieldingLaw, such as laws.Thornton(), lets all contacts of `contact_law` yield, that
        with the structure too.

    References
    ----------
    Khatri's thesis, equations 1.5, 3.1 and 6.1, with the positive part of each bracket.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> hl.Chain([bead] * 20, striker=bead, impact_speed=hl.drop_speed(0.01), gravity=9.81)
    Chain(20 Sphere, struck by Sphere at 0.4429 m/s, gravity=9.81)
    """

    beads: Sequence[Bead]
    striker: Bead | Excitation | None
    impact_speed: Annotated[float, replace(Likely.SPEED, or_zero=True)] | None = None
    gravity: Annotated[float, Likely.GRAVITY] = 0.0
    dissipation: Dissipation | None = None
    preload: Annotated[float, Likely.PRELOAD] = 0.0
    inclination: Angle = pi / 2.0
    law: ContactLaw | LawOfPair | YieldingLaw | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "beads", tuple(listed("beads", self.beads, object, "one bead or more")))
        # Chains repeat their beads, and a batch has thousands of chains: each bead is checked once.
        places = dict[int, int]()
        for place, bead in enumerate(self.beads):
            places.setdefault(id(bead), place)
        for place in places.values():
            check_bead(f"beads[{place}]", self.beads[place], doubt=True)
        if isinstance(self.striker, Excitation):
            if self.impact_speed is not None:
                raise ValueError(f"impact_speed = {self.impact_speed!r}: the striker sets it; must be left out")
        elif self.striker is not None:
            what = "a bead, such as Sphere, or SpringLoaded, PushedBead, Piston or None"
            check_bead("striker", self.striker, what, doubt=id(self.striker) not in places)
            Likely.SPEED.check("impact_speed", self.impact_speed)  # type: ignore[arg-type]
        if not isinstance(self.dissipation, Dissipation | None):
            raise ValueError(
                f"dissipation = {self.dissipation!r}: must be None or a loss such as LinearDashpot(coefficient)"
            )
        self._check_law()
        drive, faced = self.excitation.drive, self.excitation.faces(self.beads[0])
        if (drive.kind == FREE and self.body is None) or (drive.kind == MOVED and faced is None):
            raise ValueError(f"striker = {self.striker!r}: must have a body if its drive is FREE, a surface if MOVED")
        if not self.impact_energy > 0.0:
            raise ValueError(f"striker = {self.striker!r}: moves nothing")
        if self.dissipation is not None:
            coefficients_of(self.dissipation, reduced_masses(self.masses))

    def _check_law(self) -> None:
        if callable(self.law) and not isinstance(self.law, ContactLaw | type):
            function("law", self.law, 2, "a function of two bodies, law(body, next body or Surface)")
        elif not isinstance(self.law, YieldingLaw | None):
            check_contact_law("law", self.law, "None, a law such as PowerLaw(k, n), or a function of two bodies")

    def __repr__(self) -> str:
        settings = [f"{name}={value}" for name, value in self._special]
        return f"{type(self).__name__}({', '.join([self._kinds, self._struck, *settings])})"

    def _repr_html_(self) -> str:
        energy, length = f"{1e3 * self.impact_energy:.4g} mJ", f"{float(sum(bead.size for bead in self.beads)):.4g} m"
        rows = [("beads", self._kinds), ("excitation", self._struck), ("impact energy", energy), ("length", length)]
        known: Described = vars(Chain)["__described__"]
        settings = [(name, f"{value} {known.units.get(name, '')}".rstrip()) for name, value in self._special]
        return html_table(type(self).__name__, [*rows, *settings])

    @property
    def _kinds(self) -> str:
        """Beads in a few words: 20 Sphere, or 10 Sphere + 10 Cylinder."""
        names = [type(bead).__name__ for bead in self.beads]
        return " + ".join(f"{names.count(name)} {name}" for name in dict.fromkeys(names))

    @property
    def _struck(self) -> str:
        if isinstance(self.striker, Excitation):
            return f"struck by {short(self.striker)}"
        who = "first bead starts" if self.striker is None else f"struck by {type(self.striker).__name__}"
        return f"{who} at {self.impact_speed or 0.0:.4g} m/s".replace(" at 0 m/s", " at rest")

    @property
    def _special(self) -> list[tuple[str, str]]:
        """Arguments that differ from their defaults: names and values."""
        rest = [field for field in fields(self) if field.name not in ("beads", "striker", "impact_speed")]
        changed = [field for field in rest if getattr(self, field.name) != field.default]
        return [(field.name, short(getattr(self, field.name))) for field in changed]

    @cached_property
    def excitation(self) -> Excitation:
        """The excitation that sets the chain in motion, whatever the form of `striker`."""
        if isinstance(self.striker, Excitation):
            return self.striker
        return Impact(self.striker, self.impact_speed or 0.0)

    @property
    def gravity_along(self) -> float:
        """Component of gravity along the chain, m/s²."""
        return self.gravity * sin(self.inclination)

    @property
    def body(self) -> Bead | None:
        """Body 0 of the results, the striker; None where there is none, or a force or a motion replaces it."""
        return self.excitation.body

    @property
    def speed(self) -> float:
        """Speed at time zero, m/s, of the striker, or of the first bead where there is none."""
        return self.excitation.speed(self.gravity_along)

    @property
    def impact_energy(self) -> float:
        """Energy of the excitation, J: the scale of steps, tolerances and of energy_error.

        The striker's kinetic energy at time zero, and what is left in its spring. For a force history ½ J²/m with its
        impulse J on the first bead, for a piston the energy of the first bead at twice the greatest speed; for
        one at rest, ½ m (10 mm/s)². Without a striker the first bead's kinetic energy, at rest ½ m (10 mm/s)² too.
        """
        return self.excitation.energy(self.beads[0].mass, self.gravity_along)

    @property
    def masses(self) -> Vector:
        """The masses of striker and beads, kg; infinite where a structure, a piston or a force replaces the striker."""
        return np.array([self.body.mass if self.body else inf, *(bead.mass for bead in self.beads)])

    @property
    def centres(self) -> Vector:
        """Distance of the centres of striker and beads from the struck end of the first bead, m."""
        sizes = np.array([bead.size for bead in self.beads])
        ends = np.cumsum(sizes)
        return np.concatenate([[-self.body.size / 2.0 if self.body else 0.0], ends - sizes / 2.0])

    def with_law(self, law: ContactLaw | YieldingLaw) -> Self:
        """Return the same chain with another law; itself if it has this one."""
        if law is self.law:
            return self
        chain = copy(self)
        object.__setattr__(chain, "law", law)
        chain._check_law()
        return chain

    def describe(self) -> dict[str, Any]:
        """Return the chain as plain data, for the attributes of a result."""
        # Chains repeat their beads; to describe each of them again takes as long as a short run.
        described = {number: plain_data(bead) for number, bead in {id(bead): bead for bead in self.beads}.items()}
        plain = {field.name: plain_data(getattr(self, field.name)) for field in fields(self) if field.name != "beads"}
        return {"beads": [described[id(bead)] for bead in self.beads], **plain}


def reduced_masses(mass: Vector) -> Vector:
    """Return the reduced masses of the N + 1 contacts of these bodies, kg; a structure, a piston or a force counts as
    immovable."""
    inverse = np.append(1.0 / mass, 0.0)
    return np.asarray(1.0 / (inverse[:-1] + inverse[1:]))


def static_forces(chain: Chain, surface: Surface | None, dead_load: float) -> Vector:
    """Return the static force of each contact, N; that of contact 1 is what the place of body 0 bears of the preload.

    dead_load: what presses on the first bead where nothing there bears the preload, N.
    """
    for name, value, along in (
        ("gravity", chain.gravity, chain.gravity_along),
        ("preload", chain.preload, chain.preload),
    ):
        # Gravity may act across a chain that nothing holds.
        if surface is None and abs(along) > 1e-12 * value:
            raise ValueError(f"{name} = {value!r}: must be 0 for a chain that nothing holds (structure None)")
    weights = np.cumsum([bead.mass for bead in chain.beads])
    static = np.concatenate([[chain.preload - dead_load], chain.preload + chain.gravity_along * weights])
    if static.min() < 0.0:
        least = chain.preload - static.min()
        raise ValueError(f"preload = {chain.preload!r}: must be at least {least:.4g} N to hold a chain that hangs")
    return static
