"""What a command loads before it works, and how a signal ends it: in one line."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from twin.logs import AxisLog, Log, write_log
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


def test_matrices_are_not_shared_out_unless_the_user_says_so(tmp_path: Path) -> None:
    found = started("--help", folder=tmp_path, OMP_NUM_THREADS="3")
    assert not found["early"]  # read once, when NumPy is imported
    assert found["threads"] == {**dict.fromkeys(VARIABLES, "1"), "OMP_NUM_THREADS": "3"}


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
        assert one_for_matrices(blas_threads)() == {1}
        assert blas_threads() == {2}
        unsaid.setenv(VARIABLES[0], "2")
        assert one_for_matrices(blas_threads)() == {2}


@pytest.mark.usefixtures("unsaid")
def test_calls_that_overlap_have_one_thread_for_matrices_and_leave_them() -> None:
    begun, joined, over = Event(), Event(), Event()

    @one_for_matrices
    def first() -> None:
        begun.set()
        assert joined.wait(timeout=10.0)

    @one_for_matrices
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
