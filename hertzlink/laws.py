"""Contact laws F(δ) that are computed or tabulated, power laws, and laws of contacts that yield."""

from particles.laws.axisymmetric import computed_law as computed_law
from particles.laws.law import ContactLaw as ContactLaw
from particles.laws.law import PowerLaw as PowerLaw
from particles.laws.law import TabulatedLaw as TabulatedLaw
from particles.laws.yielding import JacksonGreen as JacksonGreen
from particles.laws.yielding import Thornton as Thornton
from particles.laws.yielding import YieldingLaw as YieldingLaw
