"""What help() shows of public functions and classes: the names that a user types, and signatures that can be read."""

import inspect
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

from hertzlink._rooms import ROOMS

LINE = 80
"""Columns; a longer signature is written with one parameter a line."""


def name_for_users(value: Any, package: str, name: str) -> None:
    """Give a public function or class the module and name that a user types, and a readable signature."""
    if callable(value) and value.__module__.partition(".")[0] in (*ROOMS, "hertzlink"):
        value.__module__, value.__name__, value.__qualname__ = package, name, name
        for function in _functions(value):
            function.__signature__ = ShortSignature.of(function)


def _functions(value: Any) -> Iterator[Any]:
    """The function itself, or the public functions and the initializer of a class that the packages define."""
    if not inspect.isclass(value):
        yield value
        return
    for name, member in vars(value).items():
        function = getattr(member, "__func__", member)
        if not inspect.isfunction(function) or (name.startswith("_") and name not in ("__init__", "__new__")):
            continue
        if function.__module__.partition(".")[0] in ROOMS or (name == "__new__" and issubclass(value, tuple)):
            yield function


class ShortParameter(inspect.Parameter):
    """A parameter that is printed with the short name of its type."""

    def __str__(self) -> str:
        text = super().__str__()
        if self.annotation is not self.empty:
            text = text.replace(inspect.formatannotation(self.annotation), short_type(self.annotation), 1)
        return text.replace(repr(self.default), self.default.__name__) if inspect.isfunction(self.default) else text


class ShortSignature(inspect.Signature):
    """A signature that is printed with short names of types, and with one parameter a line where it is long."""

    @classmethod
    def of(cls, function: Any) -> "ShortSignature":
        """That of a function, with its real annotations."""
        known = inspect.signature(function)
        parameters = [
            ShortParameter(one.name, one.kind, default=one.default, annotation=one.annotation)
            for one in known.parameters.values()
        ]
        return cls(parameters, return_annotation=known.return_annotation)

    def __str__(self) -> str:
        parts, starred = list[str](), False
        for one in self.parameters.values():
            if one.kind is one.KEYWORD_ONLY and not starred:
                parts.append("*")
            starred = starred or one.kind in (one.KEYWORD_ONLY, one.VAR_POSITIONAL)
            parts.append(str(one))
        result = "" if self.return_annotation is self.empty else f" -> {short_type(self.return_annotation)}"
        line = f"({', '.join(parts)}){result}"
        return line if len(line) <= LINE else f"(\n    {f',{chr(10)}    '.join(parts)},\n){result}"

    def format(self, **_: Any) -> str:
        """What Python 3.13 and later call instead of str."""
        return str(self)


@cache
def _expanded() -> dict[str, str]:
    """Short names of types that Python writes out in full, up to 200 columns each, without modules."""
    from numpy.typing import ArrayLike

    from coupling.interface import Facing
    from particles.chain import LawOfPair
    from structures.structure import Vector

    types = {"ArrayLike": ArrayLike, "Facing": Facing, "LawOfPair": LawOfPair, "ndarray": Vector}
    texts = {name: _without_modules(inspect.formatannotation(one)) for name, one in types.items()}
    return {re.sub(r"^Union\[(.*)\]$", r"\1", text): name for name, text in texts.items()}


def short_type(annotation: Any) -> str:
    """A type in a signature, without modules and with short names."""
    text = _without_modules(annotation if isinstance(annotation, str) else inspect.formatannotation(annotation))
    for expanded, name in _expanded().items():
        text = text.replace(f"Union[{expanded}]", name).replace(expanded, name)
    return re.sub(r"Union\[([^][]*)\]", lambda found: found[1].replace(", ", " | "), text)


def _without_modules(text: str) -> str:
    return re.sub(r"\b(?:[A-Za-z_]\w*\.)+(?=\w)", "", text).replace("NoneType", "None")
