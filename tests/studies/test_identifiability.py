"""The study of identifiability: limits that need no simulation of their own, and the findings."""

from collections.abc import Sequence
from math import inf

import numpy as np
import pytest
import xarray as xr
from quick import quick

import hertzlink as hl
from coupling.inference.information import bounds_of
from hertzlink.studies import identifiability as study

BEADS = 9.53e-3


def waveform(distance: float, **how: float) -> xr.DataArray:
    values = {"distance": distance, "thickness": 4.83e-3, "impact_speed": 0.31}
    return study.edge_design(BEADS, values, **how).waveform()


def bounds(
    data: xr.DataArray, sensors: Sequence[int], until: float = inf, known: Sequence[str] = ()
) -> dict[str, float]:
    found = bounds_of(data.sel(sensor=list(sensors), time=slice(None, until)), known)[0]
    return {name: bound for name, bound in found.items() if name in study.EDGE_UNKNOWNS}


@pytest.fixture(scope="module")
def near() -> xr.DataArray:
    return waveform(0.06)


def test_an_edge_whose_echo_is_late_is_blind() -> None:
    """The fastest resolved bending wave has the group speed 2 √(a ω): its echo is back after the end of the record."""
    alloy = hl.ALUMINIUM_6061
    diffusion = 4.83e-3 * (alloy.youngs_modulus / 12.0 / (1.0 - alloy.poisson_ratio**2) / alloy.density) ** 0.5
    speed = 2.0 * (diffusion * 2.0 * np.pi * study.HIGHEST_FREQUENCY) ** 0.5
    far = waveform(0.6 * speed * max(study.RECORDS))
    assert all(bounds(far, sensors)["distance"] == inf for sensors in study.MEASURED.values())
    assert bounds(far, (7,))["impact_speed"] < 0.05


def test_information_is_proportional_to_samples_over_noise(near: xr.DataArray) -> None:
    double, of = bounds(waveform(0.06, noise=2.0 * study.NOISE), (7, 13)), bounds(near, (7, 13))
    assert double == pytest.approx({name: 2.0 * bound for name, bound in of.items()}, rel=1e-9)
    dense = bounds(waveform(0.06, sample_every=0.5 * study.SAMPLE_EVERY), (7,), study.RECORDS[0])
    sparse = bounds(near, (7,), study.RECORDS[0])
    assert dense == pytest.approx({name: bound / np.sqrt(2.0) for name, bound in sparse.items()}, rel=0.03)


def test_more_data_or_less_to_find_is_never_worse(near: xr.DataArray) -> None:
    """Two sensors against each of them, a long record against a short one, one unknown against three."""
    for record in study.RECORDS:
        both = bounds(near, (7, 13), record)
        for alone in (bounds(near, (7,), record), bounds(near, (13,), record)):
            assert all(both[name] <= bound * (1.0 + 1e-9) for name, bound in alone.items())
    short, long = (bounds(near, (7,), record) for record in study.RECORDS)
    assert all(long[name] <= bound * (1.0 + 1e-9) for name, bound in short.items())
    assert bounds(near, (7,), inf, study.EDGE_UNKNOWNS[1:])["distance"] <= long["distance"]


def test_parts_are_what_information_reports(near: xr.DataArray) -> None:
    """By its own runs, with its own steps."""

    def build(distance: float, thickness: float, impact_speed: float) -> hl.CoSimulation:
        return study.edge_case(BEADS, distance, thickness, impact_speed)

    own = hl.identifiability(
        build, sensors=[7, 13], until=max(study.RECORDS), distance=0.06, thickness=4.83e-3, impact_speed=0.31
    )
    assert bounds(near, (7, 13)) == pytest.approx(own.relative, rel=0.05)


def test_two_numbers_do_not_give_three_unknowns() -> None:
    values = dict(zip(study.EDGE_UNKNOWNS, (0.06, 4.83e-3, 0.31), strict=True))
    features = study.edge_design(BEADS, values).features(sensors=(7,), until=study.RECORDS[0], draws=8)
    assert bounds_of(features)[0] == dict.fromkeys(study.EDGE_UNKNOWNS, inf)
    two, one = (bounds_of(features, study.EDGE_UNKNOWNS[k:])[0]["distance"] for k in (2, 1))
    assert one <= two < inf


def test_an_alloy_of_any_modulus_bends_like_another_plate() -> None:
    """Its motion depends on E t⁴ and d⁴/(E t²) alone: no trace distinguishes such plates where the contact is known."""
    factor = 1.3
    plates = [
        study.edge_case(BEADS, 0.03, 4.83e-3, 0.31),
        study.edge_case(BEADS, 0.03 * factor**0.125, 4.83e-3 * factor**-0.25, 0.31, factor * 68.9e9),
    ]
    forces = [hl.sensor_force(one.run(1e-3), 7).values for one in plates]
    assert forces[1] == pytest.approx(forces[0], abs=1e-3 * forces[0].max())
    other = study.edge_case(BEADS, 0.03, 4.83e-3, 0.31, factor * 68.9e9)
    assert abs(hl.sensor_force(other.run(1e-3), 7).values - forces[0]).max() > 0.02 * forces[0].max()


@pytest.mark.thorough
def test_near_the_edge_one_combination_is_left() -> None:
    """That of statics, d²/E t³, known to a part of a per cent, and none of the three by itself."""
    at = quick("identifiability").sel(contact=study.KNOWN, near=0.0125)
    assert study.cosine(at.combination_of.values[0], study.STATICS) > 0.995
    assert study.cosine(at.combination_of.values[-1], study.UNSEEN) > 0.999
    best, middle, worst = at.combination_error.values
    assert best < 0.01 < 0.05 < middle
    assert worst > study.BLIND


@pytest.mark.thorough
def test_sensors_nearer_to_the_plate_see_farther() -> None:
    errors = quick("identifiability").edge_error.sel(diameter=BEADS, free="all", record=study.RECORDS[0]).squeeze()
    far = errors.sel(distance=0.16)
    assert far.sel(measured="bead 7") > study.BLIND
    assert (far.sel(measured=["bead 13", "bead 16"]) < 0.05).all()
    assert (errors.sel(distance=0.06).drop_sel(measured=study.FEATURES) < 0.01).all()
    assert (errors.sel(measured=study.FEATURES) == inf).all()


@pytest.mark.thorough
def test_bonds_are_seen_where_they_are_soft_compared_with_the_layer() -> None:
    """Compliances add, so a bond much stiffer than its layer is blind; of PTFE every epoxy is."""
    errors = quick("identifiability").bond_error
    assert (errors.sel(upper="PTFE", bond_stiffness=study.EPOXY) > study.BLIND).all()
    assert (errors.sel(upper="steel", bond_free="all", bond_stiffness=3e11) < 0.05).all()
    ratio = errors.sel(upper="PTFE") / errors.sel(upper="steel")
    assert (ratio > 1.0).all()
