"""Messages of a bag -> columns: one column a number in a message.

A column is ``topic.field``, ``topic.field.inner``, or ``topic.field[1]`` for the first of an array;
where a message names the entries of its arrays, as sensor_msgs/JointState does, or an entry has a
name of its own, also ``topic.field.name``. ``topic.log_time`` and time stamps in a message are
times since 1970.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

LOG_TIME = "log_time"
_STAMPS = (("sec", "nanosec"), ("seconds", "nanos"))  # ROS 2, protobuf


def of_message(name: str, value: Any, names: Sequence[str] = ()) -> dict[str, Any]:
    """The numbers and time stamps in a value, by name; names: of its entries, if it has as many."""
    if isinstance(value, bool | int | float | np.number):
        return {name: float(value)}
    out: dict[str, Any] = {}
    if (fields := _fields(value)) is not None:
        for seconds, rest in _STAMPS:
            if fields.keys() == {seconds, rest}:
                time = int(fields[seconds]) * 10**9 + int(fields[rest])
                return {name: np.datetime64(time, "ns")}
        lists = [v for v in fields.values() if _are_entries(v) and len(v)
                 and all(isinstance(text, str) for text in v)]  # fmt: skip
        for key, inner in fields.items():
            out |= of_message(f"{name}.{key}", inner, lists[0] if lists else ())
    elif _are_entries(value):
        for k, entry in enumerate(value):
            texts = [v for v in (_fields(entry) or {}).values() if isinstance(v, str)]
            called = names[k : k + 1] if len(names) == len(value) else texts  # as that of a joint
            keys = [f"{name}.{called[0]}"] if len(called) == 1 and called[0] else []
            for key in (f"{name}[{k + 1}]", *keys):
                out |= of_message(key, entry)
    return out


def _are_entries(value: Any) -> bool:
    """Whether it is a list, of whatever kind a library makes them."""
    return hasattr(value, "__len__") and not isinstance(value, str | bytes | Mapping)


def _fields(value: Any) -> Mapping[str, Any] | None:
    """The fields of a message; None where it is none."""
    if isinstance(value, Mapping):
        return value
    if hasattr(value, "__len__"):
        return None
    if hasattr(value, "DESCRIPTOR"):
        return {f.name: getattr(value, f.name) for f in value.DESCRIPTOR.fields}
    slots = getattr(value, "__slots__", None)
    return None if slots is None else {name: getattr(value, name) for name in slots}
