"""Which tests are nearest to a function of the source: read from the names in the source and in the tests.

A test is as far from a function as the calls between them, at least. Names stand for what they name anywhere, so that a
distance can be too short, never too long: the order of the tests is a guess, and only the order.
"""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

ROOMS = ("particles", "plates", "structures", "coupling")
PARTS = (0, 1, 4, 15)
"""The first part is the nearest file, the next ends with the fourth: most mutants are caught in the first file."""


@dataclass(frozen=True)
class Function:
    """A function, method or constant of a module, and the names that it uses."""

    file: str
    name: str
    used: frozenset[str]


class NearestTests:
    """The quick tests of the rooms of one checkout."""

    def __init__(self, checkout: Path) -> None:
        self.source = [one for room in ROOMS for one in _functions(checkout, f"{room}/**/*.py")]
        self.tests: dict[str, list[Function]] = {}
        for one in (one for room in ROOMS for one in _functions(checkout, f"tests/{room}/test_*.py")):
            self.tests.setdefault(one.file, []).append(one)

    def to(self, file: str, function: str) -> list[list[str]]:
        """The tests in parts (PARTS) of some files each, the nearest first."""
        holder, _, method = function.partition(".")
        in_class = holder.lstrip("_")[:1].isupper() and method
        away = _distances({method if in_class and not method.startswith("__") else holder}, self.source)
        levels = range(max(away.values()) + 1)
        near = {}
        for test_file, own in self.tests.items():
            reach = {
                level: _distances({name for name, far in away.items() if far <= level}, own).keys() for level in levels
            }
            tests = [one.name for one in own if one.name.startswith("test_") and one.name in reach[levels[-1]]]
            if tests:
                near[test_file] = {one: next(level for level in levels if one in reach[level]) for one in tests}
        room, words = file.split("/")[0], set(Path(file).stem.split("_"))

        def order(test_file: str) -> tuple[bool, int, int]:
            """By room or name, then by distance; a file with another name, or without the class, is a call farther."""
            apart = not words & set(Path(test_file).stem.split("_"))
            other = test_file.split("/")[1] != room
            strange = bool(in_class) and not any(holder in one.used for one in self.tests[test_file])
            return other and apart, min(near[test_file].values()) + apart + strange, -len(near[test_file])

        ranked = sorted(near, key=order)
        return [
            [f"{one}::{name}" for one in ranked[start:end] for name in sorted(near[one], key=near[one].__getitem__)]
            for start, end in pairwise(PARTS)
        ]


def assigned(node: ast.AST) -> str:
    """The constant that a statement defines, or nothing."""
    match node:
        case ast.Assign(targets=[ast.Name(id=name), *_]) | ast.AnnAssign(target=ast.Name(id=name)):
            return name
    return ""


def _functions(checkout: Path, pattern: str) -> Iterator[Function]:
    for path in sorted(checkout.glob(pattern)):
        for outer in ast.parse(path.read_text()).body:
            for one in outer.body if isinstance(outer, ast.ClassDef) else [outer]:
                name = one.name if isinstance(one, ast.FunctionDef) else assigned(one)
                if isinstance(outer, ast.ClassDef) and name.startswith("__"):
                    name = outer.name
                used = {node.id for node in ast.walk(one) if isinstance(node, ast.Name)}
                used |= {node.attr for node in ast.walk(one) if isinstance(node, ast.Attribute)}
                used |= {node.arg for node in ast.walk(one) if isinstance(node, ast.arg)}
                if name:
                    yield Function(path.relative_to(checkout).as_posix(), name, frozenset(used - {name}))


def _distances(names: set[str], within: list[Function]) -> dict[str, int]:
    """How many calls lead from each function to one of these names, at least."""
    away, level, last = dict.fromkeys(names, 0), 0, names
    while last:
        level += 1
        last = {one.name for one in within if one.used & last} - set(away)
        away |= dict.fromkeys(last, level)
    return away
