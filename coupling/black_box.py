"""The loop over windows in Python: for participants of a user, and for structures that the compiled engine cannot take.

For each window a scheme finds the mean forces on which both sides agree: predicted forces push the structures, the
chains follow their surfaces, and the forces that they answer less those that pushed are the residual.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import Annotated, Any, NamedTuple

import numpy as np

from coupling.interface import Interface, check_finite
from coupling.kernels.recorders import Elsewhere, record_row
from coupling.kernels.records import CONTACT, NODE, REMEMBERED, TOTALS, WINDOW, Run
from coupling.participant import CheckedParticipant
from coupling.recording.frames import Frames
from particles.kernels.motion import MOVED, WORK_ROWS
from structures.checks import count_of
from structures.described import described
from structures.moving import MovingStructure
from structures.quantities import Count, Quantity
from structures.structure import Vector

MOST_HALVINGS = 12  # of a window that does not converge, before the run stops
MOST_TRIALS = 60  # of Newton's method before the window is halved; it takes three or four
MOST_ORDER = 2  # of a predictor; polynomials of higher order are unstable
MOST_MADE = 0.05  # part of the impact energy; an exchange that makes or loses more is no motion of the bodies
LARGEST_GAIN = 0.01  # part of the impact energy that a passive participant may give back beyond what it received
PROBE = 0.01  # part of the greatest force with which a user's participant is tested before the run
STILL = 1e-14  # of the greatest approach, a way of a surface that gives Newton's method no slope

# Of forces, in units of the greatest one; below the range lies rounding.
Tolerance = Annotated[float, Quantity(low=1e-14, high=1.0)]
# From 2 on no fixed-point iteration converges, however stiff the structure.
Relaxation = Annotated[float, Quantity(high=2.0, ends=False)]


class NotConverged(RuntimeError):
    """Chains and structures did not agree on the mean forces of a window, however short."""


class Scheme:
    """How both sides come to agree on the mean forces of a window."""

    # Enough where both sides agree on every window. With 64 in the shortest contact the worst amplitude ratio found, on
    # a tip of one bead's mass that chatters, was off by 3e-4; the error falls with the square.
    windows_per_contact = 112
    tolerance: Any
    largest_count = 1
    predictor = MOST_ORDER
    parallel = False

    @property
    def repeats(self) -> bool:
        """Whether it repeats a window from the same state, which needs participants that can."""
        return self.tolerance is not None


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
    >>> hl.Condensed()
    Condensed(tolerance=1e-11)
    """

    tolerance: Tolerance = 1e-11
    largest_count = MOST_TRIALS


@described
class Explicit(Scheme):
    """One exchange a window: forces predicted from the last windows push the structures.

    Parameters
    ----------
    predictor : int
        Order of the polynomial through the last mean forces, 0 to 2. 0 repeats the last force, and the scheme is of
        first order; with 1 and 2 it is of second order.
    parallel : bool
        Whether both sides move at once, the chains against predicted surfaces. Else, in series, the chains follow the
        new motion of the surfaces.
    tolerance : float or None
        The greatest difference between predicted and answered forces, in units of the greatest force that the contact
        could bear. The window is halved where it is exceeded. None accepts every window, for a participant that
        cannot repeat one.

    Notes
    -----
    Explicit schemes create or lose energy, see interface_mismatch in the result. The tolerance stops a scheme that
    becomes unstable on a light structure, but seldom rescues it. A force that jumps, as where a contact with a dashpot
    closes, remains wrong in any window; it is accepted once its impulse is small.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.Explicit(tolerance=None)
    Explicit(predictor=1, parallel=False, tolerance=None)
    """

    predictor: Annotated[int, Count(0, MOST_ORDER)] = 1
    parallel: bool = False
    tolerance: Tolerance | None = 1e-2
    windows_per_contact = 512


@dataclass(frozen=True)
class Iterated(Scheme):
    """Both sides repeat a window until the forces agree and the surfaces come to rest.

    No step divides by a residual, which is zero as long as a gap is open.
    """

    tolerance: Tolerance = 1e-9
    relaxation: Relaxation = 0.5
    largest_count: Annotated[int, Count(1, 100_000)] = 50


