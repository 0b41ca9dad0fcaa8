"""Results as JSON objects, and the JSON schema of all that commands print.

``python -m identify.output.as_json`` writes the schema anew, beside those of the files of a user.
"""

from __future__ import annotations

import json
import tomllib
from keyword import iskeyword
from pathlib import Path
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, models_json_schema

from identify.output.answers import (
    SCHEMA,
    Answer,
    answer_of,
    bodies,
    diagnoses,
    fits,
    fleet,
    frequency,
    machine,
    plans,
    project,
)
from twin.effects import Catalogue
from twin.errors import InputError
from twin.files import write_atomically
from twin.model.file import parse_model
from twin.model.machine import MachineModel
from twin.schemas import FOLDER

FILE = FOLDER / "answers.schema.json"


def json_of(result: Any, **more: Any) -> dict[str, Any]:
    """The object that the command of a result prints; more: entries that the command adds."""
    return answer_of(result, **more).entries()


def save(result: Any, path: Path) -> None:
    """Write the object that the command of a result prints, whole or not at all."""
    text = json.dumps(json_of(result), indent=1, ensure_ascii=False)
    write_atomically(path, f"{text}\n".encode())


def load(path: Path | str) -> Answer:
    """The answer that a file holds, of ``save`` or of a command with ``--json``.

    Its entries are attributes under the names that the JSON has; it is equal to the answer that was
    written. Raises InputError, in one line, where the file holds none.
    """
    try:
        entries = json.loads(Path(path).read_text(encoding="utf-8"), object_hook=_named)
        kinds = {_place(kind): kind for kind in answers()}
        return kinds[entries["schema"]].model_validate(entries, by_alias=False, by_name=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, TypeError, KeyError) as error:
        raise InputError(
            f"{path}: is no answer of this version; give what `save` or a command with --json wrote"
        ) from error


def found_in(path: Path, given: MachineModel, catalogue: Catalogue) -> MachineModel:
    """The model with all that a diagnosis of a model found, of the file of its saved answer.

    Raises InputError, in one line, where the file is none.
    """
    try:
        entries = json.loads(path.read_text(encoding="utf-8"))
        is_one = entries["schema"] == _place(diagnoses.DiagnosisAnswer)
        document, mjcf = tomllib.loads(entries["model"] if is_one else ""), entries.get("mujoco")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, TypeError, KeyError):
        document = {}
    if not document:
        raise InputError(
            f"{path}: is no answer of a diagnosis; give what `twin diagnose ... --json` printed in "
            "the place of EFFECT"
        )
    return parse_model(document, catalogue, mjcf or given.mjcf, str(path))


def _named(entries: dict[str, Any]) -> dict[str, Any]:
    """The entries of an object under the names of fields: `or` is none in Python."""
    return {f"{key}_" if iskeyword(key) else key: value for key, value in entries.items()}


def _place(answer: type[Answer]) -> str:
    return f"{SCHEMA}#/$defs/{answer.__name__}"


def answers() -> list[type[Answer]]:
    """The class of every object that a command prints."""
    known = {
        k: v
        for module in (machine, fits, diagnoses, bodies, plans, frequency, fleet, project)
        for k, v in vars(module).items()
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
        own["properties"] = {"schema": {"const": _place(answer)}, **own["properties"]}
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
