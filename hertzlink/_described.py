"""All modules that describe what users construct: cases and reports read what they describe."""

from importlib import import_module

from hertzlink._names import HOME, PUBLIC, listed_in
from hertzlink._rooms import ROOMS

WITHOUT_NAME = ("particles.laws.axisymmetric",)
"""Modules of parts without a public name: the law that `computed_law` returns."""


def describing() -> list[str]:
    """Return the modules of public names that describe parts, by their sources: to import all would load all."""
    spaces = [listed_in(HOME / f"{name}.py") for name, module in PUBLIC.items() if module == "hertzlink"]
    modules = {module for names in (PUBLIC, *spaces) for module in names.values()}
    files = {name: (HOME.parent / name.replace(".", "/")).with_suffix(".py") for name in sorted(modules)}
    inside = {name: file for name, file in files.items() if name.partition(".")[0] in ROOMS and file.is_file()}
    uses = "from structures.described import"
    return [*(name for name, file in inside.items() if uses in file.read_text("utf-8")), *WITHOUT_NAME]


for _module in describing():
    import_module(_module)
