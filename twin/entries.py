"""The entries of a user's TOML file, checked against a schema; a mistake is one line.

The description of a field, or the docstring below it, says what may be given: it is the end of the
error, and what an editor shows that has the JSON schema.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo

from twin.errors import InputError, at, near

_MCAP = b"\x89MCAP"  # with which a log begins
NAME_OF_TABLE = "[key]"  # where the library found fault with the name and not what it names


class Entries(BaseModel):
    """A table of a TOML file; every entry must be known, and of the type that it is shown with."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


Kind = TypeVar("Kind", bound=Entries)


def read_entries(kind: type[Kind], document: Mapping[str, Any]) -> Kind:
    """The document as ``kind``; raises InputError with where, what was given and what may be."""
    try:
        return kind.model_validate(document)
    except ValidationError as errors:
        error = errors.errors(include_url=False, include_context=False)[0]
        raise InputError(_sentence(kind, document, error["type"], error["loc"])) from None


def read_toml(path: Path) -> dict[str, Any]:
    """The document of a TOML file; raises InputError, which names the file, where it is none."""
    with at(str(path)):
        return toml_document(path)[1]


def toml_document(path: Path) -> tuple[str, dict[str, Any]]:
    """The text of a TOML file and its document; raises InputError where it is none."""
    most_bytes = 5_000_000  # of a TOML file
    with path.open("rb") as file:
        content = file.read(most_bytes + 1)
    if content.startswith(_MCAP):
        raise InputError("is an MCAP log and no TOML file; a model comes before its logs")
    if len(content) > most_bytes:
        raise InputError(f"is larger than {most_bytes // 10**6} MB; give a TOML file")
    try:
        text = content.decode("utf-8-sig")  # editors of Windows begin with a mark
        return text, tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number of 5000 digits, 5000 nested lists
        raise InputError(f"is not a TOML file: {error}") from error


def shown(value: object) -> str:
    """A value of the file in a message, cut where it is long."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):
        text = "something too large to be shown"
    longest_value = 60  # characters of it in a message
    return text if len(text) <= longest_value else f"{text[:longest_value]}..."


def _sentence(kind: type[Entries], document: Any, error: str, place: tuple[str | int, ...]) -> str:
    if place[-1] == NAME_OF_TABLE:
        where, _, field, _ = _walk(kind, place[:-2])
        return f"{'.'.join(where)}.{place[-2]}: give {field.description if field else ''}"
    where, owner, field, depth = _walk(kind, place)
    key, prefix = (where[-1] if where else ""), "".join(f"{part}: " for part in where[:-1])
    if error == "extra_forbidden" and owner is not None:
        known = list(owner.model_fields)
        return (
            f"{prefix}unknown entry '{place[-1]}'; {near(str(place[-1]), known)}"
            f"allowed: {', '.join(known)}"
        )
    wanted = (field.description if field else None) or "a table, as [...] or {...}"
    if error == "missing":
        return f"{prefix}has no {key}; give {wanted}"
    value: Any = reduce(getitem, place[:depth], document)
    return f"{prefix}{key} = {shown(value)}: give {wanted}"


def _walk(
    kind: Any, place: tuple[str | int, ...]
) -> tuple[list[str], type[Entries] | None, FieldInfo | None, int]:
    """Down to an error: the path in words, the table and the field there, and how deep they are."""
    where: list[str] = []
    owner: type[Entries] | None = None
    field: FieldInfo | None = None
    for depth, key in enumerate(place):
        table = _table_of(kind)
        if table is not None:
            owner, field = table, table.model_fields.get(str(key))
            where.append(str(key))
            kind = field.annotation if field else None
        elif get_origin(kind) is dict or (get_origin(kind) is list and _table_of(_inner(kind))):
            where[-1] += f".{key}"
            kind = _inner(kind)
        else:  # within a plain list: the whole list is shown
            return where, owner, field, depth
    return where, owner, field, len(place)


def _inner(kind: Any) -> Any:
    """What a list, or a dictionary, holds."""
    return get_args(kind)[-1]


def _table_of(kind: Any) -> type[Entries] | None:
    """The table among the types of an entry that may be left out."""
    for option in (kind, *get_args(kind)):
        if isinstance(option, type) and issubclass(option, Entries):
            return option if get_origin(kind) not in (dict, list) else None
    return None