@described
class Aitken(Iterated):
    """Fixed-point iteration with Aitken's relaxation, for structures that are black boxes.

    Parameters
    ----------
    tolerance : float
        Of the mean forces, in units of the greatest force that a contact could bear, and of the surfaces, in units of
        the greatest approach.
    relaxation : float
        The relaxation factor of the first repetition, between 0 and 2.
    largest_count : int
        Repetitions of a window, after which it is halved.

    References
    ----------
    Küttler and Wall, Comput. Mech. 43 (2008) 61, section 3.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.Aitken(tolerance=1e-10)
    Aitken(tolerance=1e-10, relaxation=0.5, largest_count=50)
    """


@described
class IQN_ILS(Iterated):
    """Interface quasi-Newton: an approximation of the inverse Jacobian by least squares.

    Parameters
    ----------
    tolerance, relaxation, largest_count
        As in `Aitken`; repetitions are relaxed as long as there are no differences.
    reuse : int
        Number of earlier windows whose differences are used, if they have the same length.
    filtering : float
        A difference that adds less than this part of its length to the newer ones is dropped.

    References
    ----------
    Degroote, Bathe and Vierendeels, Comput. Struct. 87 (2009) 793; QR filtering: Haelterman et al., Comput. Struct. 171
    (2016) 9.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.IQN_ILS(reuse=0)
    IQN_ILS(tolerance=1e-09, relaxation=0.5, largest_count=50, reuse=0, filtering=0.001)
    """

    reuse: Annotated[int, Count(0)] = 2
    filtering: Annotated[float, Quantity()] = 1e-3


# What `step` of the next three returns is the change of the forces, N, after a trial with this residual.


class Newton:
    """Newton's method on answer(w_free + C F) − F, with a secant slope for each contact, from those of the window
    before."""

    def __init__(self, slope: Vector, compliance: Vector, still: float) -> None:
        self.slope, self.compliance, self.still = slope.copy(), compliance, still
        self.last: tuple[Vector, Vector] | None = None

    def step(self, residual: Vector, answer: Vector, surface: Vector) -> Vector:
        if self.last is not None:
            moved = surface - self.last[0]
            far = abs(moved) > self.still
            self.slope[far] = np.minimum((answer - self.last[1])[far] / moved[far], 0.0)
        self.last = surface, answer
        matrix = np.eye(len(residual)) - self.slope[:, None] * self.compliance
        return np.asarray(np.linalg.solve(matrix, residual))


class Relaxed:
    """A part of the residual, which follows from the last two."""

    def __init__(self, factor: float) -> None:
        self.factor = factor
        self.last: Vector | None = None

    def step(self, residual: Vector, answer: Vector, surface: Vector) -> Vector:
        if self.last is not None:
            change = residual - self.last
            if (square := float(change @ change)) > 0.0:
                self.factor *= -float(self.last @ change) / square
        self.last = residual
        return self.factor * residual


class LeastSquares:
    """The change of the answers for the least residual, from differences (of residuals, of answers), newest first."""

    def __init__(self, scheme: IQN_ILS, earlier: Sequence[tuple[Vector, Vector]]) -> None:
        self.scheme, self.earlier = scheme, earlier
        self.new: list[tuple[Vector, Vector]] = []
        self.last: tuple[Vector, Vector] | None = None

    def step(self, residual: Vector, answer: Vector, surface: Vector) -> Vector:
        if self.last is not None:
            self.new.insert(0, (residual - self.last[0], answer - self.last[1]))
        self.last = residual, answer
        pairs = [*self.new, *self.earlier]
        while pairs:
            matrix = np.array([column for column, _ in pairs]).T
            directions, upper = np.linalg.qr(matrix)
            added = np.zeros(len(pairs))
            added[: len(upper)] = abs(np.diagonal(upper))
            little = np.flatnonzero(added <= self.scheme.filtering * np.linalg.norm(matrix, axis=0))
            if not little.size:
                # Σ cᵢ Δresidualᵢ = −residual in the least squares; Σ cᵢ Δanswerᵢ is then the change of the answers.
                parts = np.linalg.solve(upper, -(directions.T @ residual))
                change: Vector = np.array([other for _, other in pairs]).T @ parts + residual
                return change
            del pairs[little[0]]
        return self.scheme.relaxation * residual


