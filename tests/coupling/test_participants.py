"""Black boxes that fail, give wrong answers or cannot repeat are named in the error, in any scheme; sound ones run."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from hard_cases import BEAD

import hertzlink as hl

CHAIN = hl.Chain([BEAD] * 3, BEAD, 0.31)
UNTIL = 2e-4
STEEL = hl.Surface(hl.STEEL_440C)
SCHEMES = {"Aitken": hl.Aitken(), "IQN-ILS": hl.IQN_ILS(), "Explicit": hl.Explicit()}


class Sound:
    """A mass on a damped spring by the implicit midpoint."""

    surface: Any = STEEL
    mass, stiffness, damping = 0.0141, 1.7e7, 40.0

    def start(self) -> Any:
        return 0.0, 0.0

    def advance(self, state: Any, force: Any, window: float) -> Any:
        u, v = state
        whole = self.mass + window / 2.0 * self.damping + window**2 / 4.0 * self.stiffness
        middle = (self.mass * v + window / 2.0 * (force - self.stiffness * u)) / whole
        return (u + window * middle, 2.0 * middle - v), u + window * middle


class SoundPair(Sound):
    """Two of them, each at a contact point of its own."""

    surface = (STEEL, STEEL)

    def start(self) -> Any:
        return np.zeros(2), np.zeros(2)


def simulate(participant: Any, scheme: Any = None, until: float = UNTIL) -> xr.Dataset:
    """A pair faces two chains."""
    pair = isinstance(participant, Sound) and isinstance(participant.surface, tuple)
    chains = [CHAIN, hl.Chain([BEAD] * 2, BEAD, 0.2)] if pair else CHAIN
    return hl.CoSimulation(chains, participant, scheme or hl.Aitken()).run(until)


def answering(answer: Any, kind: type = Sound) -> Any:
    """A participant that changes the displacement, or the whole answer, of the sound one."""

    class Liar(kind):  # type: ignore[misc, valid-type]
        def advance(self, state: Any, force: Any, window: float) -> Any:
            return answer(*super().advance(state, force, window))

    return Liar()


@pytest.mark.thorough
@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_black_box_does_as_the_structure_that_it_is(scheme: str) -> None:
    """The structure has one contact point, or two."""
    matrices = [np.array([[value]]) for value in (Sound.mass, Sound.stiffness, Sound.damping)]
    one = hl.Structure(*matrices, np.ones(1), 0.0, STEEL)
    pair = hl.Structure(*(np.kron(np.eye(2), matrix) for matrix in matrices), np.eye(2), 0.0, STEEL)
    for box, structure in ((Sound(), one), (SoundPair(), pair)):
        found = simulate(box, SCHEMES[scheme])
        chains = [CHAIN, hl.Chain([BEAD] * 2, BEAD, 0.2)] if structure is pair else CHAIN
        expected = hl.CoSimulation(chains, structure).run(UNTIL)
        greatest = float(expected.contact_force.max())
        assert found.contact_force.values == pytest.approx(
            expected.contact_force.values, abs=1e-3 * greatest, nan_ok=True
        )
        assert found.structure_kinetic_energy.isnull().all()
        assert hl.energy_error(found) < 1e-4


ANSWERS = {
    "a complex number": lambda state, place: (state, complex(place, 1e-9)),
    "text": lambda state, place: (state, str(place)),
    "nothing": lambda state, place: (state, None),
    "a function": lambda state, place: (state, lambda: place),
    "no state": lambda state, place: place,
    "a state alone": lambda state, place: np.array(state),
    "None alone": lambda state, place: None,
}


@pytest.mark.parametrize("scheme", ["Aitken", "Explicit, unvetted"])
@pytest.mark.parametrize("answer", ANSWERS)
def test_answers_that_are_no_displacement(answer: str, scheme: str) -> None:
    with pytest.raises(ValueError, match=r"Liar\.advance returned .*: must be \(state, displacement in m\)"):
        simulate(answering(ANSWERS[answer]), SCHEMES.get(scheme, hl.Explicit(tolerance=None)))


@pytest.mark.parametrize("places", [lambda p: p[:1], lambda p: p[0], lambda p: p[:, None], lambda p: ["a", "b"]])
def test_answers_of_two_points_that_are_not_two_numbers(places: Any) -> None:
    liar = answering(lambda state, place: (state, places(place)), SoundPair)
    with pytest.raises(ValueError, match=r"Liar\.advance returned [^:]*: must be \(state, 2 displacements in m\)"):
        simulate(liar)


@pytest.mark.parametrize("scheme", ["IQN-ILS", "Explicit, unvetted"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -1e4])
def test_a_displacement_that_is_not_finite_or_absurd(value: Any, scheme: str) -> None:
    liar = answering(lambda state, place: (state, place if abs(place) < 1e-8 else value))
    message = r"window from t = .* s: Liar\.advance returned a displacement of .* m"
    with pytest.raises(FloatingPointError, match=message):
        simulate(liar, SCHEMES.get(scheme, hl.Explicit(tolerance=None)))


@pytest.mark.parametrize("kind", [Sound, SoundPair])
@pytest.mark.parametrize("scheme", [*SCHEMES, "Explicit, unvetted"])
def test_displacements_that_count_from_elsewhere(scheme: str, kind: type) -> None:
    liar = answering(lambda state, place: (state, place + 1e-6), kind)
    with pytest.raises(ValueError, match=r"Liar\.advance returned a displacement of .* without force: must be 0"):
        simulate(liar, SCHEMES.get(scheme, hl.Explicit(tolerance=None)))


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("kind", [Sound, SoundPair])
def test_a_displacement_of_the_wrong_sign_is_found_before_the_run(kind: type, scheme: str) -> None:
    liar = answering(lambda state, place: (state, -place), kind)
    point = "the contact point" if kind is Sound else "contact point 0"
    message = rf"Liar\.advance moved {point} by -.* m, towards the chain, under .* N from rest; .* passive = False"
    with pytest.raises(ValueError, match=message):
        simulate(liar, SCHEMES[scheme])


class FeedsEnergy(Sound):
    """A dashpot of the wrong sign, which shows only when it moves."""

    damping = -400.0


@pytest.mark.thorough
@pytest.mark.parametrize("scheme", [*SCHEMES, "Explicit, unvetted"])
def test_a_source_of_energy_is_found_out_unless_it_says_so(scheme: str) -> None:
    chosen = SCHEMES.get(scheme, hl.Explicit(tolerance=None))
    message = r"FeedsEnergy\.advance gives back more energy than it received, .* J up to t = .* passive = False"
    with pytest.raises(ValueError, match=message):
        simulate(FeedsEnergy(), chosen, 1e-3)
    honest = FeedsEnergy()
    honest.passive = False  # type: ignore[attr-defined]
    # The energy that an exchange creates in such a motion would stop an explicit scheme that checks it.
    run = simulate(honest, hl.Explicit(tolerance=None) if isinstance(chosen, hl.Explicit) else chosen, 1e-3)
    assert float(run.structure_work.min()) < -0.01 * float(run.impact_energy)


class Motor(Sound):
    """Pushes back on its own from the start, by 10 N."""

    passive = False

    def advance(self, state: Any, force: Any, window: float) -> Any:
        return super().advance(state, force - 10.0, window)


def test_a_motor_may_move_towards_the_chain() -> None:
    assert float(simulate(Motor()).surface_displacement.min()) < -1e-7


def hidden_states() -> dict[str, Any]:
    """Participants whose answers from one state differ."""

    class KeepsItself(Sound):
        def start(self) -> Any:
            self.state = super().start()

        def advance(self, state: Any, force: Any, window: float) -> Any:
            self.state, place = super().advance(self.state, force, window)
            return None, place

    class ChangesTheOldState(Sound):
        def start(self) -> Any:
            return np.zeros(2)

        def advance(self, state: Any, force: Any, window: float) -> Any:
            state[:], place = super().advance(state, force, window)
            return state, place

    class Random(Sound):
        numbers = np.random.default_rng(1)

        def advance(self, state: Any, force: Any, window: float) -> Any:
            state, place = super().advance(state, force, window)
            return state, place * (1.0 + 1e-9 * self.numbers.normal())

    return {kind.__name__: kind for kind in (KeepsItself, ChangesTheOldState, Random)}


@pytest.mark.parametrize("name", hidden_states())
def test_what_cannot_repeat_is_told_before_the_run(name: str) -> None:
    with pytest.raises(ValueError, match=rf"{name}\.advance is not repeatable: .* Explicit\(tolerance=None\)"):
        simulate(hidden_states()[name]())


@pytest.mark.parametrize("scheme", ["Aitken", "IQN-ILS"])
@pytest.mark.parametrize("kind", [Sound, SoundPair])
def test_what_cannot_repeat_under_load_is_told_where_the_scheme_gives_up(kind: type, scheme: str) -> None:
    """The trial before the run has a hundredth of the greatest force."""

    class Slips(kind):  # type: ignore[misc, valid-type]
        numbers = np.random.default_rng(1)

        def advance(self, state: Any, force: Any, window: float) -> Any:
            state, place = super().advance(state, force, window)
            return state, place + np.where(np.abs(force) > 30.0, 1e-7 * self.numbers.normal(), 0.0)

    slips = answering(lambda state, place: (state, place if np.ndim(place) else float(place)), Slips)
    with pytest.raises(ValueError, match=r"Liar\.advance is not repeatable: from one state") as caught:
        simulate(slips, SCHEMES[scheme])
    assert "residual" in str(caught.value.__context__)


def test_what_cannot_repeat_takes_part_unvetted() -> None:
    """Each window is requested once, in order, and gives the result of the sound participant."""

    class Once(Sound):
        def start(self) -> Any:
            self.state, self.calls = super().start(), 0

        def advance(self, state: Any, force: Any, window: float) -> Any:
            self.calls += 1
            self.state, place = super().advance(self.state, force, window)
            return None, place

    once = Once()
    found, expected = simulate(once, hl.Explicit(tolerance=None)), simulate(Sound(), hl.Explicit(tolerance=None))
    assert found.contact_force.values.tobytes() == expected.contact_force.values.tobytes()
    assert once.calls == int(found.windows.sum())


@pytest.mark.parametrize(
    ("surface", "message"),
    [
        ("steel", r"Odd\.surface = 'steel': must be a Surface\(material\), or a tuple"),
        (None, r"Odd\.surface = None: must be a Surface"),
        ([STEEL, STEEL], r"Odd\.surface = \[Surface.*: must be a Surface\(material\), or a tuple"),
        ((None,), r"Odd\.surface = \(None,\): must be a Surface"),
    ],
)
def test_surfaces_that_are_none(surface: Any, message: str) -> None:
    class Odd(Sound):
        pass

    odd = Odd()
    odd.surface = surface
    with pytest.raises(ValueError, match=message):
        hl.CoSimulation(CHAIN, odd, hl.Aitken())


def test_passive_is_true_or_false() -> None:
    box = Sound()
    box.passive = "no"  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match=r"Sound\.passive = 'no': must be True or False"):
        hl.CoSimulation(CHAIN, box, hl.Aitken())


def test_what_is_no_participant() -> None:
    class NoSurface:
        start, advance = Sound.start, Sound.advance

    class SurfaceOnly:
        surface = Sound.surface

    for given, message in (
        (NoSurface(), "structure = NoSurface: lacks surface; must be a Structure .* or an object with surface, start"),
        (Sound, r"structure = the class Sound: must be an instance, such as Sound\(…\)"),
        (Sound().advance, "structure = method: must be a Structure"),
        (SurfaceOnly(), "structure = SurfaceOnly: lacks start and advance; must be a Structure"),
    ):
        with pytest.raises(ValueError, match=message):
            hl.CoSimulation(CHAIN, given, hl.Aitken())
    with pytest.raises(ValueError, match="structure = the class Sound: must be an instance"):
        hl.ContactPoint(Sound, 0)
    with pytest.raises(ValueError, match=r"needs a Structure; use Aitken\(\) for a solver of your own \(Sound\)"):
        hl.CoSimulation(CHAIN, Sound())


def test_the_one_of_several_that_fails_is_named() -> None:
    class Second(Sound):
        def advance(self, state: Any, force: Any, window: float) -> Any:
            return state, "far"

    with pytest.raises(ValueError, match=r"Second\.advance returned .*'far'.*: must be \(state, displacement in m\)"):
        hl.CoSimulation([CHAIN, CHAIN], [Sound(), Second()], hl.Aitken()).run(UNTIL)
