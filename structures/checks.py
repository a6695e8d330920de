"""Checks of arguments, and the wording of their messages: the argument, its value, and what it must be."""

import inspect
import math
import os
import re
from collections.abc import Callable, Collection, Iterable, Sequence
from decimal import Decimal
from difflib import get_close_matches
from html import escape
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

import numpy as np
from numpy.typing import NDArray

Kind = TypeVar("Kind")
Word = TypeVar("Word", str, str | int)

LONGEST_VALUE_TEXT = 100  # Characters of a value that a message shows: one line of a terminal, without the name.

# Types that float() accepts, but that are not numbers, lose a part, or cannot be multiplied by a float.
NO_NUMBERS = (str, bytes, bool, Decimal, np.bool_, np.complexfloating, np.datetime64, np.timedelta64)

# The least similarity, from 0 to 1, of a misspelt word to a name, and to a part of a name.
LIKENESS, PART_LIKENESS = 0.6, 0.75

# No quantity in SI units is larger, and a product of three stays within floating point. Smaller numbers become zero.
SMALLEST, LARGEST = 1e-100, 1e100

MOST = 2**53  # The largest count. Above it, floats cannot represent every whole number.


def finite(name: str, value: float, unit: str = "") -> float:
    """Return `value` as a float; raise a ValueError if it is not finite, or larger than any quantity can be."""
    try:
        number = math.nan if isinstance(value, NO_NUMBERS) or getattr(value, "ndim", 0) != 0 else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not abs(number) <= LARGEST:
        most = f", at most {LARGEST:g}" if math.isfinite(number) else ""
        raise ValueError(f"{name} = {short(value)}: must be a finite number{unit and f' of {unit}'}{most}")
    return number if abs(number) >= SMALLEST else 0.0


def within(
    name: str, value: float, low: float, high: float, unit: str = "", or_zero: bool = False, ends: bool = True
) -> float:
    """Return `value` as a float; raise a ValueError if it lies outside a range. An end of zero is excluded.

    or_zero: zero is valid whatever the range. ends: the ends of the range, unless they are zero, are valid.
    """
    number = finite(name, value, unit)
    if low < number < high or (or_zero and number == 0.0) or (ends and number in (low, high) and number != 0.0):
        return number
    if low >= 0.0 >= number:
        least = f", at least {SMALLEST:g}" if value > 0.0 else ""
        must = f"be {'zero or ' * or_zero}a positive number{unit and f' of {unit}'}{least}"
    elif high == math.inf:
        must = f"be at least {low:g}{unit and f' {unit}'}"
    elif unit == "rad" and high == 2.0 * math.pi:
        must = "lie between -2π and 2π, in rad; for 45° write math.radians(45)"
    else:
        must = f"lie between {low:g} and {high:g}{unit and f' {unit}'}{'' if ends else ', both excluded'}"
    raise ValueError(f"{name} = {value!r}: must {must}")


def positive(name: str, value: float, unit: str = "") -> float:
    """Return `value` as a float; raise a ValueError if it is not positive and finite."""
    return within(name, value, 0.0, math.inf, unit)


def not_negative(name: str, value: float, unit: str = "") -> float:
    """Return `value` as a float; raise a ValueError if it is negative or not finite."""
    return within(name, value, 0.0, math.inf, unit, or_zero=True)


def whole(name: str, value: int, smallest: int = 1, largest: int = MOST) -> int:
    """Return `value` as an int; raise a ValueError if it is not a whole number from `smallest` to `largest`."""
    try:
        number = finite(name, value)
    except ValueError:
        number = math.nan
    if not smallest <= number <= largest or number != int(number):
        most = f", at most {largest}" if number > largest else f", {smallest} or more"
        raise ValueError(f"{name} = {short(value)}: must be a whole number{most}")
    return int(number)


def each(check: Callable[[str, float, str], float], name: str, value: Any, unit: str = "") -> NDArray[np.float64]:
    """Return `value` as an array; raise a ValueError if one of its numbers fails the check."""
    try:
        array = np.asarray(value)
        are_real = array.dtype.kind in "iufO" and value is not None and not isinstance(value, Decimal)
        numbers = array.astype(float) if are_real else None
    except (TypeError, ValueError, OverflowError):
        numbers = None
    if numbers is None:
        raise ValueError(f"{name} = {short(value)}: must be a number or an array of numbers{unit and f', in {unit}'}")
    # Minimum and maximum propagate NaN, so checking these two checks all numbers.
    for extreme in (numbers.min(), numbers.max()) if numbers.size else ():
        check(name, float(extreme), unit)
    return numbers


def plain(result: NDArray[np.float64]) -> Any:
    """Return an array, or a float if it has no dimension."""
    return float(result) if np.ndim(result) == 0 else result


def several(value: object) -> TypeGuard[Sequence[Any]]:
    """Return whether it is a sequence or an array of at least one dimension; a text does not count as a sequence."""
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def listed(name: str, value: object, kind: type, what: str) -> list[Any]:
    """Return `value` as a list of one or more objects of a kind, or raise a ValueError."""
    many = isinstance(value, Iterable) and not isinstance(value, str | bytes) and getattr(value, "ndim", 1) > 0
    items = list(value) if many else []  # type: ignore[call-overload]
    if not items or not all(isinstance(item, kind) for item in items):
        classes = "".join({_of_class(item): None for item in items})
        raise ValueError(f"{name} = {short(value)}: must be a list of {what}{classes}")
    return items


