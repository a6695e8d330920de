"""The window loop in Python, for a user's participants and for structures that the compiled engine cannot take.

In each window a scheme finds the mean forces on which both sides agree. Predicted forces push the structures, the
chains follow the surfaces and answer with forces of their own. The difference of these forces is the residual.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, nan, prod
from typing import Annotated, Any, NamedTuple

import numpy as np

from coupling.interface import Interface, check_finite
from coupling.kernels.recorders import record_row
from coupling.kernels.records import CONTACT, NODE, REMEMBERED, TOTALS, WINDOW, Run
from coupling.participant import CheckedParticipant
from coupling.recording.frames import Frames
from particles.kernels.motion import MOVED, WORK_ROWS
from structures.checks import count_of
from structures.described import described
from structures.kernels.linear import dense
from structures.moving import MovingStructure
from structures.quantities import Count, Quantity
from structures.structure import Vector

MOST_HALVINGS = 12  # halvings of a window that does not converge, before the run stops
MOST_TRIALS = 60  # trials of Newton's method before the window is halved; three or four usually suffice
MOST_MADE = 0.05  # part of the impact energy; an exchange that creates or loses more does not describe the bodies
LARGEST_GAIN = 0.01  # part of the impact energy that a passive participant may return beyond what it received
PROBE = 0.01  # part of the greatest force; the test force on a user's participant before the run
STILL = 1e-14  # part of the greatest approach; a smaller motion of a surface gives Newton's method no slope

# A tolerance of forces, in units of the greatest force. Values below the range are rounding errors.
Tolerance = Annotated[float, Quantity(low=1e-14, high=1.0)]
# With a factor of 2 or more no fixed-point iteration converges, however stiff the structure is.
Relaxation = Annotated[float, Quantity(high=2.0, ends=False)]


class NotConverged(RuntimeError):
    """Chains and structures did not agree on the mean forces of a window, however short."""


class Scheme:
    """A rule by which both sides agree on the mean forces of a window."""

    # With 64 windows in the shortest contact the largest error of AR that was found was 3e-4, on a chattering tip with
    # the mass of one bead. The error falls with the square of the window's length, so 112 windows leave about 1e-4.
    windows_per_contact = 112
    tolerance: Any
    largest_count = 1
    predictor = 2  # the order of the polynomial that predicts the forces; higher orders are unstable

    @property
    def repeats(self) -> bool:
        """Whether the scheme repeats windows. Participants must then be able to repeat a window from an old state."""
        return self.tolerance is not None


@described
class Condensed(Scheme):
    """Strong coupling with one structural solve for each window, for linear structures.

    Parameters
    ----------
    tolerance : float
        Largest error of the mean force, in units of the greatest force that the contact can reach.

    Notes
    -----
    At the end of a window the surfaces are at w_free + C F̄, where the compliance C is known beforehand. Newton's method
    with C and a secant slope for each contact finds F̄ from repeated chain windows, which are cheap. The interface
    creates no energy: the surface moves linearly, and the mean force of the chain's own steps drives the structure.

    Examples
    --------
    >>> hl.Condensed()
    Condensed(tolerance=1e-11)
    """

    tolerance: Tolerance = 1e-11
    largest_count = MOST_TRIALS


@described
class Explicit(Scheme):
    """One exchange in each window: predicted forces push the structures, and the chains follow the new surfaces.

    Parameters
    ----------
    predictor : int
        Order of the polynomial through the last mean forces, 0 to 2. With 0 the last force is repeated, and the scheme
        is of first order; with 1 and 2 it is of second order.
    tolerance : float or None
        Largest difference between predicted and answered forces, in units of the greatest force that the contact can
        reach. A window with a larger difference is halved. None accepts every window; use it for a participant that
        cannot repeat a window.

    Notes
    -----
    Explicit schemes create or lose energy; see `interface_mismatch` in the result. The tolerance stops a scheme that
    becomes unstable on a light structure, but seldom rescues the run. A force that jumps, for example where a contact
    with a dashpot closes, is wrong in a window of any length; the window is accepted once the impulse is small.

    Examples
    --------
    >>> hl.Explicit(tolerance=None)
    Explicit(predictor=1, tolerance=None)
    """

    predictor: Annotated[int, Count(0, 2)] = 1
    tolerance: Tolerance | None = 1e-2
    windows_per_contact = 512


@dataclass(frozen=True)
class Iterated(Scheme):
    """Both sides repeat a window until the forces agree and the surfaces come to rest. No step divides by the residual,
    because it is zero as long as a gap is open."""

    tolerance: Tolerance = 1e-9
    relaxation: Relaxation = 0.5
    largest_count: Annotated[int, Count(1, 100_000)] = 50


@described
class Aitken(Iterated):
    """Fixed-point iteration with Aitken's relaxation, for structures that are black boxes.

    Parameters
    ----------
    tolerance : float
        Largest error of the mean forces, in units of the greatest force that a contact can reach, and largest last
        change of the surfaces, in units of the greatest approach.
    relaxation : float
        The relaxation factor of the first repetition, between 0 and 2.
    largest_count : int
        Number of repetitions after which a window is halved.

    References
    ----------
    Küttler and Wall, Comput. Mech. 43 (2008) 61, section 3.2.

    Examples
    --------
    >>> hl.Aitken(tolerance=1e-10)
    Aitken(tolerance=1e-10, relaxation=0.5, largest_count=50)
    """


@described
class IQN_ILS(Iterated):
    """Interface quasi-Newton: an approximation of the inverse Jacobian by least squares.

    Parameters
    ----------
    tolerance, relaxation, largest_count
        As in `Aitken`. The relaxation serves repetitions for which no differences are known yet.
    reuse : int
        Number of earlier windows of the same length whose differences are used.
    filtering : float
        A difference is dropped if the part of it that the newer ones do not span is shorter than this part of it.

    References
    ----------
    Degroote, Bathe and Vierendeels, Comput. Struct. 87 (2009) 793; QR filtering: Haelterman et al., Comput. Struct. 171
    (2016) 9.

    Examples
    --------
    >>> hl.IQN_ILS(reuse=0)
    IQN_ILS(tolerance=1e-09, relaxation=0.5, largest_count=50, reuse=0, filtering=0.001)
    """

    reuse: Annotated[int, Count(0)] = 2
    filtering: Annotated[float, Quantity()] = 1e-3


class Trial(NamedTuple):
    """A trial of a window."""

    residual: Vector  # the answer minus the forces that pushed the structures, N
    answer: Vector  # mean forces that the chains answered, N
    surface: Vector  # displacements of the surfaces at the end, m


Pairs = Sequence[tuple[Vector, Vector]]
"""Differences of residuals and of answers, N, newest first."""


def by_newton(trials: Sequence[Trial], slope: Vector, compliance: Vector, still: float) -> Vector:
    """Return the next change of the forces by Newton's method on answer(w_free + C F) − F, and update the slopes."""
    residual, answer, surface = trials[-1]
    if len(trials) > 1:
        moved = surface - trials[-2].surface
        far = abs(moved) > still
        slope[far] = np.minimum((answer - trials[-2].answer)[far] / moved[far], 0.0)
    return np.asarray(np.linalg.solve(np.eye(len(residual)) - slope[:, None] * compliance, residual))


