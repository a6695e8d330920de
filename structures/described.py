"""Signatures as declarations: they give the checks of arguments, the plain data of origins, and the kinds of cases."""

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, is_dataclass
from functools import cached_property, partial, wraps
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, dataclass_transform, get_args, get_origin, get_type_hints

from structures.checks import instance
from structures.quantities import Quantity

Thing = TypeVar("Thing", bound=Callable[..., Any])

_ALL: dict[tuple[str, str], "Described"] = {}
"""All descriptions by module and name. A cell of a notebook that runs again replaces its earlier definition."""


@dataclass(frozen=True)
class Parameter:
    """A parameter: its type without None and notes, its notes (from Annotated), its default, whether it may be None."""

    name: str
    type: Any
    notes: tuple[Any, ...]
    default: Any
    may_be_none: bool

    @property
    def required(self) -> bool:
        """True if it has no default."""
        return self.default is inspect.Parameter.empty

    @cached_property
    def members(self) -> list[tuple[Any, tuple[Any, ...]]]:
        """The types of a union, each with its notes; empty for a single type."""
        return [noted(member) for member in get_args(self.type)] if get_origin(self.type) is Union else []

    @cached_property
    def quantity(self) -> Quantity | None:
        """Its quantity, if it is or may be a number."""
        notes = [*self.notes, *(note for _, own in self.members for note in own)]
        return next((note for note in notes if isinstance(note, Quantity)), None)

    def checked(self, value: Any) -> Any:
        """Return an argument that fits the annotation, a number as a float; raise a ValueError otherwise."""
        kind, notes = self.type, self.notes
        if self.members:
            # isinstance() cannot tell whether an object fits a protocol.
            plain = [member for member, own in self.members if not own and inspect.isclass(member)]
            if any(isinstance(value, member) for member in plain if not getattr(member, "_is_protocol", False)):
                return value
            kind, notes = next((member for member in self.members if member[1]), (Any, ()))
        checks = [note for note in notes if hasattr(note, "check")]
        for note in checks:
            value = note.check(self.name, value)
        if kind in (str, bool) and not checks:
            instance(self.name, value, kind, "a text" if kind is str else "True or False")
        elif type(value) is not kind and (entry := description(kind)) and inspect.isclass(kind):
            instance(self.name, value, kind, entry.what)
        return value


class Described:
    """A class or a function with its parameters, and its names in messages, origins and case files."""

    def __init__(self, target: Any, what: str = "", called: str = "", also: tuple[str, ...] = ()) -> None:
        self.target, self.name, self.also = target, target.__name__, also
        self.kind = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", self.name).lower()
        """Its name in case files: linear_dashpot for LinearDashpot."""
        self.called = called or self.kind
        self.what = what or f"{'an' if self.name[0] in 'AEIOU' else 'a'} {self.name}"

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """Its parameters by name."""
        is_class = inspect.isclass(self.target)
        call = inspect.unwrap(self.target.__init__ if is_class else self.target)
        hints = {**_hints(call), **_hints(self.target)}
        found = {}
        for name, argument in list(inspect.signature(call).parameters.items())[is_class:]:
            hint = hints.get(name, argument.annotation)
            found[name] = Parameter(name, *noted(hint), argument.default, NoneType in get_args(hint))
        return found

    @property
    def makes(self) -> Any:
        """The class itself, or the return type of the function."""
        return self.target if inspect.isclass(self.target) else _hints(self.target).get("return")

    @property
    def builds(self) -> bool:
        """Whether it makes a new object; a function that changes a structure takes one as an argument."""
        return all(parameter.type is not self.makes for parameter in self.parameters.values())

    def checked(self, values: Mapping[str, Any], owner: str) -> dict[str, Any]:
        """Return the given arguments as the checks convert them: numbers become floats.

        The first wrong argument raises a ValueError. If all are right, warnings name improbable ones.
        """
        changed: dict[str, Any] = {}
        for name, parameter in self.parameters.items():
            value = values.get(name, parameter.default)
            # A default such as None or infinity need not be a valid value of the quantity.
            if value is parameter.default or (type(value) is float and value == parameter.default):
                continue
            if value is not None or not parameter.may_be_none:
                changed[name] = parameter.checked(value)
        for name, value in changed.items():
            quantity = self.parameters[name].quantity
            if quantity is not None and isinstance(value, float):
                quantity.warn(owner, name, value)
        return changed


