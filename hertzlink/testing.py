"""Regression tests of your own models: their waves, compared with a saved reference or with published numbers."""

from coupling.references import assert_same_waves as assert_same_waves
from hertzlink._help import offer as _offer
from particles.chain import LawOfPair as _LawOfPair
from structures.checks import function as _function


def assert_literature(law: _LawOfPair) -> None:
    """Compare a contact law with the numbers of chains and collisions that other authors and programs print.

    Parameters
    ----------
    law : callable
        A function law(body, next body or Surface) that returns a contact law; `contact_law` is Hertz's.

    Raises
    ------
    ValueError
        If the law is no function.
    AssertionError
        If a number differs by more than its printed digits or scatter allow; the message lists each one.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.testing.assert_literature(hl.contact_law)
    """
    from hertzlink.studies.literature import of_chains, problems

    _function("law", law, 2, "a function of a body and the next body, such as hl.contact_law")
    found = problems(*of_chains(law))
    if found:
        raise AssertionError("\n".join([f"{len(found)} numbers of the literature are not reproduced:", *found]))


_offer(__name__)
