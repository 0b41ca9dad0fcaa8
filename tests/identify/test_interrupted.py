"""Ctrl-C and SIGTERM end `twin` in one line, with their exit code, and leave nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
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
