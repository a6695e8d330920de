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
    document = _table(form_of(Sections), "", definitions)
    del document["required"]
    document["properties"] |= {
        "extends": {"type": "string", "description": "a case file that this one changes"},
        "without": {"type": "array", "items": {"type": "string"}, "description": "entries of that file to leave out"},
    }
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, **document, "$defs": definitions, "title": "hertzlink case"}


def _table(form: Form, kind: str, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a table."""
    properties: dict[str, Any] = {form.tag: {"const": kind}} if form.tag else {}
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


def _value(parameter: Parameter, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of what an annotation asks for: any of the types that it allows."""
    may, choices = allowed(parameter), list[dict[str, Any]]()
    for kind, form in (one for forms in may.tables.values() for one in forms.items()):
        name = f"{form.tag} {kind}".strip()
        if name not in definitions:
            definitions[name] = {}  # of a table that may hold tables of its own kind
            definitions[name] = _table(form, kind, definitions)
        choices.append({"$ref": f"#/$defs/{name.replace(' ', '%20')}"})
    for make, item, count in may.rows:
        inner = _value(item, definitions)
        length = {} if count is None else {"minItems": count, "maxItems": count}
        array = {"type": "array", "items": inner, **length}
        choices.append({"type": "object", "additionalProperties": inner} if make is dict else array)
    for kind, notes in may.values:
        noted = {type(note): note for note in notes}
        if OneOf in noted:
            choices.append({"enum": list(noted[OneOf].words)})
        elif kind is float:
            quantity = noted.get(Quantity, Quantity())
            unit = quantity.unit_in_files
            what = f": a number in {unit}, or a text such as {example_of(quantity)}" if unit else ""
            choices.append({"type": ["number", "string"], "description": quantity.noun + what})
        elif kind is int:
            count = noted.get(Count, Count(-MOST))
            least = {"minimum": count.least} if count.least > -MOST else {}
            choices.append({"type": "integer", **least, **({"maximum": count.most} if count.most < MOST else {})})
        elif kind is not Any or notes:
            choices.append({"type": "boolean" if kind is bool else "string"})
    unique = [choice for i, choice in enumerate(choices) if choice not in choices[:i]]
    return {"anyOf": unique} if len(unique) > 1 else dict(unique[0]) if unique else {}
