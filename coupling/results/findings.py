"""Findings: what may mislead in a result. The attribute `warnings` of its Dataset has one finding in each line.

A finding begins with its subject and a colon, such as "energy: …". Findings whose subjects differ only in numbers are
of one kind; those of many runs are reported together.
"""

import re
from collections.abc import Mapping, Sequence

import xarray as xr

from structures.caution import caution

NUMBER = re.compile(r"[-+]?\d[\d.]*(e[-+]?\d+)?")


def with_warnings(data: xr.Dataset, findings: Sequence[str]) -> xr.Dataset:
    """Return the Dataset with the attribute `warnings`, each finding once."""
    return data.assign_attrs(as_attribute(findings))


def as_attribute(findings: Sequence[str]) -> dict[str, str]:
    """Return the attribute `warnings`, empty where there are no findings."""
    return {"warnings": "\n".join(dict.fromkeys(" ".join(finding.split()) for finding in findings))}


def findings_of(data: xr.Dataset) -> list[str]:
    """Return the lines of the attribute `warnings`."""
    return str(data.attrs.get("warnings", "")).splitlines()


def kind(finding: str) -> str:
    """Return the kind of a finding: the words before the first colon, without their numbers."""
    return NUMBER.sub("#", finding.split(": ")[0])


def gathered(findings: Mapping[str, Sequence[str]], count: int, what: str = "points") -> list[str]:
    """Return the first finding of each kind in `count` runs, and how many have one. findings: by the run's name."""
    kinds: dict[str, dict[str, str]] = {}
    for name, lines in findings.items():
        for line in lines:
            kinds.setdefault(kind(line), {}).setdefault(name, line)
    return [
        f"{next(iter(runs.values()))} (at {next(iter(runs))}; reported at {len(runs)} of {count} {what})"
        for runs in kinds.values()
    ]


def one_of_each(findings: Sequence[str]) -> list[str]:
    """Return the first finding of each kind, and how many more there are."""
    kinds: dict[str, list[str]] = {}
    for finding in dict.fromkeys(findings):
        kinds.setdefault(kind(finding), []).append(finding)
    return [first if not more else f"{first} (and {len(more)} more of this kind)" for first, *more in kinds.values()]


def warn(findings: Sequence[str]) -> None:
    """Warn the user of each finding."""
    for finding in findings:
        caution(finding)
