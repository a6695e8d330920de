"""The constants of identification and of derivatives, which no user needs to choose."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Lengths are parts of a range, if nothing else is said; χ² are compared by their ratio, or by their difference.

    Echoes make minima as narrow as 1/40 of a range of the factor 60: lines of 128 places find them, 48 missed one.
    Derivatives over much less than a standard deviation would show how traces scatter where a mesh changes with an
    unknown: that looks like information, and made intervals too short.
    """

    # Predictions. Cubic splines between 48 saved times in the shortest contact are exact to 1e-5 of a pulse.
    accuracy: str = "screening"
    saved_per_contact: float = 48.0
    remembered_traces: int = 256
    most_samples: float = 1e6
    shortest_part: float = 0.75
    """The user is warned of structures that were made for less than this part of the usual prediction."""

    # The signal. Fifty samples of a quiet lead give its noise to 10 %; evidence is that of Kass and Raftery (1995).
    samples_per_contact: float = 4.0
    fewest_samples: int = 16
    fewest_of_lead: int = 50
    orders_of_memory: int = 4
    degrees_of_drift: int = 3
    strong_evidence: float = 6.0

    # The scan: for one or two unknowns the smallest, twice as many points for each further one.
    smallest_scan: int = 32
    largest_scan: int = 128
    many_unknowns: int = 5
    """So many and more begin at starts_of_many points, have lines only where no fit explains the signal, and only half
    of the places beside a fit."""
    starts_of_many: int = 8
    starts_apart: float = 0.05

    # Lines. Where a fit explains the signal, so many places lie in a valley like its own, below a rival.
    fewest_places_of_line: int = 16
    most_places_of_line: int = 128
    places_in_valley: int = 4
    rival: float = 4.0
    """Where a fit explains the signal, a minimum on a line may be a rival if χ² is not larger by this factor."""
    starts_from_lines: int = 6
    rounds_of_lines: int = 3
    steps_beside: int = 19
    growth_beside: float = 1.25
    rounds_beside: int = 6
    """Distances from the best fit at which others are looked for: 2, 2.5, 3.1, … standard deviations. Beads that rattle
    make minima that are closer than the places of a line: a plate's edge at 37 mm was found at 36.8, and valleys some
    hundredths of a millimetre apart beside it, which the search leaves one after the other."""

    # Least squares, which end where χ², or every unknown, changes by less than the precision.
    precision: float = 1e-5
    most_tries: int = 30
    rough_precision: float = 1e-2
    rough_tries: int = 10
    hopeless: float = 1.5
    """A rough fit whose χ² is larger by more than this factor is searched no further."""
    solutions_apart: float = 1e-2
    first_step: float = 1e-3
    """Half the distance of runs for a derivative, before the error of the unknown is known."""
    step_over_error: float = 0.3
    shortest_step: float = 1e-5
    longest_step: float = 2e-2
    most_shifts: int = 8
    precise_shift: float = 1e-6
    """The time zero is exact to this part of a contact time, after at most so many shifts."""

    # Intervals.
    deviations: float = 1.959964
    """Standard deviations in half of a 95 % interval."""
    unlikely: float = 6.0
    """Another minimum is a mode of its own if χ² there is within this number of the least: a likelihood of 5 %."""
    widest_curvature: float = 0.1
    """Wider intervals come from the profile of χ², not from its curvature; so do those of unknowns that are more
    correlated than largest_correlation, and those at whose ends χ² rises by less or more than least_rise and
    largest_rise of what its curvature predicts. Within these its root is nearly straight, which moves the ends."""
    largest_correlation: float = 0.98
    least_rise: float = 0.8
    largest_rise: float = 1.25
    finest_profile: float = 1e-3
    """Its first step at least: smaller ones end in the roughness that beads which rattle give χ²; intervals were too
    short."""
    correlated: float = 0.25
    """Standard deviation of the Gaussian by which a discrepancy is correlated in time, in contact times."""


SETTINGS = Settings()


@dataclass(frozen=True)
class OfDifferences:
    """Of derivatives by differences of runs, of budgets of uncertainty, and of numerical errors."""

    steps: tuple[float, ...] = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
    smooth: float = 0.01
    """Steps are parts of the value of a parameter. Where the derivatives of both sides differ by more than the part
    `smooth`, as by rounding, a larger one follows; contacts that open bend traces, so that the error grows with it."""
    steps_with_losses: tuple[float, ...] = (1e-2, 3e-3, 1e-3)
    smooth_with_losses: float = 0.05
    """Losses begin at the first step after a contact closes, so that traces jump by what they do in a part of a step; a
    large difference contains many such jumps, and their mean."""
    negligible: float = 1e-3
    """Part of a force: less of it does not matter, for a parameter that changes by as much as it is."""
    shift: float = 1e-5
    """Part of the peak by which traces are shifted along their derivatives, to differentiate a measure of them."""
    jump: float = 0.1
    """Part of a derivative by which those of both sides differ where the measure has none."""
    bent: float = 0.3
    curved: float = 0.05
    """Parts by which runs at the ends of the uncertainties, and sampled ones, may differ from what derivatives predict:
    the former in all, the latter besides two standard errors."""
    rounding: float = 1e-4
    """A smaller part of a measure is no change of it, but a numerical error."""
    richardson: float = 4.0 / 3.0
    """An error over its change when lengths are halved: at order 2 it falls to a quarter."""
    repeated: float = 1e-6
    """Part by which measures of two equal runs may differ, by rounding."""
    tighter: float = 1e-2
    """Factor of the tolerance of an exact reduction."""


DIFFERENCES = OfDifferences()
