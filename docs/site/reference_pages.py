"""The reference of the site: one page for each public name of `hertzlink/__init__.pyi`, and of each namespace."""

import inspect
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any, get_args, get_type_hints

import hertzlink
from hertzlink._names import PUBLIC, namespaces

GROUPS = {
    "Chains, beads and losses": ("particles",),
    "Structures and materials": ("structures",),
    "Plates": ("plates",),
    "Runs": ("coupling.cosimulation", "coupling.interface", "coupling.participant", "coupling.plan"),
    "Coupling schemes": ("coupling.black_box",),
    "Waves, signals and measures": ("coupling.results", "coupling.signals"),
    "Sweeps and batches": ("coupling.sweeps",),
    "Identification": ("coupling.inference",),
    "Other programs": ("coupling.ports",),
}
"""Headings of the index, and the modules that define what stands below them."""

RETURNED = ("coupling.results", "coupling.inference", "particles.laws", "plates.critical_distance")
"""Where classes are defined that only functions return; the pages of these functions describe them."""


def write(folder: Path) -> None:
    """Write all pages again."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    lines = ["Reference", "=========", "", "What ``import hertzlink as hl`` offers. Numbers are SI throughout.", ""]
    left = {name for name, module in PUBLIC.items() if module != "hertzlink"}
    for heading, modules in GROUPS.items():
        names = sorted((one for one in left if PUBLIC[one].startswith(modules)), key=str.lower)
        left -= set(names)
        lines += [heading, "-" * len(heading), "", *_rows(names, folder)]
    if left:
        raise ValueError(f"GROUPS in {__file__}: has no heading for {', '.join(sorted(left))}")
    for space in sorted(namespaces()):
        module: ModuleType = getattr(hertzlink, space)
        title = f"hertzlink.{space}"
        lines += [title, "-" * len(title), "", _first_line(module), ""]
        lines += _rows([f"{space}.{name}" for name in sorted(namespaces()[space], key=str.lower)], folder)
    (folder / "index.rst").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _rows(names: list[str], folder: Path) -> list[str]:
    """A table of names and first lines, and the pages that it leads to."""
    if not names:
        return []
    lines = [".. list-table::", "   :widths: 30 70", ""]
    for name in names:
        value = _value(name)
        lines += [f"   * - :doc:`{name}`", f"     - {_first_line(value)}"]
        (folder / f"{name}.rst").write_text(_page(name, value), encoding="utf-8")
    return [*lines, "", ".. toctree::", "   :hidden:", "", *(f"   {name}" for name in names), ""]


def _page(name: str, value: object) -> str:
    if isinstance(value, type):
        directive, options = (
            "autoclass",
            "   :members:\n   :inherited-members: object, tuple, Exception, BaseException\n",
        )
    elif inspect.isroutine(value):
        directive, options = "autofunction", ""
    elif isinstance(value, type(hertzlink.quantities.Length)):
        directive, options = "data", f"\n   {_first_line(value)}\n"
    else:
        directive, options = "autodata", "   :no-value:\n"
    inner = name.rpartition(".")[2]
    page = f"{inner}\n{'=' * len(inner)}\n\n.. {directive}:: hertzlink.{name}\n{options}"
    for kind in _returned(value) if inspect.isroutine(value) else []:
        page += f"\n.. autoclass:: {kind.__module__}.{kind.__name__}\n   :members:\n   :no-index:\n"
    return page


def _returned(function: Any) -> list[type]:
    """The classes that a function returns, and those in them, which have no page of their own."""
    public = {value for value in map(_value, hertzlink.__all__) if isinstance(value, type)}
    classes, left = list[type](), [_hints(function).get("return")]
    for hint in left:
        left += get_args(hint)
        if isinstance(hint, type) and hint.__module__.startswith(RETURNED) and hint not in {*public, *classes}:
            classes.append(hint)
            left += [
                one for one in _hints(hint).values() if isinstance(one, type) and one.__module__ == hint.__module__
            ]
            left += [inner for one in _hints(hint).values() for inner in get_args(one)]
    return classes


def _hints(thing: Any) -> dict[str, Any]:
    try:
        return get_type_hints(thing)
    except NameError:  # of a type that is imported for type checkers only
        return {}


def _value(name: str) -> object:
    value: object = hertzlink
    for part in name.split("."):
        value = getattr(value, part)
    return value


def _first_line(value: object) -> str:
    if isinstance(value, type(hertzlink.quantities.Length)):
        quantity = value.__metadata__[0]
        return f"An annotation: {quantity.noun} in {quantity.unit}; case files also take “{quantity.example}”."
    if (name := getattr(value, "name", None)) and not isinstance(value, type | ModuleType):
        return f"{type(value).__name__}: {name}"
    return (inspect.getdoc(value) or "").split("\n\n")[0].replace("\n", " ")
