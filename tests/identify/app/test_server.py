"""The server of `twin app`: whom it answers, which files it gives and takes, what it runs."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from time import sleep
from urllib.error import HTTPError
from urllib.request import HTTPCookieProcessor, Request, build_opener, urlopen

import pytest

pytest.importorskip("starlette", reason="the extra app is not installed")
from app_runs import asked, served
from planted_logs import SLIDE, having

from identify.app import jobs as queue
from identify.app.commands import checked
from identify.app.guard import POLICY, upload_name
from identify.app.jobs import Jobs
from identify.app.server import STATIC, Server, application
from identify.app.state import model_of
from identify.project.folder import Folder
from identify.project.history import commands
from twin.errors import InputError
from twin.model.file import save_model
from twin.model.machine import AxisIntervals, MachineModel

TOKEN, PORT = "a-token", 8123
HOST = f"127.0.0.1:{PORT}"
KNOWN = {"host": HOST, "cookie": f"twin-{PORT}={TOKEN}"}


@pytest.fixture
def app(tmp_path: Path):
    folder = Folder(tmp_path / "machine")
    folder.root.mkdir()
    folder.begin()
    server = Server(folder, limit=100)
    yield application(server, TOKEN, PORT)
    server.jobs.close()


def test_the_token_opens_it_once_and_a_cookie_keeps_it_open(app):
    first = asked(app, f"/?token={TOKEN}", host=HOST)
    assert first.status == 303
    assert "token" not in first.headers["location"]
    cookie = first.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    page = asked(app, "/", **KNOWN)
    assert page.status == 200
    assert page.headers["content-security-policy"] == POLICY
    assert page.headers["cache-control"] == "no-store"


def test_the_command_serves_a_project_that_it_begins(tmp_path):
    """Whoever lacks its token is refused, and an upload may be of --upload MB."""
    folder = tmp_path / "new"
    with served(folder, "--upload", "1") as address:
        page, _, token = address.partition("?token=")
        opener = build_opener(HTTPCookieProcessor())
        assert b"<html" in opener.open(address).read()
        with pytest.raises(HTTPError, match="403"):
            urlopen(page)
        to = {"url": f"{page}api/upload/a.csv", "method": "PUT", "headers": {"origin": page[:-1]}}
        assert opener.open(Request(data=b"1" * 10**6, **to)).status == 200
    assert len(token) > 20
    assert commands(Folder(folder)) == ["twin project init"]


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/", {"host": HOST}),
        ("/api/state", {"host": HOST}),
        ("/?token=wrong", {"host": HOST}),
        ("/?token=ü", {"host": HOST}),
        (f"/?token={TOKEN}&token={TOKEN}", {"host": HOST}),
        ("/", {"host": HOST, "cookie": f"twin-{PORT}=wrong"}),
        ("/", {"host": HOST, "cookie": f"twin-9={TOKEN}"}),
        ("/", {**KNOWN, "host": f"evil.example:{PORT}"}),
        ("/", {**KNOWN, "host": "127.0.0.1:9"}),
        (f"/?token={TOKEN}", {"host": "evil.example"}),
        ("/api/state", {**KNOWN, "origin": "https://evil.example"}),
        ("/api/state", {**KNOWN, "origin": "null"}),
        ("/", {"cookie": KNOWN["cookie"]}),
    ],
)
def test_everybody_else_is_refused(app, path, headers):
    assert asked(app, path, **headers).status == 403


def test_no_file_outside_the_project_is_given(app, tmp_path):
    machine = tmp_path / "machine"
    (tmp_path / "secret.html").write_text("secret")
    (machine / "link.html").symlink_to(tmp_path / "secret.html")
    (machine / "up").symlink_to(tmp_path)
    (machine / "own.html").write_text("<p>own")
    for name in ("../secret.html", "%2e%2e/secret.html", "link.html", "up/secret.html",
                 str(tmp_path / "secret.html"), ".twin/.gitignore", "..%00"):  # fmt: skip
        answer = asked(app, f"/files/{name}", **KNOWN)
        assert answer.status in (400, 404), name
        assert b"secret\n" not in answer.body
    own = asked(app, "/files/own.html", **KNOWN)
    assert own.status == 200
    policy = own.headers["content-security-policy"]
    assert policy.startswith("sandbox allow-scripts ")
    assert "same-origin" not in policy  # else a page could ask the server with the user's cookie


def test_an_upload_is_taken_whole_or_not_at_all(app, tmp_path):
    machine = tmp_path / "machine"
    before = sorted(p.name for p in machine.iterdir())
    assert asked(app, "/api/upload/big.csv", "PUT", b"x" * 101, **KNOWN).status == 400
    lied = asked(app, "/api/upload/big.csv", "PUT", b"x" * 101, content_length="5", **KNOWN)
    assert b"is larger than" in lied.body
    for name in ("..%2fa.csv", ".hidden", "project.toml", "-rf.csv"):
        assert asked(app, f"/api/upload/{name}", "PUT", b"x", **KNOWN).status in (400, 404), name
    assert sorted(p.name for p in machine.iterdir()) == before
    assert asked(app, "/api/upload/a%20%3Cb%3E.csv", "PUT", b"t,x\n", **KNOWN).status == 200
    assert (machine / "a <b>.csv").read_bytes() == b"t,x\n"
    again = asked(app, "/api/upload/a%20%3Cb%3E.csv", "PUT", b"other", **KNOWN)
    assert b"is in the project already" in again.body
    assert (machine / "a <b>.csv").read_bytes() == b"t,x\n"


def test_a_job_is_stopped_by_its_number(app):
    """One that there is not was stopped already; what is no number is refused."""
    told = asked(app, "/api/stop", "POST", b'{"number": "one"}', **KNOWN)
    assert told.status == 400
    assert b"give the number of a job" in told.body
    assert asked(app, "/api/stop", "POST", b'{"number": 7}', **KNOWN).status == 200


@pytest.mark.parametrize("name", ["a/b", "a\\b", "..", ".x", "a\n.csv", "", "x" * 300, "-o"])
def test_what_is_no_plain_name_of_a_file_is_refused(name):
    with pytest.raises(InputError):
        upload_name(name)


@pytest.mark.parametrize(
    "words",
    [
        ["demo"], ["diagnose", "--effects", "mine.py"], ["import", "../x.csv"], [],
        ["import", "/etc/passwd"], ["project", "init", "x"], ["view", "a", "--html", "../x.html"],
        ["import", "out.csv"], ["export", "--to", "c", "-o", "x"], "check", [["check"]],
        ["import", "a.csv", "--map=/etc/passwd"],
    ],
)  # fmt: skip
def test_a_page_asks_for_commands_of_the_loop_alone(tmp_path, words):
    (tmp_path / "out.csv").symlink_to("/etc/hostname")
    with pytest.raises(InputError):
        checked(tmp_path, words)


def test_a_model_is_shown_with_its_units_and_intervals(tmp_path):
    axis = having(SLIDE, "cogging", p=0.021, a1=0.9)
    model = MachineModel("m", {"x": axis}, 1000.0)
    ends = {"mass": (5.2, 5.4), "cogging.a1": (0.8, 1.0)}
    model = model.with_intervals("x", AxisIntervals(ends, 1.1))
    folder = Folder(tmp_path)
    save_model(model, tmp_path / "m.toml")
    shown = model_of(folder, "m.toml")["axes"]["x"]
    values = {v["name"]: v for v in shown["values"]}
    assert values["mass"]["shown"] == "5.30 kg"
    assert values["mass"]["band"] == ["5.20 kg", "5.40 kg"]
    cogging = next(e for e in shown["effects"] if e["name"] == "cogging")
    bands = {v["name"]: v["band"] for v in cogging["values"]}
    assert bands["a1"] == ["0.800 N", "1.00 N"]
    assert not bands["p"]


def test_what_a_page_may_ask_for(tmp_path):
    for words in (["diagnose"], ["import", "a b.csv", "--set", "axes.x.position.unit=m/s"],
                  ["cut", "logs/a.mcap", "--from", "-1.5", "--to", "2"]):  # fmt: skip
        assert checked(tmp_path, words) == words


def test_the_page_loads_nothing_from_elsewhere():
    for file in STATIC.iterdir():
        found = re.findall(r"https?://\S+", file.read_text(encoding="utf-8"))
        assert set(found) <= {'http://www.w3.org/2000/svg";'}, file


# --- jobs ---


@pytest.fixture
def jobs(tmp_path, monkeypatch):
    """A queue whose commands are Python programs."""
    monkeypatch.setattr(queue, "PROGRAM", (sys.executable, "-c"))
    folder = Folder(tmp_path)
    folder.begin()
    made = Jobs(folder)
    yield made
    made.close()


def test_jobs_run_one_after_the_other_and_what_they_say_stays(jobs):
    slow = "import time; time.sleep(0.2); print('first'); open('a', 'w')"
    first = jobs.add([slow])
    last = jobs.add(["import os, sys; print(os.path.exists('a')); sys.exit('twin: no')"])
    ended = jobs.wait(last.number, 10.0)
    assert (ended.state, ended.code) == ("done", 1)
    shown = {j["number"]: j for j in Jobs(jobs.folder).shown()}  # as a server that begins anew
    assert shown[first.number]["text"] == "first\n"
    assert shown[last.number]["text"] == "True\n"
    assert shown[last.number]["remarks"] == ["no"]


def test_a_job_that_is_killed_or_stopped_is_told_and_the_next_one_runs(jobs):
    # As `twin` does: what a shell runs in the background is begun with the signal ignored.
    heeds = "import signal as s; s.signal(s.SIGINT, s.default_int_handler)"
    wait = f"{heeds}; import time; print('begun', flush=True); time.sleep(60)"
    killed, stopped, left, last = (jobs.add([text]) for text in (wait, wait, wait, "print(1)"))
    jobs.stop(left.number)
    os.kill(begun(jobs, killed.number), signal.SIGKILL)
    begun(jobs, stopped.number)
    jobs.stop(stopped.number)
    assert jobs.wait(last.number, 10.0).code == 0
    states = [jobs.jobs[j.number].state for j in (killed, stopped, left, last)]
    assert states == ["killed", "stopped", "stopped", "done"]


def begun(jobs: Jobs, number: int) -> int:
    """The process of a job, as soon as it says something."""
    while not jobs.said(jobs.jobs[number], ".out") or jobs.jobs[number].process is None:
        sleep(0.01)
    return int(jobs.jobs[number].process or 0)


def test_of_many_jobs_the_last_ones_are_remembered_and_the_files_of_others_go(jobs):
    for number in range(1, queue.KEPT + 1):
        ended = {"number": number, "words": ["check"], "state": "done", "code": 0}
        (jobs.place / f"{number}.json").write_text(json.dumps(ended))
        (jobs.place / f"{number}.out").write_text("")
    again = Jobs(jobs.folder)
    last = again.add(["print(1)"])
    again.wait(last.number, 10.0)
    again.close()
    assert sorted(again.jobs) == list(range(2, queue.KEPT + 2))
    assert not list(again.place.glob("1.*"))
    assert (again.place / "2.out").is_file()


def test_what_ended_with_the_server_is_told_by_the_next_one(jobs):
    place = jobs.place / "7.json"
    place.write_text(json.dumps({"number": 7, "words": ["diagnose"], "state": "running"}))
    (jobs.place / "8.json").write_text("half")
    assert Jobs(jobs.folder).jobs[7].state == "killed"


@pytest.fixture
def tiny(tmp_path):
    """A disk of its own of 300 kB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", str(disk)]
    if sys.platform != "linux" or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("no disk can be made here: that asks for Linux and for root")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def test_a_full_disk_is_told_in_a_sentence_and_nothing_is_half_written(tiny):
    folder = Folder(tiny)
    folder.begin()
    server = Server(folder, 10**6)
    jobs, app = server.jobs, application(server, TOKEN, PORT)
    before = folder.file.read_bytes()
    (tiny / "fill").write_bytes(bytes(shutil.disk_usage(tiny).free // 4096 * 4096))
    job = jobs.add(["import", "run.csv"])
    assert jobs.wait(job.number, 60.0).code
    (said,) = (j["remarks"] for j in jobs.shown() if j["number"] == job.number)
    assert len(said) == 1
    assert re.search("[Nn]o space( is)? left", said[0])
    given = {**KNOWN, "origin": f"http://{HOST}"}
    answer = asked(app, "/api/upload/run.csv", "PUT", bytes(100_000), **given)
    assert answer.status == 400, answer.body
    assert b"No space left on device" in answer.body
    jobs.close()
    assert folder.file.read_bytes() == before
    assert {p.name for p in tiny.iterdir()} == {"fill", "project.toml", ".twin"}
