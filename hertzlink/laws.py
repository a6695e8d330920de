"""Contact laws F(δ) that are computed, tabulated or fitted, and laws of contacts that yield."""

from particles.laws.active_set import ActiveSetNotConverged
from particles.laws.axisymmetric import contact_law_fem as axisymmetric
from particles.laws.choose import computed_law
from particles.laws.computed import ComputedLaw
from particles.laws.half_spaces import PressuresNotConverged
from particles.laws.half_spaces import contact_law_bem as half_spaces
from particles.laws.law import PowerLaw, TabulatedLaw
from particles.laws.plane import contact_law_plane as plane
from particles.laws.power_fit import fit_power_law
from particles.laws.solid import contact_law_solid as solid
from particles.laws.solid import midplane_correction
from particles.laws.yielding import JacksonGreen, Thornton, YieldingLaw

__all__ = [
    "ActiveSetNotConverged",
    "axisymmetric",
    "computed_law",
    "ComputedLaw",
    "fit_power_law",
    "half_spaces",
    "JacksonGreen",
    "midplane_correction",
    "plane",
    "PowerLaw",
    "PressuresNotConverged",
    "solid",
    "TabulatedLaw",
    "Thornton",
    "YieldingLaw",
]
