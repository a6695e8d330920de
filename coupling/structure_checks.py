"""The checks of struck structures: do theory, mesh and reduction suit the deflections and pushes of the run?"""

from collections.abc import Iterator, Mapping, Sequence
from math import ceil, inf, pi, sqrt
from numbers import Real
from operator import itemgetter
from typing import Any

import numpy as np

from coupling.interface import Interface
from coupling.participant import CheckedParticipant
from coupling.recording.frames import Motion
from coupling.results.missing_waves import rounded_up
from coupling.results.schema import LAST
from particles.bead import surface_of
from particles.contacts import Pair
from structures.reduction import error_for_pulse
from structures.structure import Vector
from structures.surface import hertz_pressure
from structures.units import readable

LARGE_DEFLECTION = 0.5
"""In thicknesses. At this deflection the stretching of the middle plane adds about a tenth to the bending stiffness
(Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, section 97)."""

FEWEST_CYCLES = 1.0
"""Least product of the length of a push and the frequency that a mesh resolves. On Kirchhoff plates AR of the primary
wave is off by 0.001 at 1.6 cycles and by 0.003 at 0.8. Mindlin plates, beams and rods are more exact. Cylinders, whose
mesh is graded by their own sizes, are off by 0.0001 at most from 0.1 on, so they need no check (docs/numerics.md)."""

SHEARED = 0.2
"""Largest D k²/S, the deflection by shear over that by bending, of waves whose period is the length of the push. With
more, Kirchhoff's theory is not enough: AR is off by 0.015 at 0.4 (carbon cross-ply), 0.1 at 4 (soft core)."""

PARTS = ("section", "supports", "reduction")  # tables in the origin of a structure

KIRCHHOFF = ("Kirchhoff plate", "half-plane", "infinite plate")

WIDE = 0.2
"""Largest half-width of a contact over the depth or the radius of the pressed layer. A wider contact does not see a
half-space: on a rigid base its force is 20 % larger at this limit (Dimitriadis et al., Biophys. J. 82 (2002) 2798)."""

THIN = 1.0 / 3.0
"""Least depth over radius of a first layer on a softer one; a thinner layer bends under the bead. For steel of 9.5 mm
radius on PTFE and acrylic the theory of rods gives AR wrong by up to 0.16, 0.04, 0.02, 0.01 at 1, 2, 3, 6.35 mm."""

ENOUGH_CYCLES = 2.0  # cycles of the finer mesh that a warning recommends
MESH_ERROR, REDUCTION_ERROR = 0.02, 0.2
"""AR of the primary wave may be wrong by the first divided by the cycles, and by the second times the estimated error
of a reduction. Plates, half-planes and rods of 2 to 5 mm need 0.007 for the first (docs/numerics.md); a preloaded
chain on a clamped beam needs 0.018."""

EXCEEDED = 2.0  # a reduction's estimated error, about twice its true one, may be this many times its tolerance


def check_structures(
    interface: Interface, motions: Sequence[Motion], highest: Vector, interval: float
) -> Iterator[str]:
    """Yield a finding for each limit of theory, reduction or mesh that is exceeded, at the contact where it is worst.
    motions: one for each chain; highest: the greatest displacement of each surface, m."""
    worst = dict[str, tuple[float, str]]()
    for k, contact in enumerate(interface.contacts):
        body = interface.structures[contact.structure]
        if isinstance(body, CheckedParticipant):
            continue
        place, origin = -1 if contact.end == LAST else 0, body.structure.origin
        force = motions[contact.chain].force[place]
        doubts = [*_doubts(origin, float(highest[k]), push_length(force - interface.static[k], interval))]
        if origin.get("kind") == "rod" and (pair := interface.chains[contact.chain].pairs[place]):
            doubts += _of_layers(origin["layers"][:: 1 if contact.point == 0 else -1], pair, float(force.max()))
        for kind, degree, words in doubts:
            worst[kind] = max(worst.get(kind, (0.0, "")), (degree, words), key=itemgetter(0))
    yield from (f"{kind}: {words}" for kind, (_, words) in worst.items())


def push_length(force: Vector, interval: float) -> float:
    """Return the length of the strongest push, s, zero if there is none: 2 ∫F dt / F_max, the length of a raised cosine
    with the same impulse and peak. force: the dynamic force, N, saved every `interval` s."""
    top, peak = float(force.max()), int(force.argmax())
    if not top > 0.0:
        return 0.0
    open_at = np.concatenate([[0], np.flatnonzero(force <= 0.0), [force.size]])
    after = int(open_at.searchsorted(peak, side="right"))
    return 2.0 * interval * float(force[open_at[after - 1] : open_at[after]].sum()) / top


