"""Rods and layered cylinders (section 6.1) compared with numbers that were recomputed independently, at γ = 5 N s/m."""

from dataclasses import replace

import numpy as np
import pytest
from quick import quick

import hertzlink as hl
from hertzlink.studies import lower_layer, rod_length, rod_stiffness, shared, upper_layer


def on_half_space(material: hl.Material, dashpot: float) -> tuple[float, float, float]:
    """AR and TOF (µs) at bead 7, and the largest displacement of bead 20 (µm)."""
    run = hl.CoSimulation(shared.chain(dashpot), hl.half_space(material)).run(until=1.5e-3)
    back, moved = shared.returned(run), float(run.displacement.sel(bead=20).max())
    return back.amplitude_ratio.item(), 1e6 * back.time_of_flight.item(), 1e6 * moved


@pytest.mark.parametrize(
    ("material", "dashpot", "expected"),
    [
        (hl.STEEL_440C, 0.0, (None, 450.0, 5.53)), (hl.PTFE, 0.0, (0.872, 607.0, 27.2)),
        (hl.STEEL_440C, 4.0, (0.784, None, None)), (hl.STEEL_440C, 5.0, (0.747, 460.8, None)),
    ],
)  # fmt: skip
def test_half_spaces(material: hl.Material, dashpot: float, expected: tuple[float | None, ...]) -> None:
    """Recomputed elsewhere; errata of equation 6.1: γ of 4 to 5 N s/m reproduces AR 0.76 to 0.78."""
    found = on_half_space(material, dashpot)
    for ours, other, apart in zip(found, expected, (0.005, 1.0, 0.05), strict=True):
        assert other is None or ours == pytest.approx(other, abs=apart)


@pytest.mark.thorough
def test_bead_20_between_steel_or_ptfe_and_the_chain() -> None:
    """facts.yaml, recomputed at γ = 5: deepest in PTFE at 431 µs; wall energy 0.847 and 0.937 of what is left."""
    data = quick("rod-stiffness")
    deepest, first, second = rod_stiffness.collisions(data)
    assert deepest == pytest.approx(431e-6, abs=2e-6)
    assert second - first == pytest.approx(111e-6, abs=3e-6)
    assert data.wall_energy_share.values == pytest.approx([0.847, 0.937], abs=0.015)
    assert 0.95 < float(data.wall_speed_ratio.sel(wall="steel")) < 1.0


@pytest.mark.thorough
def test_the_sensor_lowers_the_amplitude_ratio() -> None:
    """0.742 to 0.717 on steel with RC = 1 ms; recomputed elsewhere: 0.718."""
    data = quick("rod-stiffness")
    plain = data.material_amplitude_ratio.sel(dashpot=5.0, wave="primary", material="steel 440C").item()
    assert plain == pytest.approx(0.742, abs=1e-3)
    assert data.wall_filtered_ratio.sel(wall="steel").item() == pytest.approx(0.7175, abs=1e-3)


def test_axisymmetric_cylinders_lie_near_rods() -> None:
    """Steel to 0.0005 in AR and 0.3 µs; PTFE, part of which a rod and Hertz's law hold twice, to 0.002 and 2 µs."""
    data = quick("rod-stiffness")
    cylinders, rods = data.sel(wave="primary"), data.sel(dashpot=5.0, wave="primary")
    ratio = abs(cylinders.solid_amplitude_ratio - rods.material_amplitude_ratio)
    flight = abs(cylinders.solid_time_of_flight - rods.material_time_of_flight) * 1e6
    for values, hard, soft in ((ratio, 5e-4, 2e-3), (flight, 0.3, 2.0)):
        assert float(values.sel(material="steel 440C")) < hard
        assert float(values.sel(material="PTFE")) < soft


