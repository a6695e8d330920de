"""Verdicts on numbers that others printed: each is computed from the row of a study, none is written by hand."""

import re
from collections.abc import Callable, Iterable, Mapping
from math import inf, isfinite, isnan
from typing import NamedTuple

from hertzlink.studies.table import MEASURED, SIMILAR, SIMULATED, TIMED, WORDS, Row

REPRODUCED, CONDITION, DIFFERS = "reproduced", "reproduced under a condition", "differs"
MISPRINT, UNDEFINED = "misprint", "not defined"
VERDICTS = (REPRODUCED, CONDITION, DIFFERS, MISPRINT, UNDEFINED)
CONTRADICTS = "contradicts the printed"  # Begins what a condition contradicts.
# How the name of a condition ends that stands for an input which the text does not give.
NOT_GIVEN = "which is not given"
# What stands for a verdict where none is counted: there is nothing to reproduce; another row judges the same number.
INPUT_ONLY, READING = "input", "another reading"
AS_FAR = "no farther than theory, simulation and experiment of one author"
ABOUT = 0.1  # Of a number that the thesis calls approximate.
# Relative error of our runs that verdicts allow for; measures of waves are ten times as exact (docs/numerics.md).
SIMULATION_ERROR = 1e-3
RULE = f"""Reproduced: ours gives the printed digits when rounded, or lies within the scatter that is printed. Beyond
these {100 * SIMULATED:g} % are allowed for simulations, {100 * TIMED:g} % for measured times of flight,
{100 * MEASURED:g} % for other experiments, {100 * ABOUT:g} % for "about", {100 * SIMILAR:g} % for words of agreement,
and {100 * SIMULATION_ERROR:g} % more for the error of our runs; a verdict that needs this says so. Reproduced under a
condition: ours agrees under the condition that is named. Differs: by how much, outside of every condition that is
named. Misprint: the printed number or equation contradicts the same author's others, and the corrected form agrees with
ours. Not defined: the text lacks an input that is named, and without it nothing can be computed.
Where the text lacks an input, ours must agree over the range that is stated for it; else that is a condition. A
difference no larger than that between theory, simulation and experiment of the same author is a condition. Several
readings of one number are one entry. Inputs have no verdict."""
NUMBER = r"([-+−]?\d[\d ,]*\.?\d*(?:e[-+]?\d+)?)"
PLAIN, RANGE = re.compile(NUMBER), re.compile(rf"{NUMBER}\s*to\s*{NUMBER}")


class Interval(NamedTuple):
    """The numbers that a printed number may stand for."""

    low: float
    high: float

    def widened(self, share: float) -> "Interval":
        """Return the range wider by a part of the size at each end; ends at infinity stay."""
        return Interval(self.low - share * abs(self.low), self.high + share * abs(self.high))

    def meets(self, other: "Interval") -> bool:
        """Return whether they have a number in common."""
        return self.low <= other.high and other.low <= self.high

    def contains(self, other: "Interval") -> bool:
        """Return whether it contains a whole other one."""
        return self.low <= other.low and other.high <= self.high


class Verdict(NamedTuple):
    """One of VERDICTS, and what belongs to it: the condition, the distance, the corrected form, what is not said."""

    word: str
    detail: str = ""


def printed(value: float | str) -> Interval | None:
    """Return what a printed number may stand for, from its last digit, its scatter, or words such as "about"."""
    said = _bare(value.strip() if isinstance(value, str) else f"{value:.10g}")
    for pattern, meaning in FORMS:
        if match := pattern.fullmatch(said):
            return meaning(*match.groups())
    return None


def exact(value: float | str) -> Interval | None:
    """Return a number of ours, or a range of ours, as it stands."""
    said = _bare(value.strip() if isinstance(value, str) else repr(float(value)))
    match = RANGE.fullmatch(said) or PLAIN.fullmatch(said)
    if match is None:
        return None
    ends = sorted(_number(text) for text in match.groups())
    return Interval(ends[0], ends[-1])


def verdict(row: Row) -> Verdict:
    """Return the verdict on a row whose `thesis` is not empty."""
    if isnan(row.within):
        return Verdict(INPUT_ONLY)
    agreed = _agreement(row)
    if agreed is not None and agreed.word == CONDITION and row.against:
        return Verdict(CONDITION, f"{agreed.detail}; {CONTRADICTS} {row.against}")
    if agreed is not None:
        return agreed
    if row.provided:
        return Verdict(CONDITION, row.provided)
    corrected = row._replace(thesis=row.corrected)
    if row.corrected != "" and (row.holds is not None or _agreement(corrected) is not None):
        return Verdict(MISPRINT, f"corrected: {row.corrected}")
    if row.spread and _agreement(row._replace(thesis=row.spread, within=0.0)) is not None:
        return Verdict(CONDITION, f"{AS_FAR}, {row.spread}")
    if row.missing and exact(row.computed) is None:
        return Verdict(UNDEFINED, f"missing: {row.missing}")
    share = share_off(row)
    return Verdict(DIFFERS, f"by {in_percent(share)}" if share else "")


