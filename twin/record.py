"""A record: a class of values that is a result, an object of the JSON and its schema at once.

What the JSON has of a record are its fields, under their names, and the properties that are
``computed``. The docstring below a field is its description in the schema. A record is read again
from what was written of it, and is equal to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import isfinite
from typing import TYPE_CHECKING, Annotated, Any, dataclass_transform

from pydantic import BeforeValidator, ConfigDict, computed_field

CONFIG = ConfigDict(
    revalidate_instances="always", validate_by_name=True, validate_by_alias=True,
    json_schema_serialization_defaults_required=True,
    use_attribute_docstrings=True, json_schema_extra={"additionalProperties": False},
)  # fmt: skip


def plain_value(value: Any) -> Any:
    """Arrays as lists, members of an enum by their values."""
    listed = value.tolist() if hasattr(value, "tolist") else value
    return listed.value if isinstance(listed, Enum) else listed


def _known(value: Any) -> Any:
    value = plain_value(value)
    return None if isinstance(value, float) and not isfinite(value) else value


if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from twin.signals import Array

    Number = float
    Values = Array
    Flags = NDArray[np.bool_]
    computed = property
else:
    Number = Annotated[float | None, BeforeValidator(_known)]
    """In the JSON null, where it is infinite or no number."""
    Values = Annotated[list[Number], BeforeValidator(plain_value)]
    Flags = Annotated[list[bool], BeforeValidator(plain_value)]
    """Arrays (n,), in the JSON lists."""

    def computed(function):
        """A property that the JSON has too."""
        return computed_field(property(function))


@dataclass_transform(frozen_default=True)
def record(kind: type) -> type:
    """Make a class with annotated fields a record."""
    kind.__pydantic_config__ = CONFIG  # type: ignore[attr-defined]
    return dataclass(frozen=True)(kind)
