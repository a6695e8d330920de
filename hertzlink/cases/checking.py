"""The way from data to a checked case, or to a fault in plain words."""

from collections.abc import Mapping, Sequence
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, Tag, ValidationError
from pydantic_core import ErrorDetails

from hertzlink.cases.entry_paths import Path, entry, has, written
from hertzlink.cases.faults import Fault
from hertzlink.cases.model import CaseModel, case_model
from hertzlink.cases.parts import hint_of
from hertzlink.cases.units import shown
from structures.checks import count_of, nearest

KINDS = ("kind", "shape")
"""Entries that say which of several tables one is."""

SECTIONS = ("chain", "structure", "behind", "materials")
"""What can be varied. The section [run] holds for all runs."""

SECTIONS_OF_PATHS: tuple[Path, ...] = (("sensitivities",), ("sweep",), ("identify", "unknowns"))
"""Sections whose keys are paths of entries."""

FIRST = ("extra_forbidden", "case", "form")
"""Errors that explain others: a misspelt name makes the right one missing."""


def checked(data: Mapping[str, Any]) -> CaseModel:
    """Return the case that data mean; a Fault for the first entry that is wrong."""
    materials = data.get("materials")
    for section in SECTIONS_OF_PATHS:
        _check_quotes(data, section)
    try:
        return case_model().model_validate(
            data, context={"materials": materials if isinstance(materials, dict) else {}}
        )
    except ValidationError as error:
        faults = sorted(error.errors(include_url=False), key=lambda fault: fault["type"] not in FIRST)
        raise _fault(faults[0], data) from None


def _check_quotes(data: Mapping[str, Any], section: Path) -> None:
    """Raise a Fault for a path of an entry that lacks its quotes, so that TOML makes tables of it."""
    keys = entry(data, section) if has(data, section) else None
    for key in keys if isinstance(keys, dict) else ():
        path: Path = (key,)
        while isinstance(inner := entry(keys, path), dict) and inner and "from" not in inner:
            path = *path, next(iter(inner))
        if len(path) > 1 and "." not in key:
            raise Fault((*section, key), f'a path belongs in quotes: "{written(path)}" = …')


def value_at(model: Any, path: Path) -> Any:
    """Return the checked value at a path: numbers are SI."""
    for part in path:
        model = model[part] if isinstance(part, int) or isinstance(model, dict) else getattr(model, part)
    return model


def perhaps_at(model: Any, path: Path) -> Any:
    """Return the checked value at a path, None where there is none."""
    try:
        return value_at(model, path)
    except (AttributeError, KeyError, IndexError, TypeError):
        return None


def _fault(error: ErrorDetails, data: Any) -> Fault:
    loc, kind, value = error["loc"], error["type"], error.get("input")
    context: Mapping[str, Any] = error.get("ctx", {})
    path = _path(loc, data, kind in ("missing", "extra_forbidden"))
    if kind == "case":
        return Fault(path, str(context["message"]))
    if kind == "form":
        return Fault(path, f"{shown(value)} {error['msg']}")
    if kind == "missing":
        return Fault(path, f"is missing; {_hint(loc)}")
    if kind == "extra_forbidden":
        model = _type_at(loc[:-1])
        names = [field.alias or name for name, field in model.model_fields.items()] if model else []
        return Fault(path, f"is no entry here; {nearest(loc[-1], names, 20)}")
    if kind == "literal_error":
        choices = _choices(loc) or [
            choice.strip(" '") for choice in str(context["expected"]).replace(" or ", ",").split(",")
        ]
        return Fault(path, f"{shown(value)} is not possible; {nearest(value, choices)}")
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        name = str(context["discriminator"]).strip("'")
        choices = _tags(_annotation_at(loc), name)
        if kind == "union_tag_not_found":
            return Fault((*path, name), f"is missing; {nearest('', choices, 40)}")
        near = nearest(context["tag"], choices, 40)
        cure = "one of your own needs --with FILE.py that describes it"
        return Fault((*path, name), f'"{context["tag"]}" is no {name}; {near}; {cure}')
    if isinstance(value, str) and path and value in _tags(_annotation_at(loc), "kind"):
        return Fault(path, f'"{value}" must be a table; write {path[-1]} = {{ kind = "{value}" }}')
    return Fault(path, f"{shown(value)} {_wrong_type(kind, context, error['msg'])}{_example(loc)}")


