"""Contact laws F(δ) that are computed, tabulated or fitted, and laws of contacts that yield."""

from particles.laws.choose import computed_law as computed_law
from particles.laws.law import PowerLaw as PowerLaw
from particles.laws.law import TabulatedLaw as TabulatedLaw
from particles.laws.power_fit import fit_power_law as fit_power_law
from particles.laws.yielding import JacksonGreen as JacksonGreen
from particles.laws.yielding import Thornton as Thornton
from particles.laws.yielding import YieldingLaw as YieldingLaw