@pytest.mark.parametrize(("gravity", "dashpot"), [(0.0, 0.0), (0.0, 5.0), (9.81, 0.0), (9.81, 5.0)])
def test_the_last_bead_stays_on_ptfe_for_longer_than_the_thesis_says(gravity: float, dashpot: float) -> None:
    """So 241 µs is not a whole contact, whatever the losses; the wave arrives 320 µs before the second collision."""
    chain = replace(shared.chain(dashpot), gravity=gravity)
    run = hl.CoSimulation(chain, shared.rod(rod_stiffness.layers(hl.PTFE))).run(shared.RECORD)
    assert float(hl.contact_time(run)) > 400e-6
    moved = run.displacement.sel(bead=20)
    begin = float(run.time[int((moved > 0.01 * moved.max()).values.argmax())])
    assert begin == pytest.approx(561e-6 - 241e-6, rel=0.03)


@pytest.mark.thorough
def test_reduced_rod_is_the_rod() -> None:
    layers = rod_stiffness.layers(hl.PTFE)
    runs = [hl.CoSimulation(shared.chain(), body).run(1.5e-3) for body in (hl.rod(layers), shared.rod(layers))]
    for measure in (hl.amplitude_ratio, hl.time_of_flight):
        for wave in ("primary", "secondary"):
            full, reduced = (measure(run, 7, wave).item() for run in runs)
            assert reduced == pytest.approx(full, rel=1e-4)


@pytest.mark.thorough
def test_amplitude_ratio_falls_about_the_characteristic_length() -> None:
    """0.747 for short rods, 0.715 at 101.6 mm, 0.707 beyond 200 mm; TOF from 460.8 to 462.6 µs; 100.2 mm by theory."""
    data = quick("rod-length").sel(wave="primary", dashpot=5.0)
    ratios, flights = data.amplitude_ratio, 1e6 * data.time_of_flight
    assert ratios.sel(length=slice(None, 0.03)).values == pytest.approx(0.747, abs=0.005)
    assert ratios.sel(length=0.1016, method="nearest").item() == pytest.approx(0.715, abs=0.005)
    assert ratios.sel(length=slice(0.2, None)).values == pytest.approx(0.707, abs=0.005)
    assert [flights.min().item(), flights.max().item()] == pytest.approx([460.8, 462.6], abs=1.0)
    assert rod_length.characteristic_length() == pytest.approx(100.2, abs=0.1)


@pytest.mark.thorough
def test_thicker_steel_reflects_more() -> None:
    """Primary AR 0.398 to 0.701 for 6.35 to 101.6 mm; no secondary wave above 0.1 beyond about 25 mm."""
    middle = quick("upper-layer").amplitude_ratio.sel(dashpot=5.0)
    primary, secondary = (middle.sel(wave=wave) for wave in ("primary", "secondary"))
    assert primary.values[[0, -1]] == pytest.approx([0.398, 0.701], abs=2e-3)
    assert (primary.diff("length") > 0.0).all()
    assert (secondary.sel(length=slice(0.0253, None)).fillna(0.0) < 0.1).all()


@pytest.mark.thorough
def test_thicker_ptfe_delays_the_secondary_wave_only() -> None:
    """25.4 to 50.8 mm: primary AR and TOF unchanged to 0.1 %, secondary TOF 584 and 645 µs."""
    runs = quick("lower-layer").sel(dashpot=5.0).sel(length=[25.4e-3, 50.8e-3], method="nearest")
    for name in ("amplitude_ratio", "time_of_flight"):
        first, second = runs[name].sel(wave="primary").values
        assert first == pytest.approx(second, rel=1e-3)
    assert (runs.time_of_flight.sel(wave="secondary") * 1e6).values == pytest.approx([584.0, 645.0], abs=2.0)


