"""The study of the thesis compared with independent numbers (tests/independent/thesis, its `values.json`)."""

from functools import lru_cache
from math import inf
from typing import NamedTuple

import pytest
from independent.thesis.values import differences, load
from quick import found

import hertzlink as hl
from hertzlink.studies.closed_forms import numbers
from hertzlink.studies.compare import Case, as_cases

RELATIVE = 2e-6
"""The steps of hertzlink's runs."""
BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
LOSSES = {
    "undamped, g = 0": (0.0, None),
    "undamped, g = 9.81": (9.81, None),
    "gamma = 5, no pull, g = 9.81": (9.81, hl.LinearDashpot(5.0)),
}


def chains_on_walls() -> dict[str, dict[str, float]]:
    """AR and TOF of section 6.1.1, by the front door."""
    values: dict[str, dict[str, float]] = {}
    for name, wall in (("steel", hl.STEEL_440C), ("ptfe", hl.PTFE)):
        for loss, (gravity, dashpot) in LOSSES.items():
            options = {} if dashpot is None else {"dissipation": dashpot}
            chain = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=hl.drop_speed(0.01), gravity=gravity, **options)
            run = hl.CoSimulation(chain, hl.half_space(wall)).run(until=0.9e-3)
            primary = hl.reflections(run, sensor=7).primary
            values.setdefault(f"rods_set1_modulus/AR_psw_{name}_exp", {})[loss] = primary.amplitude_ratio
            values.setdefault(f"rods_set1_modulus/TOF_psw_{name}", {})[loss] = primary.time_of_flight * 1e3
    return values


def test_chains_on_walls_agree() -> None:
    assert list(differences(chains_on_walls(), RELATIVE)) == []


class Same(NamedTuple):
    """A number of a study, and the independent value that it must have.

    at: the place in a list of values. otherwise: the condition whose value is compared, instead of the first. size:
    one unit of the row in that of the value. within: relative difference; most rows are runs, saved every 0.25 µs.
    """

    part: str
    quantity: str
    entry: str
    variant: str
    at: int | None = None
    otherwise: str = ""
    size: float = 1.0
    within: float = 2e-3


CLOSED, ELLIPSOIDS, CYLINDERS, HOLLOW = "closed-forms", "ellipsoids", "cylinders", "hollow-spheres"
LOSSY, LENGTH, UPPER, ASPECT = "dissipation", "rod-length", "upper-layer", "aspect-ratio"
THEORY, SHAPES, RODS = "theory_constants", "nonspherical", "rods_set1_modulus"
DAMPED = "gamma = 5, no pull, g = 9.81"

