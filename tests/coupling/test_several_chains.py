"""Several chains, and several contacts of one chain, against the monolithic reference, symmetries and balances."""

import warnings
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr
from hard_cases import BEAD
from monolithic import Contact, monolithic

import hertzlink as hl

SENSOR, UNTIL = 5, 5.5e-4
CHAIN = hl.Chain([BEAD] * 10, BEAD, 0.31)
SENT = hl.Chain([BEAD] * 10, striker=None, impact_speed=0.31)
QUIET = hl.Chain([BEAD] * 6, striker=None)
LOSS = hl.LinearDashpot(5.0)
SUPPORTS = hl.Supports("clamped", "clamped", "free", "free")
WHOLE = hl.kirchhoff_plate(0.06, 0.06, 2e-3, hl.ALUMINIUM_6061, SUPPORTS, cells=(6, 6))
CLAMPED = hl.Supports("clamped", "clamped", "clamped", "clamped")
ACRYLIC_ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.03, 0.01)], elements=4)
PTFE_ROD = hl.rod([hl.Layer(hl.PTFE, 0.03, 0.01)], elements=4)
STUD = hl.rod([hl.Layer(hl.ACRYLIC, 0.02, 0.008)], base="contact", elements=4)
FRAME = hl.Structure(
    np.diag([3.0, 20.0, 5.0]) * BEAD.mass,
    1e7 * np.array([[1.0, -1.0, 0.0], [-1.0, 4.0, -3.0], [0.0, -3.0, 3.0]]),
    None,
    np.array([[-1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]),
    np.zeros(2),
    (hl.Surface(hl.STEEL_440C), hl.Surface(hl.STEEL_440C)),
)
"""Two jaws on a beam in the air: contact 0 faces forwards, contact 1 backwards, and a chain fits in between."""
TIPS = hl.Structure(
    np.diag([0.05, 0.05]) * BEAD.mass, 1e6 * np.array([[2.0, -1.0], [-1.0, 2.0]]), None, np.eye(2), 0.0,
    hl.Surface(hl.PTFE),
)  # fmt: skip
"""Two light tips on springs, side by side."""


def plate(x: list[float], y: list[float], face: Any = "front") -> hl.Structure:
    """A plate as oscillators."""
    return hl.reduce(WHOLE.at(x, y, face=face), until=UNTIL)


class System(NamedTuple):
    """The arguments of CoSimulation, and the same for the reference."""

    chain: Any
    facing: Any
    behind: Any
    structures: list[Any]
    contacts: list[Contact]

    @property
    def chains(self) -> list[hl.Chain]:
        return self.chain if isinstance(self.chain, list) else [self.chain]

    def run(self, scheme: Any = None, window: float | None = None) -> xr.Dataset:
        simulation = hl.CoSimulation(self.chain, self.facing, scheme, window, behind=self.behind)
        return simulation.run(UNTIL, save_every=1e-6 if window is None else 2e-6)


def two_on_a_plate() -> System:
    """Two chains of unlike speed and length."""
    body = plate([0.02, 0.04], [0.03, 0.03])
    slow = hl.Chain([BEAD] * 7, BEAD, 0.2)
    return System([CHAIN, slow], body, None, [body], [Contact(0, "last", 0, 0), Contact(1, "last", 0, 1)])


def between_rods() -> System:
    """The first bead moves at time zero, and strikes the rod behind when it is thrown back."""
    contacts = [Contact(0, "last", 0), Contact(0, "first", 1)]
    return System(SENT, ACRYLIC_ROD, PTFE_ROD, [ACRYLIC_ROD, PTFE_ROD], contacts)


def through_a_plate() -> System:
    """Chain, plate, chain, rod: the second chain stands on the plate's back."""
    body = plate([0.03, 0.03], [0.03, 0.03], ["front", "back"])
    return in_a_row(body, ACRYLIC_ROD)


def between_plates() -> System:
    """A quiet chain between two plates, the first of which a chain strikes."""
    return in_a_row(plate([0.03, 0.03], [0.03, 0.03], ["front", "back"]), plate([0.02], [0.03]))


def rod_between_chains() -> System:
    """A free rod with a chain on either end."""
    return in_a_row(STUD, ACRYLIC_ROD)


def in_a_row(first: hl.Structure, last: hl.Structure) -> System:
    """Chain, structure with two contacts, chain, structure."""
    facing, behind = [hl.ContactPoint(first, 0), last], [None, hl.ContactPoint(first, 1)]
    contacts = [Contact(0, "last", 0, 0), Contact(1, "last", 1), Contact(1, "first", 0, 1)]
    return System([CHAIN, QUIET], facing, behind, [first, last], contacts)


def in_a_frame() -> System:
    """Both ends of a chain on one structure."""
    contacts = [Contact(0, "last", 0, 1), Contact(0, "first", 0, 0)]
    return System(SENT, hl.ContactPoint(FRAME, 1), hl.ContactPoint(FRAME, 0), [FRAME], contacts)


def with_losses() -> System:
    """Dashpots, gravity and preload, on a light frame that chatters between its two chains."""
    one, other = (
        hl.Chain([BEAD] * 10, BEAD, 0.31, gravity=9.81, preload=0.2, dissipation=LOSS),
        hl.Chain([BEAD] * 4, BEAD, 0.2, gravity=9.81, dissipation=LOSS),
    )
    return System([one, other], TIPS, None, [TIPS], [Contact(0, "last", 0, 0), Contact(1, "last", 0, 1)])


SYSTEMS = {
    "two chains on a plate": two_on_a_plate,
    "chain between rods": between_rods,
    "chain, plate, chain, rod": through_a_plate,
    "chain between plates": between_plates,
    "rod between chains": rod_between_chains,
    "both ends on one frame": in_a_frame,
    "losses, gravity, preload": with_losses,
}
SCHEMES = {"Condensed": hl.Condensed(), "Aitken": hl.Aitken(), "IQN-ILS": hl.IQN_ILS(), "Explicit": hl.Explicit()}


@cache
def system(name: str) -> System:
    return SYSTEMS[name]()


@cache
def reference(name: str) -> list[xr.Dataset]:
    whole = system(name)
    times = 1e-6 * np.arange(round(UNTIL / 1e-6) + 1)
    return monolithic(whole.chains, whole.structures, whole.contacts, times, 1e-11)


@cache
def condensed(name: str) -> xr.Dataset:
    return system(name).run()


def chain_of(run: xr.Dataset, number: int) -> xr.Dataset:
    return run.isel(chain=number) if "chain" in run.dims else run


def bodies(values: xr.DataArray, count: int) -> Any:
    """The bodies of a chain, without padding."""
    assert values[:, count:].isnull().all()
    return values.values[:, :count]


@pytest.mark.thorough
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", SYSTEMS)
def test_all_schemes_agree_with_the_monolithic_reference(name: str, scheme: str) -> None:
    """Velocities of all bodies, amplitude ratios, surfaces, and forces where no dashpot makes them jump."""
    run = condensed(name) if scheme == "Condensed" else system(name).run(SCHEMES[scheme])
    for number, expected in enumerate(reference(name)):
        one, count = chain_of(run, number), expected.sizes["bead"]
        first = int(system(name).chains[number].striker is None)
        velocity = bodies(one.velocity, count)[:, first:]
        assert velocity == pytest.approx(expected.velocity.values[:, first:], abs=1e-3 * 0.31)
        if not system(name).chains[0].dissipation:
            assert bodies(one.contact_force, count) == pytest.approx(expected.contact_force.values, abs=0.05)
        for sensor in range(SENSOR - 1, count - SENSOR):
            ratio = hl.amplitude_ratio(expected, sensor).item()
            assert hl.amplitude_ratio(one, sensor).item() == pytest.approx(ratio, abs=1e-4, nan_ok=True)
    ends = {"last": "surface_displacement", "first": "first_surface_displacement"}
    for k, contact in enumerate(system(name).contacts):
        expected_place = reference(name)[contact.chain][ends[contact.end]].values
        assert run.surface_displacement.values[:, k] == pytest.approx(
            expected_place, abs=2e-3 * abs(expected_place).max()
        )


QUICK_SYSTEMS = ("chain between rods", "two chains on a plate")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK_SYSTEMS else pytest.mark.thorough) for name in SYSTEMS]
)
def test_nothing_is_lost_at_the_interfaces(name: str) -> None:
    """Energy of all bodies, work from either side, and the impulse of bodies that are not fixed."""
    run = condensed(name)
    energy = float(run.impact_energy.sum())
    assert hl.energy_error(run) < 1e-6
    assert float(abs(run.interface_mismatch).max()) < 1e-9 * energy
    work = run.structure_work.sum("structure") if "structure" in run.dims else run.structure_work
    assert run.interface_work.sum("interface").values == pytest.approx(work.values, abs=1e-12 * energy)
    assert float(run.residual.max()) < 1e-7