def test_equations_of_layers() -> None:
    """Recomputed in facts.yaml and the errata: AR by 6.24 and 6.26, TOF by 6.34, T_l by 6.32 with and without M_l/3."""
    ends = upper_layer.theory(np.array([6.35e-3, 101.6e-3]), 25.4e-3)
    assert ends.amplitude_ratio.values == pytest.approx([0.542, 0.963], abs=1e-3)
    assert ends.secondary.values * 1e6 == pytest.approx([587.0, 835.0], abs=1.0)
    assert ends.time_of_flight.values[0] * 1e6 == pytest.approx(496.0, abs=1.0)
    delays = lower_layer.expected(np.array([9.52e-3, 25.4e-3, 152.4e-3]))
    later = 1e6 * (delays[["secondary", "secondary_with_mass"]] - delays.time_of_flight)
    assert later.secondary.values == pytest.approx([55.2, 90.1, 220.7], abs=0.2)
    assert later.secondary_with_mass.values == pytest.approx([58.8, 105.4, 395.1], abs=0.3)


@pytest.mark.thorough
def test_a_layer_that_may_widen_makes_the_cylinder_a_rod() -> None:
    """A thin layer of PTFE bonded to steel and base is stiffer than a rod's: 0.507 for 0.453; with ν = 0 it is not."""
    layers = upper_layer.layers(6.35e-3, 9.52e-3)
    free = [layers[0], replace(layers[1], material=replace(hl.PTFE, poisson_ratio=0.0))]
    bodies = shared.rod(layers), shared.cylinder(layers), shared.cylinder(free)
    runs = [hl.CoSimulation(shared.chain(), body).run(1.5e-3) for body in bodies]
    found = [hl.amplitude_ratio(run, 7).item() for run in runs]
    assert found == pytest.approx([0.453, 0.507, found[0]], abs=1e-3)


@pytest.mark.thorough
def test_viscoelastic_ptfe_is_one_possible_cause() -> None:
    """The experiment has AR 0.428 and 0.3, and TOF 619 µs of the secondary wave, below 6.35 mm of steel.

    Recomputed elsewhere with 40 % of the modulus fading in 30 µs: AR 0.418 and 0.293, TOF 611 µs; elastic 0.416. The
    more fades, the weaker and later the secondary wave; the primary one hardly changes.
    """
    stack = hl.rod(upper_layer.layers(6.35e-3, upper_layer.LOWER))

    def returned(share: float) -> tuple[float, float, float]:
        body = stack
        if share:
            body = hl.damping.damped(stack, hl.damping.StandardLinearSolid(share, 30e-6, "instantaneous"), part=1)
        run = hl.CoSimulation(shared.chain(4.0), hl.reduce(body, shared.RECORD)).run(shared.RECORD)
        found = shared.measure(run)
        return (*found.amplitude_ratio.values.tolist(), 1e6 * found.time_of_flight.values[1])

    elastic, less, middle, more = (returned(share) for share in (0.0, 0.3, 0.4, 0.5))
    assert middle[:2] == pytest.approx([0.418, 0.293], abs=2e-3)
    assert middle[2] == pytest.approx(611.0, abs=1.0)
    assert elastic[1] == pytest.approx(0.416, abs=2e-3)
    for first, second in ((less, middle), (middle, more)):
        assert second[1] < first[1] - 0.02
        assert second[2] > first[2] + 5.0


@pytest.mark.thorough
def test_a_wave_that_breaks_into_two_collisions_arrives_with_the_higher_hump() -> None:
    """Between 20 and 30 mm of steel the two humps of the force at bead 7 part. AR changes continuously; TOF, peak to
    peak, jumps once, from the second hump to the first."""

    def layered(upper: float) -> hl.CoSimulation:
        return hl.CoSimulation(shared.chain(), shared.rod(upper_layer.layers(upper, 25.4e-3)))

    branch = hl.sweep(layered, 1.2e-3, 1, shared.measure, upper=np.geomspace(20e-3, 30e-3, 17)).sel(wave="secondary")
    peak = np.diff(1e6 * branch.time_of_flight.values)
    (leap,) = np.flatnonzero(peak < 0.0)
    assert -25.0 < peak[leap] < -15.0
    assert np.delete(peak, leap).max() < 5.0
    assert np.abs(np.diff(branch.amplitude_ratio)).max() < 0.01