def _doubts(origin: Any, moved: float, length: float) -> Iterator[tuple[str, float, str]]:
    """Yield the doubts about a structure whose contact moved by `moved`, m, under a push of `length`, s: the kind,
    degree and words of each. The origin of a user's structure may hold anything."""

    part = {name: found if isinstance(found := origin.get(name), Mapping) else {} for name in PARTS}

    def number(name: str, of: Any = origin) -> float:
        return float(found) if isinstance(found := of.get(name), Real) else 0.0

    # Only a supported plate is stretched; a free one may fly off.
    thickness = number("thickness") or number("thickness", part["section"])
    supports = part["supports"] or {"": "held"}
    held = any(support not in ("free", "symmetry") for support in supports.values())
    if thickness and held and moved > LARGE_DEFLECTION * thickness:
        words = (
            f"the plate moves by {readable(moved, 'm', 2)} at the contact, more than half its thickness of "
            f"{readable(thickness, 'm')}; linear theory neglects the stretching that then stiffens it"
        )
        yield "deflection", moved / thickness, words
    if length == 0.0:
        return

    wrong = "AR may be wrong by {:.1g}, late and secondary waves by more"
    report = part["reduction"]
    if {"pulse", "error_estimate", "tolerance"} <= set(report):
        error, allowed = error_for_pulse(report, length), report["tolerance"]
        if error > EXCEEDED * allowed:
            words = (
                f"its estimated error is {100.0 * error:.2g} % for this run's push of {readable(length, 's', 2)}, "
                f"its tolerance {100.0 * allowed:.2g} % for pulses of {readable(report['pulse'], 's', 2)}; "
                f"{wrong.format(min(REDUCTION_ERROR * error, 1.0))}; reduce(..., pulse={length:.1e}) suits this push"
            )
            yield "reduction", error / allowed, words

    frequency = 0.0 if origin.get("kind") == "cylinder" else number("highest_frequency")
    if frequency and length * frequency < FEWEST_CYCLES:
        needed = ENOUGH_CYCLES / length
        times = rounded_up(needed / frequency)
        finer = f"highest_frequency={rounded_up(needed):g}"
        if origin.get("kind") == "rod":
            finer = f"elements={ceil(times * max(origin['elements']))}"
        elif origin.get("kind") == "solid":
            finer = f"a mesh {times:g} times as fine"
        elif origin.get("kind") == "from_modes":
            finer = f"modes up to {readable(rounded_up(needed), 'Hz')}"
        words = (
            f"it resolves waves up to {readable(frequency, 'Hz')}, and this run's push of "
            f"{readable(length, 's', 2)} excites higher ones; "
            f"{wrong.format(min(MESH_ERROR / (length * frequency), 1.0))}; {finer} suits this push"
        )
        yield "mesh", 1.0 / (length * frequency), words

    wall = part["section"]
    if origin.get("kind") in KIRCHHOFF and {"bending", "shear", "mass"} <= set(wall):
        stiffness, shear = np.diag(wall["bending"])[:2], np.diag(wall["shear"])
        share = float((2.0 * np.pi / length * np.sqrt(wall["mass"] * stiffness) / shear).max())
        if share > SHEARED:
            added = f"{100.0 * share:.0f} % of" if share < 10.0 else f"{share:.0f} times"
            words = (
                f"during this run's push of {readable(length, 's', 2)}, shear adds {added} the plate's bending "
                "deflection; Kirchhoff's theory leaves it out, so AR is not reliable; mindlin_plate includes it"
            )
            yield "shear", share, words


def _of_layers(layers: Sequence[Mapping[str, Any]], pair: Pair, force: float) -> Iterator[tuple[str, float, str]]:
    """Yield the doubts about the layers of a rod, the pressed one first, under a contact force, N."""
    first, radius = layers[0], layers[0]["radius"]
    depth = first["length"] if len(layers) > 1 else inf
    moduli = [layer["material"]["youngs_modulus"] for layer in layers]
    if depth < THIN * radius and moduli[0] > 2.0 * moduli[1]:
        words = (
            f"the pressed layer, {readable(depth, 'm', 2)} thick and {readable(2.0 * radius, 'm', 2)} wide, bends over "
            "the softer one, which the theory of rods leaves out; AR may be wrong by 0.02 to 0.2; layered_cylinder "
            "includes it"
        )
        yield "layer", radius / depth, words
    pressed, facing = (surface_of(body) for body in pair)
    width = sqrt(1.5 * force / (pi * hertz_pressure(pressed, facing, force))) if force > 0.0 else 0.0
    if width > WIDE * min(depth, radius):
        size = f"{readable(depth, 'm', 2)} thick" if depth < radius else f"{readable(radius, 'm', 2)} in radius"
        words = (
            f"is {readable(2.0 * width, 'm', 2)} wide, and the pressed layer {size}; Hertz's law holds for bodies much "
            "larger than the contact; AR and TOF are wrong"
        )
        yield "contact", width / min(depth, radius), words
