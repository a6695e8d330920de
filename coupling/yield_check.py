"""Yielding in a run with elastic contacts: how far the greatest force of a contact is beyond yield."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from coupling.recording.frames import Motion
from particles.contacts import once_per_pair
from particles.deformable.deformable_chain import DeformableChain
from particles.laws.yielding import JacksonGreen
from particles.moving import MovingChain
from particles.overloads import overloads, slower, unknown_strengths, weaker

SLIGHT = 1.12
"""The pressure of a contact, in units of that at which it yields, up to which no run is warned of: 1.4 times the force.
There, by Jackson and Green's law, AR at bead 10 of 20 is lower by 0.011 to 0.013 on half-spaces, by 0.007 and 0.010 on
plates of brass and aluminium, and the incident force by up to 2.5 % where beads yield."""

CURE = "law=hl.laws.JacksonGreen() in Chain computes it"


def is_of_yield(finding: str) -> bool:
    """Return whether a law of yielding would change the run that a finding is about."""
    return finding.startswith("yield: ") and CURE in finding


def yields(chains: Sequence[Sequence[MovingChain]], motions: Sequence[Motion]) -> Iterator[tuple[int, str]]:
    """Yield the number of a run and a finding on its contact that is pressed farthest beyond yield.

    chains: of each motion, one for each run.
    """
    ratios = [overloads(of_runs[0], motion.peaks) for of_runs, motion in zip(chains, motions, strict=True)]
    greatest = np.array([of_chain.max(axis=1) for of_chain in ratios])
    for run in np.flatnonzero(greatest.max(axis=0) > SLIGHT).tolist():
        number = int(greatest[:, run].argmax())
        chain, contact, ratio = chains[number][run], int(ratios[number][run].argmax()), float(greatest[number, run])
        where = f"contact {contact + 1}" + (f" of chain {number}" if len(chains) > 1 else "")
        what = weaker(chain, contact).name or "the softer body"
        law = chain.once("takes a law of yielding", partial(_takes_a_law, chain))
        yield (
            run,
            f"yield: {where} presses {what} to {ratio:.3g} times the pressure at which it yields; "
            + (f"its dent is left out; {CURE}" if law else slower(chain, contact, ratio)),
        )
    unknown = dict.fromkeys(strength for of_runs in chains for strength in unknown_strengths(of_runs[0]))
    yield from ((run, strength) for run in range(greatest.shape[1]) for strength in unknown)


def _takes_a_law(chain: MovingChain) -> bool:
    """Return whether all bodies of a chain touch in circles, and it has no law of its own."""
    if isinstance(chain.chain, DeformableChain) or chain.chain.law is not None:
        return False
    law, laws = JacksonGreen(), chain.laws
    try:
        once_per_pair(chain.pairs, lambda pair, i: law.of_law(*pair, laws[i]))  # type: ignore[arg-type]
    except ValueError:
        return False
    return True
