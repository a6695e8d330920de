"""Wrappers of public functions and classes: hints for wrong arguments, and signatures that can be read."""

import inspect
import re
import sys
from functools import cache
from typing import Any

from hertzlink._hints import hinting, missing
from hertzlink._names import PUBLIC, namespaces
from hertzlink._rooms import ROOMS
from structures.described import without_notes

OURS = (*ROOMS, "hertzlink")

LINE = 80
"""Columns; a longer signature is written with one parameter a line."""


def for_users(value: Any, name: str, package: str = "hertzlink") -> Any:
    """Return what a user gets: of a public function a wrapper that names a right argument, all else as it is.

    Classes name a right argument too, also those of what functions return. The packages call their functions without
    the wrapper.
    """
    for public, module in PUBLIC.items():
        if module in sys.modules:
            _hint_in_class(vars(sys.modules[module]).get(public), public)
    if not inspect.isfunction(value) or not _is_ours(value):
        _hint_in_class(value, name)
        return value
    wrapper = _hinting(value, f"{package}.{name}".removeprefix("hertzlink."))
    # Pickle finds the wrapper by them.
    wrapper.__module__, wrapper.__name__, wrapper.__qualname__ = package, name, name
    return wrapper


def offer(namespace: str) -> None:
    """Give a namespace the functions that a user gets, and an error with the nearest name; it calls this at its end."""
    names, space = vars(sys.modules[namespace]), namespace.rpartition(".")[2]
    names.update({name: for_users(names[name], name, namespace) for name in namespaces()[space]})

    def missing_here(name: str) -> object:
        raise missing(name, space)

    names["__getattr__"] = missing_here


def _is_ours(value: Any) -> bool:
    return value.__module__.partition(".")[0] in OURS


def _hint_in_class(value: Any, name: str) -> None:
    """Let a public class and those that it derives from name a right argument."""
    if inspect.isclass(value) and _is_ours(value):
        for kind in value.__mro__:
            if _is_ours(kind) and not getattr(kind, "_is_protocol", False):
                _hint_in(kind, name)


def _hint_in(kind: Any, name: str) -> None:
    """Wrap the initializer and the public methods that a class defines."""
    for called, member in list(vars(kind).items()):
        function = getattr(member, "__func__", member)
        if not inspect.isfunction(function) or isinstance(getattr(function, "__signature__", None), ShortSignature):
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


class ShortSignature(inspect.Signature):
    """A signature that is printed with the short names of its types, and with line breaks if it is long."""

    @classmethod
    def of(cls, function: Any) -> "ShortSignature":
        """Return that of a function, with its real annotations."""
        signature = inspect.signature(function)
        parameters = [p.replace(annotation=without_notes(p.annotation)) for p in signature.parameters.values()]
        return cls(parameters, return_annotation=signature.return_annotation)

    def __str__(self) -> str:
        parts, starred = list[str](), False
        for parameter in self.parameters.values():
            if parameter.kind is parameter.KEYWORD_ONLY and not starred:
                parts.append("*")
            starred = starred or parameter.kind in (parameter.KEYWORD_ONLY, parameter.VAR_POSITIONAL)
            parts.append(short(str(parameter)))
        returned = self.return_annotation
        result = "" if returned is self.empty else f" -> {short(inspect.formatannotation(returned))}"
        line = f"({', '.join(parts)}){result}"
        return line if len(line) <= LINE else f"(\n    {f',{chr(10)}    '.join(parts)},\n){result}"

    def format(self, **_: Any) -> str:
        """Return what Python 3.13 and later call instead of str."""
        return str(self)


@cache
def _expanded() -> dict[str, str]:
    """Return the short names of types that Python writes out in full, up to 200 columns each, without modules."""
    from numpy.typing import ArrayLike

    from coupling.interface import Facing
    from particles.chain import LawOfPair
    from structures.structure import Vector

    types = {"ArrayLike": ArrayLike, "Facing": Facing, "LawOfPair": LawOfPair, "ndarray": Vector}
    texts = {name: _without_modules(inspect.formatannotation(kind)) for name, kind in types.items()}
    return {re.sub(r"^Union\[(.*)\]$", r"\1", text): name for name, text in texts.items()}


def short(text: str) -> str:
    """Return the types in a text without modules and with short names."""
    text = _without_modules(re.sub(r"<(?:class|function) '?([\w.]+)'?(?: at 0x\w+)?>", r"\1", text))
    for expanded, name in _expanded().items():
        text = text.replace(f"Union[{expanded}]", name).replace(expanded, name)
    return re.sub(r"Union\[([^][]*)\]", lambda match: match[1].replace(", ", " | "), text)


def _without_modules(text: str) -> str:
    return re.sub(r"\b(?:[A-Za-z_]\w*\.)+(?=\w)", "", text).replace("NoneType", "None")