class Window(NamedTuple):
    """One that ended at a time, s: its length, s; surfaces at its end, m; mean forces that the chains answered, N."""

    time: float
    length: float
    surface: Vector
    force: Vector


class Disagreement(Exception):
    """A window for which no forces were found."""


class Loop:
    """Both sides of a run at the end of a window, its ledger, and what the next window starts from. K contacts.

    followed: the surfaces that the chains last followed, m; predicted ones, where both sides move at once.
    """

    def __init__(self, interface: Interface, scheme: Scheme) -> None:
        self.interface, self.scheme, self.time = interface, scheme, 0.0
        self.chains = [chain.start() for chain in interface.chains]
        self.structures = [structure.start() for structure in interface.structures]
        self.surface = self.followed = np.zeros(interface.size)
        self.contact = np.zeros(interface.size, CONTACT)
        self.past: list[Window] = []
        self.tried, self.windows, self.residual = 0, 0, 0.0
        self.slope = np.zeros(interface.size)
        self.differences: dict[float, list[list[tuple[Vector, Vector]]]] = {}
        """Of IQN_ILS: by the length of the last windows, those of each that was repeated, newest first."""

    def advance(self, length: float, halvings: int = MOST_HALVINGS) -> None:
        """Move on by a window of `length` s; one for which no forces are found is halved at most so many times."""
        try:
            self.exchange(length)
        except Disagreement as found:
            if halvings == 0:
                raise Disagreement(f"t = {self.time:.6g} s, {length:.3g} s long: {found}") from None
            for _ in range(2):
                self.advance(length / 2.0, halvings - 1)

    def exchange(self, length: float) -> None:
        """Move on by a window of `length` s under the forces on which both sides agree."""
        interface, scheme = self.interface, self.scheme
        force = np.zeros(interface.size)
        if self.past:
            middles = [window.time - window.length / 2.0 for window in self.past]
            forces = [window.force for window in self.past]
            guess = predicted(middles, forces, scheme.predictor, self.time + length / 2.0)
            force = np.maximum(guess, -interface.static)  # a contact cannot pull
        search: Newton | Relaxed | LeastSquares | None = None
        begin, linear = self.structures, isinstance(scheme, Condensed)
        if linear:
            begin = [body.free(now, length) for body, now in zip(interface.structures, begin, strict=True)]
            compliance = np.zeros((interface.size, interface.size))
            for seats, body in zip(interface.of_structure, interface.structures, strict=True):
                used = seats >= 0
                compliance[np.ix_(seats[used], seats[used])] = body.compliance(length)[np.ix_(used, used)]
            search = Newton(self.slope, compliance, STILL * interface.indentation_scale)
        elif isinstance(scheme, Aitken):
            search = Relaxed(scheme.relaxation)
        elif isinstance(scheme, IQN_ILS):
            search = LeastSquares(scheme, [pair for pairs in self.differences.get(length, []) for pair in pairs])
        enough = inf if scheme.tolerance is None else scheme.tolerance * interface.force_scale
        if isinstance(scheme, Explicit):  # in short windows the impulse counts
            enough *= max(1.0, interface.contact_time / scheme.windows_per_contact / length)

        still, last = inf, self.surface
        for count in range(1, scheme.largest_count + 1):
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
            target = self.predicted_surface(length) if scheme.parallel else surface
            chains, answer = self.follow(target, length)
            residual = answer - force
            wrong = float(abs(residual).max())
            if not wrong > enough and not abs(surface - last).max() > still:
                break
            if count == scheme.largest_count or search is None:
                raise Disagreement(f"residual {wrong:.3g} N after {count_of(count, 'trial')}, tolerance {enough:.3g} N")
            force = force + search.step(residual, answer, surface)
            if isinstance(scheme, Iterated):
                still, last = scheme.tolerance * interface.indentation_scale, surface

        contact = self.contact.copy()
        contact["work"] += force * (surface - self.surface)
        contact["given"] += answer * (target - self.followed)
        contact["impulse"] += length * force
        contact["surface"] = surface
        if isinstance(scheme, Explicit) and scheme.repeats:
            made = float(abs((contact["given"] - contact["work"]).sum())) / interface.impact_energy
            if made > MOST_MADE:
                raise Disagreement(f"the exchange has made or lost {made:.2g} of the impact energy")
        if isinstance(search, Newton):
            self.slope = search.slope
        elif isinstance(search, LeastSquares) and isinstance(scheme, IQN_ILS):
            known = [search.new, *self.differences.get(length, [])] if search.new else self.differences.get(length, [])
            self.differences = {length: known[: scheme.reuse]}
        self.chains, self.structures, self.contact = chains, ends, contact
        self.surface, self.followed, self.time = surface, target, self.time + length
        self.past = [*self.past[1 - REMEMBERED :], Window(self.time, length, surface, answer)]
        self.windows, self.residual = self.windows + 1, max(self.residual, wrong)

    def follow(self, surface: Vector, length: float) -> tuple[list[Any], Vector]:
        """Return the chains and their mean forces, N, after their surfaces moved straight to these places, m."""
        interface, chains, force = self.interface, [], np.empty(self.interface.size)
        for chain, state, seats in zip(interface.chains, self.chains, interface.of_chain, strict=True):
            motion: Any = self.followed[seats], surface[seats]
            if len(seats) == 1:
                motion = float(motion[0][0]), float(motion[1][0])
            moved, force[seats] = chain.advance(state, motion, length)
            chains.append(moved)
        self.tried += 1
        return chains, force

    def predicted_surface(self, length: float) -> Vector:
        """Return the surfaces at the end of a window, m, from those at the ends of the last ones."""
        if not self.past:
            return self.surface
        times, places = [window.time for window in self.past], [window.surface for window in self.past]
        if len(times) <= MOST_ORDER:
            times, places = [times[0] - self.past[0].length, *times], [np.zeros_like(self.surface), *places]
        return predicted(times, places, self.scheme.predictor, self.time + length)

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
        record_row(frames.saved, row, self.time, run, interface.model, Elsewhere(), work)
        if row % frames.saved.every:
            return
        self.tried, self.windows, self.residual = 0, 0, 0.0
        for structure, state, frame in zip(interface.structures, self.structures, frames.saved.structure, strict=True):
            known = isinstance(structure, MovingStructure)
            frame[row // frames.saved.every] = (*structure.energies(state), 0.0) if known else (nan, nan, nan)


def predicted(places: Sequence[float], values: Sequence[Vector], order: int, at: float) -> Vector:
    """Return the polynomial of at most this order through the newest values, which are last, at another place."""
    places, values = places[-order - 1 :], values[-order - 1 :]
    total: Vector = np.zeros(len(values[0]))
    for value, place in zip(values, places, strict=True):
        weight = 1.0
        for other in places:
            if other != place:
                weight *= (at - other) / (place - other)
        total = total + weight * value
    return total


def run_windows(interface: Interface, scheme: Scheme, frames: Frames, length: float, stride: int) -> None:
    """Fill the frames by windows of `length` s, of which `stride` make a saved interval.

    Raises NotConverged, FloatingPointError, and ValueError for participants that do not do as they must.
    """
    loop = Loop(interface, scheme)
    boxes = [(place, body) for place, body in enumerate(interface.structures) if isinstance(body, CheckedParticipant)]
    negligible = PROBE * interface.indentation_scale
    for _, body in boxes if scheme.repeats else ():
        body.check(PROBE * interface.force_scale, length, negligible)
    loop.record(frames, 0)
    for done in range(1, (frames.rows - 1) * stride + 1):
        begin = loop.time
        try:
            loop.advance(length)
        except Disagreement as found:
            error = NotConverged(f"window {done}, {found}")
            for place, body in boxes if scheme.repeats else ():
                # Under the load at which the scheme gave up, and twice that load.
                for forces in (body.last_forces, 2.0 * body.last_forces):
                    body.check_repeats(loop.structures[place], forces, length)
            raise error from None
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
                    f"{loop.time:.6g} s; check the displacement's sign and unit, or set passive = False"
                )
    frames.count_damping(interface)
