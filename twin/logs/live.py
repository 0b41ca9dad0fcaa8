"""Topics that a machine serves while it runs, by the Foxglove WebSocket protocol.

They are those of a log, with its schemas: ``/axis/NAME``, each message with the time at which its
sample was taken. The protocol is small (``advertise``, ``subscribe``, messages behind a head of 13
bytes: https://github.com/foxglove/ws-protocol), and its Python library only serves.
"""

from __future__ import annotations

import base64
import binascii
import importlib
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from twin.errors import InputError
from twin.installed import pip_install
from twin.logs.follow import Incoming
from twin.logs.log import Log
from twin.logs.topics import MessageLayout, Topic, sample_times, seconds, tag

PROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
PATIENCE = 5.0  # s for a server to answer
TO_LEARN = 100  # messages by whose times a sample rate is learnt that is not stated
RATE = "sample_rate_hz"
_HEAD = struct.Struct("<BIQ")  # a message: opcode, subscription, time in ns
_MESSAGE = 1  # its opcode
_DOUBLE = 1  # the type of a field on the wire


@dataclass
class _Arriving:
    """The messages of a topic that were not taken yet. last: time (ns) of the last one that was.

    first: time (ns) of the sample since which it has been even; count: samples since then.
    """

    topic: Topic
    times: list[int] = field(default_factory=list)
    payloads: list[bytes] = field(default_factory=list)
    first: int = 0
    last: int = 0
    count: int = 0


class LiveTopics:
    """Follows the axes that a server at ``ws://...`` has topics of.

    told: what was lost on the way, a line each: a gap, a clock that jumps, a server that dies and
    one that comes back. It has no end by itself.
    """

    ended = False

    def __init__(self, address: str, fields: Sequence[str] | None = None) -> None:
        """Connect. Raises InputError where nobody answers, or without the extra ``live``."""
        self.address, self.fields = address, fields
        self.told: list[str] = []
        self._open = ExitStack()
        self._socket: Any = None
        self._begin()
        self._client = _client()
        try:
            self._connect()
        except (OSError, ValueError, self._client.exceptions.WebSocketException) as error:
            raise InputError(
                f"{address}: nobody serves topics there ({' '.join(str(error).split())}); give it "
                "as ws://host:8765"
            ) from error

    def _begin(self) -> None:
        self._incoming = Incoming(self.fields)
        self._arriving: dict[int, _Arriving] = {}

    def _connect(self) -> None:
        # Whoever serves does not wait, and what is not taken from it is lost: the queue has no end.
        connection = self._client.sync.client.connect(
            self.address, subprotocols=PROTOCOLS, open_timeout=PATIENCE, max_queue=None,
            max_size=None, compression=None,
        )  # fmt: skip
        self._socket = self._open.enter_context(connection)

    def close(self) -> None:
        """Leave the server."""
        self._open.close()
        self._socket = None

    def windows(self, length: float) -> Iterator[tuple[float, Log]]:
        """The whole windows of that length (s) that have come, each with its time in s.

        Raises InputError where the topics are none of a machine.
        """
        self._receive()
        broken: Sequence[_Arriving] | None = None
        while broken is None or broken:
            for channel, arriving in self._arriving.items():
                if self._knows_rate(channel, arriving):
                    self._pass_on(channel, arriving)
            yield from self._incoming.whole(length)
            broken = [a for a in self._arriving.values() if a.count and a.times]
            for arriving in broken:
                self._break(arriving)

    def _receive(self) -> None:
        """Take all that has come by now; come back to a server that has come back."""
        errors = self._client.exceptions
        try:
            if self._socket is None:
                self._connect()
                self.told.append(f"{self.address}: serves again")
            socket: Any = self._socket
            while True:
                self._take(socket.recv(timeout=0.0))
        except TimeoutError:
            return
        except (OSError, errors.WebSocketException):
            if self._socket is not None:
                self.told.append(f"{self.address}: the connection was lost")
                self.close()
                self._begin()

    def _take(self, message: str | bytes) -> None:
        if isinstance(message, str):
            self._by_server(message)
            return
        if len(message) < _HEAD.size or message[0] != _MESSAGE:
            return
        _, channel, time = _HEAD.unpack_from(message)
        if channel in self._arriving:
            self._arriving[channel].times.append(time)
            self._arriving[channel].payloads.append(message[_HEAD.size :])

    def _by_server(self, text: str) -> None:
        try:
            said = json.loads(text)
        except ValueError:
            return
        match said:
            case {"op": "advertise", "channels": channels}:
                self._subscribe([self._known(each) for each in channels])
            case {"op": "unadvertise", "channelIds": numbers}:
                self._forget(numbers)

    def _forget(self, numbers: Sequence[int]) -> None:
        """Wait for no more of topics that a server has taken back; it may serve them anew."""
        for number in {*numbers} & {*self._arriving}:
            self.told.append(f"{self.address}: {self._arriving.pop(number).topic.name}: taken back")
            self._incoming.topics.forget(number)
            self._incoming.drop()

    def _known(self, each: Mapping[str, Any]) -> int | None:
        """The number of a channel that holds samples of an axis."""
        number = int(each["id"])
        schema = _schema(number, each)
        metadata = {str(k): str(v) for k, v in (each.get("metadata") or {}).items()}
        topics = self._incoming.topics
        topics.schemas[number] = schema
        topics.channels[number] = Channel(
            id=number, topic=each["topic"], message_encoding=each["encoding"], metadata=metadata,
            schema_id=number,
        )  # fmt: skip
        topic = topics.topic(number)
        if topic is None or topic.is_truth:
            topics.forget(number)
            return None
        self._arriving[number] = _Arriving(topic)
        return number

    def _subscribe(self, channels: Sequence[int | None]) -> None:
        wanted = [{"id": c, "channelId": c} for c in channels if c is not None]
        if wanted:
            self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    def _knows_rate(self, channel: int, arriving: _Arriving) -> bool:
        """Whether the sample rate is stated, or was learnt of the first messages."""
        metadata = self._incoming.topics.channels[channel].metadata
        if RATE not in metadata:
            if len(arriving.times) < TO_LEARN:
                return False
            period = float(np.median(np.diff(arriving.times)))
            if period <= 0.0:
                raise InputError(
                    f"{self.address}: {arriving.topic.name}: its times do not increase; give each "
                    "message the time at which its sample was taken"
                )
            metadata[RATE] = f"{1e9 / period:.6g}"
        return bool(arriving.times)

    def _pass_on(self, channel: int, arriving: _Arriving) -> None:
        """Give the samples on up to the first that does not follow; each takes its number's time.

        They follow by the time since the one before, so that a clock may be a little fast.
        """
        times, rate = np.array(arriving.times, dtype=np.int64), arriving.topic.sample_rate
        if not arriving.count:
            arriving.first = int(times[0])
            arriving.last = int(times[0] - 1e9 / rate)
        steps = np.rint(np.diff(times, prepend=arriving.last) * 1e-9 * rate)
        end = int(np.argmax(steps != 1)) if (steps != 1).any() else len(times)
        if end:
            arriving.last = int(times[end - 1])
            self._give(channel, arriving, arriving.payloads[:end])
        del arriving.times[:end], arriving.payloads[:end]

    def _break(self, arriving: _Arriving) -> None:
        """Begin anew with a sample that does not follow."""
        before, now = arriving.last, arriving.times[0]
        what = "a gap" if now > before else "its clock jumps"
        self.told.append(
            f"{self.address}: {arriving.topic.name}: {what}: {seconds(before)} is followed by "
            f"{seconds(now)}"
        )
        self._incoming.drop()
        arriving.count = 0

    def _give(self, channel: int, arriving: _Arriving, payloads: Sequence[bytes]) -> None:
        count = len(payloads)
        times = arriving.first + sample_times(arriving.count, count, arriving.topic.sample_rate)
        layout = arriving.topic.layout
        try:
            records = _records(layout, payloads, arriving.count, times)
            arriving.count += count
            self._incoming.take(records)
        except InputError as error:
            self.told.append(f"{self.address}: {error}; what was held of it is left out")


