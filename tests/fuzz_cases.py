"""Wrong case files: a template, of which one or two entries are replaced, cut, doubled, moved or removed.

A wrong case may be read and checked, or be refused in one line that begins with the file. Everything else is a fault.
"""

import random
import tomllib
import traceback
from collections.abc import Callable, Iterator
from copy import deepcopy
from importlib.resources import files
from pathlib import Path
from typing import Any

from hertzlink.cases import CaseError, Fault, as_toml
from hertzlink.cases.case import read
from hertzlink.cases.tasks import task_of
from structures.caution import collected

Place = tuple[str | int, ...]
TEMPLATES = sorted(files("hertzlink.cases").joinpath("templates").iterdir(), key=str)
CASES = [tomllib.loads(one.read_text(encoding="utf-8")) for one in TEMPLATES if one.name.endswith(".toml")]
NUMBERS: tuple[Any, ...] = (float("nan"), float("inf"), -1, 0, 1, -1.0, 3.7, 1e-300, 1e300, 10**30, True)
TEXTS = (
    *("", " ", "text", "ü" * 300, "bead", "steel", "structure.thickness", "chain.impact_speed", "-0.5", "1 %"),
    *("1 mm mm", "1 mm", "-1 mm", "1 kg", "nan mm", "1e999 m", "1e-30 m", "0 GPa"),
)
TABLES: tuple[Any, ...] = (
    *([], [1], ["1 mm", "2 mm"], ["a"], [[1]], {}, {"kind": "x"}, {"structure.thickness": ["1 mm", "2 mm"]}),
    {"from": 1, "to": 2, "step": 0},
    {"from": "1 mm", "to": "2 mm", "step": "1e-9 mm"},
    {"from": "1 mm", "to": "2 mm", "count": 3},
)


def places(data: Any, at: Place = ()) -> Iterator[Place]:
    """The places of all entries of a document."""
    entries = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for name, value in entries:
        yield (*at, name)
        yield from places(value, (*at, name))


def entry(data: Any, at: Place) -> Any:
    """The entry at a place."""
    for part in at:
        data = data[part]
    return data


def damaged(old: Any, drawn: random.Random) -> Any:
    """An entry that was cut, doubled, or scaled."""
    if isinstance(old, str):
        return old[: drawn.randint(0, len(old))]
    if isinstance(old, list):
        return old * 2
    if isinstance(old, dict):
        return old | {"nonsense": 1}
    return old * drawn.choice((-1, 1000, 1e-3, 1e9))


def wrong_case(drawn: random.Random) -> dict[str, Any]:
    """A template with one or two changes."""
    data = deepcopy(drawn.choice(CASES))
    for _ in range(drawn.choice((1, 1, 1, 2))):
        *above, name = drawn.choice(list(places(data)))
        parent, other = entry(data, tuple(above)), drawn.choice(CASES)
        *folder, taken = drawn.choice(list(places(other)))
        kind = drawn.choice(("replaced", "replaced", "removed", "damaged", "exchanged", "added"))
        if kind == "replaced":
            parent[name] = deepcopy(drawn.choice(NUMBERS + TEXTS + TABLES))
        elif kind == "removed":
            del parent[name]
        elif kind == "damaged":
            parent[name] = damaged(parent[name], drawn)
        elif kind == "exchanged":
            parent[name] = deepcopy(entry(other, (*folder, taken)))
        elif isinstance(parent, dict) and isinstance(taken, str):
            parent[taken] = deepcopy(entry(other, (*folder, taken)))
    return data


def attempt(data: dict[str, Any], read: Callable[..., Any] = read) -> str | None:
    """Read and check a case; the fault, if there is one."""
    file = Path("case.toml")
    file.write_text(as_toml(data), encoding="utf-8")
    try:
        with collected():
            case, source = read(str(file))
            try:
                task_of(case)
            except Fault as fault:
                raise source.error(fault) from None
    except CaseError as error:
        text = str(error)
        well_said = text.startswith("case.toml") and "\n" not in text
        return None if well_said else f"no place, or several lines: {text[:200]}"
    except Exception as error:  # noqa: BLE001 (whatever must not happen is sought)
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} [{Path(last.filename).name}:{last.lineno}]: {str(error)[:200]}"
    return None
