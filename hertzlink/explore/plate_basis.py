"""One basis for a thin rectangular plate at all values of its sliders, so that no run needs a mesh of its own."""

from collections.abc import Sequence

from coupling.inference.plates import Struck, share_modes, struck_by
from hertzlink.cases.case import Case
from hertzlink.explore.sliders import Slider

TOLERANCE, MOST_ERROR = 0.03, 0.1
"""Error of the displacement after a pulse that a basis is made for, and the largest with which it is used: with 0.3
late waves are wrong, with 0.07 AR is off by some 1e-4."""


def plates_of(case: Case, sliders: Sequence[Slider]) -> tuple[Struck, list[list[Struck]]] | None:
    """Return the plate at the first values and at both ends of each slider; None where no basis serves them all."""
    moved = [slider for slider in sliders if slider.path[0] in ("structure", "materials")]
    if not moved or case.model.run.reduce is not True or any(slider.choices for slider in moved):
        return None
    changes: list[dict[str, float]] = [{}, *({s.name: s.si(end)} for s in moved for end in (s.low, s.high))]
    plates = [struck for change in changes if (struck := struck_by(case.changed(change).simulation))]
    if len(plates) < len(changes) or not share_modes(plates):
        return None
    return plates[0], [plates[i : i + 2] for i in range(1, len(plates), 2)]