@dataclass_transform(frozen_default=True)
def described(target: Thing) -> Thing:
    """Declare a class or a function as a part of hertzlink, by its signature.

    A class becomes a frozen dataclass. Arguments are checked, and a number that is probably in another unit causes a
    warning. The `origin` of a structure records the arguments of the function that made it. Case files use the part by
    its name: `kind = "cantilever"` with `hertzlink run case.toml --with mine.py`.

    Parameters
    ----------
    target : class or function
        Annotations declare its parameters: `length: hl.quantities.Length`, `material: hl.Material`.

    Returns
    -------
    class or function
        The same, with checks. A parameter without an annotation raises a ValueError.

    Examples
    --------
    >>> @hl.described
    ... def block(side: hl.quantities.Length, material: hl.Material) -> hl.Structure:
    ...     mass = material.density * side**3
    ...     return hl.Structure([[mass]], [[0.0]], None, [1.0], 0.0, hl.Surface(material))
    >>> block(-1.0, hl.PTFE)
    Traceback (most recent call last):
    ValueError: side = -1.0: must be a positive number of m
    """
    return _described(target)  # type: ignore[no-any-return]


@dataclass_transform(frozen_default=True)
def described_as(
    what: str = "", called: str = "", also: tuple[str, ...] = (), eq: bool = True
) -> Callable[[Thing], Thing]:
    """Return `described` with settings.

    what: the words with which messages ask for it. called: its kind in the origin of a structure. also: other kinds
    that a case file may use for it. eq: whether objects with equal fields are equal; arrays cannot be compared so.
    """

    return partial(_described, what=what, called=called, also=also, eq=eq)


def checked_call(target: Thing) -> Thing:
    """Return a function or method that checks its arguments by their annotations; case files cannot use it."""
    made: Any = _function(target)
    made.__described__ = Described(made)
    return made  # type: ignore[no-any-return]


def description(thing: Any) -> Described | None:
    """Return the description of a class or a function; None if it has none."""
    return vars(thing).get("__described__") if hasattr(thing, "__dict__") else None


def registered() -> tuple[Described, ...]:
    """Return all descriptions."""
    return tuple(_ALL.values())


def noted(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return the type of an annotation, without None, and its notes."""
    if get_origin(hint) is Annotated:
        kind, more = noted(get_args(hint)[0])
        return kind, (*more, *hint.__metadata__)
    if get_origin(hint) in (Union, UnionType):
        members = [member for member in get_args(hint) if member is not NoneType]
        return noted(members[0]) if len(members) == 1 else (Union[tuple(members)], ())  # noqa: UP007
    return hint, ()


def _hints(target: Any) -> dict[str, Any]:
    try:
        return get_type_hints(target, include_extras=True)
    except NameError:  # a name that only type checkers import
        return dict(inspect.get_annotations(target))


def _described(target: Any, what: str = "", called: str = "", also: tuple[str, ...] = (), eq: bool = True) -> Any:
    """Return a class as a frozen dataclass, or a function, with checks, and note its description."""
    product: Any = target
    if not inspect.isclass(target):
        product = _function(target)
    elif "__init__" in vars(target):  # its arguments need not be its fields
        product.__init__ = checked_call(product.__init__)
    else:
        before = getattr(target, "__post_init__", None)

        def __post_init__(self: Any) -> None:
            # Only the most derived class checks, so that no argument is checked twice.
            entry: Described = type(self).__described__
            if entry.target is product:
                kind, own = type(self).__name__, vars(self).get("name")
                for name, value in entry.checked(vars(self), f"{kind} {own!r}" if own else kind).items():
                    object.__setattr__(self, name, value)
            if before is not None:
                before(self)

        product.__post_init__ = __post_init__
        inherited = target.__repr__ is not object.__repr__ and not hasattr(target.__repr__, "__wrapped__")
        product = dataclass(frozen=True, eq=eq, repr=not inherited)(target)
    for name, parameter in inspect.signature(product).parameters.items():
        if parameter.annotation is parameter.empty:
            raise ValueError(
                f"{target.__name__}: {name} must have an annotation, such as {name}: float or "
                f"{name}: hl.quantities.Length, by which its arguments are checked"
            )
    product.__described__ = _ALL[target.__module__, target.__qualname__] = Described(product, what, called, also)
    return product


def _function(target: Any) -> Any:
    signature = inspect.signature(target)

    @wraps(target)
    def called(*arguments: Any, **named: Any) -> Any:
        try:
            bound = signature.bind(*arguments, **named)
        except TypeError:
            return target(*arguments, **named)  # Python says what is wrong with the call
        entry: Described = called.__described__  # type: ignore[attr-defined]
        bound.arguments.update(entry.checked(bound.arguments, entry.name))
        product = target(*bound.args, **bound.kwargs)
        # The type comes first, because hasattr() is slow on a Dataset that lacks the name.
        has_origin = is_dataclass(product) and hasattr(product, "origin")
        if has_origin and entry.builds and product.origin.get("kind", entry.called) == entry.called:
            bound.apply_defaults()
            plain = {name: as_argument(value) for name, value in bound.arguments.items()} | dict(product.origin)
            stated = {name: value for name, value in plain.items() if value is not None}
            object.__setattr__(product, "origin", {"kind": entry.called, **stated})
        return product

    return called


def as_argument(value: Any) -> Any:
    """Return an argument as plain data."""
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return [as_argument(member) for member in value] if isinstance(value, list | tuple) else value
