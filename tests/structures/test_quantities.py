"""Numbers in another unit than SI get a warning that names the argument, its value and the unit that may be meant."""

import pydoc
import warnings
from collections.abc import Callable

import pytest

import hertzlink as hl
from structures.quantities import Count, Likely, OneOf, Quantity

STEEL = hl.STEEL_440C
BEAD = hl.Sphere(4.76e-3, STEEL)
FREE = hl.Supports()


def tapped(modulus: float) -> hl.CoSimulation:
    return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, 0.3), hl.half_space(hl.Material(modulus, 0.3, 2000.0)))


UNLIKELY: list[tuple[Callable[[], object], str]] = [
    (lambda: hl.Sphere(4.76, STEEL), r"Sphere radius = 4\.76: is read as 4\.76 m, .* mean \S+ mm\?"),
    (lambda: hl.Material(200, 0.28, 7800.0), r"Material youngs_modulus = 200: .* 200 Pa, .* mean \S+ GPa or MPa\?"),
    (lambda: hl.Material(200e9, 0.28, 7.8, "mine"), r"Material 'mine' density = 7\.8: .* kg/m³, .* mean \S+ g/cm³\?"),
    (lambda: hl.Ply(STEEL, 0.125), r"Ply thickness = 0\.125: .* mm\?"),
    (lambda: hl.Layer(STEEL, 76.2, 9.5e-3), r"Layer length = 76\.2: .* mm\?"),
    (lambda: hl.drop_speed(10.0), r"drop_speed height = 10: .* m, .* mean \S+ mm\?"),
    (lambda: hl.Chain([BEAD], BEAD, 310.0), r"Chain impact_speed = 310: .* m/s, .* mean \S+ mm/s\?"),
    (lambda: hl.Chain([BEAD], BEAD, 0.3, gravity=9810.0), r"Chain gravity = 9810: .* mm/s²\?"),
    (lambda: hl.Chain([BEAD], BEAD, 0.3, preload=5e6), r"Chain preload = 5e\+06: .* mN\?"),
    (lambda: hl.SpringLoaded(BEAD, 0.5, 5e-3), r"SpringLoaded stiffness = 0\.5: .* N/mm\?"),
    (lambda: hl.PushedBead([0, 10, 20], [0, 50, 0]), r"PushedBead time\[-1\] = 20: .* µs or ms\?"),
    (lambda: hl.Piston([0.0, 1e-4], [0.0, 2.0]), r"Piston max \|displacement\| = 2: .* mm\?"),
    (lambda: hl.KuwabaraKono(5.0), r"KuwabaraKono time = 5: .* µs or ms\?"),
    (lambda: hl.kirchhoff_plate(300, 0.3, 2e-3, STEEL, FREE), r"kirchhoff_plate length = 300: .* mm\?"),
    (lambda: hl.kirchhoff_plate(3.0, 3.0, 2.29, STEEL, FREE), r"kirchhoff_plate thickness = 2\.29: .* mm\?"),
    (lambda: hl.kirchhoff_plate(0.3, 0.3, 2e-3, STEEL, FREE, highest_frequency=40), r"frequency = 40: .* kHz\?"),
    (lambda: hl.Outline(((0, 0), (300, 0), (0, 300))), r"Outline size = .*: .* mm\?"),
    (
        lambda: hl.half_plane(2e-3, STEEL, "clamped", 20, until=1e-4),
        r"half_plane distance = 20: .* m, .* mean \S+ mm\?",
    ),
    (lambda: hl.reduce(hl.half_space(STEEL), 1e-4, pulse=25), r"reduce pulse = 25: .* s, .* mean \S+ µs or ms\?"),
    (lambda: hl.Prestress(20), r"Prestress xx = 20: is read as 20 N/m, .* mean \S+ N/mm, or a stress in MPa\?"),
    (lambda: hl.laws.Thornton(300), r"Thornton yield_strength = 300: is read as 300 Pa, .* mean \S+ MPa or GPa\?"),
    (
        lambda: hl.identifiability(tapped, noise=5.0, sensors=[5], until=2e-4, modulus=3e9),
        r"identifiability noise = 5: is read as 5 times the greatest force, .* mean \S+ %\?",
    ),
    (lambda: hl.beam(0.5, 3e8, 1.5, STEEL, 0.2), r"beam bending_stiffness = 3e\+08: .* N mm²\?"),
    (lambda: hl.beam(0.5, 300.0, 1500.0, STEEL, 0.2), r"beam mass_per_length = 1500: .* g/m\?"),
    (lambda: hl.PointMass(0.1, 0.1, 250.0), r"PointMass mass = 250: is read as 250 kg, .* mean \S+ g\?"),
    (
        lambda: hl.damping.damped(hl.infinite_plate(2e-3, STEEL), hl.damping.Rayleigh(0.0, 5.0)),
        r"Rayleigh stiffness_time = 5: .* µs or ms\?",
    ),
    (
        lambda: hl.damping.damped(hl.rod([hl.Layer(STEEL, 0.02, 0.01)]), hl.damping.StandardLinearSolid(40.0, 1e-5)),
        r"StandardLinearSolid share = 40: is read as 40 times the modulus, .* mean \S+ %\?",
    ),
    (
        lambda: hl.damping.damped(hl.reduce(hl.rod([hl.Layer(STEEL, 0.02, 0.01)]), 1e-4), hl.damping.Modal(2.0)),
        r"Modal ratio = 2: is read as 2 times the critical damping, .* mean \S+ %\?",
    ),
]


