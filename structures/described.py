"""What users construct, described once by its signature: checked arguments, plain data, and a kind for case files."""

import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, is_dataclass
from functools import cached_property, wraps
from math import inf
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, dataclass_transform, get_args, get_origin, get_type_hints

from structures.checks import instance
from structures.quantities import Quantity

Thing = TypeVar("Thing", bound=Callable[..., Any])

_ALL: dict[tuple[str, str], "Described"] = {}
"""All that is described, by module and name: what is defined again, as in a notebook, replaces what it was."""


@dataclass(frozen=True)
class Parameter:
    """A parameter: its type without None and without notes, its notes, its default, and whether it may be None."""

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
        """The types that it may have, where there are several, each with its notes."""
        return [noted(member) for member in get_args(self.type)] if get_origin(self.type) is Union else []

    @cached_property
    def quantity(self) -> Quantity | None:
        """Its quantity, where it is, or may be, a number."""
        notes = [*self.notes, *(note for _, own in self.members for note in own)]
        return next((note for note in notes if isinstance(note, Quantity)), None)


class Described:
    """A class or a function, and what its signature says of it."""

    def __init__(self, target: Any, what: str = "", called: str = "", also: tuple[str, ...] = ()) -> None:
        self.target, self.name, self.also = target, target.__name__, also
        self.called = called or self.kind
        self.what = what or f"{'an' if self.name[0] in 'AEIOU' else 'a'} {self.name}"

    @property
    def kind(self) -> str:
        """Its name as case files spell it: linear_dashpot of LinearDashpot."""
        return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", self.name).lower()

    @cached_property
    def summary(self) -> str:
        """The first sentence of its docstring."""
        return " ".join((inspect.getdoc(self.target) or "").partition("\n\n")[0].split())

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """Its parameters by name."""
        is_class = inspect.isclass(self.target)
        call = inspect.unwrap(self.target.__init__ if is_class else self.target)
        hints = {**_hints(call), **_hints(self.target)}
        arguments = list(inspect.signature(call).parameters.values())[is_class:]
        of = {argument.name: hints.get(argument.name, argument.annotation) for argument in arguments}
        return {
            argument.name: Parameter(
                argument.name, *noted(of[argument.name]), argument.default, NoneType in get_args(of[argument.name])
            )
            for argument in arguments
        }

    @cached_property
    def units(self) -> dict[str, str]:
        """The units of its parameters that are numbers, by name."""
        return {parameter.name: parameter.quantity.unit for parameter in self.parameters.values() if parameter.quantity}

    @cached_property
    def makes(self) -> Any:
        """The class itself, or what the function returns."""
        return self.target if inspect.isclass(self.target) else _hints(self.target).get("return")

    @cached_property
    def builds(self) -> bool:
        """Whether it makes something anew; a function that changes a structure takes one."""
        return all(parameter.type is not self.makes for parameter in self.parameters.values())

    @cached_property
    def _looks(self) -> list[tuple[str, Parameter, Any, float, float]]:
        """Name, default and ends of each parameter: between these its numbers need no further look."""
        ends = {
            name: parameter.quantity.usual if parameter.quantity else (inf, -inf)
            for name, parameter in self.parameters.items()
        }
        return [(name, parameter, parameter.default, *ends[name]) for name, parameter in self.parameters.items()]

    def checked(self, values: Mapping[str, Any], owner: str) -> dict[str, Any]:
        """Return what checks change of the arguments: numbers become floats.

        A ValueError names the first argument that is wrong; then warnings say what is odd.
        """
        changed: dict[str, Any] = {}
        odd: list[tuple[Quantity, str, Any]] = []
        for name, parameter, default, low, high in self._looks:
            value = values.get(name, default)
            if value is default or (type(value) is float and low < value < high):
                continue
            # A default that stands for something else, as None or infinity, is no value of the quantity.
            if _same(value, default) or (value is None and parameter.may_be_none):
                continue
            new = _checked(name, value, parameter)
            if new is not value:
                changed[name] = new
            if parameter.quantity is not None and isinstance(new, float):
                odd.append((parameter.quantity, name, new))
        for quantity, name, value in odd:
            quantity.warn(owner, name, value)
        return changed