def by_least_squares(trials: Sequence[Trial], earlier: Pairs, scheme: IQN_ILS) -> Vector:
    """Return the change of the forces that makes the residual least, from differences of this and earlier windows."""
    residual, pairs = trials[-1].residual, [*differences(trials), *earlier]
    while pairs:
        matrix = np.array([column for column, _ in pairs]).T
        directions, upper = np.linalg.qr(matrix)
        added = np.zeros(len(pairs))
        added[: len(upper)] = abs(np.diagonal(upper))
        little = np.flatnonzero(added <= scheme.filtering * np.linalg.norm(matrix, axis=0))
        if not little.size:
            # By least squares Σ cᵢ Δresidualᵢ = −residual; the answers then change by Σ cᵢ Δanswerᵢ.
            parts = np.linalg.solve(upper, -(directions.T @ residual))
            change: Vector = np.array([other for _, other in pairs]).T @ parts + residual
            return change
        del pairs[little[0]]
    return scheme.relaxation * residual


def differences(trials: Sequence[Trial]) -> Pairs:
    """Return the differences between the trials of a window."""
    return [(now.residual - before.residual, now.answer - before.answer) for before, now in pairwise(trials)][::-1]


class Window(NamedTuple):
    """A window that has ended."""

    time: float  # of its end, s
    length: float  # s
    surface: Vector  # displacements at its end, m
    force: Vector  # mean forces that the chains answered, N