def _wrong_type(kind: str, context: Mapping[str, Any], message: str) -> str:
    if kind in ("too_short", "too_long"):
        count = context.get("min_length", context.get("max_length"))
        return (
            f"has {count_of(context['actual_length'], 'entry')}; must have {'at least ' if count == 1 else ''}{count}"
        )
    words = {
        "string_type": "must be a text in quotes",
        "int_type": "must be a whole number",
        "bool_type": "must be true or false",
        "list_type": "must be a list",
        "greater_than": "must be positive" if context.get("gt") == 0 else f"must be more than {context.get('gt')}",
        "greater_than_equal": f"must be at least {context.get('ge')}",
        "less_than_equal": f"must be at most {context.get('le')}",
    }
    if kind in ("dict_type", "model_type", "model_attributes_type"):
        return "must be a table"
    return words.get(kind, message.replace("Input should be", "must be"))


def _path(loc: Sequence[str | int], data: Any, keep_last: bool) -> Path:
    """Return the path of an entry, without the names that pydantic gives to the members of a union."""
    parts: list[str | int] = []
    for i, part in enumerate(loc):
        inside = part in data if isinstance(data, dict) else isinstance(data, list) and isinstance(part, int)
        if inside and (isinstance(data, dict) or (isinstance(part, int) and part < len(data))):
            data = data[part]
            parts.append(part)
        elif keep_last and i + 1 == len(loc):
            parts.append(part)
    return tuple(parts)


def _hint(loc: Sequence[str | int]) -> str:
    model = _type_at(loc[:-1])
    names = {field.alias or name: name for name, field in model.model_fields.items()} if model else {}
    return hint_of(model, names[str(loc[-1])]) if model and loc[-1] in names else "give it"


def _example(loc: Sequence[str | int]) -> str:
    """Return what would be right, of the nearest entry around a place that says it; its section says too little."""
    for end in range(len(loc), max(min(1, len(loc) - 1), len(loc) - 3), -1):
        if isinstance(loc[end - 1], str) and (hint := _hint(loc[:end])) != "give it":
            return f"; {hint}"
    return ""


def _type_at(loc: Sequence[str | int]) -> type[BaseModel] | None:
    """Return the model of the table at a place of pydantic's."""
    kind = _plain(_annotation_at(loc))
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def _annotation_at(loc: Sequence[str | int]) -> Any:
    annotation: Any = case_model()
    for part in loc:
        annotation = _inner(annotation, part)
    return annotation


def _plain(annotation: Any) -> Any:
    """Return an annotation without what is noted on it, and without None."""
    while True:
        if get_origin(annotation) is Annotated:
            annotation = get_args(annotation)[0]
        elif get_origin(annotation) in (Union, UnionType):
            members = [member for member in get_args(annotation) if member is not NoneType]
            if len(members) > 1:
                return annotation
            annotation = members[0]
        else:
            return annotation


def _members(annotation: Any) -> list[Any]:
    """Return the members of a union of unions."""
    plain = _plain(annotation)
    if get_origin(plain) not in (Union, UnionType):
        return [annotation]
    members: list[Any] = []
    for member in get_args(plain):
        tagged = get_origin(member) is Annotated and any(isinstance(note, Tag) for note in get_args(member)[1:])
        members += [member] if tagged else [inner for inner in _members(member) if inner is not NoneType]
    return members


def _inner(annotation: Any, part: str | int) -> Any:
    plain = _plain(annotation)
    if get_origin(plain) in (Union, UnionType):
        for member in _members(plain):
            notes = get_args(member)[1:] if get_origin(member) is Annotated else ()
            if any(isinstance(note, Tag) and note.tag == part for note in notes) or part in _kinds(_plain(member)):
                return member
        return None
    if isinstance(plain, type) and issubclass(plain, BaseModel):
        for name, member in plain.model_fields.items():
            if part in (name, member.alias):
                return member.annotation
        return None
    if get_origin(plain) is list:
        return get_args(plain)[0]
    return get_args(plain)[1] if get_origin(plain) is dict else None


def _kinds(model: Any) -> list[str]:
    """Return the kinds, or shapes, that a model stands for."""
    fields = getattr(model, "model_fields", {})
    return [word for name in KINDS if name in fields for word in get_args(fields[name].annotation)]


def _tags(annotation: Any, name: str) -> list[str]:
    return [word for member in _members(annotation) for word in _kinds(_plain(member))]


def _choices(loc: Sequence[str | int]) -> list[str]:
    annotation = _plain(_annotation_at(loc))
    return [str(choice) for choice in get_args(annotation)] if get_origin(annotation) is Literal else []
