"""Cracks and stops that close: unilateral contacts inside a structure, without a penalty."""

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from structures.checks import count_of, each, finite, instance, short
from structures.described import described
from structures.moving import MovingStructure
from structures.oscillators import Oscillators
from structures.quantities import Quantity
from structures.stepping import ImplicitMidpoint, Step, StructureState, energies
from structures.structure import Structure, Vector

PARTS = 16
"""Parts of a window in which a gap closes, so that the time at which it does is known to one of them."""


@described
class Gap:
    """A gap in static equilibrium: its width, m, and the force across it, N, which only a closed gap has."""

    # Chains move structures by micrometres; a wider gap is most likely in another unit.
    opening: Annotated[float, Quantity("m", "a length", "2.29 mm", high=1e-2, or_zero=True)] = 0.0
    # More than the strength of any rod in use.
    preload: Annotated[float, Quantity("N", "a force", "2 N", high=1e9, or_zero=True)] = 0.0

    def __post_init__(self) -> None:
        if self.opening > 0.0 and self.preload > 0.0:
            raise ValueError(f"preload = {self.preload:g}: must be 0 where the gap is open, opening > 0")


class ClosingState(NamedTuple):
    """The state of a structure whose gaps close.

    Parameters
    ----------
    body : StructureState
        Displacements and velocities of the degrees of freedom.
    pressed : ndarray
        The mean force across each gap over the last window, N: zero where the gap is open at its end.
    lost : float
        The energy that damping and the closing of gaps have dissipated so far, J.

    Examples
    --------
    >>> import hertzlink as hl
    >>> halves = [hl.Layer(hl.STEEL_440C, length=0.1, radius=9.525e-3)] * 2
    >>> body = hl.stepping.Closing(hl.rod(halves, cracks=[0]), opening=[0.0], preload=[50.0])
    >>> body.start().pressed
    array([50.])
    """

    body: StructureState
    pressed: Vector
    lost: float


class _Ahead(NamedTuple):
    """The forecast from a state whatever the forces: the state at the window's end where none acts, the rate of each
    gap there, and the gaps that may press, or None.
    """

    free: StructureState
    rate: Vector
    near: NDArray[np.bool_] | None


