"""What the server answers to the questions of its page, without a browser."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra app is not installed")
from app_runs import Answer, asked
from planted_logs import SLIDE

from identify.app.server import Server, application, listening
from identify.project.folder import Folder
from twin.errors import InputError
from twin.logs import AxisLog, Log, write_log
from twin.model.file import save_model
from twin.model.machine import MachineModel

TOKEN, PORT = "a-token", 8123
KNOWN = {"host": f"127.0.0.1:{PORT}", "cookie": f"twin-{PORT}={TOKEN}"}


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    made = Folder(tmp_path / "machine")
    made.root.mkdir()
    made.begin()
    return made


@pytest.fixture
def app(folder: Folder):
    server = Server(folder, limit=10**6)
    yield application(server, TOKEN, PORT)
    server.jobs.close()


def get(app, path: str) -> Answer:
    return asked(app, path, **KNOWN)


def told(answer: Answer) -> dict:
    assert answer.status == 200, answer.body
    return json.loads(answer.body)


def test_the_state_is_told_once_and_again_when_a_file_has_come(app, folder) -> None:
    first = told(get(app, "/api/state"))
    assert first["name"] == "machine"
    assert first["files"] == []
    assert first["error"] is None
    since = f"/api/state?since={first['signature']}"
    assert get(app, since).status == 204  # nothing is new, and the page has gone
    (folder.root / "run.csv").write_text("t,x\n", encoding="utf-8")
    (folder.root / "notes.md").write_text("x", encoding="utf-8")
    (folder.root / "arm.xml").write_text("<mujoco/>", encoding="utf-8")
    os.utime(folder.root, (1, 1))
    then = told(get(app, since))
    assert then["signature"] != first["signature"]
    assert then["files"] == [{"name": "run.csv", "taken": False}]
    assert then["mechanisms"] == ["arm.xml"]


def test_the_signals_of_a_log_are_those_of_the_command_and_asked_once(app, folder) -> None:
    t = np.arange(1500) * 1e-3
    x = 0.02 * np.sin(7.0 * t) + 0.01 * np.sin(17.0 * t)
    path, asking = folder.root / "a.mcap", "/api/signals?file=a.mcap"
    write_log(Log(1000.0, {"x": AxisLog({"position": x, "force": 2.0 * x})}), path)
    found = told(get(app, asking))
    (log,) = found["logs"].values()
    channels = log["axes"]["x"]["channels"]
    assert channels["position"]["least"] == pytest.approx(x.min())
    assert channels["force"]["most"] == pytest.approx(2.0 * x.max())
    stamp = path.stat().st_mtime_ns
    path.write_bytes(b"no log")
    os.utime(path, ns=(stamp, stamp))
    assert told(get(app, asking)) == found  # as it was asked of that file already


def test_a_model_an_answer_and_what_is_not_there(app, folder) -> None:
    save_model(MachineModel("m", {"x": SLIDE}, 1000.0), folder.root / "m.toml")
    model = told(get(app, "/api/model?file=m.toml"))
    assert model["file"] == "m.toml"
    assert {v["name"] for v in model["axes"]["x"]["values"]} >= {"mass"}
    saved = {"command": "fit", "model": "text", "mujoco": "<x/>", "parameters": 3, "ok": True}
    (folder.root / "a.json").write_text(json.dumps(saved), encoding="utf-8")
    assert told(get(app, "/api/answer?file=a.json")) == {"command": "fit", "ok": True}
    plan = {"ranking": [], "axes": {"x": 1}}
    (folder.root / "b.json").write_text(json.dumps(plan), encoding="utf-8")
    assert told(get(app, "/api/answer?file=b.json")) == {"ranking": []}
    several = {"ranking": [], "axes": {"x": 1, "y": 2}}
    (folder.root / "c.json").write_text(json.dumps(several), encoding="utf-8")
    assert told(get(app, "/api/answer?file=c.json")) == several
    for path in ("/api/model?file=gone.toml", "/api/answer?file=gone.json", "/files/gone.html"):
        assert get(app, path).status == 404
    assert get(app, "/api/model?file=../x.toml").status == 400


def test_pages_are_shown_and_all_else_is_kept(app, folder) -> None:
    for name in ("a.html", "b.png", "c.csv"):
        (folder.root / name).write_bytes(b"x")
    shown = get(app, "/files/a.html")
    assert "content-disposition" not in shown.headers
    assert shown.headers["content-type"].startswith("text/html")
    assert "content-disposition" not in get(app, "/files/b.png").headers
    for path in ("/files/c.csv", "/files/a.html?keep"):
        kept = get(app, path.replace("?keep", "?keep=1"))
        assert kept.headers["content-disposition"].startswith("attachment")


def test_the_files_of_the_page_are_there_and_no_others(app) -> None:
    assert get(app, "/").headers["content-type"].startswith("text/html")
    assert get(app, "/static/index.html").body == get(app, "/").body
    assert get(app, "/static/server.py").status == 404


@pytest.mark.parametrize("body", [b"", b"no json", b"[1]", b'{"words": ["' + b"x" * 10**5 + b'"]}'])
def test_a_question_that_is_no_object_or_too_long_is_refused(app, body: bytes) -> None:
    answer = asked(app, "/api/run", "POST", body, **KNOWN)
    assert answer.status == 400
    assert b"the request is no JSON object" in answer.body


def test_a_command_that_a_page_may_not_ask_for_is_no_job(app, folder) -> None:
    for words, said in (
        (["demo"], "demo: is no command that a page may ask for"),
        (["diagnose", "--effects", "a.py"], "--effects: is no option that a page may give"),
        (["project", "init"], "project: give role or take or leave"),
        (["import", "../a.csv"], "'../a.csv': is no file of this project"),
        ([""], "a command is a list of words"),
    ):
        answer = asked(app, "/api/run", "POST", json.dumps({"words": words}).encode(), **KNOWN)
        assert (answer.status, json.loads(answer.body)["error"]) == (400, said)
    name = asked(app, "/api/upload/.x", "PUT", b"", **KNOWN)
    assert b"is no name of a file; give one without / that begins plainly" in name.body


def test_a_port_that_is_taken_is_told() -> None:
    with listening(0) as taken:
        number = taken.getsockname()[1]
        taken.listen()
        with pytest.raises(InputError, match=rf"^port {number}: .*; give another one, or 0 for"):
            listening(number)
    with pytest.raises(InputError, match=r"^port 70000: "):
        listening(70_000)
