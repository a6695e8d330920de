"""The power law nearest to another law, over a range: its numbers belong to that range and that weighting."""

from dataclasses import dataclass

import numpy as np

from particles.laws.law import ContactLaw, PowerLaw, check_contact_law
from structures.checks import one_of, positive

WEIGHTINGS = ("relative", "absolute")

POINTS = 400
"""Of a law that are fitted."""

STEEPEST = 10.0
"""The largest exponent that is looked for, that of PowerLaw."""


@dataclass(frozen=True)
class PowerFit:
    """F = k δⁿ, fitted over a range of approaches by a weighting; k and n mean little without these.

    Parameters
    ----------
    stiffness : float
        k, N/mⁿ.
    exponent : float
        n.
    lowest, highest : float
        Range of approaches, m.
    weighting : str
        "relative" or "absolute".
    misfit : float
        Largest relative deviation of the force in the range.
    """

    stiffness: float
    exponent: float
    lowest: float
    highest: float
    weighting: str
    misfit: float

    @property
    def law(self) -> PowerLaw:
        """The fit as a law for a chain, trusted up to `highest`."""
        name = f"power law fitted from {self.lowest:.3g} to {self.highest:.3g} m, {self.weighting} weighting"
        return PowerLaw(self.stiffness, self.exponent, self.highest, name)


def fit_power_law(law: ContactLaw, lowest: float, highest: float, weighting: str = "relative") -> PowerFit:
    """Return the power law nearest to a law over a range of approaches.

    Parameters
    ----------
    law : ContactLaw
        The law.
    lowest : float
        Start of the range, m.
    highest : float
        End of the range, m.
    weighting : str
        "relative", least squares of ln F at even steps of ln δ; or "absolute", of F at even steps of δ, which weights
        large forces (over 0.2–10 µm: Table 5.1 of Khatri's thesis).

    Returns
    -------
    PowerFit
        Stiffness, exponent and misfit; its `law` is a PowerLaw.

    Raises
    ------
    ValueError
        For a highest approach that is not above the lowest, and for another weighting.

    Examples
    --------
    >>> import hertzlink as hl
    >>> shell = hl.HollowSphere(9.525e-3, 8.655e-3, hl.ALUMINIUM_6061)
    >>> fit = hl.laws.fit_power_law(hl.contact_law(shell, shell), 1e-6, 10e-6)
    >>> round(fit.exponent, 2)
    1.25
    """
    check_contact_law("law", law)
    one_of("weighting", weighting, WEIGHTINGS)
    lowest, highest = positive("lowest", lowest, "m"), positive("highest", highest, "m")
    if lowest >= highest:
        raise ValueError(f"highest = {highest!r}: must be more than lowest, {lowest!r} m")
    logarithms = np.linspace(np.log(lowest / highest), 0.0, POINTS)
    # In parts of the range's end, so that k of any unit N/mⁿ comes out of numbers near one.
    parts = np.exp(logarithms) if weighting == "relative" else np.linspace(lowest / highest, 1.0, POINTS)
    end = float(law.force(np.array(highest)))
    forces = law.force(parts * highest) / end
    if weighting == "relative":
        exponent, logarithm = np.polyfit(logarithms, np.log(forces), 1)
        factor = np.exp(logarithm)
    else:
        from scipy.optimize import minimize_scalar

        def factor_of(exponent: float) -> float:
            shape = parts**exponent
            return float(shape @ forces / (shape @ shape))

        def squares(exponent: float) -> float:
            return float(np.sum((factor_of(exponent) * parts**exponent - forces) ** 2))

        exponent = minimize_scalar(squares, bounds=(0.5, STEEPEST), method="bounded", options={"xatol": 1e-10}).x
        factor = factor_of(exponent)
    misfit = float(np.abs(factor * parts**exponent / forces - 1.0).max())
    stiffness = float(factor * end / highest**exponent)
    return PowerFit(stiffness, float(exponent), lowest, highest, weighting, misfit)
