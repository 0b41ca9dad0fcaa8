"""Entries of an import map set by name, as `axes.x.position.unit = mm`."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from typing import Any

import tomlkit
from tomlkit.exceptions import ParseError

from twin.errors import InputError

REMARK = re.compile(r"NOT KNOWN|ASSUMED")
COLUMN = "column"


def with_entries(text: str, entries: Iterable[str]) -> str:
    """The text of a map with entries set, "NAME=VALUE" each; without a value the entry goes.

    NAME is the place in the map, as "axes.x.force_constant". A value is TOML, or else a text; where
    a table of a column stands, a text is the name of the column. Raises InputError where NAME leads
    nowhere.
    """
    try:
        document = tomlkit.parse(text)
    except ParseError as error:
        raise InputError(f"the map is not a TOML file: {error}") from None
    for entry in entries:
        name, sign, value = entry.partition("=")
        keys = [part.strip() for part in name.split(".")]
        if not sign or not all(keys):
            raise InputError(f"'{entry}': give an entry of the map as axes.x.position.unit=mm")
        _set(document, keys, value.strip(), name.strip())
    return tomlkit.dumps(document)


def _set(document: Any, keys: list[str], text: str, name: str) -> None:
    table, before = document, None
    for key in keys[:-1]:
        if key not in table:
            table[key] = tomlkit.table() if table is document else tomlkit.inline_table()
        before, table = table, table[key]
        if not hasattr(table, "keys"):
            raise InputError(f"'{name}': {key} is no table of the map, so it has no {keys[-1]}")
    last = keys[-1]
    if not text:
        table.pop(last, None)
        return
    value = _value(text)
    if hasattr(table.get(last), "keys") and isinstance(value, str):
        table[last][COLUMN] = value
    else:
        table[last] = value
    changed = table[last] if hasattr(table[last], "keys") else table
    if changed is not document and hasattr(changed, "trivia") and before is not None:
        _forget_remark(changed)


def _forget_remark(table: Any) -> None:
    """What a proposal remarked on an entry that the user has set is not so any more."""
    if REMARK.search(table.trivia.comment):
        table.comment("as given")


def _value(text: str) -> Any:
    """A number, a truth value or a table as TOML has it; anything else is a text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except ValueError:
        return text