class Closing:
    """A structure with gaps that open and close, as a participant.

    The last contacts of the structure are gaps. The force across a gap pushes its two faces apart and never pulls:
    g ≥ 0, Λ ≥ 0, g Λ = 0, where g is the width and Λ the force. The first contacts are those that chains face.

    Parameters
    ----------
    structure : Structure
        A linear structure with the contacts of the chains, followed by one contact for each gap, such as
        ``rod(layers, cracks=[0])``. A positive displacement of a gap's contact opens it. `reduce` keeps the motion of
        gaps as it keeps that of all contacts.
    opening : sequence of float
        Width of each gap in static equilibrium, m, 0 to 0.01.
    preload : sequence of float, optional
        Force across each gap in static equilibrium, N. Only a closed gap, whose opening is 0, has one. By default 0.

    Raises
    ------
    ValueError
        If an opening or a preload is out of range, an open gap has a preload, or no contact is left for a chain, or
        a face of a gap has no mass.

    Notes
    -----
    The structure moves by the implicit midpoint rule. A gap may press in a window if it pressed in the last one, or if
    its faces approach and would meet before the middle of the window. There the velocity at the end of the window
    obeys ġ ≥ 0, Λ ≥ 0, ġ Λ = 0. The forces of several gaps follow from a non-negative least-squares problem. No
    stiffness has to be chosen. A window in which a gap closes is divided into 16 parts, so that faces overlap by at
    most the approach in half of such a part.

    Faces that meet lose the relative velocity of the masses that the mesh gives them, as in a plastic impact. The loss
    is never negative, and it vanishes as the mesh and the window are refined together. `ClosingState.lost` is its sum.

    The displacement depends on the force in a nonlinear way. A co-simulation finds the force by `Condensed()` as for a
    linear structure: a gap that closes only makes the structure stiffer, so Newton's method with its compliance
    converges.

    References
    ----------
    Moreau, in Nonsmooth Mechanics and Applications, Springer (1988) 1, section 9; Jean, Comput. Methods Appl. Mech.
    Eng. 177 (1999) 235, section 4.

    Examples
    --------
    A steel rod with a crack of 0.1 µm. The wave of a slow striker does not close it, that of a fast one does:

    >>> import hertzlink as hl
    >>> halves = [hl.Layer(hl.STEEL_440C, length=0.1, radius=9.525e-3)] * 2
    >>> cut = hl.reduce(hl.rod(halves, base="free", cracks=[0]), until=2e-4)
    >>> cracked = hl.stepping.Closing(cut, opening=[1e-7])
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> for speed in (0.01, 0.5):
    ...     chain = hl.Chain([bead] * 5, striker=bead, impact_speed=speed)
    ...     run = hl.CoSimulation(chain, cracked).run(until=2e-4)
    """

    def __init__(self, structure: Structure, opening: Sequence[float], preload: Sequence[float] | None = None) -> None:
        instance("structure", structure, Structure, "a Structure")
        widths = _each("opening", opening, "m")
        forces = np.zeros(len(widths)) if preload is None else _each("preload", preload, "N")
        if len(forces) != len(widths):
            raise ValueError(
                f"preload: has {count_of(len(forces), 'number')}, must have {len(widths)}, one for each opening"
            )
        for number, (width, force) in enumerate(zip(widths.tolist(), forces.tolist(), strict=True)):
            try:
                Gap(width, force)
            except ValueError as error:
                name, _, words = str(error).partition(" = ")
                raise ValueError(f"{name}[{number}] = {words}") from None
        if len(widths) >= structure.contacts:
            raise ValueError(
                f"opening: has {count_of(len(widths), 'number')}, must have fewer than the structure's "
                f"{structure.contacts} contacts; the first is the chain's, and rod(layers, cracks=[0]) adds another"
            )
        massless = abs(structure.mass).sum(axis=0) == 0.0
        gaps = structure.contact_vectors[:, structure.contacts - len(widths) :]
        if (gaps[massless] != 0.0).any():
            raise ValueError("structure: has a gap at a degree of freedom without mass, whose velocity is undetermined")
        self.structure, self.opening, self.preload = structure, widths, forces
        self._count = structure.contacts - len(widths)
        self.moving = MovingStructure(structure, stepper=_midpoint)
        self._gaps, self._read = gaps, np.ascontiguousarray(gaps.T)
        self._compliances: dict[float, Vector] = {}
        self._kept: tuple[ClosingState | None, dict[float, _Ahead]] = (None, {})

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what the last state brings; for pickles and copies."""
        return {**vars(self), "_kept": (None, {})}

    @property
    def surface(self) -> Any:
        """Material and curvature at the contact of the chain: a Surface, or a tuple of them for several chains."""
        surfaces = self.structure.surfaces[: self._count]
        return surfaces[0] if self._count == 1 else surfaces

    def describe(self) -> dict[str, Any]:
        """Return how the structure was made, and its gaps, as plain data."""
        return {**self.structure.origin, "opening": self.opening.tolist(), "preload": self.preload.tolist()}

    def __repr__(self) -> str:
        return f"Closing({self.structure!r}, opening={self.opening.tolist()}, preload={self.preload.tolist()})"

    def start(self) -> ClosingState:
        """Return the state at rest in static equilibrium."""
        return ClosingState(self.moving.start(), self.preload.copy(), 0.0)

    def advance(self, state: ClosingState, force: Any, window: float) -> tuple[ClosingState, Any]:
        """Advance by one window (s) under the mean force (N) of each chain, relative to the static one.

        Parameters
        ----------
        state : ClosingState
            The state at the beginning of the window.
        force : float or ndarray
            Mean force of the chain, N; of several chains one number for each.
        window : float
            Length of the window, s.

        Returns
        -------
        state : ClosingState
            The state at the end.
        displacement : float or ndarray
            Displacement of each chain's contact, m.
        """
        forces = np.concatenate([np.atleast_1d(np.asarray(force, dtype=float)), -self.preload])
        after = self._stepped(state, self._kept_ahead(state, window), forces, window)
        if self._switched(state, after):
            part, pressed = window / PARTS, np.zeros(len(self.opening))
            ahead, after = self._kept_ahead(state, part), state
            for number in range(PARTS):
                ahead = self._ahead(after, part) if number else ahead
                after = self._stepped(after, ahead, forces, part)
                pressed += after.pressed / PARTS
            # What opened again is open: its faces move apart.
            after = after._replace(pressed=np.where(after.pressed > 0.0, pressed, 0.0))
        places = self.moving.read(after.body)[: self._count]
        return after, float(places[0]) if self._count == 1 else places

    def _kept_ahead(self, state: ClosingState, window: float) -> _Ahead:
        """Return `_ahead`, stored for the last state: a co-simulation repeats a window with other forces."""
        rates = self._kept
        if rates[0] is not state:
            rates = self._kept = (state, {})
        if not isinstance(window, float):
            return self._ahead(state, window)
        if window not in rates[1]:
            rates[1][window] = self._ahead(state, window)
        return rates[1][window]

    def _ahead(self, state: ClosingState, window: float) -> _Ahead:
        """Return what follows from a state over a window (s)."""
        body = state.body
        free, rate = self.moving.free(body, window), self._read @ body.velocity
        middle = self.widths(state) + 0.5 * window * rate
        near = (state.pressed > 0.0) | ((middle <= 0.0) & (rate <= 0.0))
        return _Ahead(free, self._read @ free.velocity, near if near.any() else None)

    def _stepped(self, state: ClosingState, ahead: _Ahead, forces: Vector, window: float) -> ClosingState:
        """Return one step of the implicit midpoint rule, in which each gap is open or presses."""
        if ahead.near is None:
            end = self.moving.pushed(ahead.free, forces, window)
            lost = self.moving.dissipated(state.body, end, window)
            return ClosingState(end, np.zeros(len(self.opening)), state.lost + lost)
        compliance, near = self._compliance(window), ahead.near
        rate = ahead.rate + compliance @ forces
        gap_compliance = compliance[:, self._count :]
        if near.all():
            pressed = _separating(gap_compliance, rate)
        else:
            pressed = np.zeros(len(self.opening))
            pressed[near] = _separating(gap_compliance[np.ix_(near, near)], rate[near])
        end = self.moving.pushed(ahead.free, np.append(forces[: self._count], forces[self._count :] + pressed), window)
        lost = self.moving.dissipated(state.body, end, window)
        if pressed.any():
            lost -= float(pressed @ (self._read @ (end.displacement - state.body.displacement)))
        return ClosingState(end, pressed, state.lost + lost)

    def _switched(self, before: ClosingState, after: ClosingState) -> bool:
        """Return whether a gap closed on the way, or should have closed."""
        presses = after.pressed > 0.0
        if (presses & (before.pressed == 0.0)).any():
            return True
        overlaps = ~presses & (self.widths(after) < 0.0)
        return bool(overlaps.any() and (overlaps & (self._read @ after.body.velocity < 0.0)).any())

    def widths(self, state: ClosingState) -> Vector:
        """Return the width of each gap, m. A gap that closed may overlap by 1/32 of a window's approach.

        Parameters
        ----------
        state : ClosingState
            A state of this structure.

        Returns
        -------
        ndarray
            One number for each gap.
        """
        widths: Vector = self.opening + self._read @ state.body.displacement
        return widths

    def energy(self, state: ClosingState) -> float:
        """Return the kinetic and elastic energy relative to static equilibrium, J, with the work against the preload.

        Parameters
        ----------
        state : ClosingState
            A state of this structure.

        Returns
        -------
        float
            The energy. The work of the chains equals its gain plus `ClosingState.lost`.
        """
        kinetic, elastic, _ = self.energies(state)
        return kinetic + elastic

    def energies(self, state: ClosingState) -> tuple[float, float, float]:
        """Return the kinetic and elastic energy, the latter with the work against the preload, and lost energy.

        Parameters
        ----------
        state : ClosingState
            A state of this structure.

        Returns
        -------
        tuple of float
            The three energies, J.
        """
        kinetic, elastic = energies(self.structure, state.body)
        return kinetic, elastic + float(self.preload @ (self._read @ state.body.displacement)), state.lost

    def _compliance(self, window: float) -> Vector:
        """The velocity of each gap at the end of a window after 1 N at each contact, m/(N s)."""
        if window not in self._compliances:
            matrix = self._read @ self.moving.response(window).velocity
            gap_compliance = matrix[:, self._count :]
            self._compliances[window] = np.hstack([matrix[:, : self._count], 0.5 * (gap_compliance + gap_compliance.T)])
        return self._compliances[window]


def _midpoint(structure: Structure, window: float) -> Step:
    """Return the implicit midpoint for all motions: ẇ at both ends of a window then gives its change of w exactly."""
    return Oscillators(structure, window, exact=False) if structure.is_modal else ImplicitMidpoint(structure, window)


def _separating(compliance: Vector, rate: Vector) -> Vector:
    """Return Λ ≥ 0 with rate + compliance Λ ≥ 0, and zero where Λ > 0.

    For one gap Λ is known. Of several, mostly those press that would close. Else nnls finds them.

    This is the condition of optimality of least ½ ΛᵀAΛ + ΛᵀR, solved as least ‖LᵀΛ + L⁻¹R‖ with A = LLᵀ, in units in
    which the diagonal of A is one.
    """
    closing = rate < 0.0
    force: Vector = np.zeros_like(rate)
    if rate.size == 1:
        force[0] = max(-rate[0] / compliance[0, 0], 0.0)
        return force
    if closing.any():
        force[closing] = np.linalg.solve(compliance[np.ix_(closing, closing)], -rate[closing])
    if (force >= 0.0).all() and (closing | (rate + compliance @ force >= 0.0)).all():
        return force
    from scipy.optimize import nnls  # loaded by those whose gaps close in other ways

    units = np.sqrt(compliance.diagonal())
    scaled = rate / units
    scale = float(abs(scaled).max())
    if scale == 0.0:
        return np.zeros_like(rate)
    lower = np.linalg.cholesky(compliance / np.outer(units, units))
    solution, _ = nnls(lower.T, -solve_triangular(lower, scaled / scale, lower=True))
    force = solution * scale / units
    return force


def _each(name: str, values: Any, unit: str) -> Vector:
    """Return one number or more."""
    numbers = np.asarray(each(finite, name, values, unit))  # type: ignore[arg-type]
    if numbers.ndim != 1 or not numbers.size:
        raise ValueError(f"{name} = {short(values)}: must be a list with one number of {unit} for each gap")
    return numbers
