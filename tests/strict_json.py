"""JSON of results as a strict reader gets it: valid against the schema that ships."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from jsonschema import Draft202012Validator

from identify.output.as_json import FILE, json_of


def strict(found: Any) -> Any:
    """The object after its way through text, which knows no NaN and no infinity."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(json.dumps(found), parse_constant=refuse)


def told(result: Any, **more: Any) -> Any:
    """What the command of a result prints with --json, without its place in the schema."""
    return valid(strict(json_of(result, **more)))


def valid(found: dict[str, Any]) -> dict[str, Any]:
    """The object of a command, without its place in the schema, against which it is held."""
    place = found.pop("schema")
    identifier, _, at = place.partition("#")
    assert identifier == shipped()["$id"]
    within = {**shipped(), "anyOf": [{"$ref": f"#{at}"}]}
    Draft202012Validator(within).validate({"schema": place, **found})
    return found


@cache
def shipped() -> dict[str, Any]:
    """The JSON schema of answers, as it ships."""
    return json.loads(FILE.read_text(encoding="utf-8"))
