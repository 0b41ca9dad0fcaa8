"""The command line: `twin COMMAND`."""

from __future__ import annotations

import gc
import json
import os
import sys
from collections.abc import Sequence
from functools import cache
from typing import Any

from typer.main import get_command

from identify.cli import browser, doctor, fleet, importing, live, loop, machine, project
from identify.cli.shared import app
from twin.errors import InputError
from twin.threads import VARIABLES

__all__ = [
    "app",
    "browser",
    "doctor",
    "fleet",
    "importing",
    "live",
    "loop",
    "machine",
    "main",
    "project",
]

ANYTHING = {"ignore_unknown_options": True, "allow_extra_args": True}


def _moved(command: str, what: str, how: str) -> None:
    """A command that says where it went."""

    @app.command(command, hidden=True, add_help_option=False, context_settings=ANYTHING)
    def gone() -> None:
        """Say where it went."""
        raise InputError(
            f"{command} is no command any more; run {what} from the source folder with {how}"
        )


_moved("reproduce", "the thesis's study", "`make thesis` or `python -m studies.thesis`")
_moved("selftest", "the self-test", "`make selftest` or `python -m benchmarks selftest`")


def main() -> None:
    """Entry point of `twin`: errors are one line, exit code 2."""
    interrupted = 130  # exit code that typer makes of Ctrl-C, without a word
    # One thread for matrices (twin.threads). Read once, as NumPy is imported by a command.
    for threads in VARIABLES:
        os.environ.setdefault(threads, "1")
    # Modules are a million objects that stay: to seek cycles among them, again and again while
    # they load, is a fifth of the start.
    gc.set_threshold(100_000)  # that may be made before cycles among them are sought
    try:
        _require_no_empty(sys.argv[1:])
        code = _command()(sys.argv[1:] or ["--help"], prog_name="twin", standalone_mode=False)
        if code == interrupted:
            raise KeyboardInterrupt
    except InputError as error:
        code = fail(str(error))
    except KeyboardInterrupt:
        print("twin: interrupted", file=sys.stderr)
        code = interrupted
    except OSError as error:
        code = fail(f"{error.filename}: {error.strerror}; check the name and the permissions")
    except Exception as error:
        if hasattr(error, "format_message"):  # a usage error; its class moves between versions
            said = error.format_message()
            end = "" if said.endswith((".", "?")) else "."
            used = getattr(error, "ctx", None)
            code = fail(f"{said}{end} See `{used.command_path if used else 'twin'} --help`.")
        elif "TWIN_TRACEBACK" in os.environ:
            raise
        else:
            code = fail(
                f"this is a fault of the program: {type(error).__name__}: {error}; please report "
                "it with the command and what TWIN_TRACEBACK=1 adds"
            )
    gc.freeze()  # all of it ends with the process: to seek cycles before takes as long as to load
    sys.exit(code if isinstance(code, int) else 0)


@cache
def _command() -> Any:
    """All commands as one: reading their signatures takes longer than many a command."""
    return get_command(app)


def _require_no_empty(arguments: Sequence[str]) -> None:
    """Raise InputError for an argument without a letter, as an unset variable of a script leaves.

    As a path it would be this folder.
    """
    if "" in arguments:
        place = arguments.index("")
        raise InputError(" ".join([*arguments[:place][-1:], "'': is empty; give a name"]))


def fail(message: str) -> int:
    """Print one line on standard error, and with --json an object; the exit code of bad input."""
    line = " ".join(message.split())
    print(f"twin: {line}", file=sys.stderr)
    if "--json" in sys.argv[1:]:
        from identify.output.answers.machine import ErrorAnswer

        print(json.dumps(ErrorAnswer(error=line).entries()))
    return 2