def test_momentum_passes_through_a_free_rod() -> None:
    """The momentum of two chains and a free rod is the striker's at every time."""
    facing, behind = [hl.ContactPoint(STUD, 0), None], [None, hl.ContactPoint(STUD, 1)]
    run = hl.CoSimulation([CHAIN, QUIET], facing, behind=behind).run(4e-4)
    assert run.gap.isel(interface=1).isnull().all(), "the last chain faces nothing"
    first, second = run.velocity.isel(chain=0).sum("bead"), run.velocity.isel(chain=1, bead=slice(1, 7)).sum("bead")
    rod = run.interface_impulse.isel(interface=0) - run.interface_impulse.isel(interface=2)
    struck = BEAD.mass * 0.31
    assert (BEAD.mass * (first + second) + rod).values == pytest.approx(struck, abs=1e-7 * struck)
    assert float(BEAD.mass * second[-1]) > 0.5 * struck


@pytest.mark.thorough
def test_equal_chains_do_as_each_other_in_the_mirror() -> None:
    """On a plate symmetric about x = 0.03: both equal, and exchanged if they are struck differently."""
    body = WHOLE.at([0.02, 0.04], [0.03, 0.03])
    slow = hl.Chain([BEAD] * 10, BEAD, 0.2)
    in_phase, pair, swapped = (
        hl.CoSimulation(chains, body).run(UNTIL, save_every=1e-6).contact_force
        for chains in ([CHAIN, CHAIN], [CHAIN, slow], [slow, CHAIN])
    )
    assert in_phase.isel(chain=0).values == pytest.approx(in_phase.isel(chain=1).values, abs=1e-6)
    assert pair.values == pytest.approx(swapped.isel(chain=[1, 0]).values, abs=1e-6)
    assert float(abs(pair - in_phase).isel(chain=0).max()) > 0.1, "they feel each other"


