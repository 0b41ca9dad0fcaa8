"""Results as JSON objects, and the JSON schema of all that commands print.

``python -m identify.output.as_json`` writes the schema anew, beside those of the files of a user.
"""

from __future__ import annotations

import json
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, models_json_schema

from identify.output.answers import SCHEMA, Answer, answer_of, diagnoses, fits, frequency, machine
from twin.files import write_atomically
from twin.schemas import FOLDER

FILE = FOLDER / "answers.schema.json"


def json_of(result: Any, **more: Any) -> dict[str, Any]:
    """The object that the command of a result prints; more: entries that the command adds."""
    return answer_of(result, **more).entries()


def answers() -> list[type[Answer]]:
    """The class of every object that a command prints."""
    known = {
        k: v for module in (machine, fits, diagnoses, frequency) for k, v in vars(module).items()
    }
    return [v for k, v in known.items() if k.endswith("Answer") and v is not Answer]


class _Plain(GenerateJsonSchema):
    def field_title_should_be_set(self, schema: Any) -> bool:
        """No titles: they repeat the names."""
        return False


def schema_text() -> str:
    """The JSON schema of every object that a command prints."""
    every = answers()
    _, made = models_json_schema([(a, "serialization") for a in every], schema_generator=_Plain)
    for answer in every:
        own = made["$defs"][answer.__name__]
        place = {"const": f"{SCHEMA}#/$defs/{answer.__name__}"}
        own["properties"] = {"schema": place, **own["properties"]}
        own["required"] = [*own["required"], "schema"]
    document = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": SCHEMA,
        "title": "What the commands of twin print with --json",
        "anyOf": [{"$ref": f"#/$defs/{answer.__name__}"} for answer in every],
        **made,
    }
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    write_atomically(FILE, schema_text().encode("utf-8"))
