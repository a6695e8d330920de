"""`scaled`: a plate of another thickness or material from one that is already reduced."""

from dataclasses import replace

import numpy as np
import pytest

import hertzlink as hl
from structures.described import Parameter, description

SUPPORTS = hl.Supports("simple", "simple", "simple", "simple")
GLASSY = hl.Material(70e9, hl.ALUMINIUM_6061.poisson_ratio, 2500.0, "ν of aluminium")
LENGTH, WIDTH, THIN, THICK = 0.2, 0.15, 2e-3, 3e-3
BEAD = hl.Sphere(2.38e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 12, BEAD, impact_speed=0.31)


def faster(thickness, material):
    """The ratio of frequencies to those of the thin aluminium plate."""
    return thickness / THIN * material.bar_speed / hl.ALUMINIUM_6061.bar_speed


def plate(thickness=THIN, material=hl.ALUMINIUM_6061, **changes):
    return hl.kirchhoff_plate(LENGTH, WIDTH, thickness, material, SUPPORTS, **changes)


def amplitude(structure, until=0.7e-3):
    return float(hl.amplitude_ratio(hl.CoSimulation(CHAIN, structure, window=1e-6).run(until), 5))


@pytest.mark.parametrize(("thickness", "material"), [(THICK, None), (None, GLASSY), (1.3e-3, GLASSY)])
@pytest.mark.parametrize("places", [(0.06, 0.05), ([0.06, 0.1], [0.05, 0.05])])
def test_scaled_plate_is_the_plate_built_anew_on_the_same_mesh(thickness, material, places):
    # A frequency scaled with the plate's gives the same wavelength, and so the same mesh.
    t, of = thickness or THIN, material or hl.ALUMINIUM_6061
    scaled = hl.scaled(plate(highest_frequency=30e3).at(*places), thickness, material)
    anew = plate(t, of, highest_frequency=30e3 * faster(t, of)).at(*places)
    for name in ("mass", "stiffness"):
        one, other = getattr(scaled, name), getattr(anew, name)
        assert abs(one - other).max() < 1e-11 * abs(other).max()
    assert np.array_equal(scaled.contact, anew.contact)
    assert scaled.surface == anew.surface
    assert scaled.origin["highest_frequency"] == pytest.approx(anew.origin["highest_frequency"])
    same = [name for name in anew.origin if name not in ("highest_frequency", "section")]
    assert {name: scaled.origin[name] for name in same} == {name: anew.origin[name] for name in same}
    bending = [one.origin["section"]["bending"] for one in (scaled, anew)]
    assert np.array_equal(*bending)


def test_frequencies_of_the_scaled_reduction_are_those_of_the_theory():
    # Simply supported: ω_mn = π² (m²/a² + n²/b²) √(D/ρt) (Leissa, Vibration of plates, equation 4.20).
    reduced = hl.scaled(hl.reduce(plate().at(0.07, 0.05), 1e-3, tolerance=1e-4), THICK, GLASSY)
    rigidity = GLASSY.contact_modulus * THICK**3 / 12.0
    modes = np.add.outer((np.arange(1, 4) / LENGTH) ** 2, (np.arange(1, 4) / WIDTH) ** 2)
    theory = np.sort(modes.ravel())[:3] * np.pi**2 * (rigidity / (GLASSY.density * THICK)) ** 0.5
    assert np.sqrt(reduced.stiffness.diagonal()[:3]) == pytest.approx(theory, rel=1e-4)


def test_scaled_reduction_agrees_with_a_reduction_of_the_new_plate():
    ratio = faster(THICK, GLASSY)
    old = hl.reduce(plate(highest_frequency=40e3).at(0.06, 0.05), 0.7e-3 * ratio, tolerance=1e-3)
    scaled = hl.scaled(old, THICK, GLASSY)
    anew = hl.reduce(plate(THICK, GLASSY, highest_frequency=40e3 * ratio).at(0.06, 0.05), 0.7e-3, tolerance=1e-3)
    assert amplitude(scaled) == pytest.approx(amplitude(anew), abs=2e-5)
    assert amplitude(scaled) != pytest.approx(amplitude(old), abs=1e-2)


def test_valid_times_scale():
    old = hl.reduce(plate().at(0.06, 0.05), 1e-3)
    new = hl.scaled(old, 2.0 * THIN)
    assert new.valid_until == pytest.approx(0.5e-3)
    report, before = new.origin["reduction"], old.origin["reduction"]
    assert report["pulse"] == pytest.approx(0.5 * before["pulse"])
    assert report["error_estimate"] == before["error_estimate"]
    assert [one for one, _ in report["shorter_pulses"]] == pytest.approx([0.5 * p for p, _ in before["shorter_pulses"]])
    with pytest.raises(ValueError, match="reduced for runs"):
        hl.CoSimulation(CHAIN, new).run(0.6e-3)


