"""Messages of ROS 1 and 2 by the definitions that a bag brings, read by rosbags."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twin.errors import InputError
from twin.importers.table import extra

_TIME = {"Time": "int32 sec\nuint32 nanosec", "Duration": "int32 sec\nuint32 nanosec"}
_PLAIN_CDR = (0, 1)  # kinds of CDR by the second byte of a message: big, little endian


def ros_decoder(
    encoding: str, kind: str, name: str, definition: bytes
) -> Callable[[bytes], Any] | None:
    """What reads messages of an encoding ("cdr", "ros1"), whose type a text defines.

    kind: of the text, "ros2msg", "ros1msg" or "ros2idl". None for another; raises InputError where
    the package is missing.
    """
    if kind not in ("ros2msg", "ros1msg", "ros2idl", "ros2idl2", "omgidl"):
        return None
    typesys = extra("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    for time, text in _TIME.items():
        store.register(typesys.get_types_from_msg(text, f"builtin_interfaces/msg/{time}"))
    text = definition.decode(errors="replace")
    full = name if "/msg/" in name else name.replace("/", "/msg/", 1)
    if kind.endswith("msg"):
        types = typesys.get_types_from_msg(text, full)
    else:
        types = typesys.get_types_from_idl(text)
    store.register({n: t for n, t in types.items() if n not in store.fielddefs})
    if encoding == "ros1":
        return lambda data: store.deserialize_ros1(data, full)

    def of_cdr(data: bytes) -> Any:
        if len(data) < 4 or data[1] not in _PLAIN_CDR:
            raise InputError(
                f"a message of {full} is of CDR kind {data[1] if len(data) > 1 else 'none'}, which "
                "is not read; known is plain CDR (0, 1): record it with another middleware"
            )
        return store.deserialize_cdr(data, full)

    return of_cdr