def test_chains_far_apart_are_alone_until_the_waves_meet() -> None:
    """0.2 m apart on a plate of 2 mm: bending waves of 20 kHz run at some 1300 m/s, and arrive after 0.15 ms."""
    whole = hl.kirchhoff_plate(0.4, 0.2, 2e-3, hl.ALUMINIUM_6061, CLAMPED, cells=(16, 8))
    chains = [hl.Chain([BEAD] * 2, BEAD, speed) for speed in (0.31, 0.2)]

    def run(struck: Any, x: Any, y: Any) -> xr.Dataset:
        return hl.CoSimulation(struck, hl.reduce(whole.at(x, y), until=UNTIL)).run(UNTIL, save_every=1e-6)

    both = run(chains, [0.1, 0.3], [0.1, 0.1]).surface_displacement
    for number, place in enumerate((0.1, 0.3)):
        alone = run(chains[number], place, 0.1).surface_displacement
        apart, greatest = abs(both.isel(interface=number) - alone), float(abs(alone).max())
        assert float(apart.sel(time=slice(0.0, 1e-4)).max()) < 1e-3 * greatest
        assert float(apart.max()) > 1e-2 * greatest


@pytest.mark.thorough
@pytest.mark.parametrize("number", [0, 1])
def test_measures_of_one_chain_are_those_of_a_run_of_its_own(number: int) -> None:
    """Chains of unlike length, each on a rod of its own: the padding of the shorter one changes nothing."""
    chains = [hl.Chain([BEAD] * 8, BEAD, 0.31, gravity=9.81), CHAIN]
    rods = [PTFE_ROD, ACRYLIC_ROD]
    run = hl.CoSimulation(chains, rods).run(UNTIL, save_every=1e-6)
    alone = hl.CoSimulation(chains[number], rods[number]).run(UNTIL, save_every=1e-6)
    one = run.isel(chain=number)
    assert hl.contact_time(one) == pytest.approx(hl.contact_time(alone), rel=1e-6, nan_ok=True)
    assert float(hl.contact_time(run)[number]) == pytest.approx(hl.contact_time(one), rel=1e-12, nan_ok=True)
    assert hl.wave_speed(one, 4, 6) == pytest.approx(hl.wave_speed(alone, 4, 6), rel=1e-6)
    assert hl.sensor_force(one, 5).values == pytest.approx(hl.sensor_force(alone, 5).values, abs=1e-5)
    for wave in ("primary", "secondary"):
        for measure in (hl.amplitude_ratio, hl.time_of_flight):
            expected = measure(alone, 4, wave).item()
            assert measure(one, 4, wave).item() == pytest.approx(expected, rel=1e-5, nan_ok=True)
            assert measure(run, 4, wave)[number].item() == pytest.approx(expected, rel=1e-5, nan_ok=True)
    waves, expected_waves = hl.reflections(one, 4), hl.reflections(alone, 4)
    assert [bool(wave) for wave in waves] == [bool(wave) for wave in expected_waves]


