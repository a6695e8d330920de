"""The numbers that a study expects, from a file of data, and the rows of its table that compare them with ours."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from hertzlink.studies.table import INPUT, MEASURED, SIMULATED, TIMED, Row

# How far a printed number and ours may lie apart, by what it comes from; none for what follows from an equation.
SCATTER = {"": 0.0, "simulation": SIMULATED, "experiment": MEASURED, "time": TIMED, "input": INPUT}
Named = dict[str, Any]  # What stands in the name of a row, and its theory, by name.


@dataclass(frozen=True)
class Expected:
    """A row of a table: a printed number or statement, or the words of what nobody printed.

    ours: what hertzlink has instead, where no study computes it. scatter: what it comes from, a key of SCATTER. source:
    where it stands. reason: why ours differs, with a place {} for each value that a run gives. quantity: its name in
    the table where it is not the key of the entry.
    """

    value: float | str = ""
    source: str = ""
    ours: float | str = ""
    unit: str = ""
    scatter: str = ""
    reason: str = ""
    quantity: str = ""


@dataclass(frozen=True)
class Rows:
    """The rows of one part of files of data, which lie here or at absolute paths."""

    part: str
    files: tuple[str, ...] = ("thesis.toml", "rows.toml")

    @property
    def entries(self) -> Mapping[str, Expected]:
        """The expected numbers, by name."""
        return {name: entry for file in self.files for name, entry in expected(file).get(self.part, {}).items()}

    def __call__(
        self, name: str, computed: float | str | None, /, *said: object, theory: float | str = "",
        otherwise: Mapping[str, float | str] = MappingProxyType({}), holds: bool | None = None, **labels: object,
    ) -> Row:  # fmt: skip
        """Return row of an entry. said: the values in its reason; labels: those in its name; the others as of a Row."""
        entry = self.entries[name]
        computed = entry.ours if computed is None else computed
        reason = entry.reason.format(*said) if said else entry.reason
        quantity = (entry.quantity or name).format(**labels)
        return Row(
            quantity, entry.value, computed, entry.unit, reason, theory, SCATTER[entry.scatter], otherwise, holds
        )


@cache
def expected(file: str) -> dict[str, dict[str, Expected]]:
    """Return what a file of data holds, by part and by the name of the entry."""
    parts = tomllib.loads((Path(__file__).parent / file).read_text(encoding="utf-8"))
    return {part: {name: Expected(**entry) for name, entry in entries.items()} for part, entries in parts.items()}
