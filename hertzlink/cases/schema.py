"""The JSON schema of case files, by which editors complete and check entries: from the same annotations as `reader`."""

from inspect import getdoc
from typing import Any

from hertzlink.cases.forms import Form, allowed, asked, example_of, form_of
from hertzlink.cases.parts import Sections
from structures.checks import MOST
from structures.described import Parameter
from structures.quantities import Count, OneOf, Quantity


def schema() -> dict[str, Any]:
    """Return the schema. A file that extends another may lack sections, so none is required."""
    definitions: dict[str, Any] = {}
    document = _table(form_of(Sections), definitions)
    del document["required"]
    document["properties"] |= {
        "extends": {"type": "string", "description": "a case file that this one changes"},
        "without": {"type": "array", "items": {"type": "string"}, "description": "entries of that file to leave out"},
    }
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, **document, "$defs": definitions, "title": "hertzlink case"}


def _table(form: Form, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a table."""
    properties: dict[str, Any] = {form.tag: {"const": form.kind}} if form.tag else {}
    for name, parameter in form.entries.items():
        properties[name] = _value(parameter, definitions)
        if words := asked(parameter):
            properties[name]["description"] = words
    first_sentence = " ".join((getdoc(form.target) or "").partition("\n\n")[0].split())
    required = [name for name, parameter in form.entries.items() if parameter.required and not parameter.may_be_none]
    return {
        "type": "object", "description": first_sentence, "properties": properties, "additionalProperties": False,
        "required": [form.tag, *required] if form.tag else required,
    }  # fmt: skip


def _reference(form: Form, kind: str, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the reference to a table, which may hold tables of its own kind."""
    name = f"{form.tag} {kind}".strip()
    if name not in definitions:
        definitions[name] = {}
        definitions[name] = _table(form, definitions)
        if form.tag:
            definitions[name]["properties"][form.tag] = {"const": kind}
    return {"$ref": f"#/$defs/{name.replace(' ', '%20')}"}


def _value(parameter: Parameter, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of what an annotation asks for: any of the types that it allows."""
    may = allowed(parameter)
    choices = [_reference(form, name, definitions) for forms in may.tagged.values() for name, form in forms.items()]
    choices += [_reference(form, form.kind, definitions) for form in may.plain]
    for _, item, count in may.lists:
        length = {} if count is None else {"minItems": count, "maxItems": count}
        items = {} if item is None else {"items": _value(item, definitions)}
        choices.append({"type": "array", **items, **length})
    for item in may.mappings:
        choices.append({"type": "object", "additionalProperties": _value(item, definitions)})
    for kind, notes in may.single:
        words = next((note.words for note in notes if isinstance(note, OneOf)), None)
        quantity = next((note for note in notes if isinstance(note, Quantity)), None)
        count_note = next((note for note in notes if isinstance(note, Count)), None)
        if words:
            choices.append({"enum": list(words)})
        elif kind is float:
            what = quantity.noun if quantity else "a number"
            if quantity and quantity.unit_in_files:
                what += f": a number in {quantity.unit_in_files}, or a text such as {example_of(quantity)}"
            choices.append({"type": ["number", "string"], "description": what})
        elif kind is int:
            least = {"minimum": count_note.least} if count_note else {}
            most = {"maximum": count_note.most} if count_note and count_note.most < MOST else {}
            choices.append({"type": "integer", **least, **most})
        elif kind is not Any or notes:
            choices.append({"type": "boolean" if kind is bool else "string"})
    unique = [choice for i, choice in enumerate(choices) if choice not in choices[:i]]
    return {"anyOf": unique} if len(unique) > 1 else dict(unique[0]) if unique else {}
