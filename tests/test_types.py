"""The types are right: pyrefly, as a test, so that it runs beside the others."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CHECK = (
    sys.executable, "-m", "pyrefly", "check", "--min-severity", "error",
    "--python-interpreter-path", sys.executable, "--config",
)  # fmt: skip


def check(*files: Path) -> subprocess.CompletedProcess[str]:
    words = [*CHECK, "pyproject.toml", *files]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True)


def test_types() -> None:
    done = check()
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_wrong_type_is_told(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.py"
    wrong.write_text("def length() -> int:\n    return 'one metre'\n")
    done = check(wrong)
    assert done.returncode == 1
    assert "bad-return" in done.stdout
