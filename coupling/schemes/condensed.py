"""Strong coupling with one structural solve a window, and the prediction that other schemes start from."""

import numpy as np

from coupling.interface import Interface
from coupling.schemes.scheme import Scheme, Tolerance
from coupling.state import CoupledState, NotConverged, predicted
from structures.described import described
from structures.structure import Vector

STILL = 1e-14
"""Of the greatest approach, a way of a surface that gives no slope."""

MOST_TRIALS = 60
"""Evaluations of Newton's method before the window is halved; it takes three or four."""


@described
class Condensed(Scheme):
    """Strong coupling with one structural solve for each window, for linear structures.

    Parameters
    ----------
    tolerance : float
        Of the mean force, in units of the greatest force that the contact could bear.

    Notes
    -----
    At the end of a window the surfaces are at w_free + C F̄, where the compliance C is known beforehand. Newton's method
    with C and a secant slope for each contact finds F̄ from repeated chain windows, which are cheap. The interface
    creates no energy: the surface moves linearly, and the mean force of the chain's own steps drives the structure.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 3, striker=bead, impact_speed=0.44)
    >>> rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=1e-4)
    >>> run = hl.CoSimulation(chain, rod, hl.Condensed()).run(until=1e-4)
    >>> print(f"{1e6 * float(run.surface_displacement.max()):.2f} µm")
    0.62 µm
    """

    tolerance: Tolerance = 1e-11

    def start(self, interface: Interface) -> Vector:
        """Return the secant slope of each contact."""
        if interface.black_boxes:
            name = interface.black_boxes[0].name
            raise ValueError(f"scheme = {self!r}: needs a Structure; use Aitken() for a solver of your own ({name})")
        return np.zeros(interface.size)

    def step(self, interface: Interface, state: CoupledState, length: float, substeps: int) -> list[CoupledState]:
        """Advance from one window's end to the next. Raises NotConverged.

        Newton's method on r(F) = G(w_free + C F) − F, with G the chains' mean forces, and its slopes by secants.
        """
        tolerance, compliance = self.tolerance * interface.force_scale, interface.compliance(length)
        both = zip(interface.structures, state.structures, strict=True)
        free = [structure.free(now, length) for structure, now in both]
        at_rest = interface.read(free)
        slope, identity = state.memory.copy(), np.eye(interface.size)
        force = trial_force(interface, state, length)
        last_surface, last_answer = at_rest, force
        for count in range(1, MOST_TRIALS + 1):
            surface = at_rest + compliance @ force
            moved, answer, work = interface.follow(state.chains, state.past, surface, length)
            residual = answer - force
            if not abs(residual).max() > tolerance:
                pushed = interface.pushed(free, force, length)
                return [interface.next(state, length, moved, pushed, surface, force, (answer, work), slope, count)]
            if count > 1:
                step = surface - last_surface
                moved_enough = abs(step) > STILL * interface.indentation_scale
                slope[moved_enough] = np.minimum((answer - last_answer)[moved_enough] / step[moved_enough], 0.0)
            last_surface, last_answer = surface, answer
            force = force + np.linalg.solve(identity - slope[:, None] * compliance, residual)
        worst = int(abs(residual).argmax())
        raise NotConverged(
            f"residual {residual[worst]:.3g} N at contact {worst} after {count} evaluations, "
            f"tolerance {tolerance:.3g} N",
            evaluations=count,
        )


def trial_force(interface: Interface, state: CoupledState, length: float, order: int = 2) -> Vector:
    """Return the mean forces (N) over the coming substep, predicted from the last ones; a surface is never pulled."""
    past = state.past
    if not past:
        return np.zeros(interface.size)
    middles = [node.time - node.length / 2.0 for node in past]
    guess = predicted(middles, [node.force for node in past], order, state.time + length / 2.0)
    forces: Vector = np.maximum(guess, -interface.static)
    return forces
