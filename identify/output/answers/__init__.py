"""The JSON objects of commands: one class each, from which the JSON schema is made.

A field is read from the attribute of the result that has its name, or that ``read`` tells; arrays,
enums and what is no number are dealt with in ``Entry``. Numbers are in SI units, beside their
units. ``python -m identify.output.as_json`` writes the schema anew.
"""

from __future__ import annotations

from functools import singledispatch
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any, Self

from pydantic import (
    AliasPath,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)
from pydantic_core import to_jsonable_python

from twin.record import plain_value

SCHEMA = "answers-1"  # the number grows when an entry goes, or gets another meaning
File = Annotated[str, BeforeValidator(lambda v: str(v) if isinstance(v, Path) else v)]  # as typed
LOWER = BeforeValidator(str.lower)  # of the name of an enum's member
Told = Annotated[str | None, BeforeValidator(lambda v: v or None)]  # null: there is nothing to tell


def read(path: str) -> Any:
    """A field that is read from this attribute of the result, e.g. "tested.before"."""
    return Field(validation_alias=AliasPath(*path.split(".")))


def plain(value: Any) -> Any:
    """A value as JSON knows it: classes by their fields, arrays as lists, no number as null."""
    return to_jsonable_python(value, inf_nan_mode="null", fallback=lambda v: v.tolist())


class Entry(BaseModel):
    """An object within an answer.

    A field has the name of the attribute that it is read from, where ``read`` tells no other.
    """

    model_config = ConfigDict(
        from_attributes=True, extra="forbid", validate_by_name=True, validate_by_alias=True,
        json_schema_serialization_defaults_required=True, use_attribute_docstrings=True,
    )  # fmt: skip

    @model_validator(mode="before")
    @classmethod
    def _of_json(cls, value: Any) -> Any:
        """An object that was read: less its place in the schema."""
        if isinstance(value, dict):
            return {k: v for k, v in value.items() if k != "schema"}
        return value

    @field_validator("*", mode="before")
    @classmethod
    def _of_array_or_enum(cls, value: Any) -> Any:
        return plain_value(value)

    @classmethod
    def of(cls, *sources: object, **given: Any) -> Self:
        """With the entries that are given, and the others from the first source that has them."""
        return cls.model_validate(_Joined(SimpleNamespace(**given), *sources))


class Answer(Entry):
    """The object that a command prints, which begins with its place in the JSON schema."""

    @model_serializer(mode="wrap")
    def _with_schema(self, handler: SerializerFunctionWrapHandler):
        return {"schema": f"{SCHEMA}#/$defs/{type(self).__name__}", **handler(self)}

    def entries(self) -> dict[str, Any]:
        """The object as JSON knows it."""
        found: dict[str, Any] = plain(self)
        return found


class _Joined:
    """The attributes of several objects as those of one: of the first that has them."""

    def __init__(self, *sources: object) -> None:
        self._sources = sources

    def __getattr__(self, name: str) -> Any:
        for source in self._sources:
            if hasattr(source, name):
                return getattr(source, name)
        raise AttributeError(name)


@singledispatch
def answer_of(result: Any, **more: Any) -> Answer:
    """The JSON object of a result; more: entries that its command adds."""
    raise TypeError(f"a {type(result).__name__} has no JSON")
