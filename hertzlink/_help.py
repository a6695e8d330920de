"""What help() shows of public functions and classes: the names that a user types, and signatures that can be read."""

import inspect
import re
from functools import cache
from typing import Any

from hertzlink._hints import hinting
from hertzlink._rooms import ROOMS

OURS = (*ROOMS, "hertzlink")

LINE = 80
"""Columns; a longer signature is written with one parameter a line."""


def for_users(value: Any, package: str, name: str) -> Any:
    """What a user gets: of a public function a wrapper that names a right argument, all else as it is.

    The packages call their functions without it.
    """
    if not inspect.isfunction(value) or value.__module__.partition(".")[0] not in OURS:
        return value
    wrapper = _hinting(value, f"{package}.{name}".removeprefix("hertzlink."))
    wrapper.__module__, wrapper.__name__, wrapper.__qualname__ = package, name, name
    return wrapper


def name_class(value: Any, package: str, name: str) -> None:
    """Give a public class the module and name that a user types; its methods name a right argument."""
    if not inspect.isclass(value) or value.__module__.partition(".")[0] not in OURS:
        return
    for kind in value.__mro__:
        if kind.__module__.partition(".")[0] in OURS and not getattr(kind, "_is_protocol", False):
            _hint_in(kind, name)
    value.__module__, value.__name__, value.__qualname__ = package, name, name


def _hint_in(kind: Any, name: str) -> None:
    """Wrap the initializer and the public methods that a class defines."""
    for called, member in list(vars(kind).items()):
        function = getattr(member, "__func__", member)
        if not inspect.isfunction(function) or hasattr(function, "__wrapped__"):
            continue
        if called in ("__init__", "__new__"):
            setattr(kind, called, _hinting(function, name, method=True))
        elif not called.startswith("_"):
            wrapper = _hinting(function, f"{name}.{called}", not isinstance(member, staticmethod))
            setattr(kind, called, wrapper if member is function else type(member)(wrapper))


def _hinting(function: Any, name: str, method: bool = False) -> Any:
    wrapper: Any = hinting(function, name, method)
    wrapper.__signature__ = ShortSignature.of(function)
    return wrapper


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
