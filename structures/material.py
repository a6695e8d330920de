"""Linear elastic, isotropic materials, and those of the thesis's Table 2.1."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches

from structures.checks import finite, instance, positive


@dataclass(frozen=True)
class Material:
    """A linear elastic, isotropic solid.

    youngs_modulus in Pa, poisson_ratio in (-1, 0.5), density in kg/m³.
    Raises ValueError where a number cannot belong to a solid.
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float
    name: str = ""

    def __post_init__(self) -> None:
        instance("name", self.name, str, "a text")
        object.__setattr__(self, "youngs_modulus", positive("youngs_modulus", self.youngs_modulus, "Pa"))
        object.__setattr__(self, "density", positive("density", self.density, "kg/m³"))
        ratio = finite("poisson_ratio", self.poisson_ratio)
        if not -1.0 < ratio < 0.5:
            raise ValueError(f"poisson_ratio = {self.poisson_ratio!r}: must lie between -1 and 0.5, both excluded")
        object.__setattr__(self, "poisson_ratio", ratio)

    @property
    def contact_modulus(self) -> float:
        """Plane-strain modulus E/(1 − ν²), Pa."""
        return self.youngs_modulus / (1.0 - self.poisson_ratio**2)

    @property
    def bar_speed(self) -> float:
        """Speed of longitudinal waves in a thin bar, √(E/ρ), m/s."""
        return float((self.youngs_modulus / self.density) ** 0.5)


class UnknownMaterial(ValueError, KeyError):
    """A name that no material of the table has."""

    def __str__(self) -> str:
        return str(self.args[0])


class MaterialTable(Mapping[str, Material]):
    """Materials by name; case, blanks, dashes and underscores do not matter.

    Looking up an unknown name raises UnknownMaterial (a ValueError and a KeyError) with the nearest names.
    """

    def __init__(self, *materials: Material) -> None:
        self._by_key = {_key(material.name): material for material in materials}

    def __getitem__(self, name: str) -> Material:
        if _key(name) not in self._by_key:
            near = get_close_matches(_key(name), self._by_key, n=3, cutoff=0.5) or list(self._by_key)
            names = ", ".join(repr(self._by_key[key].name) for key in near)
            raise UnknownMaterial(f"material = {name!r}: unknown; the nearest names are {names}")
        return self._by_key[_key(name)]

    def __iter__(self) -> Iterator[str]:
        return (material.name for material in self._by_key.values())

    def __len__(self) -> int:
        return len(self._by_key)


def _key(name: str) -> str:
    return "".join(letter for letter in str(name).lower() if letter.isalnum())


STEEL_316 = Material(193.0e9, 0.30, 8000.0, "steel 316")
STEEL_440C = Material(200.0e9, 0.28, 7800.0, "steel 440C")
COPPER = Material(115.0e9, 0.35, 8960.0, "copper")
BRASS_360 = Material(103.0e9, 0.34, 8550.0, "brass 360")
ALUMINIUM_6061 = Material(68.9e9, 0.33, 2693.0, "aluminium 6061")
NYLON = Material(6.52e9, 0.40, 1140.0, "nylon")
ACRYLIC = Material(4.75e9, 0.35, 1186.0, "acrylic")
POLYCARBONATE = Material(3.75e9, 0.35, 1196.0, "polycarbonate")
PTFE = Material(1.53e9, 0.46, 2151.0, "PTFE")

MATERIALS = MaterialTable(STEEL_316, STEEL_440C, COPPER, BRASS_360, ALUMINIUM_6061, NYLON, ACRYLIC, POLYCARBONATE, PTFE)
"""The materials of the thesis's Table 2.1 (section 2.1) by name."""
