"""Topics of a machine are followed as its log is, and what is found is served as topics."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from dataclasses import replace
from io import StringIO
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest
from cli_runs import refusal
from machines import tracked

from identify.fleet.change_point import AFTER
from identify.fleet.floor import STAGE
from identify.fleet.live_diagnosis import Background, named_in
from identify.fleet.served import serving
from identify.fleet.watch import Watcher, Window
from identify.output.live import table_of
from identify.results.fleet import LiveAlarm
from twin.errors import InputError
from twin.logs import Log
from twin.logs.live import LiveTopics
from twin.logs.topics import AXIS_SAMPLE, FIELD_NUMBERS, file_descriptor_set, tag
from twin.model.file import load_model

foxglove = pytest.importorskip("foxglove", reason="foxglove-sdk (extra live) is not installed")
pytest.importorskip("websockets", reason="websockets (extra live) is not installed")

MODEL = load_model(STAGE)
SECONDS = 6
SOON = 5.0  # s for what was sent to arrive


@pytest.fixture(scope="module")
def log() -> Log:
    return tracked(MODEL, seed=3, duration=float(SECONDS))


class Machine:
    """Serves the samples of a log as a machine would."""

    channel: Any

    def __init__(self, log: Log, port: int = 0, **metadata: str) -> None:
        self.columns = log.axes["x"].columns
        self.rate, self.context = log.sample_rate, foxglove.Context()
        context = self.context
        self.server = foxglove.start_server(port=port, context=context, message_backlog_size=9999)
        self.advertise(**metadata)
        foxglove.Channel("/camera", schema={"type": "object"}, context=context)

    def advertise(self, **metadata: str) -> None:
        numbers = {name: FIELD_NUMBERS[name] for name in self.columns}
        schema = foxglove.Schema(
            name=AXIS_SAMPLE, encoding="protobuf", data=file_descriptor_set(AXIS_SAMPLE, numbers)
        )
        self.channel = foxglove.Channel(
            "/axis/x", schema=schema, message_encoding="protobuf", context=self.context,
            metadata=metadata,
        )  # fmt: skip

    def send(self, first: int, last: int, late: float = 0.0) -> None:
        for i in range(first, last):
            values = {n: struct.pack("<d", c[i]) for n, c in self.columns.items()}
            # As a writer of protobuf does: what is zero is left out.
            payload = b"".join(tag(FIELD_NUMBERS[n]) + v for n, v in values.items() if any(v))
            self.channel.log(payload, log_time=round((i / self.rate + 1.0 + late) * 1e9))


@contextmanager
def machine(log: Log, port: int = 0, **metadata: str) -> Iterator[Machine]:
    """At a port that one before may not have left yet."""

    def served() -> Machine | None:
        try:
            return Machine(log, port, **metadata)
        except RuntimeError:
            return None

    made = until(served)
    try:
        yield made
    finally:
        made.server.stop()


@contextmanager
def followed(made: Machine) -> Iterator[LiveTopics]:
    live = LiveTopics(f"ws://127.0.0.1:{made.server.port}")
    try:
        until(lambda: not list(live.windows(1.0)) and made.channel.has_sinks())
        yield live
    finally:
        live.close()


def until(what: Any) -> Any:
    """What something gives as soon as it gives anything."""
    end = monotonic() + SOON
    while not (found := what()) and monotonic() < end:
        sleep(0.01)
    return found


def windows(live: LiveTopics, count: int) -> list[tuple[float, Log]]:
    seen: list[tuple[float, Log]] = []
    until(lambda: seen.extend(live.windows(1.0)) or len(seen) >= count)
    return seen


@pytest.mark.parametrize("stated", [{"sample_rate_hz": "1000.0"}, {}])
def test_the_windows_of_topics_are_those_of_the_log(log, stated) -> None:
    """Also where the server tells no sample rate."""
    with machine(log, **stated) as made, followed(made) as live:
        made.send(0, 2500)
        seen = windows(live, 2)
        assert [start for start, _ in seen] == [1.0, 2.0]
        for i, (_, window) in enumerate(seen):
            part = log.part(1000 * i, 1000 * (i + 1))
            assert window.sample_rate == 1000.0
            for name, column in part.axes["x"].columns.items():
                assert np.array_equal(window.axes["x"].columns[name], column)
        assert live.told == []


def test_lost_messages_and_a_clock_that_jumps_back_are_told_and_followed(log) -> None:
    with machine(log) as made, followed(made) as live:
        made.send(0, 1300, late=30.0)
        made.send(1310, 2600, late=30.0)
        made.send(2600, 3700, late=10.0)
        seen = windows(live, 3)
        assert [round(start, 3) for start, _ in seen] == [31.0, 32.31, 13.6]
        assert "a gap: 32.299 s is followed by 32.31 s" in live.told[0]
        assert "its clock jumps: 33.599 s is followed by 13.6 s" in live.told[1]
        assert len(live.told) == 2


def test_a_server_that_dies_and_comes_back_is_followed_again(log) -> None:
    with machine(log) as made, followed(made) as live:
        port = made.server.port
        made.send(0, 1100)
        assert len(windows(live, 1)) == 1
        made.server.stop()
        until(lambda: list(live.windows(1.0)) or live.told)
        assert "the connection was lost" in live.told[0]
        with machine(log, port) as again:
            until(lambda: list(live.windows(1.0)) or again.channel.has_sinks())
            again.send(0, 1100)
            assert len(windows(live, 1)) == 1
        assert "serves again" in live.told[1]


def test_a_topic_that_is_taken_back_and_served_anew_is_followed(log) -> None:
    with machine(log) as made, followed(made) as live:
        made.send(0, 1100)
        assert len(windows(live, 1)) == 1
        made.channel.close()
        until(lambda: list(live.windows(1.0)) or live.told)
        assert live.told == [f"{live.address}: /axis/x: taken back"]
        made.advertise()
        until(lambda: list(live.windows(1.0)) or made.channel.has_sinks())
        made.send(2000, 3100)
        assert [start for start, _ in windows(live, 1)] == [3.0]
        assert len(live.told) == 1


def test_where_nobody_serves_a_line_says_so(tmp_path) -> None:
    said = refusal("watch", "ws://127.0.0.1:9", STAGE, folder=tmp_path)
    assert "nobody serves topics there" in said
    (tmp_path / "x.mcap").write_bytes(b"")
    with serving(0) as served:
        port = served.address.rpartition(":")[2]
        said = refusal("watch", "x.mcap", STAGE, "--serve", port, folder=tmp_path)
    assert "give another port" in said


def test_parameters_are_followed_and_one_that_changes_is_found(log) -> None:
    """A tenth more friction from the third second on; an axis at rest forgets nothing."""
    axis = MODEL.axes["x"]
    friction = axis["coulomb_viscous"]
    moved = replace(friction, values={**friction.values, "Fc": 1.1 * friction.values["Fc"]})
    other = MODEL.with_axis("x", axis.without("coulomb_viscous").with_effect(moved))
    seen = told(Watcher(MODEL), tracked(other, seed=3, duration=float(SECONDS)))
    now = {p.name: p for p in seen[-1].axes[0].parameters}
    found = now["coulomb_viscous.Fc"]
    assert found.fitted == friction.values["Fc"]
    assert abs(found.value - 1.1 * found.fitted) < 2.0 * found.half < 0.01 * found.fitted
    usual = {p.name: p for p in told(Watcher(MODEL), log)[-1].axes[0].parameters}
    assert abs(usual["coulomb_viscous.Fc"].value - found.fitted) < 0.01 * found.fitted


def test_the_usual_error_is_that_of_the_windows_that_were_well(log) -> None:
    first, *_ = (w for w in told(Watcher(MODEL), log) if w.axes)
    assert first.axes[0].usual is None
    watcher = Watcher(MODEL)
    watcher.errors["x"] = [0.02, 0.03, 0.07] * AFTER
    again, *_ = (w for w in told(watcher, log) if w.axes)
    assert again.axes[0].usual == 0.03


def told(watcher: Watcher, log: Log) -> list[Window]:
    count = round(log.sample_rate)
    return [watcher.take(float(i), log.part(i * count, (i + 1) * count)) for i in range(SECONDS)]


def test_what_was_travelled_fades_and_time_alone_does_not(log) -> None:
    from identify.fleet.recursion import Recursion

    watcher = Watcher(MODEL)
    watcher.then = float(SECONDS)
    slow, logs = Recursion.of(MODEL.axes["x"]), [watcher._prepared("x", log)]
    count, none = len(slow.where), np.zeros(len(logs[0]), dtype=bool)
    slow.root = np.eye(count)
    slow.take(logs, np.zeros(len(none)), none, 0.0)  # at rest
    assert np.array_equal(slow.root, np.eye(count))
    loud = 1e9 * np.random.default_rng(0).standard_normal(len(none))
    for _ in range(60):
        slow.take(logs, loud, ~none, 0.5)  # far, and it tells nothing
    assert np.abs(np.diag(slow.root)) == pytest.approx(np.exp(-0.5), rel=1e-6)


class Here(Executor):
    """Runs a job at once."""

    def submit(self, job: Any, /, *given: Any, **named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(job(*given, **named))
        except InputError as error:
            future.set_exception(error)
        return future


def alarm(changed: float, after: float = 2.0) -> LiveAlarm:
    return LiveAlarm("x", changed + 3.0, changed, 1.0, after, "N")


def test_the_time_since_an_alarm_is_diagnosed_once_there_is_enough(log, monkeypatch) -> None:
    asked: list[Log] = []
    job = "identify.fleet.live_diagnosis.named_in"
    monkeypatch.setattr(job, lambda model, axis, log, effects: asked.append(log) or ("cogging",))
    behind, minute = Background(MODEL, Here()), log.part(0, 1000)
    for i in range(70):
        alarms = (alarm(20.0), alarm(20.0, after=0.5)) if i == 23 else ()
        behind.take(Window(i + 1.0, minute, alarms=alarms))
        causes = list(behind.ended())
        assert bool(causes) is (i == 49)  # 30 s after the change
        if causes:
            assert causes[0].named == ("cogging",)
    assert [len(one) for one in asked] == [30_000]
    behind.take(Window(1000.0, minute, alarms=(alarm(999.0),)))
    (cause,) = behind.rest()
    assert "less than 9 s" in cause.failed
    for i in range(400):
        behind.take(Window(1001.0 + i, minute))
    assert len(behind.held) == 181


@pytest.mark.slow
def test_the_diagnosis_names_what_came(log) -> None:
    from twin.effects import load_catalogue
    from twin.model.machine import Fitted

    extra = Fitted.at_start(load_catalogue()["cogging"], {"p": 0.02, "a1": 0.2})
    spoilt = MODEL.with_axis("x", MODEL.axes["x"].with_effect(extra))
    assert named_in(MODEL, "x", tracked(spoilt, seed=4, duration=12.0)) == ("cogging",)


# --- what is served -------------------------------------------------------------------------------


def test_a_client_that_is_none_of_the_library_reads_back_what_is_served(log) -> None:
    from websockets.sync.client import connect

    seen = told(Watcher(MODEL), log)
    with serving(0) as served:
        served.tell(replace(seen[-1], alarms=(alarm(2.0),)))
        with connect(served.address, subprotocols=["foxglove.sdk.v1"]) as client:
            said = [json.loads(client.recv(timeout=SOON)) for _ in range(2)]
            channels = {c["topic"]: c for c in said[1]["channels"]}
            assert sorted(channels) == ["/twin/alarms", "/twin/x/parameters", "/twin/x/residual"]
            assert channels["/twin/x/residual"]["metadata"] == {"unit": "N"}
            ids = [{"id": i, "channelId": c["id"]} for i, c in enumerate(channels.values())]
            client.send(json.dumps({"op": "subscribe", "subscriptions": ids}))
            until(lambda: all(c.has_sinks() for c in served._channels.values()))
            served.tell(replace(seen[-1], alarms=(alarm(2.0),)))
            axis = seen[-1].axes[0]
            got = [client.recv(timeout=SOON) for _ in range(len(axis.time) + 2)]
    read = [(m[0], struct.unpack_from("<IQ", m, 1), json.loads(m[13:])) for m in got]
    left = [body for _, (_, _), body in read if "residual" in body]
    assert [one["residual"] for one in left] == axis.residual.tolist()
    (parameters,) = (body for _, _, body in read if "coulomb_viscous" in body)
    own = {p.name: p for p in axis.parameters}["coulomb_viscous.Fc"]
    assert parameters["coulomb_viscous"]["Fc"]["value"] == own.value
    assert parameters["coulomb_viscous"]["Fc"]["low"] == own.value - own.half
    (told_alarm,) = (body for _, _, body in read if "text" in body)
    assert told_alarm["changed"] == 2.0


NODE = """
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { WebSocket } = require("ws");
const client = new FoxgloveClient({ ws: new WebSocket(process.argv[1], ["foxglove.sdk.v1"]) });
client.on("advertise", (channels) => channels.forEach((c) => client.subscribe(c.id)));
client.on("message", (m) => {
  console.log(Buffer.from(m.data.buffer, m.data.byteOffset, m.data.byteLength).toString());
  process.exit(0);
});
"""


def _node() -> str | None:
    """Why the client of npm cannot be used here."""
    if shutil.which("node") is None:
        return "node is not installed"
    found = subprocess.run(["node", "-e", NODE.split("const client")[0]], capture_output=True)
    return None if found.returncode == 0 else "npm's @foxglove/ws-protocol and ws are not installed"


def test_the_client_of_npm_reads_it_back(log) -> None:
    if why := _node():
        pytest.skip(why)
    window = told(Watcher(MODEL), log)[-1]
    with serving(0) as served:
        served.tell(window)
        with subprocess.Popen(
            ["node", "-e", NODE, served.address], stdout=subprocess.PIPE, text=True
        ) as node:
            until(lambda: served._channels["/twin/x/residual"].has_sinks())
            served.tell(window)
            out, _ = node.communicate(timeout=4.0 * SOON)
    assert json.loads(out)["residual"] == window.axes[0].residual[0]


def test_the_terminal_shows_error_and_parameters(log) -> None:
    from rich.console import Console

    window = told(Watcher(MODEL), log)[-1]
    console = Console(width=120, record=True, file=StringIO())
    console.print(table_of("run.mcap", window.end, window.axes))
    text = console.export_text()
    assert "run.mcap, 6 s" in text
    assert "coulomb_viscous.Fc" in text
    assert "(fitted 2.00 N)" in text
