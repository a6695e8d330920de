"""Structures from a frequency response that was measured or computed at the point that is struck."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np

from structures.caution import caution
from structures.checks import count_of, each, existing, one_of, positive
from structures.described import described_as
from structures.linear_algebra.factor import numbers
from structures.material import Material
from structures.other_programs.foreign_files import FOREIGN, read_foreign
from structures.other_programs.imported import MEMORY, source_of_argument
from structures.other_programs.imported_modes import oscillators
from structures.other_programs.matrix_files import Vector
from structures.other_programs.table_heads import FREQUENCY, Head, table_in
from structures.other_programs.vector_fitting import Complex, fit_modes
from structures.quantities import Count, Curvature, InFile, OneOf, Quantity
from structures.structure import Structure
from structures.surface import Surface

QUANTITIES = {"receptance": 0, "mobility": 1, "accelerance": 2}
"""Displacement, velocity and acceleration for a unit force, and how often each is differentiated."""

UNITS = {
    "receptance": {"m/N": 1.0, "mm/N": 1e-3},
    "mobility": {"m/s/N": 1.0, "mm/s/N": 1e-3},
    "accelerance": {"1/kg": 1.0, "m/s²/N": 1.0, "mm/s²/N": 1e-3},
}
"""What units of tables are worth in those of the quantities."""

PARTS = "real", "imaginary"
POLAR = r"mag|abs|ampl|phase|deg|arg|db$|^\|"
"""Heads of a response that is not in real and imaginary parts."""

OF_TYPE = {8: "receptance", 11: "mobility", 12: "accelerance"}
"""The same by the types of ordinates in datasets 58."""

FEWEST, MOST = 20, 4000
"""Frequencies that a fit needs, and that it can take."""

LARGEST_ERROR, USELESS = 0.1, 0.5
"""Root mean squares of the relative error of a fit: beyond, a warning, and a refusal."""

NEGATIVE, MOST_NEGATIVE = 0.05, 0.3
"""Parts of the frequencies at which a mobility may have a negative real part: beyond, a warning, and a refusal."""

BAND = 10.0
"""The passivity of a fit is checked up to this multiple of the highest frequency."""


@described_as(also=("frequency_response",))
def from_frequency_response(
    response: Annotated[Any, InFile("a frequency response", "mobility.csv")],
    material: Material,
    frequency: Any = None,
    quantity: Annotated[str, OneOf(*QUANTITIES)] = "mobility",
    tolerance: Annotated[float, Quantity()] = 0.01,
    most_modes: Annotated[int, Count()] = 120,
    curvature: Curvature = 0.0,
) -> Structure:
    """A body whose response to a force at the point that is struck was measured or computed.

    The response becomes a sum of damped modes with positive masses, a rigid motion and a spring. Such a sum is stable
    and gives no energy.

    Parameters
    ----------
    response : array, str or Path
        Complex response at the point and in the direction of the force, n numbers; or a file: a table with the columns
        frequency (Hz), real and imaginary part (.csv, .txt), or a universal file (.unv, .uff; `hertzlink[uff]`), whose
        only driving point counts, and which says what was measured. With the time dependence e^(iωt).
    material : Material
        The material at the contact, for Hertz's law.
    frequency : array, optional
        Frequencies, Hz, n; needed if `response` are numbers.
    quantity : str
        "receptance" (m/N), "mobility" (m/(N s)) or "accelerance" (1/kg).
    tolerance : float
        Root mean square of the relative error at which no more modes are added; take that of the noise.
    most_modes : int
        The most modes.
    curvature : float
        Curvature of the surface at the contact, 1/m, for Hertz's law.

    Returns
    -------
    Structure
        One oscillator for each mode. `origin["fit"]` holds the error, the band, the number of modes, and the least real
        part of the mobility as a part of its largest size, up to ten times the band: it is not negative. Runs are
        warned of if the push is shorter than the band resolves.

    Raises
    ------
    ValueError
        If the file cannot be read, numbers do not fit each other, or the response is none of a passive body.

    Notes
    -----
    What a hammer's tip or a glued sensor adds to the local compliance is part of a measured response, and Hertz's law
    contains the compliance of a half-space. The spring beyond the modes, `flexibility`, is where such a part ends up.

    References
    ----------
    Gustavsen, IEEE Trans. Power Deliv. 21 (2006) 1587.

    Examples
    --------
    >>> import hertzlink as hl, numpy as np
    >>> f = np.linspace(50.0, 5e3, 400)
    >>> s = 2j * np.pi * f
    >>> body = hl.from_frequency_response(s / (1.7e7 + 20.0 * s + 0.0141 * s**2), hl.PTFE, frequency=f)
    >>> round(float(1.0 / body.contact[-1] ** 2), 4)  # the mass, kg
    0.0141
    """
    if isinstance(response, str | Path):
        hertz, values, quantity = _read(Path(response), quantity)
    else:
        hertz, values = numbers("frequency", [] if frequency is None else frequency), _complex(response)
    if hertz.ndim != 1 or values.shape != hertz.shape:
        raise ValueError(f"frequency has shape {hertz.shape}: must be a list as long as the response, {values.shape}")
    kept = np.argsort(hertz, kind="stable")
    kept = kept[hertz[kept] > 0.0]  # at zero, a receptance says nothing of a mobility
    hertz, values = hertz[kept], values[kept]
    if (np.diff(hertz) <= 0.0).any():
        raise ValueError(f"frequency: holds {hertz[:-1][np.diff(hertz) <= 0.0][0]} Hz twice")
    if hertz.size < FEWEST:
        raise ValueError(f"frequency: holds {hertz.size} positive numbers; {FEWEST} or more are needed")
    if hertz.size > MOST:
        every = -(-hertz.size // MOST)
        caution(f"response: has {hertz.size} frequencies, of which {MOST} are fitted at most; one in {every} is used")
        hertz, values = hertz[::every], values[::every]
    each(positive, "frequency", hertz, "Hz")
    omega = 2.0 * np.pi * hertz
    mobility = values * (1j * omega) ** (1 - QUANTITIES[one_of("quantity", quantity, QUANTITIES)])
    _check_passive(mobility)
    try:
        fit = fit_modes(omega, mobility, tolerance, most_modes)
    except np.linalg.LinAlgError:
        raise ValueError("response: its fit does not converge; its numbers must be of one order of magnitude") from None
    words = (
        f"response: its fit by {count_of(fit.omega.size, 'mode')} is {100.0 * fit.error:.2g} % off (root mean "
        "square); fit a shorter band, allow most_modes, or give more frequencies about resonances"
    )
    if fit.error > USELESS:
        raise ValueError(words)
    if fit.error > LARGEST_ERROR:
        caution(words)
    fine = np.geomspace(omega[0] / BAND, BAND * omega[-1], 20_000)
    fitted = fit.mobility(fine)
    report = {
        "error": fit.error,
        "band": [float(hertz[0]), float(hertz[-1])],
        "modes": fit.omega.size,
        "least_real_part": float(fitted.real.min() / np.abs(mobility).max()),
    }
    rigid = [0.0] if fit.rigid > 0.0 else []
    order = np.argsort(fit.omega)
    square = np.concatenate([[fit.rigid] * len(rigid), fit.square[order]])
    origin = {
        "response": source_of_argument(response),
        "frequency": None if isinstance(response, str | Path) else MEMORY,
        "quantity": quantity,
        "fit": report,
        "highest_frequency": float(hertz[-1]),
    }
    return oscillators(
        np.concatenate([rigid, fit.omega[order]]),
        np.concatenate([rigid, fit.ratios[order]]),
        np.sqrt(square)[:, None],
        fit.compliance,
        Surface(material, curvature),
        origin,
    )


def _complex(response: Any) -> Complex:
    try:
        values = np.asarray(response, dtype=complex)
    except (TypeError, ValueError):
        values = np.array(np.nan + 0j)
    if not np.isfinite(values).all():
        raise ValueError("response: must hold finite complex numbers, or be the path of a file")
    return values


def _check_passive(mobility: Complex) -> None:
    """Raise a ValueError, or warn, for a mobility that gives energy at many frequencies."""
    if not np.abs(mobility).max() > 0.0:
        raise ValueError("response: must not be zero")
    part = float((mobility.real < 0.0).mean())
    if part > MOST_NEGATIVE:
        raise ValueError(
            f"response: gives energy at {100.0 * part:.0f} % of its frequencies, where the mobility's real part is "
            "negative; is it at the point and in the direction of the force, of this quantity, and for e^(iωt)?"
        )
    if part > NEGATIVE:
        caution(f"response: gives energy at {100.0 * part:.0f} % of its frequencies; its noise is large there")


def _read(path: Path, quantity: str) -> tuple[Vector, Complex, str]:
    """Return the frequencies, Hz, the response and the quantity of a file."""
    what = f"response = {str(path)!r}"
    suffix = existing(what, path).suffix.lower()
    if suffix in (".csv", ".txt"):
        units = {"": 1.0, **UNITS[one_of("quantity", quantity, QUANTITIES)]}
        heads = [Head("real part", POLAR, {}), *(Head(f"{part} part", rf"\b{part[:2]}", units) for part in PARTS)]
        table = table_in(what, path, [*FREQUENCY, *heads])
        real, imaginary = (table[f"{part} part"] for part in PARTS)
        if real.unit != imaginary.unit:
            raise ValueError(f"{what}: its parts are in {real.unit or 'no unit'} and {imaginary.unit or 'no unit'}")
        return table["frequency"].values, real.values + 1j * imaginary.values, quantity
    if suffix not in (".unv", ".uff") or suffix not in FOREIGN:
        raise ValueError(f"{what}: must be one of .csv, .txt, .unv, .uff, or complex numbers")
    driven = [
        one
        for one in read_foreign(path, what, "response")["sets"]
        if np.iscomplexobj(one["data"])
        and (one["rsp_node"], abs(one["rsp_dir"] or 0)) == (one["ref_node"], abs(one["ref_dir"] or 0))
    ]
    if len(driven) != 1:
        raise ValueError(f"{what}: has {len(driven)} complex responses at the point of the force; one is needed")
    of = OF_TYPE.get(int(driven[0]["ordinate_spec_data_type"] or 0), quantity)
    sign = np.sign(driven[0]["rsp_dir"] or 1) * np.sign(driven[0]["ref_dir"] or 1)
    return np.asarray(driven[0]["x"], dtype=float), sign * _complex(driven[0]["data"]), of