def build(speed: float) -> hl.CoSimulation:
    return hl.CoSimulation([hl.Chain([BEAD] * 7, BEAD, speed), QUIET], [ACRYLIC_ROD, PTFE_ROD])


@pytest.mark.thorough
def test_a_sweep_over_runs_of_several_chains() -> None:
    runs = hl.sweep(build, UNTIL, jobs=1, speed=[0.2, 0.3])
    one = build(0.3).run(UNTIL)
    assert runs.contact_force.dims == ("speed", "time", "chain", "contact")
    assert hl.contact_time(runs).dims == ("speed", "chain")
    assert float(hl.contact_time(runs)[1, 0]) == hl.contact_time(one.isel(chain=0))
    assert hl.energy_error(runs).values[1] == pytest.approx(hl.energy_error(one), rel=1e-9)  # type: ignore[union-attr]
    with pytest.raises(ValueError, match=r"run: has the axes speed; choose one run with run\.isel\(speed=0\)"):
        hl.plots.energy(runs)
    with pytest.raises(ValueError, match=r"axes = .*chain.*every run"):
        hl.sweep(build, 3e-4, jobs=1, chain=[0.2, 0.3])


PLATE = plate([0.02, 0.04], [0.03, 0.03])
POINT = hl.ContactPoint(PLATE, 0)