class Loop:
    """Both sides of a run at the end of a window, the ledger, and the start values of the next window; K contacts."""

    def __init__(self, interface: Interface, scheme: Scheme) -> None:
        self.interface, self.scheme, self.time = interface, scheme, 0.0
        self.chains = [chain.start() for chain in interface.chains]
        self.structures = [structure.start() for structure in interface.structures]
        self.surface, self.slope = np.zeros((2, interface.size))
        self.contact, self.past = np.zeros(interface.size, CONTACT), list[Window]()
        self.tried, self.windows, self.residual = 0, 0, 0.0
        self.earlier: list[Pairs] = []  # differences of the last repeated windows, newest first, all of one length

    def advance(self, length: float, halvings: int = MOST_HALVINGS) -> None:
        """Advance by a window of `length` s. If no forces are found, halve it, at most `halvings` times."""
        try:
            self.exchange(length)
        except NotConverged as found:
            if halvings == 0:
                raise NotConverged(f"t = {self.time:.6g} s, {length:.3g} s long: {found}") from None
            for _ in range(2):
                self.advance(length / 2.0, halvings - 1)

    def exchange(self, length: float) -> None:
        """Advance by a window of `length` s under the forces on which both sides agree."""
        interface, scheme, force, trials = self.interface, self.scheme, self.predicted(length), list[Trial]()
        begin, linear = self.structures, isinstance(scheme, Condensed)
        slope, compliance = self.slope.copy(), np.zeros((interface.size, interface.size))
        known = self.earlier if self.past and self.past[-1].length == length else []
        if linear:
            begin = [body.free(now, length) for body, now in zip(interface.structures, begin, strict=True)]
            for seats, body in zip(interface.of_structure, interface.structures, strict=True):
                used = seats >= 0
                compliance[np.ix_(seats[used], seats[used])] = body.compliance(length)[np.ix_(used, used)]
        enough = inf if scheme.tolerance is None else scheme.tolerance * interface.force_scale
        if isinstance(scheme, Explicit):  # in short windows the impulse counts, not the force
            enough *= max(1.0, interface.contact_time / scheme.windows_per_contact / length)
        still = scheme.tolerance * interface.indentation_scale if isinstance(scheme, Iterated) else inf

        while True:
            surface, ends = np.empty(interface.size), []
            for body, now, seats in zip(interface.structures, begin, interface.of_structure, strict=True):
                pushes = np.where(seats < 0, 0.0, force[seats])
                if linear:
                    end = body.pushed(now, pushes, length)
                    places = body.read(end)
                else:
                    end, places = body.move(now, pushes, length)
                surface[seats[seats >= 0]] = places[seats >= 0]
                ends.append(end)
            chains, answer = self.follow(surface, length)
            trials.append(Trial(answer - force, answer, surface))
            wrong = float(abs(answer - force).max())
            moved = abs(surface - trials[-2].surface).max() if len(trials) > 1 else 0.0
            if not wrong > enough and not moved > still:
                break
            if len(trials) == scheme.largest_count:
                count = count_of(len(trials), "trial")
                raise NotConverged(f"residual {wrong:.3g} N after {count}, tolerance {enough:.3g} N")
            if linear:
                force = force + by_newton(trials, slope, compliance, STILL * interface.indentation_scale)
            elif isinstance(scheme, IQN_ILS):
                force = force + by_least_squares(trials, [pair for pairs in known for pair in pairs], scheme)
            elif isinstance(scheme, Iterated):
                part = scheme.relaxation  # factor of the residual, by Aitken's rule from all trials of the window
                for before, now in pairwise(trials):
                    change = now.residual - before.residual
                    if (square := float(change @ change)) > 0.0:
                        part *= -float(before.residual @ change) / square
                force = force + part * trials[-1].residual

        contact = self.contact.copy()
        contact["work"] += force * (surface - self.surface)
        contact["given"] += answer * (surface - self.surface)
        contact["impulse"] += length * force
        contact["surface"] = surface
        made = float(abs((contact["given"] - contact["work"]).sum())) / interface.impact_energy
        if isinstance(scheme, Explicit) and scheme.repeats and made > MOST_MADE:
            raise NotConverged(f"the exchange has created or lost {made:.2g} of the impact energy")
        if isinstance(scheme, IQN_ILS):
            self.earlier = [*filter(None, [differences(trials[:-1])]), *known][: scheme.reuse]
        self.chains, self.structures, self.contact, self.slope = chains, ends, contact, slope
        self.surface, self.time = surface, self.time + length
        self.past = [*self.past[1 - REMEMBERED :], Window(self.time, length, surface, answer)]
        self.windows, self.residual = self.windows + 1, max(self.residual, wrong)

    def predicted(self, length: float) -> Vector:
        """Return the predicted mean forces, N, by a polynomial through those of the last windows; no contact pulls."""
        past, now, total = self.past[-self.scheme.predictor - 1 :], self.time + length / 2.0, np.zeros_like(self.slope)
        middles = [window.time - window.length / 2.0 for window in past]
        for window, middle in zip(past, middles, strict=True):
            weight = prod((now - other) / (middle - other) for other in middles if other != middle)
            total = total + weight * window.force
        return np.asarray(np.maximum(total, -self.interface.static))

    def follow(self, surface: Vector, length: float) -> tuple[list[Any], Vector]:
        """Return the chains and their mean forces, N, after the surfaces moved in straight lines to places, m."""
        interface, chains, force = self.interface, [], np.empty(self.interface.size)
        for chain, state, seats in zip(interface.chains, self.chains, interface.of_chain, strict=True):
            motion: Any = self.surface[seats], surface[seats]
            if len(seats) == 1:
                motion = float(motion[0][0]), float(motion[1][0])
            moved, force[seats] = chain.advance(state, motion, length)
            chains.append(moved)
        self.tried += 1
        return chains, force

    def record(self, frames: Frames, row: int) -> None:
        """Fill a row of the frames, as the compiled engine does."""
        interface, size, none = self.interface, self.interface.size, np.zeros(0)
        node, window = np.zeros((REMEMBERED, size), NODE), np.zeros(REMEMBERED, WINDOW)
        for i, (time, length, surface, force) in enumerate(reversed(self.past)):
            node["surface"][i], node["force"][i], window[i] = surface, force, (time - length / 2.0, length)
        chain = np.array([(state.lost, state.driven) for state in self.chains], MOVED)
        totals = np.array([(len(self.past), self.tried, self.windows, self.residual)], TOTALS)
        run = Run(*interface.together(self.chains), none, self.contact, chain, node, window, totals)
        work = np.zeros((WORK_ROWS, interface.coordinates))
        # The structures are not in this record: Python moves them, and their energies are entered below.
        elsewhere = dense(*np.zeros((2, 0, 0)), np.zeros(len(interface.structures) + 1, int), *np.zeros((3, 0, 0)))
        record_row(frames.saved, row, self.time, run, interface.model, elsewhere, work)
        if row % frames.saved.every:
            return
        self.tried, self.windows, self.residual = 0, 0, 0.0
        for structure, state, frame in zip(interface.structures, self.structures, frames.saved.structure, strict=True):
            known = isinstance(structure, MovingStructure)
            frame[row // frames.saved.every] = (*structure.energies(state), 0.0) if known else (nan, nan, nan)


def run_windows(interface: Interface, scheme: Scheme, frames: Frames, length: float, stride: int) -> None:
    """Fill the frames by windows of `length` s; `stride` windows make a saved interval. Raises NotConverged,
    FloatingPointError, and ValueError for participants that break the rules of `Participant`."""
    loop = Loop(interface, scheme)
    boxes = [(place, body) for place, body in enumerate(interface.structures) if isinstance(body, CheckedParticipant)]
    negligible, repeated = PROBE * interface.indentation_scale, boxes if scheme.repeats else []
    for _, body in repeated:
        body.check(PROBE * interface.force_scale, length, negligible)
    loop.record(frames, 0)
    for done in range(1, (frames.rows - 1) * stride + 1):
        begin = loop.time
        try:
            loop.advance(length)
        except NotConverged as found:
            for place, body in repeated:
                # Perhaps a participant does not repeat a window: test it with the last forces, and with twice these.
                for forces in (body.last_forces, 2.0 * body.last_forces):
                    body.check_repeats(loop.structures[place], forces, length)
            raise NotConverged(f"window {done}, {found}") from None
        except FloatingPointError as error:
            raise FloatingPointError(f"window from t = {begin:.6g} s: {error}") from error
        if done % stride == 0:
            loop.record(frames, done // stride)
        check_finite(interface, [state[:2] for state in loop.chains], loop.surface, loop.time)
        for place, body in boxes:
            touching = interface.touching[place]
            if done == 1 and not scheme.repeats:  # no force acts in the first window
                body.check_rest(loop.surface[touching], negligible)
            work = float(loop.contact["work"][touching].sum())
            if body.passive and work < -LARGEST_GAIN * interface.impact_energy:
                raise ValueError(
                    f"{body.name}.advance gives back more energy than it received, {-work:.3g} J up to t = "
                    f"{loop.time:.6g} s; check the sign and the unit of the displacement, or set passive = False"
                )
