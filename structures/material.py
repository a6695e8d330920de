"""Linear elastic, isotropic materials, and those of Table 2.1 of the thesis."""

from typing import Annotated

from structures.caution import caution
from structures.checks import near
from structures.described import described_as
from structures.quantities import Asks, Density, Modulus, PoissonRatio, Strength

# A stress that strains a material of unknown yield strength by more was probably given in another unit
LARGE_STRAIN = 0.1


@described_as("a Material; MATERIALS[name] gives one by name")
class Material:
    """A linear elastic, isotropic solid.

    Parameters
    ----------
    youngs_modulus, poisson_ratio, density : float
        E, Pa; ν, between -1 and 0.5, both excluded; ρ, kg/m³.
    name : str
        Name for tables and results.
    yield_strength : float, optional
        Pa. If it is given, a run warns when a contact pressure exceeds yield.

    Examples
    --------
    >>> glass = hl.Material(youngs_modulus=70e9, poisson_ratio=0.22, density=2500.0, name="glass")
    >>> round(glass.bar_speed), round(glass.contact_modulus * 1e-9, 1)
    (5292, 73.6)
    """

    youngs_modulus: Modulus
    poisson_ratio: PoissonRatio
    density: Density
    name: Annotated[str, Asks("a name for tables")] = ""
    yield_strength: Strength | None = None

    @property
    def contact_modulus(self) -> float:
        """Plane-strain modulus E/(1 − ν²), Pa."""
        return self.youngs_modulus / (1.0 - self.poisson_ratio**2)

    @property
    def bar_speed(self) -> float:
        """Speed of longitudinal waves in a thin bar, √(E/ρ), m/s."""
        return float((self.youngs_modulus / self.density) ** 0.5)


class MaterialTable(dict[str, Material]):
    """Materials by name. Case, blanks, dashes and underscores do not matter, and a unique first word suffices."""

    def __missing__(self, name: str) -> Material:
        key = name_key(name)
        for key_of in (name_key, lambda known: name_key(known.split()[0])):
            meant = [known for known in self if key_of(known) == key]
            if len(meant) == 1:
                return self[meant[0]]
        raise ValueError(
            f"material = {name!r}: must be in MATERIALS; nearest: {', '.join(map(repr, near(name, self) or self))}"
        )

    def __contains__(self, name: object) -> bool:
        try:
            return isinstance(name, str) and bool(self[name])
        except ValueError:
            return False


def check_stress(argument: str, stress: float, material: Material, means: str) -> None:
    """Warn about a stress, Pa, that the material cannot carry. means: a reminder of the meaning of the argument."""
    limit, name = material.yield_strength, "its yield strength of"
    if limit is None:
        limit, name = LARGE_STRAIN * material.youngs_modulus, "a tenth of its Young's modulus,"
    if abs(stress) > limit:
        caution(
            f"{argument}: stresses {material.name or 'the material'} to {1e-6 * abs(stress):.3g} MPa, beyond {name} "
            f"{1e-6 * limit:.3g} MPa; {means}"
        )


def name_key(name: str) -> str:
    """Return a name without case, blanks and dashes, in British spelling."""
    return "".join(letter for letter in str(name).lower() if letter.isalnum()).replace("aluminum", "aluminium")


STEEL_316 = Material(193.0e9, 0.30, 8000.0, "steel 316", 205.0e6)
STEEL_440C = Material(200.0e9, 0.28, 7800.0, "steel 440C", 1900.0e6)
COPPER = Material(115.0e9, 0.35, 8960.0, "copper")
BRASS_360 = Material(103.0e9, 0.34, 8550.0, "brass 360", 170.0e6)
ALUMINIUM_6061 = Material(68.9e9, 0.33, 2693.0, "aluminium 6061", 276.0e6)
NYLON = Material(6.52e9, 0.40, 1140.0, "nylon")
ACRYLIC = Material(4.75e9, 0.35, 1186.0, "acrylic")
POLYCARBONATE = Material(3.75e9, 0.35, 1196.0, "polycarbonate")
PTFE = Material(1.53e9, 0.46, 2151.0, "PTFE")

# The materials of Table 2.1 of the thesis, by name. Yield strengths come from other sources: steel 316 annealed,
# minimum of ASTM A276; steel 440C hardened and tempered at 200 to 315 °C, data sheets of bars to AMS 5630; brass 360
# half hard, minimum of ASTM B16; aluminium 6061-T6, typical value of the Aluminum Association. Copper and polymers
# have none, because theirs depend on temper and strain rate.
_TABLE = (STEEL_316, STEEL_440C, COPPER, BRASS_360, ALUMINIUM_6061, NYLON, ACRYLIC, POLYCARBONATE, PTFE)
MATERIALS = MaterialTable({material.name: material for material in _TABLE})
