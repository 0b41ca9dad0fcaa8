"""What a command says while it works: lines where standard error is no terminal, else a bar."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys

import pytest
from planted_logs import SLIDE, Ride, begun, few, having, logged

from identify.cli.command import Part, roughly
from identify.selection.diagnosis import diagnose_axis
from twin.parallel import within

LINE = re.compile(r"twin: .+ \(\d+ (s|min) so far\)")
DIAGNOSIS = """
import json
from dataclasses import replace
from identify import workflow
from identify.cli.command import progress_on_stderr
from twin.effects import Catalogue, load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
model = load_model("proton_xy", load_catalogue())
model = replace(model, sample_rate=2500.0)
logs = {"log": simulate(model, "tracking", seed=1, duration=3.0)}
known = load_catalogue()
few = Catalogue([known["cable_slab"]])
model = model.with_axis("x", model.axes["x"].without("cable_slab"))
with progress_on_stderr(first=0.1, every=0.05) as progress:
    found = workflow.diagnose(model, logs, catalogue=few, progress=progress)
print(json.dumps(list(found.axes)))
"""
# Two of ten parts, then one that takes long and says nothing.
PLANTED = """
import time
from identify.cli.command import progress_on_stderr
with progress_on_stderr(first={first}, every=0.2) as progress:
    for done in range(3):
        progress("digging", done, 10)
        time.sleep(0.1)
    time.sleep(0.8)
print("dug")
"""


def run(script: str) -> subprocess.CompletedProcess[str]:
    """A process of its own, whose standard error is a pipe."""
    return subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=100
    )


def test_a_diagnosis_says_in_lines_what_it_does_and_its_answer_stays_alone() -> None:
    done = run(DIAGNOSIS)
    assert json.loads(done.stdout) == ["x", "y"]
    lines = done.stderr.splitlines()
    assert all(LINE.fullmatch(line) for line in lines), lines
    assert any(re.search(r"diagnosis of [xy], step 1 of at most 5, \w+", line) for line in lines), (
        lines
    )


def test_lines_come_while_a_part_says_nothing_and_its_time_left_grows() -> None:
    done = run(PLANTED.format(first=0.25))
    assert done.stdout == "dug\n"
    lines = done.stderr.splitlines()
    assert 3 <= len(lines) <= 6, "one in 0.2 s, of the 1.1 s"
    assert lines[-1].startswith("twin: digging: 2 of 10, about ")
    left = [int(line.split("about ")[1].split(" s left")[0]) for line in lines]
    assert left == sorted(left)
    assert left[-1] >= 3


@pytest.mark.skipif(sys.platform == "win32", reason="no terminal to give a process there")
def test_on_a_terminal_it_is_a_bar_that_goes_when_the_work_is_done() -> None:
    import pty

    ours, theirs = pty.openpty()
    made = subprocess.run(
        [sys.executable, "-c", PLANTED.format(first=0.0)], stderr=theirs, stdout=subprocess.PIPE,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"}, text=True, check=True, timeout=100,
    )  # fmt: skip
    os.close(theirs)
    shown = os.read(ours, 1 << 16).decode()
    os.close(ours)
    assert made.stdout == "dug\n"
    assert "digging: 2 of 10, about " in shown
    assert "━" in shown
    assert "twin:" not in shown
    assert "\x1b[2K" in shown.rpartition("so far)")[2], "what is drawn last is wiped"


def test_a_search_counts_the_changes_of_each_step() -> None:
    told: list[tuple[str, int, int]] = []
    log, known = logged(having(SLIDE, "constant_force", F0=0.3), Ride(1)), few("wear", "spring")
    diagnose_axis(
        *begun(SLIDE, {"one": log}, {}),
        known,
        within(lambda *at: told.append(at), "diagnosis of x"),
    )
    what = "diagnosis of x, step 1 of at most 5, trying changes"
    counted = [(done, total) for name, done, total in told if name == what]
    total = counted[0][1]
    assert total >= len(known)
    assert counted == [(k, total) for k in range(total + 1)]
    assert all(0 <= done <= of for _, done, of in told)


def test_the_time_left_is_by_what_was_done_since_the_part_began() -> None:
    at = Part("p", 30, 50, first=10, begun=100.0)
    assert at.left(140.0) == pytest.approx(40.0)
    assert at.words(140.0) == "p: 30 of 50, about 40 s left of this part"
    for none in (Part("p", 10, 50, 10, 100.0), Part("p", 50, 50, 10, 100.0)):
        assert none.left(140.0) is None
        assert none.words(140.0) == f"p: {none.done} of 50"
    assert Part("p", 0, 1, 0, 100.0).words(140.0) == "p"
    assert Part("p", 1500, 6000, 0, 0.0).words(60.0) == "p: 25 %, about 3 min left of this part"


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "1 s"), (99.0, "99 s"), (100.0, "2 min"), (9000.0, "2.5 h")],
)
def test_a_time_is_told_as_roughly_as_it_is_known(seconds: float, words: str) -> None:
    assert roughly(seconds) == words
