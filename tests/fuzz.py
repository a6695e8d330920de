# ruff: noqa: T201 (a script that prints)
"""Bad calls of the public API: a good call, of which one or two arguments are replaced by a bad or extreme value.

A bad call may return a finite result, or raise a ValueError or TypeError that the package itself raises and that names
an argument. Everything else is a fault: any other exception, an error that numpy or Python raises on its own, NaN or
infinity in a result, more than half a minute, more than 2 GB of memory.

    python tests/fuzz.py 10000 [seed]    reports all faults of calls drawn at random, each kind once
"""

import faulthandler
import inspect
import linecache
import math
import os
import random
import re
import reprlib
import resource
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

ROOT = Path(__file__).resolve().parents[1]
OWN_FOLDERS = tuple(str(ROOT / room) for room in ("hertzlink", "coupling", "particles", "plates", "structures"))
LONGEST_CALL = 30.0  # s of the processor
LARGEST_MEMORY = 2 * 1024**3  # B, in addition to what the process holds already
LONGEST_REPR = 3000
"""Number of characters: a table of some lines."""
LARGEST_DEPTH = 4
"""Nested containers of a result that are examined: a dictionary of lists of named tuples has three."""

NUMBERS: tuple[Any, ...] = (
    *(math.nan, math.inf, -math.inf, 0, 0.0, -1.0, 1e-300, 1e-30, 1e-12, 1e-6, 1e-3, 0.5, 1, 1.5, 2, 7),
    *(1e3, 1e6, 1e9, 1e12, 1e30, 1e300, 10**400, 10**9, -(10**9), np.float32(0.1), np.int64(3), True, np.bool_(False)),
    *(Fraction(1, 3), Decimal("0.1"), 1.0 + 0.0j, np.float64(math.nan), "0.1"),
    *(5e-324, 1e-160, 1e160, 1.7e308, 2**53 + 1, 2**63, -(2**63), np.uint64(2**63), np.int64(-(2**63))),
    *(Fraction(7), Fraction(10**400), np.array(7), np.array(0.05), np.array([0.05]), np.float16(0.1)),
)
TEXTS: tuple[Any, ...] = ("", "x", "nan", "FREE", "\n", "é" * 1000, "../x", "\0", b"free")
WRONG: tuple[Any, ...] = (
    *(None, "", "x", b"x", [], (), {}, set(), float, math.sin, lambda: None, [None], ["x"], {"x": math.nan}),
    *(np.array([]), np.array(math.nan), np.ones((2, 2)), np.array([1.0, math.nan]), np.array(["a"]), np.array([0.3])),
    *(xr.Dataset(), xr.DataArray([1.0]), Path("nowhere"), range(3), [[1.0, 2.0], [3.0]], np.datetime64("2020"), 0, -1),
    *(math.nan, math.inf, 1e300, 10**9, object(), np.ma.masked, [math.nan], [1e300, 1e300], (1, 2, 3), {1: 2}),
)
FACTORS = (1e-9, 1e-6, 1e-3, 0.1, 0.5, 2.0, 10.0, 1e3, 1e6, 1e9, -1.0)
"""Multiples of a good number: a length in millimetres or micrometres, a time in milliseconds, a wrong sign."""


@dataclass(frozen=True)
class Target:
    """A function, its good arguments, what is done with the result, and further values worth a try by argument."""

    call: Callable[..., Any]
    good: Mapping[str, Any]
    use: Callable[[Any], Any] | None = None
    more: Mapping[str, Iterable[Any]] | None = None
    lasting: Mapping[str, tuple[float, float]] | None = None  # numbers of which a warning says that they take long
    infinite: bool = False  # NaN and infinity in the result are documented

    def values(self, name: str, things: Iterable[Any]) -> list[Any]:
        """Values to put in place of an argument: those of its kind, and those of wrong kinds."""
        own = list((self.more or {}).get(name, ()))
        low, high = (self.lasting or {}).get(name, (1.0, 0.0))
        every = [*own, *of_kind(self.good[name]), *WRONG, *things]
        return [one for one in every if not (isinstance(one, int | float | Fraction) and low <= one <= high)]