@dataclass_transform(frozen_default=True)
def described(target: Thing) -> Thing:
    """Describe a class or a function by its signature: a part that hertzlink checks, stores and varies.

    A class becomes a frozen dataclass. Parameters with a quantity, such as hl.Length, are checked, become floats, and
    warn where the number is probably in another unit. A function that returns a Structure notes its arguments in the
    structure's origin. Both have a kind, their name in case files: `kind = "cantilever"` with
    `hertzlink run case.toml --with mine.py`.

    Parameters
    ----------
    target : class or function
        Its annotations say what its parameters are: `length: hl.Length`, `material: hl.Material`.

    Returns
    -------
    class or function
        The same, with checks.

    Raises
    ------
    ValueError
        If a parameter has no annotation.

    Examples
    --------
    >>> import hertzlink as hl
    >>> @hl.described
    ... def block(side: hl.Length, material: hl.Material) -> hl.Structure:
    ...     mass = material.density * side**3
    ...     return hl.Structure([[mass]], [[0.0]], None, [1.0], 0.0, hl.Surface(material))
    >>> block(0.02, hl.PTFE).origin["side"]
    0.02
    >>> block(-1.0, hl.PTFE)
    Traceback (most recent call last):
    ValueError: side = -1.0: must be a positive number of m
    """
    return described_as()(target)


@dataclass_transform(frozen_default=True)
def described_as(
    what: str = "", called: str = "", also: tuple[str, ...] = (), eq: bool = True
) -> Callable[[Thing], Thing]:
    """Return `described` with settings of its own.

    what: the words in which messages ask for it. called: its kind in the origin of a structure. also: other kinds that
    a case file may use for it. eq: whether objects of a class with equal fields are equal, which arrays do not say.
    """

    def describe(target: Any) -> Any:
        place = target.__module__, target.__qualname__
        product = _class(target, eq) if inspect.isclass(target) else _function(target)
        for name, parameter in inspect.signature(product).parameters.items():
            if parameter.annotation is parameter.empty:
                raise ValueError(
                    f"{target.__name__}: {name} has no annotation, must have one, such as {name}: hl.Length or {name}: "
                    "float, by which its arguments are checked"
                )
        _ALL[place] = product.__described__ = Described(product, what, called, also)
        return product

    return describe


def checked_call(target: Thing) -> Thing:
    """Return a function or method that checks its arguments by their annotations, and is no part of a case."""
    made: Any = _function(target)
    made.__described__ = Described(made)
    return made  # type: ignore[no-any-return]


def description(thing: Any) -> Described | None:
    """Return what is known of a class or a function; None where it is not described."""
    entry = vars(thing).get("__described__") if hasattr(thing, "__dict__") else None
    return entry if isinstance(entry, Described) else None


def registered() -> tuple[Described, ...]:
    """Return all that is described."""
    return tuple(_ALL.values())


def of_family(base: type) -> Iterator[Described]:
    """Yield what makes an object of a class."""
    for entry in registered():
        if inspect.isclass(entry.makes) and base in entry.makes.__mro__ and not inspect.isabstract(entry.makes):
            yield entry


def as_argument(value: Any) -> Any:
    """Return an argument as plain data."""
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return [as_argument(member) for member in value] if isinstance(value, list | tuple) else value


