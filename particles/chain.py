"""A chain of beads and its excitation, as data; `MovingChain` moves it."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import cached_property
from math import pi, sin
from typing import Annotated, Any

import numpy as np

from particles.bead import Bead, check_bead, plain_data
from particles.dissipation import Dissipation
from particles.excitation import Excitation, Impact
from particles.kernels.drives import FREE, MOVED
from particles.laws.law import ContactLaw, check_contact_law
from particles.laws.yielding import YieldingLaw
from structures.checks import function, instance, listed, short
from structures.described import described
from structures.quantities import Angle, Likely
from structures.structure import Vector
from structures.surface import Surface

LawOfPair = Callable[[Bead, Bead | Surface], ContactLaw]  # of two bodies, or of a body and a surface


@described
class Chain:
    """A row of beads. The first one is struck, the last one faces a structure (Khatri's thesis, equations 1.5 to 6.1).

    Parameters
    ----------
    beads : sequence of Bead
        The bodies, of any kinds, starting at the struck end.
    striker : Bead or Excitation or None
        A bead that arrives at the impact speed, or an Excitation. None: the first bead starts at that speed.
    impact_speed : float, optional
        Speed of the striker, m/s; without a striker, speed of the first bead, by default 0. Omit it with an Excitation.
    gravity, inclination : float
        Gravity, m/s², and the angle by which the chain slopes down to the structure, rad; by default it is vertical.
    dissipation : Dissipation or None
        A loss at every contact, such as LinearDashpot, or on every bead.
    preload : float
        Static force along the chain, N: a dead load on the first bead, or the force of a Piston or structure behind it.
    law : ContactLaw or callable or YieldingLaw or None
        One law for all contacts between bodies, or a function law(body, next body or Surface); by default
        `contact_law`. With a YieldingLaw all contacts yield, including that with the structure.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 20, striker=bead, impact_speed=hl.drop_speed(0.01), gravity=9.81)
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
        # Each different bead is checked once: chains repeat their beads, and a batch has thousands of chains.
        places = {id(bead): place for place, bead in reversed([*enumerate(self.beads)])}
        for place in sorted(places.values()):
            check_bead(f"beads[{place}]", self.beads[place])
        if isinstance(self.striker, Excitation):
            if self.impact_speed is not None:
                raise ValueError(f"impact_speed = {self.impact_speed!r}: must be omitted, as the striker sets it")
        elif self.striker is not None:
            if id(self.striker) not in places:  # beads are checked already
                what = "a bead, such as Sphere, or SpringLoaded, PushedBead, Piston or None"
                check_bead("striker", self.striker, what)
            if self.impact_speed == 0.0:
                raise ValueError("impact_speed = 0.0: must be a positive number of m/s, unless striker=None")
            Likely.SPEED.check("impact_speed", self.impact_speed)  # type: ignore[arg-type]
        if self.dissipation is not None:
            instance("dissipation", self.dissipation, Dissipation, "None or a loss such as LinearDashpot(5.0)")
        if callable(self.law) and not isinstance(self.law, ContactLaw | type):
            function("law", self.law, 2, "a function of two bodies, law(body, next body or Surface)")
        elif not isinstance(self.law, YieldingLaw | None):
            check_contact_law("law", self.law, "None, a law such as PowerLaw(k, n), or a function of two bodies")

        # A user's own excitation may be wrong.
        kind, faced = self.excitation.drive.kind, self.excitation.faces(self.beads[0])
        if (kind == FREE and self.body is None) or (kind == MOVED and faced is None):
            raise ValueError(f"striker = {self.striker!r}: must have a body if its drive is FREE, a surface if MOVED")
        if not self.impact_energy > 0.0:
            raise ValueError(f"striker = {self.striker!r}: must have a positive energy")

    def __repr__(self) -> str:
        names = Counter(type(bead).__name__ for bead in self.beads)
        kinds = " + ".join(f"{count} {name}" for name, count in names.items())
        who = "first bead starts" if self.striker is None else f"struck by {type(self.striker).__name__}"
        struck = f"{who} at {self.impact_speed:.4g} m/s" if self.impact_speed else f"{who} at rest"
        if isinstance(self.striker, Excitation):
            struck = f"struck by {short(self.striker)}"
        given = {field.name: getattr(self, field.name) for field in fields(self)[3:]}
        settings = [f"{name}={short(value)}" for name, value in given.items() if value != getattr(type(self), name)]
        return f"{type(self).__name__}({', '.join([kinds, struck, *settings])})"

    @cached_property
    def excitation(self) -> Excitation:
        return self.striker if isinstance(self.striker, Excitation) else Impact(self.striker, self.impact_speed or 0.0)

    @property
    def gravity_along(self) -> float:
        """Component of gravity along the chain, m/s²."""
        return self.gravity * sin(self.inclination)

    @property
    def body(self) -> Bead | None:
        """The striker, body 0 of the results; None if there is none."""
        return self.excitation.body

    @property
    def speed(self) -> float:
        """Speed of the striker, or else of the first bead, at time zero, m/s."""
        return self.excitation.speed(self.gravity_along)

    @property
    def impact_energy(self) -> float:
        """Energy of the excitation, J: the scale of steps, tolerances and energy_error; see each `Excitation`."""
        return self.excitation.energy(self.beads[0].mass, self.gravity_along)

    @property
    def centres(self) -> Vector:
        """Distances of the centres of striker and beads from the struck end of the first bead, m."""
        sizes = np.array([bead.size for bead in self.beads])
        return np.append(-self.body.size / 2.0 if self.body else 0.0, np.cumsum(sizes) - sizes / 2.0)

    def describe(self) -> dict[str, Any]:
        """Return the chain as plain data, for the attributes of a result."""
        # Each different bead is described once; to describe every bead takes as long as a short run.
        described = {number: plain_data(bead) for number, bead in {id(bead): bead for bead in self.beads}.items()}
        plain = {field.name: plain_data(getattr(self, field.name)) for field in fields(self) if field.name != "beads"}
        return {"beads": [described[id(bead)] for bead in self.beads], **plain}