@dataclass(frozen=True)
class Fault:
    kind: str
    text: str


class Hangs(BaseException):
    """Raised by the alarm; no `except Exception` catches it."""


def of_kind(good: Any) -> list[Any]:
    """Bad and extreme values of the kind of a good one."""
    if isinstance(good, bool):
        return [*NUMBERS, *TEXTS]
    if isinstance(good, int | float):
        return [*NUMBERS, *(good * factor for factor in FACTORS)]
    if isinstance(good, str | Path):
        return list(TEXTS)
    if isinstance(good, Mapping):
        changed = [{**good, key: bad} for key in good for bad in (*NUMBERS, None, "x", [])]
        return [*changed, {**good, "x": 1.0}, {**good, 99: 1}, {**good, -1: 1}, {None: None}]
    if isinstance(good, np.ndarray) and good.ndim and good.size:
        broken = good.astype(float, copy=True)
        broken.flat[broken.size // 2] = math.nan
        return [broken, good[:1], good[:-1], good[..., None], good + 1e300, -good, good * 0.0, good[::-1], good + 0j]
    if type(good) in (list, tuple) and good:
        kind, elements = type(good), list(good)
        places = {0, len(elements) - 1}
        swapped = [
            kind([*elements[:at], bad, *elements[at + 1 :]])
            for at in sorted(places)
            for bad in (*NUMBERS, None, "x", [], object())
        ]
        return [*swapped, kind(elements[:1]), kind(elements[::-1]), kind(elements * 2), kind([good]), elements * 10**6]
    return []


@contextmanager
def guarded() -> Iterator[None]:
    """Raises Hangs after half a minute of the processor, MemoryError above 2 GB more."""

    def too_long(*_: object) -> None:
        raise Hangs

    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before, handler = resource.getrlimit(resource.RLIMIT_AS), signal.signal(signal.SIGPROF, too_long)
    resource.setrlimit(resource.RLIMIT_AS, (held + LARGEST_MEMORY, before[1]))
    signal.setitimer(signal.ITIMER_PROF, LONGEST_CALL)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        resource.setrlimit(resource.RLIMIT_AS, before)
        signal.signal(signal.SIGPROF, handler)


def attempt(target: Target, changes: Mapping[str, Any], names: Iterable[str]) -> Fault | None:
    """The fault of one call, or None. `names` are the parameters of the whole API, for what a result is used for."""
    said: list[Any] = []
    try:
        with guarded(), warnings.catch_warnings(record=True) as said, np.errstate(all="ignore"):
            warnings.simplefilter("always")
            result = target.call(**{**target.good, **changes})
            used = target.use(result) if target.use else None
            shown = repr(result)
            if hasattr(result, "_repr_html_"):
                result._repr_html_()
    except (ValueError, TypeError) as error:
        own = argument_names(target)
        return _said(error, own | set(names) if target.use else own)
    except Hangs:
        return None if _announced(said) else Fault("hangs", "longer than 30 s")
    except MemoryError as error:
        if _announced(said):
            return None
        return Fault("memory", f"more than 2 GB: {error} {_place(error)}")
    except Exception as error:  # noqa: BLE001 (whatever a call raises is examined)
        if type(error).__name__ in DOCUMENTED or isinstance(error, OSError):
            return None
        return Fault(type(error).__name__, f"{error} {_place(error)}")
    if len(shown) > LONGEST_REPR and not isinstance(result, np.ndarray | xr.Dataset | xr.DataArray | list | tuple):
        return Fault("repr", f"{len(shown)} characters")
    if not target.infinite and not (is_finite(result) and is_finite(used)):
        return Fault("not finite", f"{str(result)[:200]} {str(used)[:200]}")
    return None


DOCUMENTED = (*("NoWaveError", "NotConverged", "ContactNotConverged", "FloatingPointError"), "ImportError")
"""Exceptions that a docstring names, and an optional package that is missing. An OSError names
the file."""


def is_finite(value: Any, depth: int = 0) -> bool:
    """Whether the numbers of a result are finite. Objects of classes are not opened, apart from their arrays."""
    if depth > LARGEST_DEPTH:
        return True
    if isinstance(value, xr.Dataset):
        if "error" in value and "run" in value.dims:  # where a run of several failed
            value = value.isel(run=value.error.values == "")
        return all(is_finite(one.values) for name, one in value.data_vars.items() if name not in MAY_BE_NAN)
    if isinstance(value, xr.DataArray):
        return is_finite(value.values)
    if isinstance(value, np.ndarray | np.number | float | complex):
        numbers = np.asarray(value)
        return numbers.dtype.kind not in "fc" or bool(np.isfinite(numbers).all())
    if hasattr(value, "nnz") and hasattr(value, "data"):
        return is_finite(np.asarray(value.data))
    if isinstance(value, Mapping):
        return all(is_finite(one, depth + 1) for one in value.values())
    if isinstance(value, list | tuple):
        return all(is_finite(one, depth + 1) for one in value)
    return True


MAY_BE_NAN = (
    *("amplitude_ratio", "time_of_flight", "critical_distance", "bracket"),
    *("structure_kinetic_energy", "structure_elastic_energy", "structure_energy", "structure_dissipated_energy"),
    *("structure_numerical_loss", "gap"),
)
"""Measures of a wave that is not there, energies that a structure does not know, the gap to no structure: their
docstrings say NaN."""


def _said(error: Exception, names: Iterable[str]) -> Fault | None:
    """A fault if the package did not raise the error itself, or if its message names no argument."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    line = linecache.getline(last.filename, last.lineno or 0).strip()
    text, kind = str(error), type(error).__name__
    if Path(last.filename).name == "fuzz_targets.py" and "unexpected keyword argument" in text:
        return None  # a user's own builder, called as the user asked
    if not last.filename.startswith(OWN_FOLDERS) or not line.startswith("raise"):
        return Fault(f"raw {kind}", f"{text[:200]} {_place(error)}")
    words = set(re.findall(r"\w+", text))
    if not words & {one for name in names for one in (name, name.removesuffix("s"), *name.split("_")[-1:])}:
        return Fault(f"unnamed {kind}", f"{text[:200]} {_place(error)}")
    return None


def _announced(warned: Iterable[warnings.WarningMessage]) -> bool:
    """Whether a warning said that the call takes long or much memory."""
    return any(
        re.search(r"take[s]? .* (GB|steps)|times the .* s that a wave takes", str(one.message)) for one in warned
    )


def _place(error: BaseException) -> str:
    """The last line of the package in a traceback."""
    own = [one for one in traceback.extract_tb(error.__traceback__) if one.filename.startswith(OWN_FOLDERS)]
    return f"[{Path(own[-1].filename).relative_to(ROOT)}:{own[-1].lineno}]" if own else ""


def argument_names(target: Target) -> set[str]:
    """The names of a target's arguments, also of those that its good call leaves out."""
    try:
        return {*target.good, *inspect.signature(target.call).parameters}
    except (TypeError, ValueError):  # of functions that take any arguments
        return set(target.good)


def at_random(
    table: Mapping[str, Target], others: list[Any], tries: int, seed: int
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Names of targets and changes of their arguments, drawn."""
    draw, names = random.Random(seed), [name for name, target in table.items() if target.good]
    for _ in range(tries):
        name = draw.choice(names)
        target = table[name]
        arguments = draw.sample(list(target.good), min(len(target.good), draw.choice((1, 1, 1, 2))))
        yield name, {one: draw.choice(target.values(one, others)) for one in arguments}


def main(tries: str, seed: str = "0") -> int:
    """Reports each kind of fault once; should the process end, the last line names the call that ran."""
    from fuzz_targets import targets, things

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table, others = targets(), things()
    names = {name for target in table.values() for name in argument_names(target)}
    os.chdir(tempfile.mkdtemp(prefix="fuzz"))
    faulthandler.enable()
    found = set()
    for name, changes in at_random(table, others, int(tries), int(seed)):
        print(f"{name}({reprlib.repr(changes)})", end="\r", flush=True)
        fault = attempt(table[name], changes, names)
        if fault and (name, fault.kind, *changes) not in found:
            found.add((name, fault.kind, *changes))
            print(f"\n    {fault.kind}: {fault.text}")
    print(f"\n{len(found)} kinds of fault")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