def test_field_scales():
    thin = hl.reduce(plate(highest_frequency=30e3).at(0.06, 0.05), 1e-3, keep_field=True)
    full = plate(THICK, highest_frequency=30e3 * THICK / THIN).at(0.06, 0.05)
    scaled = hl.scaled(thin, THICK)
    q = np.linspace(1.0, 0.1, scaled.size)
    # The motion of the reduced plate in the degrees of freedom of the full one.
    u = thin.field.basis @ q * (THIN / THICK) ** 0.5
    for name in ("displacement", "stress"):
        found, expected = getattr(scaled.field, name)(q), getattr(full.field, name)(u)
        assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()


@pytest.mark.parametrize("name", ["thickness", "modulus"])
def test_amplitude_ratio_is_a_smooth_function(name):
    reduced = hl.reduce(plate().at(0.06, 0.05), 1e-3, tolerance=0.02)
    factors = 1.0 + 1e-5 * np.arange(-4, 5)
    if name == "thickness":
        found = [amplitude(hl.scaled(reduced, THIN * one)) for one in factors]
    else:
        aluminium = hl.ALUMINIUM_6061
        of = [replace(aluminium, youngs_modulus=aluminium.youngs_modulus * one) for one in factors]
        found = [amplitude(hl.scaled(reduced, material=one)) for one in of]
    step = np.linspace(-1.0, 1.0, 9)
    rest = found - np.polyval(np.polyfit(step, found, 2), step)
    assert np.ptp(found) > 1e-6
    assert np.abs(rest).max() < 1e-9


LAMINATE = hl.Laminate([hl.Ply(hl.ALUMINIUM_6061, 1e-3), hl.Ply(hl.BRASS_360, 1e-3)])


@pytest.mark.parametrize(
    ("structure", "changes", "words"),
    [
        (lambda: "plate", {}, "structure"),
        (lambda: hl.rod([hl.Layer(hl.PTFE, 0.03, 0.01)]), {}, "only plates in Kirchhoff"),
        (lambda: hl.mindlin_plate(0.2, 0.2, 4e-3, GLASSY, SUPPORTS).at(0.1, 0.1), {}, "only plates in Kirchhoff"),
        (lambda: hl.kirchhoff_plate(0.2, 0.2, None, LAMINATE, SUPPORTS).at(0.1, 0.1), {}, "one isotropic material"),
        (lambda: plate(additions=[hl.PointMass(0.05, 0.05, 0.01)]).at(0.1, 0.1), {}, "additions"),
        (
            lambda: hl.kirchhoff_plate(0.2, 0.2, THIN, GLASSY, hl.Supports(left=hl.ElasticEdge(1e6))).at(0.1, 0.1),
            {}, "elastic edges",
        ),
        (lambda: hl.damped(plate().at(0.1, 0.1), hl.damping.Rayleigh(1.0, 1e-8)), {}, "damping"),
        (lambda: plate().at(0.1, 0.1), {"material": hl.STEEL_316}, "ν = "),
        (lambda: plate().at(0.1, 0.1), {"material": "steel"}, "material"),
        (lambda: plate().at(0.1, 0.1), {"thickness": -1e-3}, "thickness"),
        (lambda: plate().at(0.1, 0.1), {"thickness": 0.16}, "thickness = 0.16"),
    ],
)  # fmt: skip
def test_what_does_not_scale_is_refused(structure, changes, words):
    with pytest.raises(ValueError, match=words):
        hl.scaled(structure(), **changes)


@pytest.mark.parametrize(
    "scale",
    [
        lambda plate: hl.scaled(plate.at(0.06, 0.05), THICK),
        lambda plate: hl.ReducedPlate(plate, 1e-4, 0.06, 0.05, tolerance=0.1, thickness=(THIN, THICK)),
    ],
)
def test_a_further_parameter_of_the_builder_is_refused_by_name(scale, monkeypatch):
    """No scaling of a foam is known here: a parameter that is declared later must not be dropped."""
    entry = description(hl.kirchhoff_plate)
    monkeypatch.setitem(entry.parameters, "porosity", Parameter("porosity", float, (), 0.0, False))
    solid = plate(cells=(8, 6))
    foam = replace(solid, origin={**solid.origin, "porosity": 0.3})
    with pytest.raises(ValueError, match=r"its porosity = 0\.3 may change in another way"):
        scale(foam)
    assert hl.scaled(replace(foam, origin=solid.origin).at(0.06, 0.05), THICK).origin["thickness"] == THICK


def test_a_wall_that_is_not_of_its_material_is_refused():
    usual = plate(cells=(8, 6))
    stiffer = replace(usual.section, bending=2.0 * usual.section.bending)
    with pytest.raises(ValueError, match="its section is not that of its thickness and material"):
        hl.scaled(replace(usual, section=stiffer).at(0.06, 0.05), THICK)


def test_a_thick_plate_warns():
    with pytest.warns(hl.HertzlinkWarning, match="tenth of the plate's shorter side"):
        hl.scaled(plate().at(0.1, 0.1), 0.02)