def coordinates(name: str, values: object, names: Sequence[str] = ("x", "y")) -> tuple[float, ...]:
    """Return the values as a tuple of floats in m, one for each name; raise a ValueError for any other number."""
    items = list(values) if several(values) else []
    if len(items) != len(names):
        raise ValueError(f"{name} = {short(values)}: must be ({', '.join(names)}), in m")
    return tuple(finite(f"{name}[{i}]", value, "m") for i, value in enumerate(items))


def instance(name: str, value: object, kind: type[Kind] | tuple[type[Kind], ...], what: str) -> Kind:
    """Return `value`; raise a ValueError if it is not of the kind, or of one of the kinds."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} = {short(value)}: must be {what}{_of_class(value)}")
    return value


def function(name: str, value: Any, count: int, what: str) -> Any:
    """Return `value`; raise a ValueError if it is not a function of `count` arguments. A class does not count."""
    fault = _of_class(value)
    if callable(value) and not fault:
        try:
            inspect.signature(value).bind(*[None] * count)
            return value
        except ValueError:  # some functions written in C have no signature
            return value
        except TypeError as error:
            fault = f" ({error})"
    raise ValueError(f"{name} = {short(value)}: must be {what}{fault}")


def existing(what: str, path: Path) -> Path:
    """Return the path of a regular file, or raise a ValueError. Reading a file under /proc may never end.

    what: the beginning of messages.
    """
    if not path.is_file() or path.resolve().is_relative_to("/proc"):
        fault = "is not a regular file" if os.path.lexists(path) else "there is no such file"
        raise ValueError(f"{what}: {'is a folder; give a file in it' if path.is_dir() else fault}")
    return path


def one_of(name: str, value: Word, choices: Collection[Word], hint: str = "") -> Word:
    """Return a word or a number; raise a ValueError with the choices and the nearest ones if it is not one of them.

    hint: the end of the message.
    """
    if not isinstance(value, str | int) or value not in choices:
        meant = did_you_mean(value, map(str, choices)) if isinstance(value, str) else ""
        every = ", ".join(map(repr, choices)) or "none"
        raise ValueError(f"{name} = {value!r}: must be one of {every}{meant and f' ({meant})'}{hint}")
    return value


def near(word: object, choices: Iterable[str]) -> list[str]:
    """Return the choices that a wrong word may mean, in upper or lower case.

    It is the most similar choice; or else all choices with a similar word: steel 316 and steel 440C for "steal".
    """
    guess, lower = str(word).lower(), {choice.lower(): choice for choice in choices}
    if matches := [guess] if guess in lower else get_close_matches(guess, lower, 1, LIKENESS):
        return [lower[matches[0]]]
    words = {choice: re.split(r"[\W_]+", choice) for choice in lower}
    part = get_close_matches(guess, sorted({part for parts in words.values() for part in parts}), 1, PART_LIKENESS)
    return [lower[choice] for choice, parts in words.items() if part and part[0] in parts]


def did_you_mean(word: object, choices: Iterable[str], shown: Callable[[str], str] = repr) -> str:
    """Return the question "did you mean …?" for the end of a message, or "" if no choice is near."""
    matches = near(word, choices)
    return f"did you mean {' or '.join(map(shown, matches))}?" if matches else ""


def nearest(word: object, choices: Collection[str], many: int = 12) -> str:
    """Return the end of a message: the nearest names, or all of them if none is near and they are few."""
    every = f"must be one of {', '.join(choices)}" if len(choices) <= many else "see `hertzlink schema`"
    return did_you_mean(word, choices, str) or every


def count_of(number: int, word: str, many: str = "") -> str:
    """Return a number and what it counts: "1 entry", "2 entries". many: an irregular plural."""
    plural = many or (f"{word[:-1]}ies" if word.endswith("y") else f"{word}s")
    return f"{number} {word if number == 1 else plural}"


def short(value: object) -> str:
    """Return a value as a short text on one line; the value may be a whole chain."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # an integer with thousands of digits
        return f"{type(value).__name__} of thousands of digits"
    return text if len(text) <= LONGEST_VALUE_TEXT else f"{text[:LONGEST_VALUE_TEXT]}…"


def html_table(title: str, rows: Sequence[tuple[str, str]]) -> str:
    """Return an HTML table of names and values under a title, with which notebooks show an object."""
    left = ' style="text-align: left"'  # notebooks align cells to the right, which suits numbers but not words
    cells = "".join(f"<tr><th{left}>{escape(name)}</th><td{left}>{escape(value)}</td></tr>" for name, value in rows)
    caption = f'<caption style="text-align: left; font-weight: bold; white-space: nowrap">{escape(title)}</caption>'
    return f"<table>{caption}<tbody>{cells}</tbody></table>"


def _of_class(value: object) -> str:
    """Return a hint for a message if a class was given instead of an object."""
    return f"; {value.__name__} is a class, so write {value.__name__}(...)" if isinstance(value, type) else ""
