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
COMMAND = [sys.executable, "-m", "identify.start", "simulate", "tracking", "--duration", "60"]


@pytest.mark.parametrize(
    ("number", "code", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
@pytest.mark.parametrize("seconds", [0.15, 1.0])
def test_a_signal_is_one_line(
    number: signal.Signals, code: int, word: str, seconds: float, tmp_path: Path
) -> None:
    run = subprocess.Popen(
        [*COMMAND, "-o", "log.mcap"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    time.sleep(seconds)
    run.send_signal(number)
    out, err = run.communicate()
    assert (run.returncode, out, err) == (code, "", f"twin: {word}\n")
    assert list(tmp_path.iterdir()) == []
