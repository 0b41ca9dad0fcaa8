"""The first module of `twin`: from here on Ctrl-C and SIGTERM end it in one line, at any moment.

What is loaded before is loaded without: only what the interpreter has loaded for itself.
"""

from __future__ import annotations

import os
import signal
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from types import FrameType
    from typing import Any, NoReturn

IMPORTS = "<frozen importlib._bootstrap>"  # as its code names itself
SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Ended(SystemExit):
    """A signal that asks the program to end; no ``except Exception`` holds it."""

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self.number = number


def main() -> None:
    """Entry point of `twin`."""
    sys.unraisablehook = _swallowed
    # What MuJoCo loads for drawing starts a Python of its own, which tells of the signal too.
    os.environ.setdefault("MUJOCO_GL", "disable")
    for number in SIGNALS:
        signal.signal(number, _end)
    try:
        from identify.cli import main as run

        run()
    except Ended as ended:
        _say(ended.number)
        raise SystemExit(ended.code) from None
    finally:
        for number in SIGNALS:  # what is left is to end, and the exit code is known
            signal.signal(number, signal.SIG_IGN)


def _end(number: int, frame: FrameType | None) -> None:
    """Leave what runs in order. Threads that are waited for may hold that up."""
    if _loads(frame):  # a library may turn what is raised there into an error of its own
        _end_at_once(number)
    seconds = 2.0  # for what runs to be left in order; then the program ends where it is
    _alarm(seconds, lambda *_: _end_at_once(number))
    raise Ended(number)


def _loads(frame: FrameType | None) -> bool:
    """Whether a module is being loaded."""
    while frame is not None:
        if frame.f_code.co_filename == IMPORTS:
            return True
        frame = frame.f_back
    return False


def _swallowed(fault: Any) -> None:
    """A signal that arrived within a callback from compiled code is raised again behind it."""
    if isinstance(fault.exc_value, Ended):
        number = fault.exc_value.number
        again = 0.05  # s after which a signal is raised again that a library has swallowed
        _alarm(again, lambda *_: _end(number, None))
        return
    sys.__unraisablehook__(fault)


def _alarm(seconds: float, action: Any) -> None:
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, action)
        signal.setitimer(signal.ITIMER_REAL, seconds)


def _end_at_once(number: int) -> NoReturn:
    files = sys.modules.get("twin.files")
    if files is not None:
        files.remove_unfinished()
    _say(number)
    os._exit(128 + number)


def _say(number: int) -> None:
    word = "interrupted" if number == signal.SIGINT else "terminated"
    print(f"twin: {word}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