@pytest.mark.parametrize(
    ("chain", "facing", "behind", "message"),
    [
        ([], None, None, r"chain = \[\]: must be a list of one Chain or more"),
        ([CHAIN, BEAD], PLATE, None, r"chain = .*: must be a list of one Chain or more"),
        (BEAD, PLATE, None, "chain = .*: must be a Chain, or a list of them"),
        ([CHAIN] * 3, PLATE, None, "structure: must be a list of 3, or one structure with 3 contact points"),
        ([CHAIN] * 2, ACRYLIC_ROD, None, "structure: must be a list of 2, or one structure with 2 contact points"),
        ([CHAIN] * 2, [ACRYLIC_ROD], None, "structure: must be a list of 2, or one structure with 2 contact points"),
        ([CHAIN] * 2, [], None, "structure: must be a list of 2, or one structure with 2 contact points"),
        ([CHAIN] * 2, "ab", None, "structure: must be a list of 2, or one structure with 2 contact points"),
        ([CHAIN] * 2, [ACRYLIC_ROD, 3.0], None, r"structure\[1\] = float: must be a Structure"),
        ([CHAIN] * 2, [ACRYLIC_ROD] * 2, None, r"structure\[1\]: another end of a chain faces that contact point"),
        ([CHAIN] * 2, [POINT, POINT], None, r"structure\[1\]: another end of a chain faces that contact point"),
        ([CHAIN] * 2, [PLATE, ACRYLIC_ROD], None, r"structure\[0\]: has 2 contact points; .* by ContactPoint"),
        (CHAIN, PLATE, None, "structure: has 2 contact points; .* by ContactPoint"),
        (CHAIN, [PLATE], None, "structure = list: must be a Structure"),
        (SENT, ACRYLIC_ROD, ACRYLIC_ROD, "behind: another end of a chain faces that contact point"),
        (SENT, ACRYLIC_ROD, 3.0, "behind = float: must be a Structure"),
        (CHAIN, ACRYLIC_ROD, PTFE_ROD, "striker = Sphere.*: must be None or a PushedBead"),
        ([CHAIN, CHAIN], PLATE, [None], "behind: must be a list of 2, or one structure with 2 contact points"),
        ([CHAIN, CHAIN], PLATE, [None, PTFE_ROD], "striker = Sphere.*: must be None or a PushedBead"),
        ([CHAIN, CHAIN], POINT, None, "structure: must be a list of 2, or one structure with 2 contact points"),
    ],
)
def test_what_cannot_be_joined(chain: Any, facing: Any, behind: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.CoSimulation(chain, facing, behind=behind)


@pytest.mark.parametrize(
    ("structure", "number", "message"),
    [
        (PLATE, 2, "number = 2: must be below 2, the structure's number of contacts"),
        (PLATE, -1, "number = -1: must be a whole number, 0 or more"),
        (PLATE, 0.5, "number = 0.5: must be a whole number, 0 or more"),
        (PLATE, "0", "number = '0': must be a whole number, 0 or more"),
        (PLATE, True, "number = True: must be a whole number, 0 or more"),
        (None, 0, "structure = NoneType: must be a Structure"),
        (POINT, 0, "structure = ContactPoint: must be a Structure"),
    ],
)
def test_contact_points_that_are_not_there(structure: Any, number: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.ContactPoint(structure, number)


def test_the_motion_of_a_plate_that_two_chains_strike() -> None:
    """At both contacts it is the motion of the run, which one force alone would not cause."""
    body = hl.reduce(WHOLE.at([0.02, 0.04], [0.03, 0.03]), until=UNTIL, keep_field=True)
    run = hl.CoSimulation([CHAIN, hl.Chain([BEAD] * 7, BEAD, 0.2)], body).run(UNTIL, save_every=5e-7)
    motion = hl.plots.motion(run, body, [3e-4, 4e-4])
    assert motion.attrs["contact_error"] < 1e-3
    lone = hl.reduce(WHOLE.at(0.02, 0.03), until=UNTIL, keep_field=True)
    with pytest.raises(ValueError, match="body: has 1 contact points, fewer than in the run"):
        hl.plots.motion(run, lone, [3e-4])
    with pytest.raises(ValueError, match="run: holds 1 of its 2 chains"):
        hl.plots.motion(run.isel(chain=0), body, [3e-4])


def test_one_structure_in_two_moving_ones_is_refused() -> None:
    """The two would know nothing of each other."""
    body = hl.rod([hl.Layer(hl.ACRYLIC, 0.03, 0.01)], base="contact", elements=4)
    ends = [hl.ContactPoint(hl.stepping.MovingStructure(body), number) for number in range(2)]
    with pytest.raises(ValueError, match=r"structure\[1\]: is in two MovingStructures"):
        hl.CoSimulation([hl.Chain([BEAD] * 3, BEAD, 0.3)] * 2, ends)


def test_a_sensor_beyond_the_shorter_of_two_chains() -> None:
    """One warning for each measure; beyond both it is refused as beyond one."""
    chains = [hl.Chain([BEAD] * count, BEAD, 0.3) for count in (4, 6)]
    run = hl.CoSimulation(chains, [None, None]).run(2e-4, save_every=1e-6)
    for measure in (hl.amplitude_ratio, hl.time_of_flight, hl.sensor_force):
        with pytest.warns(hl.HertzlinkWarning) as caught:
            found = measure(run, 5)
        warning = "sensor = 5: lies beyond the end of chain 0 of the run, whose measures are NaN"
        assert [str(one.message) for one in caught].count(warning) == 1
        assert found.isel(chain=0).isnull().all()
        with pytest.raises(ValueError, match="sensor = 7: must be a bead from 1 to 6"):
            measure(run, 7)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hl.sensor_force(run, 4)
        hl.sensor_force(run.isel(chain=1), 5)


def test_a_chain_of_one_bead_faces_nothing() -> None:
    run = hl.CoSimulation(hl.Chain([BEAD], BEAD, 0.3), None).run(5e-5)
    assert run.velocity.values[-1] == pytest.approx([0.0, 0.3], abs=1e-5)


def test_energy_is_kept_between_two_structures_where_a_window_has_fewer_steps_than_beads() -> None:
    """A repeated trial moves all beads: the surface behind the chain is another one, too."""
    bead, rod = hl.Sphere(4.76e-3, hl.STEEL_440C), hl.rod([hl.Layer(hl.PTFE, 0.02, 9.5e-3)], elements=8)
    behind = hl.rod([hl.Layer(hl.PTFE, 0.03, 9.5e-3)], elements=8)
    chain = hl.Chain([bead] * 12, None, 0.3, preload=5.0)
    coupled = hl.CoSimulation(chain, rod, window=4e-7, dt=1.001e-7, behind=behind)
    assert coupled.chain.steps(4e-7) == 4
    assert float(hl.energy_error(coupled.run(3e-4))) < 1e-4