def _class(target: Any, eq: bool) -> Any:
    if "__init__" in vars(target):  # what it makes of its arguments are no fields
        target.__init__ = checked_call(target.__init__)
        return target
    before = getattr(target, "__post_init__", None)

    def __post_init__(self: Any) -> None:
        # Of classes that derive from each other the last one that is described checks all.
        entry: Described = type(self).__described__
        if entry.target is product:
            called = vars(self).get("name", "")
            owner = f"{type(self).__name__} {called!r}" if called else type(self).__name__
            for name, value in entry.checked(vars(self), owner).items():
                object.__setattr__(self, name, value)
        if before is not None:
            before(self)

    target.__post_init__ = __post_init__
    inherited = target.__repr__ is not object.__repr__ and not hasattr(target.__repr__, "__wrapped__")
    product = dataclass(frozen=True, eq=eq, repr=not inherited)(target)
    return product


def _function(target: Any) -> Any:
    parameters = inspect.signature(target).parameters
    placed = [name for name, parameter in parameters.items() if parameter.kind is parameter.POSITIONAL_OR_KEYWORD]
    further = {name for name, parameter in parameters.items() if parameter.kind is parameter.VAR_KEYWORD}
    needed = {name for name, parameter in parameters.items() if parameter.default is parameter.empty} - further

    @wraps(target)
    def called(*arguments: Any, **named: Any) -> Any:
        entry: Described = called.__described__  # type: ignore[attr-defined]
        # As Signature.bind does, which takes as long as a short function.
        values = {**dict(zip(placed, arguments, strict=False)), **named}
        misfits = not needed <= values.keys() or not (further or values.keys() <= parameters.keys())
        if misfits or len(values) < len(arguments) + len(named):
            return target(*arguments, **named)  # Python names what is wrong with the call.
        values |= entry.checked(values, entry.name)
        product = target(**values)
        # A Dataset searches its names for what resembles one that it does not have: the type comes first.
        has_origin = is_dataclass(product) and hasattr(product, "origin")
        if has_origin and entry.builds and product.origin.get("kind", entry.called) == entry.called:
            stated = {name: values.get(name, parameter.default) for name, parameter in parameters.items()}
            plain = {name: as_argument(value) for name, value in stated.items()} | dict(product.origin)
            stated = {name: value for name, value in plain.items() if value is not None}
            object.__setattr__(product, "origin", {"kind": entry.called, **stated})
        return product

    return called


def _same(value: Any, default: Any) -> bool:
    """Return whether a value is the default: the same object, or an equal float; all NaN are equal."""
    floats = isinstance(value, float) and isinstance(default, float)
    return value is default or (floats and (value == default or (value != value and default != default)))


def _checked(name: str, value: Any, parameter: Parameter) -> Any:
    """Return an argument that is what its annotation says; raise a ValueError otherwise."""
    kind, notes = parameter.type, parameter.notes
    if parameter.members:
        if any(not noted_on and _is(value, member) for member, noted_on in parameter.members):
            return value
        kind, notes = next((member for member in parameter.members if member[1]), (Any, ()))
    for note in notes:
        value = note.check(name, value) if hasattr(note, "check") else value
    entry = description(kind) if inspect.isclass(kind) and type(value) is not kind else None
    if entry is not None:
        instance(name, value, kind, entry.what)
    elif kind in (str, bool) and not any(hasattr(note, "check") for note in notes):
        instance(name, value, kind, "a text" if kind is str else "True or False")
    return value


def _is(value: Any, kind: Any) -> bool:
    """Return whether a value is of a class; of a protocol nobody knows."""
    return inspect.isclass(kind) and not getattr(kind, "_is_protocol", False) and isinstance(value, kind)


def _hints(target: Any) -> dict[str, Any]:
    try:
        return get_type_hints(target, include_extras=True)
    except NameError:  # of a name that only type checkers import
        return dict(inspect.get_annotations(target))


def noted(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return the type of an annotation, without None, and what is noted on it."""
    if get_origin(hint) is Annotated:
        inner, *notes = get_args(hint)
        kind, more = noted(inner)
        return kind, (*more, *notes)
    if get_origin(hint) in (Union, UnionType):
        members = [member for member in get_args(hint) if member is not NoneType]
        return noted(members[0]) if len(members) == 1 else (Union[tuple(members)], ())  # noqa: UP007
    return hint, ()