SAME = [
    Same(CLOSED, "exponent of Hertz's law", f"{THEORY}/hertz_exponent", "closed form", within=1e-9),
    Same(
        CLOSED,
        "factor of the speed with preload, equation 1.9",
        f"{THEORY}/lwa_speed_coeff_precompressed",
        "closed form",
        within=1e-9,
    ),
    Same(
        CLOSED,
        "factor of the speed without preload, equation 1.10",
        f"{THEORY}/lwa_speed_coeff",
        "closed form",
        within=1e-9,
    ),
    Same(CLOSED, "width of the wave, equation 1.8", f"{THEORY}/lwa_width_spheres_D", "closed form", within=1e-9),
    Same(
        CLOSED, "factor of the contact time, equation 6.8", f"{THEORY}/contact_time_const", "closed form", within=1e-9
    ),
    Same(
        CLOSED,
        "speed of particles over the striker's, equation 6.16",
        f"{THEORY}/vp_over_vstriker",
        "discrete chain",
        within=1e-4,
    ),
    Same(CLOSED, "factor of the wave's speed, equation 6.13", f"{THEORY}/coeff_6_13", "closed form", within=1e-9),
    Same(CLOSED, "factor of the transit time, equation 6.17", f"{THEORY}/coeff_6_17", "closed form", within=1e-9),
    Same(
        CLOSED,
        "factor of the transit there and back, equation 6.20",
        f"{THEORY}/coeff_6_20",
        "closed form",
        within=1e-9,
    ),
    Same(CLOSED, "factor of τ_t, equation 6.39", f"{THEORY}/coeff_6_39_Tt", "closed form", within=1e-9),
    Same(
        ELLIPSOIDS, "larger radius of curvature R'", "geometry/ellipsoid/contact_R1p_mm", "(L/2)^2/(D/2)", within=1e-9
    ),
    Same(ELLIPSOIDS, "mass of an ellipsoid", "geometry/ellipsoid/mass_g", "from dimensions", within=1e-9),
    Same(ELLIPSOIDS, "k, along the major axis", f"{SHAPES}/ke_major", "exact b/a", size=1e9, within=1e-8),
    Same(
        ELLIPSOIDS,
        "wave speed, discrete particles",
        f"{SHAPES}/V_ellipsoid_dpm",
        "sphere of 0.925 g, g = 0",
        within=1e-4,
    ),
    Same(
        ELLIPSOIDS,
        "wave speed, finite elements",
        f"{SHAPES}/V_ellipsoid_dpm",
        "sphere of 0.925 g, g = 9.81",
        otherwise="gravity",
        within=1e-4,
    ),
    Same(
        ELLIPSOIDS,
        "wave speed, striker D 2.38 mm",
        f"{SHAPES}/V_ellipsoid_dpm",
        "sphere of D = 2.38 mm, g = 0",
        within=1e-4,
    ),
    Same(
        ELLIPSOIDS,
        "wave speed, striker R 2.38 mm",
        f"{SHAPES}/V_ellipsoid_dpm",
        "sphere of R = 2.38 mm, g = 0",
        within=1e-4,
    ),
    Same(ELLIPSOIDS, "width, in minor diameters", f"{SHAPES}/width_ellipsoid", "above 1.0%"),
    Same(CYLINDERS, "mass of a cylinder", "geometry/cylinder/mass_g", "from dimensions", within=1e-9),
    Same(CYLINDERS, "width at 90°", f"{SHAPES}/width_cyl90", "above 1.0%"),
    Same(
        CYLINDERS,
        "exponent n of parallel cylinders",
        f"{SHAPES}/n_parallel_cyl_fit",
        "fit over 1 to 100 N",
        within=1e-4,
    ),
    Same(CYLINDERS, "wave speed at 0° over 90°", f"{SHAPES}/speed_cyl0_factor", "equation 5.8"),
    Same(HOLLOW, "mass of a hollow sphere", "geometry/hollow_sphere/mass_g", "R = 9.525 mm, ratio 0.908", within=1e-9),
    Same(HOLLOW, "k, Ri/Ro 0", "hollow_table_5_1/0/k_hertz", "equation 1.1", size=1e9, within=1e-9),
    Same(HOLLOW, "wave speed, discrete particles", "hollow_table_5_1/V_dpm", "m from dimensions, g = 0", within=1e-4),
    Same(HOLLOW, "width, by equation 5.13", "hollow_table_5_1/width_theory_D", "n = 1.222", within=1e-9),
    Same(HOLLOW, "width, experiment", "hollow_table_5_1/width_theory_D", "discrete chain above 1.0%", within=2e-2),
    Same(LOSSY, "mass, steel 316", "dissipation_table_4_1/steel_316/m_g", "from dimensions", within=1e-9),
    Same(LOSSY, "mass, PTFE", "dissipation_table_4_1/ptfe/m_g", "from dimensions", within=1e-9),
    Same(LOSSY, "mass, brass 360", "dissipation_table_4_1/brass/m_g", "from dimensions", within=1e-9),
    Same(
        LOSSY,
        "exponent of speed over force, undamped",
        "dissipation_table_4_1/speed_force_exponent",
        "undamped, two strikers",
    ),
    Same(
        LOSSY,
        "secondary wave after waves meet at a contact",
        f"{THEORY}/secondary_wave_ratio_after_collision",
        "at a contact, force",
        within=1e-2,
    ),
    Same(
        LOSSY,
        "secondary wave after waves meet at a bead",
        f"{THEORY}/secondary_wave_ratio_after_collision",
        "at a bead, force",
        within=1e-2,
    ),
    Same(LENGTH, "AR, short cylinder", "rods_set2_length/AR_numeric_drop", DAMPED, 0),
    Same(LENGTH, "AR, long cylinder", "rods_set2_length/AR_numeric_drop", DAMPED, 1),
    Same(LENGTH, "characteristic length c T_c/2", "rods_set2_length/characteristic_length", "rho = 7800", within=1e-6),
    Same(
        LENGTH,
        "characteristic length c T_c/2",
        "rods_set2_length/characteristic_length",
        "mass with 8000, c with 7800",
        otherwise="8000 kg/m³",
        within=1e-6,
    ),
    Same(UPPER, "AR, primary, 6.35 mm", "layers_set3_upper/AR_psw", f"rods, {DAMPED}", 0),
    Same(UPPER, "AR, primary, 101.6 mm", "layers_set3_upper/AR_psw", f"rods, {DAMPED}", 1),
    Same(UPPER, "AR, secondary, 6.35 mm", "layers_set3_upper/AR_ssw", f"rods, {DAMPED}", 0),
    Same(UPPER, "TOF, primary, shorter by", "layers_set3_upper/TOF_psw_reduction_pct", f"rods, {DAMPED}", within=1e-2),
    Same(UPPER, "TOF, secondary, 6.35 mm", "layers_set3_upper/TOF_ssw/L_u_6p35", f"rods, {DAMPED}", size=1e-3),
    Same(
        UPPER, "TOF, secondary, 6.35 mm", "layers_set3_upper/TOF_ssw", "equation 6.34", 0, "equation 6.34", 1e-3, 1e-5
    ),
    Same(ASPECT, "λ, D 4.76, t 2.29", "plates_aspect_ratio/lambda_D4p76", "v = 0.31, rho = 7800", 0, within=1e-9),
    Same(ASPECT, "λ, D 9.53, t 2.29", "plates_aspect_ratio/lambda_D9p53", "v = 0.31, rho = 7800", 0, within=1e-9),
    Same(
        ASPECT, "contact time, D 9.53, t 2.29", "plates_aspect_ratio/T_c_D9p53", "v = 0.31, rho = 7800", 0, within=1e-6
    ),
    Same(
        ASPECT, "contact time, D 9.53, t 4.83", "plates_aspect_ratio/T_c_D9p53", "v = 0.31, rho = 7800", 1, within=1e-6
    ),
]


