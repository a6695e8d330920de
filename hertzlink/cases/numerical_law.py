"""The contact laws of a chain of a case, which hold between its beads."""

from collections.abc import Sequence
from typing import Any, Literal

from hertzlink.cases.declared import Declared
from hertzlink.cases.faults import Fault, fault_of
from particles.laws.choose import computed_law
from particles.laws.law import ContactLaw


class NumericalLaw(Declared):
    """A law that is computed for two of the chain's beads, by finite or boundary elements."""

    named_so = "NumericalLaw"
    without = ("first", "second", "options")
    kind: Literal["numerical"]

    def of_beads(self, beads: Sequence[Any]) -> ContactLaw:
        """Return the law of equal beads; a Fault for beads that differ."""
        if any(bead != beads[0] for bead in beads):
            raise Fault(("law", "kind"), "computes one law, so all beads and the striker must be equal")
        try:
            return computed_law(beads[0], beads[0], **self.given("kind"))
        except ValueError as error:
            raise fault_of(str(error), self.names(), ("law",)) from error
