"""The JSON schema of case files, by which editors complete and check entries: from the same annotations as `reader`."""

from inspect import getdoc, isclass
from typing import Any, get_args, get_origin

from hertzlink.cases.forms import (
    OF_MATERIAL,
    Form,
    alternatives,
    asked,
    example_of,
    form_of,
    forms_at,
    is_array,
    is_list,
    items_of,
)
from hertzlink.cases.parts import Sections
from structures.checks import MOST
from structures.described import noted
from structures.quantities import Count, OneOf, Quantity

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the schema. A file that extends another may lack sections, so none is required."""
    definitions: dict[str, Any] = {}
    document = _table(form_of(Sections), definitions)
    del document["required"]
    document["properties"] |= {
        "extends": {"type": "string", "description": "a case file that this one changes"},
        "without": {"type": "array", "items": {"type": "string"}, "description": "entries of that file to leave out"},
    }
    return {"$schema": DIALECT, **document, "$defs": definitions, "title": "hertzlink case"}


def _table(form: Form, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a table."""
    properties: dict[str, Any] = {form.tag: {"const": form.kind}} if form.tag else {}
    for name, parameter in form.entries.items():
        properties[name] = _value(parameter.type, parameter.notes, definitions)
        if words := asked(parameter.notes):
            properties[name]["description"] = words
    first_sentence = " ".join((getdoc(form.target) or "").partition("\n\n")[0].split())
    required = [name for name, parameter in form.entries.items() if parameter.required]
    return {
        "type": "object", "description": first_sentence, "properties": properties, "additionalProperties": False,
        "required": [form.tag, *required] if form.tag else required,
    }  # fmt: skip


def _reference(form: Form, kind: str, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the reference to a table, which may hold tables of its own kind."""
    name = f"{form.tag} {kind}".strip() if form.tag else form.kind
    if name not in definitions:
        definitions[name] = {}
        definitions[name] = _table(form, definitions)
        if form.tag:
            definitions[name]["properties"][form.tag] = {"const": kind}
    return {"$ref": f"#/$defs/{name.replace(' ', '%20')}"}


def _value(kind: Any, notes: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of what an annotation asks for: any of the types that it allows."""
    kinds = alternatives(kind, notes)
    tagged, plain = forms_at(kinds)
    choices = [_reference(form, name, definitions) for forms in tagged.values() for name, form in forms.items()]
    choices += [_reference(form, form.kind, definitions) for form in plain]
    for one, its in kinds:
        words = next((note.words for note in its if isinstance(note, OneOf)), None)
        quantity = next((note for note in its if isinstance(note, Quantity)), None)
        count = next((note for note in its if isinstance(note, Count)), None)
        if is_array(one):
            choices.append({"type": "array"})
        elif is_list(one):
            item, number = items_of(one)
            length = {} if number is None else {"minItems": number, "maxItems": number}
            choices.append({"type": "array", "items": _value(*noted(item), definitions), **length})
        elif words:
            choices.append({"enum": list(words)})
        elif one is float:
            unit, example = (quantity.unit_in_files, example_of(quantity)) if quantity else ("", "")
            what = quantity.noun if quantity else "a number"
            text = f"{what}: a number in {unit}, or a text such as {example}" if unit else what
            choices.append({"type": ["number", "string"], "description": text})
        elif one is int:
            most = {"maximum": count.most} if count and count.most < MOST else {}
            choices.append({"type": "integer", **({"minimum": count.least} if count else {}), **most})
        elif one in (str, bool) or one in OF_MATERIAL or (one is Any and its):
            choices.append({"type": "boolean" if one is bool else "string"})
        elif isclass(get_origin(one)) and not plain and not tagged:
            inner = get_args(one)[-1]
            choices.append({"type": "object", "additionalProperties": _value(*noted(inner), definitions)})
    unique = [choice for i, choice in enumerate(choices) if choice not in choices[:i]]
    if not unique:
        return {}
    return dict(unique[0]) if len(unique) == 1 else {"anyOf": unique}