@pytest.mark.filterwarnings("ignore::structures.caution.HertzlinkWarning")  # those besides the one that is expected
@pytest.mark.parametrize(("make", "message"), UNLIKELY)
def test_another_unit_gets_a_word(make: Callable[[], object], message: str) -> None:
    """A warning at the caller's line; the object is made all the same."""
    with pytest.warns(hl.HertzlinkWarning, match=message) as caught:
        assert make() is not None
    assert all(warning.filename == __file__ for warning in caught)


def test_the_thesis_and_its_neighbourhood_get_none() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", hl.HertzlinkWarning)
        for material in hl.MATERIALS.values():
            hl.Material(material.youngs_modulus, material.poisson_ratio, material.density)
        hl.Material(1e6, 0.49, 950.0, "rubber")
        hl.Material(70e6, 0.3, 60.0, "foam")
        hl.Material(1e25, 0.3, 8000.0, "rigid")
        for radius in (5e-5, 4.76e-3, 0.1):
            hl.Chain([hl.Sphere(radius, STEEL)] * 2, BEAD, hl.drop_speed(0.01), gravity=9.81)
        hl.rod([hl.Layer(STEEL, 2.0, 9.525e-3)])
        hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, FREE)
        hl.Chain([BEAD] * 2, hl.Piston(), preload=50.0)


@pytest.mark.parametrize("name", [name for name, one in vars(Likely).items() if isinstance(one, Quantity)])
def test_zero_and_the_limits_are_likely(name: str) -> None:
    quantity: Quantity = getattr(Likely, name)
    low, high = quantity.likely
    with warnings.catch_warnings():
        warnings.simplefilter("error", hl.HertzlinkWarning)
        for value in (0.0, max(low, 1e-300), min(high, 1e300), -max(low, 1e-300)):
            quantity.warn("Thing", "number", value)
    beyond = 2.0 * high if high < 1e300 else 0.5 * low
    with pytest.warns(hl.HertzlinkWarning, match="Thing number = "):
        quantity.warn("Thing", "number", beyond)


def test_help_shows_units_and_members() -> None:
    assert "radius: Annotated[float, m]," in pydoc.render_doc(hl.Sphere, renderer=pydoc.plaintext)
    assert [*map(repr, (Quantity(), Count(), Count(1, 30), OneOf("fixed", "free")))] == [
        "a number", "≥ 1", "1 to 30", "'fixed' | 'free'",
    ]  # fmt: skip
    assert "class PowerLaw(ContactLaw)" in pydoc.render_doc(hl.laws, renderer=pydoc.plaintext)


@pytest.mark.parametrize("unit", ["mm", "N/mm", "MPa", "g", "kHz", "µs"])
def test_a_unit_with_a_prefix_is_refused(unit: str) -> None:
    """A function would get "2 mm" as 2.0."""
    with pytest.raises(ValueError, match="must be an SI unit without a prefix"):
        Quantity(unit)
