"""The JSON schema of case files, by which editors complete and check entries."""

from typing import Any

from hertzlink.cases.model import case_model

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the schema; a file that extends another may lack sections, so none is required."""
    document = case_model().model_json_schema(by_alias=True)
    document.pop("required", None)
    document["properties"]["extends"] = {"type": "string", "description": "a case file that this one changes"}
    return {"$schema": DIALECT, **document, "title": "hertzlink case"}