def _agreement(row: Row) -> Verdict | None:
    """Return the verdict on a row where ours agrees, with a condition or without one; None where it does not."""
    if row.holds is not None:
        limit = WORDS.get(str(row.thesis))
        allowed_by_words = "" if limit is None else f"within {100.0 * limit:g} %"
        return Verdict(REPRODUCED, allowed_by_words) if row.holds else None
    expected, ours = printed(row.thesis), exact(row.computed)
    if expected is None:
        return None
    others = [(name, exact(value)) for name, value in row.otherwise.items()]
    allowed = expected.widened(row.within + SIMULATION_ERROR * (row.within > 0.0))
    needed, about = f"within {100.0 * row.within:g} %", str(row.thesis).startswith("about")
    if ours and allowed.contains(ours):
        assumed = [name for name, value in others if name.endswith(NOT_GIVEN) and value and not allowed.contains(value)]
        within = f"within {100.0 * ABOUT:g} %" if about else "" if expected.contains(ours) else needed
        return Verdict(CONDITION, _joined(assumed[0], within)) if assumed else Verdict(REPRODUCED, within)
    for name, value in others:
        if value and allowed.meets(value):
            return Verdict(CONDITION, _joined(name, "" if expected.meets(value) else needed))
        if value and row.corrected == "" and _cut(row.thesis, value):
            return Verdict(CONDITION, f"{name}; the last digit is cut off, not rounded")
    if ours and row.corrected == "" and _cut(row.thesis, ours):
        return Verdict(CONDITION, "the last digit is cut off, not rounded")
    if ours and ours.contains(expected):
        return Verdict(CONDITION, "within the range of the cases")
    return None


def _joined(*parts: str) -> str:
    return "; ".join(filter(None, parts))


def share_off(row: Row) -> float:
    """Return how far ours lies from the printed number or range, relatively, at the end that lies farther away.

    Zero where both are words.
    """
    said = row.thesis.removeprefix("about ") if isinstance(row.thesis, str) else row.thesis
    expected, ours = exact(said) or printed(said), exact(row.computed)
    if expected is None or ours is None:
        return 0.0
    ends = ((expected.low, min(ours.low, expected.low)), (expected.high, max(ours.high, expected.high)))
    return max((mine / theirs - 1.0 for theirs, mine in ends if theirs and isfinite(theirs)), key=abs, default=0.0)


def in_percent(share: float) -> str:
    """Return a share with its sign."""
    percent = 100.0 * share
    return f"{percent:+z.0f} %" if abs(percent) >= 10.0 else f"{percent:+z.2g} %"


def counted(verdicts: Iterable[Verdict]) -> dict[str, int]:
    """Return how many there are of each."""
    words = [verdict.word for verdict in verdicts]
    return {word: words.count(word) for word in VERDICTS}


def in_words(counts: Mapping[str, int]) -> str:
    """Return how many there are of each, without those of which there is none."""
    plural = {DIFFERS: "differ", MISPRINT: "misprints"}
    return ", ".join(
        f"{count} {plural.get(word, word) if count > 1 else word}" for word, count in counts.items() if count
    )


def _bare(said: str) -> str:
    return said.removesuffix("%").removesuffix("times").strip()


def _number(said: str) -> float:
    return float(said.replace("−", "-").replace(" ", "").replace(",", ""))


def _rounded(said: str) -> Interval:
    """Return the numbers that give these digits when rounded."""
    mantissa, _, power = said.replace(" ", "").replace(",", "").partition("e")
    half = 0.5 * 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
    return _around(_number(said), half)


def _around(value: float, half: float) -> Interval:
    return Interval(value - half, value + half)


def _range(first: str, second: str) -> Interval:
    low, high = sorted((first, second), key=_number)
    return Interval(_rounded(low).low, _rounded(high).high)


def _cut(value: float | str, ours: Interval) -> bool:
    """Return whether ours gives a plain printed number if further digits are cut off, as the thesis does at times."""
    match = PLAIN.fullmatch(value.strip() if isinstance(value, str) else f"{value:.10g}")
    if not match:
        return False
    number = _number(match[1])
    return number <= ours.low and ours.high < number + 2.0 * (_rounded(match[1]).high - number)


FORMS: tuple[tuple[re.Pattern[str], Callable[..., Interval]], ...] = (
    (re.compile(r"([-−]?\d+)\s*/\s*(\d+)"), lambda a, b: _around(_number(a) / _number(b), 0.0).widened(1e-2)),
    (re.compile(rf"{NUMBER}\s*±\s*{NUMBER}"), lambda value, half: _around(_number(value), _number(half))),
    (RANGE, _range),
    (re.compile(rf"(?:<|below)\s*{NUMBER}"), lambda most: Interval(-inf, _number(most))),
    (re.compile(rf"(?:>|above)\s*{NUMBER}"), lambda least: Interval(_number(least), inf)),
    (re.compile(rf"about\s*{NUMBER}"), lambda value: _around(_number(value), 0.0).widened(ABOUT)),
    (PLAIN, _rounded),
)