def _client() -> Any:
    """The client's library, with the modules that are used."""
    try:
        client = importlib.import_module("websockets")
        importlib.import_module("websockets.sync.client")
        importlib.import_module("websockets.exceptions")
    except ImportError as error:
        raise InputError(
            f"to follow ws://... takes the package websockets; install it with: "
            f"{pip_install('live')}"
        ) from error
    return client


def _schema(number: int, told: Mapping[str, Any]) -> Schema:
    """A schema as the server tells it: text, or in base 64 where it is not."""
    text, encoding = told.get("schema") or "", told.get("schemaEncoding") or told["encoding"]
    try:
        data = base64.b64decode(text) if encoding == "protobuf" else text.encode()
    except (binascii.Error, ValueError):
        data = b""
    return Schema(id=number, name=told.get("schemaName") or "", encoding=encoding, data=data)


def _records(
    layout: MessageLayout, payloads: Sequence[bytes], first: int, times: NDArray[np.int64]
) -> bytes:
    """Messages as they lie in the chunk of a log; times in ns."""
    records = np.repeat(layout.template, len(payloads))
    records[".sequence"] = np.arange(first, first + len(payloads)).astype(np.uint32)
    records[".log_time"] = records[".publish_time"] = times
    taken = sum(8 + len(tag(number)) for number in layout.numbers.values())
    whole = [p if len(p) == taken else _completed(layout, p) for p in payloads]
    rows = records.view(np.uint8).reshape(len(payloads), -1)
    rows[:, -taken:] = np.frombuffer(b"".join(whole), np.uint8).reshape(len(payloads), taken)
    return records.tobytes()


def _completed(layout: MessageLayout, payload: bytes) -> bytes:
    """A message with every field in its order: who writes protobuf may leave out zeros."""
    values, at = dict[int, bytes](), 0
    while at < len(payload):
        key = shift = 0
        while at < len(payload):
            byte = payload[at]
            key |= (byte & 0x7F) << shift
            at, shift = at + 1, shift + 7
            if byte < 0x80:
                break
        if key & 7 != _DOUBLE or at + 8 > len(payload):
            raise InputError("a message is not of doubles alone, as its schema says")
        values[key >> 3] = payload[at : at + 8]
        at += 8
    return b"".join(tag(n) + values.get(n, bytes(8)) for n in layout.numbers.values())
