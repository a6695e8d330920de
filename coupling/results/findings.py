"""Findings on a result that may mislead: the attribute `warnings` of its Dataset, one finding a line.

A finding begins with what it concerns and a colon, such as "energy: …": those with the same words there, numbers aside,
are of one kind, and are reported together where there are many runs.
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
    """Return what it concerns: the words before the first colon, without their numbers."""
    return NUMBER.sub("#", finding.split(": ")[0])


def gathered(findings: Mapping[str, Sequence[str]], count: int, what: str = "points") -> list[str]:
    """Return the first finding of each kind in `count` runs, and how many have one; findings: by the run's name."""
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
    """Warn the user of each."""
    for finding in findings:
        caution(finding)
