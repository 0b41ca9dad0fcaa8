"""What a command loads before it works, what it says meanwhile, and how a signal ends it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from planted_logs import SLIDE, Ride, begun, few, having, logged
from threadpoolctl import threadpool_info, threadpool_limits

from identify.cli.command import Progressed, progress_on_stderr, roughly
from identify.selection.diagnosis import diagnose_axis
from twin.logs import AxisLog, Log, write_log
from twin.parallel import AHEAD, within
from twin.threads import VARIABLES, one_for_matrices

SLOW_PARTS = ("signal", "stats", "special", "optimize", "ndimage", "fft")
HEAVY = {"scipy", "numba", "mujoco", "matplotlib", "jinja2", "rich", "ruckig"}
SCRIPT = """
import contextlib, io, json, os, sys
from identify.cli import main
early = "numpy" in sys.modules
with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
    main()
print(json.dumps({
    "early": early, "loaded": sorted({name.split(".")[0] for name in sys.modules}),
    "threads": {name: v for name, v in os.environ.items() if name.endswith("_NUM_THREADS")},
}))
"""


def started(*arguments: object, folder: Path, **environment: str) -> dict:
    """What a process of its own had loaded when `twin` ended."""
    kept = {k: v for k, v in os.environ.items() if k not in VARIABLES}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *map(str, arguments)],
        cwd=folder, env={**kept, **environment}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(done.stdout)


def small_log(folder: Path) -> Path:
    t = 1e-3 * np.arange(3000)
    columns = {"position": 0.05 * np.sin(3.0 * t), "force": np.cos(3.0 * t)}
    path = folder / "small.mcap"
    write_log(Log(1000.0, {"x": AxisLog(columns)}), path)
    return path


@pytest.mark.parametrize("command", ["--help", "effects gms", "check"])
def test_a_short_command_loads_nothing_that_it_does_not_need(command: str, tmp_path: Path) -> None:
    more = [small_log(tmp_path)] if command == "check" else []
    found = started(*command.split(), *more, folder=tmp_path)
    assert not HEAVY & set(found["loaded"])
    assert ("numpy" in found["loaded"]) == (command == "check")
    if command == "--help":  # which is asked often, and starts in a tenth of a second
        assert "pydantic" not in found["loaded"]


def test_matrices_are_not_shared_out_unless_the_user_says_so(tmp_path: Path) -> None:
    found = started("--help", folder=tmp_path, OMP_NUM_THREADS="3")
    assert not found["early"]  # read once, when NumPy is imported
    assert found["threads"] == {**dict.fromkeys(VARIABLES, "1"), "OMP_NUM_THREADS": "3"}


@pytest.mark.slow
def test_a_fit_is_not_slower_to_load_than_to_run(tmp_path: Path) -> None:
    """SciPy's larger parts take a second to load, the smaller ones half of one, as a fit runs.

    Drawing takes another, and only a report draws; only `twin simulate` and `add` run MuJoCo.
    """
    script = "import json, sys, identify.workflow; print(json.dumps([*sys.modules]))"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    loaded = set(json.loads(done.stdout))
    assert "identify.workflow" in loaded
    assert not {"matplotlib", "jinja2", "mujoco"} & loaded
    assert not {f"scipy.{part}" for part in SLOW_PARTS} & loaded


def blas_threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


@pytest.fixture
def unsaid(monkeypatch) -> pytest.MonkeyPatch:
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    return monkeypatch


def test_a_call_from_python_has_one_thread_for_matrices_and_leaves_them(unsaid) -> None:
    with threadpool_limits(2, user_api="blas"):
        assert one_for_matrices()(blas_threads)() == {1}
        assert blas_threads() == {2}
        unsaid.setenv(VARIABLES[0], "2")
        assert one_for_matrices()(blas_threads)() == {2}


@pytest.mark.usefixtures("unsaid")
def test_calls_that_overlap_have_one_thread_for_matrices_and_leave_them() -> None:
    begun, joined, over = Event(), Event(), Event()

    @one_for_matrices()
    def first() -> None:
        begun.set()
        assert joined.wait(timeout=10.0)

    @one_for_matrices()
    def second() -> set[int]:
        joined.set()
        assert over.wait(timeout=10.0)
        return blas_threads()

    with threadpool_limits(2, user_api="blas"), ThreadPoolExecutor(2) as pool:
        ending = pool.submit(first)
        assert begun.wait(timeout=10.0)
        going_on = pool.submit(second)
        ending.result()
        over.set()
        assert going_on.result() == {1}
        assert blas_threads() == {2}


POSIX = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
ENDINGS = pytest.mark.parametrize(
    ("number", "code", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
COMMAND = [sys.executable, "-m", "identify.start", "simulate", "tracking", "--duration", "60"]


def wait_until_heeded(pid: int) -> None:
    """Until a process has a handler of its own for SIGTERM; before, it is the interpreter's."""
    status = Path(f"/proc/{pid}/status")
    if not status.exists():
        time.sleep(0.5)
        return
    caught = 0
    while not caught >> (signal.SIGTERM - 1) & 1:
        time.sleep(0.002)
        caught = int(status.read_text().partition("SigCgt:")[2].split()[0], 16)


