"""What is known of a machine that runs, as topics of a Foxglove WebSocket server.

``/twin/AXIS/residual``, ``/twin/AXIS/parameters`` and ``/twin/alarms``, in JSON with its schema, so
that any client can draw them. Times are those of the log.
"""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from identify.fleet.watch import Window
from identify.output.words.fleet import cause_in_words, live_in_words
from identify.results.fleet import LiveAxis, LiveCause, LiveParameter
from twin.errors import InputError
from twin.installed import pip_install

HOST = "127.0.0.1"  # other computers see it by a tunnel: who may ask is not asked here
HELD = 4096  # messages for a client that is slow: a minute of two axes
NUMBER: Mapping[str, Any] = {"type": "number"}
OR_NONE: Mapping[str, Any] = {"type": ["number", "null"]}
TEXT: Mapping[str, Any] = {"type": "string"}
RESIDUAL = {"time": NUMBER, "residual": NUMBER, "low": OR_NONE, "high": OR_NONE}
PARAMETER = {"value": NUMBER, "low": NUMBER, "high": NUMBER, "fitted": NUMBER, "unit": TEXT}
ALARM = {
    "axis": TEXT, "time": NUMBER, "changed": NUMBER, "before": NUMBER, "after": NUMBER,
    "unit": TEXT, "text": TEXT,
}  # fmt: skip
CAUSE = {"axis": TEXT, "changed": NUMBER, "named": {"type": "array", "items": TEXT}, "text": TEXT}


class Served:
    """A server and its topics; each is made when there is something to tell."""

    def __init__(self, library: Any, server: Any, context: Any) -> None:
        self._library, self._server, self._context = library, server, context
        self._channels: dict[str, Any] = {}

    @property
    def address(self) -> str:
        """Where clients find it."""
        return f"ws://{HOST}:{self._server.port}"

    def tell(self, window: Window) -> None:
        """Serve what a window told."""
        for axis in window.axes:
            self._residual(axis)
            topic = f"/twin/{axis.axis}/parameters"
            told = _nested(axis.parameters)
            schema = {name: _object("", _schemas(of)) for name, of in told.items()}
            self._send(topic, "twin.Parameters", schema, window.end, told)
        for alarm in window.alarms:
            entries = {name: getattr(alarm, name) for name in ALARM if name != "text"}
            entries["text"] = live_in_words(alarm)
            self._send("/twin/alarms", "twin.Alarm", ALARM, window.end, entries)

    def tell_cause(self, cause: LiveCause, time: float) -> None:
        """Serve what a diagnosis named; time: of the log, s."""
        told = {
            "axis": cause.axis, "changed": cause.changed, "named": list(cause.named),
            "text": cause_in_words(cause),
        }  # fmt: skip
        self._send("/twin/causes", "twin.Cause", CAUSE, time, told)

    def _residual(self, axis: LiveAxis) -> None:
        band = axis.band
        low, high = (None, None) if band is None else (-band, band)
        for time, left in zip(axis.time.tolist(), axis.residual.tolist(), strict=True):
            told = {"time": time, "residual": left, "low": low, "high": high}
            topic = f"/twin/{axis.axis}/residual"
            self._send(topic, "twin.Residual", RESIDUAL, time, told, axis.unit)

    def _send(
        self, topic: str, name: str, schema: Mapping[str, Any], time: float,
        told: Mapping[str, Any], unit: str = "",
    ) -> None:  # fmt: skip
        channel = self._channels.get(topic)
        if channel is None:
            metadata = {"unit": unit} if unit else {}
            channel = self._library.Channel(
                topic, schema=_object(name, schema), context=self._context, metadata=metadata
            )
            self._channels[topic] = channel
        channel.log(json.dumps(told).encode(), log_time=max(round(time * 1e9), 0))


@contextmanager
def serving(port: int) -> Iterator[Served]:
    """A server on this computer at a port; 0: at any that is free. Raises InputError."""
    try:
        library = importlib.import_module("foxglove")
    except ImportError as error:
        raise InputError(
            f"--serve needs the package foxglove-sdk; install it with: {pip_install('live')}"
        ) from error
    context = library.Context()
    try:
        server = library.start_server(
            name="twin watch", host=HOST, port=port, context=context, message_backlog_size=HELD
        )
    except (OSError, RuntimeError, OverflowError, ValueError) as error:
        raise InputError(
            f"--serve {port}: cannot be served there ({' '.join(str(error).split())}); give "
            "another port, or 0 for any that is free"
        ) from error
    try:
        yield Served(library, server, context)
    finally:
        server.stop()


def _nested(parameters: tuple[LiveParameter, ...]) -> dict[str, dict[str, Any]]:
    """Parameters by effect and name, as a path of Foxglove finds them."""
    out: dict[str, dict[str, Any]] = {}
    for p in parameters:
        effect, _, name = p.name.rpartition(".")
        told = {
            "value": p.value, "low": p.value - p.half, "high": p.value + p.half,
            "fitted": p.fitted, "unit": p.unit,
        }  # fmt: skip
        out.setdefault(effect or "axis", {})[name] = told
    return out


def _schemas(of: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _object("", PARAMETER) for name in of}


def _object(name: str, properties: Mapping[str, Any]) -> dict[str, Any]:
    """A JSON schema of an object."""
    return {"type": "object", "title": name, "properties": dict(properties)}
