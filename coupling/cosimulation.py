"""The co-simulation: chains and structures, coupled by a scheme through the contacts between them."""

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Annotated, Any

import xarray as xr

from coupling.black_box import Condensed, Scheme
from coupling.engine import fill, is_compiled
from coupling.interface import Facing, Interface, changed, facing_of_each
from coupling.plan import ACCURACIES, Adaptive, HowFine, Plan, longest_window, plan_run, warn_if_coarse
from coupling.recording.dataset import dataset
from coupling.recording.frames import Frames, kept_at
from coupling.results.findings import warn
from coupling.results.provenance import folded
from coupling.results.schema import LAST
from coupling.run_checks import MOST_OF_A_RUN, check_before, check_effort, checked
from particles.chain import Chain
from particles.moving import MovingChain
from structures.checks import count_of, instance, listed
from structures.described import checked_call
from structures.fineness import Fineness, fineness, finer, times_shorter
from structures.moving import MovingStructure
from structures.quantities import Asks, Interval, Quantity
from structures.reduction import reduce as reduce_structure
from structures.structure import Structure


class CoSimulation:
    """Chains that face structures through the Hertzian contacts at their ends.

    Parameters
    ----------
    chain : Chain or list of Chain
        The chain, or several chains.
    structure : Structure, MovingStructure, Participant, ContactPoint or None
        What the last bead faces; None for nothing. A Participant is a user's own solver. For several chains give a list
        with one entry each, or one structure with as many contact points. ContactPoint(structure, number) names one
        contact point of a structure.
    scheme : Condensed, Aitken, IQN_ILS or Explicit, optional
        How both sides agree on the mean forces of a window. By default Condensed(), for linear structures; use
        Aitken() for black boxes.
    window : float or Adaptive, optional
        The length of a window, s, at whose end both sides agree; or Adaptive(tolerance). By default the scheme
        determines it.
    dt : float, optional
        The step of the chain, s. By default the shortest contact time determines it.
    behind : like `structure`
        What the first bead of the chain, or of each chain, faces with its struck side.
    accuracy : {"default", "screening", "reference"}
        The default window and dt. "screening" takes 40 windows and 160 steps in the shortest contact, about a fifth of
        the time: AR changes by at most 1e-4 on rods, plates and half-spaces, by 6e-4 where a light tip chatters, and
        energy by 1e-4. "reference" has four times the windows and steps of the default, so a sixteenth of its error.
    most_steps : float
        Number of steps, summed over the beads, above which a run is refused before it begins. The default, 1e9, takes
        some minutes; a run exceeds it mostly because a time has the wrong unit.
    reduce : bool
        Whether to reduce, as by `hl.reduce`, linear structures that the compiled engine cannot take: those of more than
        600 unknowns, or of 300 if damping couples their modes. If False, they run unreduced, in Python.

    Raises
    ------
    ValueError
        If the arguments do not fit each other, or the scheme cannot serve these structures.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 12, striker=bead, impact_speed=0.44)
    >>> simulation = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C))
    >>> simulation
    CoSimulation(12 beads on half-space; Condensed(tolerance=1e-11))
    >>> run = simulation.run(until=5e-4)
    >>> print(f"AR = {float(hl.amplitude_ratio(run, sensor=6)):.2f}")
    AR = 0.98
    """

    @checked_call
    def __init__(
        self,
        chain: Chain | Iterable[Chain],
        structure: Facing | Sequence[Facing],
        scheme: Scheme | None = None,
        window: Interval | Adaptive | None = None,
        dt: Annotated[Interval, Asks("the step of the chain; by default it follows from the contacts")] | None = None,
        *,
        behind: Facing | Sequence[Facing] = None,
        accuracy: HowFine = "default",
        most_steps: Annotated[float, Quantity("", "a number of steps of beads", "1e10")] = MOST_OF_A_RUN,
        reduce: bool = True,
    ) -> None:
        several = not isinstance(chain, Chain) and isinstance(chain, Iterable)
        if several:
            chains = listed("chain", chain, Chain, "one Chain or more")
        else:
            chains = [instance("chain", chain, Chain, "a Chain, or a list of them")]
        if scheme is not None:
            instance("scheme", scheme, Scheme, "a scheme such as Condensed() or Aitken()")
        facing = facing_of_each("structure", structure, len(chains), several)
        back = facing_of_each("behind", behind, len(chains), several)
        self.accuracy, self.most_steps = ACCURACIES[accuracy], most_steps
        self.interface = Interface(chains, facing, back, dt, self.accuracy.steps)
        self._shorter = times_shorter(self.interface.contact_time)
        if self._shorter > 1:
            near, far = (changed(one, self._suited) for one in (facing, back))
            self.interface = Interface(chains, near, far, dt, self.accuracy.steps)
        self.scheme: Scheme = Condensed() if scheme is None else scheme
        if isinstance(self.scheme, Condensed) and (boxes := self.interface.black_boxes):
            raise ValueError(
                f"scheme = {self.scheme!r}: needs a Structure; use Aitken() for a solver of your own ({boxes[0].name})"
            )
        self.window, self.reduces = window, reduce
        self.chain: MovingChain = self.interface.chains[0]
        """The chain, or the first of several."""
        self.structure: Any = self.interface.structures[0]
        """The structure that the last bead faces, as a participant; the first of several."""
        self._reduced: tuple[float, Fineness, CoSimulation] | None = None
        if dt is not None and isinstance(window, float) and dt > window:
            raise ValueError(f"dt = {dt!r}: must not be longer than the window, {window} s")
        self._given: dict[str, Any] = {
            "chain": chains if several else chains[0], "structure": facing if several else facing[0], "scheme": scheme,
            "window": window, "dt": dt, "behind": back if several else back[0], "accuracy": accuracy,
            "most_steps": most_steps, "reduce": reduce,
        }  # fmt: skip

    @checked_call
    def run(
        self, until: Interval, save_every: Interval | None = None, sensors: Iterable[int] | None = None
    ) -> xr.Dataset:
        """Simulate up to a time and return what was saved.

        Parameters
        ----------
        until : float
            The time, s. The last saved time is `until`, or the last whole interval before it.
        save_every : float, optional
            The interval between saved times, s. By default `window` if that is a number; otherwise `until` divided by
            a power of two, with at least 64 saved times in the shortest contact.
        sensors : sequence of int, optional
            Numbers of the beads of each chain to keep, each with its velocity and its two contact forces. The run is
            then faster and its result far smaller. Measures of waves work on it; energies, displacements and the motion
            of the structure are not kept. By default everything is kept.

        Returns
        -------
        Dataset
            Displacements, velocities, forces and energies over time, or what sensors keep, with the input, the versions
            and the warnings in its attributes.

        Raises
        ------
        NotConverged
            If both sides do not agree on the forces of a window.
        FloatingPointError
            If the state of a body is no longer finite.
        """
        if (whole := self.for_run(until)) is not self:
            return whole.run(until, save_every, sensors)
        adaptive = isinstance(self.window, Adaptive)
        if adaptive and not is_compiled(self.interface, self.scheme):
            raise ValueError(
                f"window = {self.window!r}: needs the compiled engine, which takes the scheme Condensed() and small or "
                "reduced structures; give a window in s, or none"
            )
        shortest = min(len(one.chain.beads) for one in self.interface.chains)
        selection = None if sensors is None else kept_at(sensors, shortest)
        findings = check_before(self.interface.chains, until)
        warn(findings)
        plan = self.plan(until, save_every)
        findings += warn_if_coarse(plan, self.interface, adaptive)
        inputs = {
            **self._described, "until": until, "window": repr(self.window) if adaptive else plan.length,
            "save_every": plan.interval, "steps": [chain.steps(plan.length) for chain in self.interface.chains],
        }  # fmt: skip
        frames = Frames(self.interface, plan.rows, selection)
        fill(frames, self.interface, self.scheme, self.window, plan)
        findings += checked(self.interface, frames, plan.interval)
        return dataset(self.interface, frames, plan.interval, inputs, findings)

    def plan(self, until: float, save_every: float | None = None) -> Plan:
        """Return the windows and saved times of a run; raise a ValueError for times that do not fit or many steps."""
        check_effort(self.interface.chains, until, self.most_steps)
        return plan_run(self.interface, self.scheme, self.window, until, save_every, self.accuracy.windows)

    @property
    def longest_window(self) -> float:
        """The longest window that the scheme, or `window`, allows, s."""
        return longest_window(self.interface, self.scheme, self.window, self.accuracy.windows)

    def replace(self, **changes: Any) -> "CoSimulation":
        """Return a copy of the co-simulation with other values of some arguments.

        Parameters
        ----------
        **changes
            New values of arguments.

        Returns
        -------
        CoSimulation
            A new one.
        """
        return CoSimulation(**{**self._given, **changes})

    def for_run(self, until: float) -> "CoSimulation":
        """Return the co-simulation that a run up to `until`, s, uses: large structures are reduced. It is kept for
        later runs that are not longer. Raises ValueError as `plan` and `hl.reduce` do."""
        # Structures that are not reduced and too large for the compiled engine.
        large = [
            body for body in self.interface.structures
            if type(body) is MovingStructure and body.size and "reduction" not in body.structure.origin
            and not body.compact
        ]  # fmt: skip
        if not self.reduces or not large:
            return self
        if self._reduced is None or self._reduced[0] < until or self._reduced[1] != fineness():
            check_effort(self.interface.chains, until, self.most_steps)
            moving = [body for body in self.interface.structures if isinstance(body, MovingStructure)]
            bodies = {id(body.structure): body for body in moving}
            with finer(shorter=self._shorter):
                for body in large:
                    bodies[id(body.structure)] = MovingStructure(reduce_structure(body.structure, until))

            def smaller(body: Any) -> Any:
                body = self._suited(body)
                return bodies.get(id(body if isinstance(body, Structure) else getattr(body, "structure", None)), body)

            made = self.replace(**{name: changed(self._given[name], smaller) for name in ("structure", "behind")})
            self._reduced = made._reduced = until, fineness(), made
        return self._reduced[2]

    def _suited(self, body: Any) -> Any:
        """Return a body whose default mesh and reduction suit the short contacts of these chains."""
        return body.for_contacts(self._shorter) if isinstance(body, Structure) else body

    def describe(self) -> dict[str, Any]:
        """Return the full input as plain data."""
        interface = self.interface
        chains = [chain.chain.describe() for chain in interface.chains]
        structures: list[Any] = [
            structure.describe() if isinstance(structure, MovingStructure) else structure.name
            for structure in interface.structures
        ]
        for contact in interface.contacts:
            if contact.end == LAST and interface.chains[contact.chain].surface is None:
                structures[contact.structure] = None
        bodies: dict[str, Any] = {"chain": chains[0], "structure": structures[0]}
        if not interface.single:
            contacts = [list(contact) for contact in interface.contacts]
            bodies = {"chains": chains, "structures": structures, "contacts": contacts}
        asked = {} if self.most_steps == MOST_OF_A_RUN else {"most_steps": self.most_steps}
        whole = {} if self.reduces else {"reduce": False}
        return {**bodies, "scheme": repr(self.scheme), **asked, **whole}

    @cached_property
    def _described(self) -> dict[str, Any]:
        """The input in the form that results hold; all runs share it, as nothing in it changes."""
        return folded(self.describe())  # type: ignore[no-any-return]

    def __repr__(self) -> str:
        interface, chain, body = self.interface, self.chain, self.structure
        if len(interface.chains) > 1 or len(interface.structures) > 1:
            counts = {"chain": len(interface.chains), "structure": len(interface.structures), "contact": interface.size}
            words = ", ".join(count_of(count, name) for name, count in counts.items())
        else:
            name = body.structure.origin.get("kind", "structure") if isinstance(body, MovingStructure) else body.name
            words = f"{count_of(len(chain.chain.beads), 'bead')} on {'nothing' if chain.surface is None else name}"
        return f"CoSimulation({words}; {self.scheme!r})"