@pytest.mark.short(2)
@POSIX
@ENDINGS
@pytest.mark.parametrize("seconds", [0.0, 1.0])
def test_a_signal_is_one_line(
    number: signal.Signals, code: int, word: str, seconds: float, tmp_path: Path
) -> None:
    run = subprocess.Popen(
        [*COMMAND, "-o", "log.mcap"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    wait_until_heeded(run.pid)
    time.sleep(seconds)
    run.send_signal(number)
    out, err = run.communicate()
    assert (run.returncode, out, err) == (code, "", f"twin: {word}\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("shares", ["cogging 80 %, spring 2 %", ""])
def test_what_is_known_when_a_command_is_stopped_is_told(shares: str, capsys) -> None:
    def stopped() -> None:
        with progress_on_stderr() as progress:
            if shares:
                progress(f"{AHEAD}{shares}", 0, 0)
            raise SystemExit(128 + signal.SIGINT)

    with pytest.raises(SystemExit):
        stopped()
    told = f"twin: stopped; ahead: {shares}; nothing of it is proved yet\n"
    assert capsys.readouterr().err == (told if shares else "")


DEAF = """
import os, time
try:
    os.kill(os.getpid(), {number})
    time.sleep(1.0)
except BaseException as error:
    raise ImportError("initialization failed") from None
"""
LOADS = """
import sys, types
def load(): import deaf
sys.modules["identify.cli"] = types.SimpleNamespace(main=load)
from identify.start import main
main()
"""


@POSIX
@ENDINGS
def test_a_library_that_is_being_loaded_cannot_make_an_error_of_a_signal(
    number: signal.Signals, code: int, word: str, tmp_path: Path
) -> None:
    (tmp_path / "deaf.py").write_text(DEAF.format(number=int(number)))
    path = os.pathsep.join([str(Path(__file__).parents[2]), str(tmp_path)])
    run = subprocess.run(
        [sys.executable, "-c", LOADS], capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    assert (run.returncode, run.stdout, run.stderr) == (code, "", f"twin: {word}\n")


def test_nothing_is_loaded_before_a_signal_is_heeded() -> None:
    """But what the interpreter and the script that pip makes have loaded for themselves."""
    script = "import re, signal, sys; a = {*sys.modules}; import identify.start; " + (
        "print(*sorted({*sys.modules} - a))"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["__future__", "identify", "identify.start"]


LINE = re.compile(r"twin: .+ \(\d+ (s|min) so far\)")
DIAGNOSIS = """
import json
from dataclasses import replace
from identify import workflow
from identify.cli.command import progress_on_stderr
from twin.effects import Catalogue, load_catalogue
from twin.simulation.simulate import simulate
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


@pytest.mark.slow
def test_a_diagnosis_says_in_lines_what_it_does_and_its_answer_stays_alone() -> None:
    done = run(DIAGNOSIS)
    assert json.loads(done.stdout) == ["x", "y"]
    lines = done.stderr.splitlines()
    assert all(LINE.fullmatch(line) for line in lines), lines
    assert any(re.search(r"diagnosis of [xy], step 1 of at most 5, \w+", line) for line in lines), (
        lines
    )


def test_lines_come_while_a_part_says_nothing_and_its_time_left_never_grows() -> None:
    done = run(PLANTED.format(first=0.25))
    assert done.stdout == "dug\n"
    lines = done.stderr.splitlines()
    assert 3 <= len(lines) <= 6, "one in 0.2 s, of the 1.1 s"
    assert lines[-1].startswith("twin: digging: 2 of 10")
    left = [line.split("about ")[1].split(" left")[0] for line in lines if "about" in line]
    assert set(left) == {"1 s"}  # of the 0.8 s that the other eight take


@pytest.mark.slow
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
    at = Progressed("p", 30, 50, first=10, begun=100.0, since=140.0)
    assert at.left(140.0) == pytest.approx(40.0)
    assert at.words(140.0) == "p: 30 of 50, about 40 s left of this part"
    assert at.words(150.0) == "p: 30 of 50, about 30 s left of this part"  # it never grows
    assert at.words(185.0) == "p: 30 of 50"  # longer than all of the rest was to take
    for none in (
        Progressed("p", 10, 50, 10, 100.0, 100.0),
        Progressed("p", 50, 50, 10, 100.0, 140.0),
    ):
        assert none.left(140.0) is None
        assert none.words(140.0) == f"p: {none.done} of 50"
    assert Progressed("p", 0, 1, 0, 100.0, 100.0).words(140.0) == "p"
    assert (
        Progressed("p", 1500, 6000, 0, 0.0, 60.0).words(60.0)
        == "p: 25 %, about 3 min left of this part"
    )


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "1 s"), (99.0, "99 s"), (100.0, "2 min"), (9000.0, "2.5 h")],
)
def test_a_time_is_told_as_roughly_as_it_is_known(seconds: float, words: str) -> None:
    assert roughly(seconds) == words
