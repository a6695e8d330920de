"""Faults of a case: the path of the entry, the reason, and, once the file is known, the line."""

from collections.abc import Mapping

from coupling.results.missing_waves import UNTIL
from hertzlink.cases.entry_paths import Path, written

YIELDING = 'law = { kind = "jackson_green" } in [chain]'
"""What a case needs for contacts that yield."""


class Fault(ValueError):
    """A fault at a path of a case. value: the number in SI units with which the reason begins, if it does."""

    def __init__(self, path: Path, reason: str, value: str = "") -> None:
        super().__init__(path, reason, value)
        self.path, self.reason, self.value = path, " ".join(reason.split()), value

    def __str__(self) -> str:
        return f"{written(self.path)}: {self.reason}" if self.path else self.reason


class CaseError(ValueError):
    """A fault with its place: `case.toml:12: structure.thickness: must be ...`, complete as it stands."""


def fault_of(message: str, names: Mapping[str, Path], path: Path = ()) -> Fault:
    """Return the fault that a message such as "thickness = -1: must be positive" is about.

    names: paths below `path` of the names with which messages begin. What names none of them is a fault at `path`.
    """
    head, colon, rest = message.partition(": ")
    name, equals, value = head.partition(" = ")
    argument = name.split("[")[0].strip()
    if not colon or argument not in names:
        return Fault(path, message)
    at = (*path, *names[argument])
    if not equals:
        return Fault(at, rest)
    joined = " " if rest.split(" ")[0] in ("must", "exceeds", "is", "has") else ": "
    return Fault(at, f"{value}{joined}{rest}", value.split(" ")[0])


def of_case(finding: str) -> str:
    """Return a finding of a run, with times and laws as a case has them: until = "0.61 ms", not until = 0.00061 (0.61
    ms)."""
    return UNTIL.sub(r'until = "\1"', finding).replace("law=hl.laws.JacksonGreen() in Chain", YIELDING)