def compared(same: Same) -> tuple[float, float]:
    """The study's number, in the unit of the independent one, and that."""
    cases = closed_forms() if same.part == CLOSED else found(same.part)
    of = cases[same.quantity]
    value = of[same.otherwise] if same.otherwise else next(iter(of.values()))
    expected = load()[same.entry]["values"][same.variant]["value"]
    return float(value) * same.size, expected if same.at is None else expected[same.at]  # type: ignore[arg-type]


@lru_cache
def closed_forms() -> dict[str, dict[str, Case]]:
    return {number.name: as_cases(number.ours) for number in numbers()}


def test_enough_is_compared() -> None:
    assert len(SAME) >= 40
    assert len({(one.entry, one.variant, one.at) for one in SAME}) == len(SAME)


def test_closed_forms_agree() -> None:
    for one in (one for one in SAME if one.part == CLOSED):
        value, expected = compared(one)
        assert value == pytest.approx(expected, rel=one.within), one.quantity


@pytest.mark.thorough
@pytest.mark.parametrize("part", [*dict.fromkeys(one.part for one in SAME if one.part != CLOSED)])
def test_the_study_agrees(part: str) -> None:
    wrong = {}
    for one in (one for one in SAME if one.part == part):
        value, expected = compared(one)
        if value != pytest.approx(expected, rel=one.within):
            wrong[one.quantity] = value, expected, value / expected - 1.0
    assert wrong == {}


def test_a_difference_is_found() -> None:
    """In a value, in a count, in a name; and a value that is no number never agrees."""
    name, variant = "theory_constants/coeff_6_13", "closed form"
    value = load()[name]["values"][variant]["value"]
    assert list(differences({name: {variant: value * (1.0 + 9e-7)}}, 1e-6)) == []
    for wrong in (value * (1.0 + 2e-6), [value, value], float("nan"), inf):
        assert len(list(differences({name: {variant: wrong}}, 1e-6))) == 1
    assert len(list(differences({name: {"other": value}, "no/entry": {variant: value}}, 1e-6))) == 2
