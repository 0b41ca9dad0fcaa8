"""The command line: `twin COMMAND`."""

from __future__ import annotations

import sys

from identify.cli import loop, machine
from identify.cli.shared import app
from twin.errors import InputError

__all__ = ["loop", "machine", "main"]


def main() -> None:
    """Entry point of `twin`: errors are one line, exit code 2."""
    try:
        code = app(standalone_mode=False)
    except InputError as error:
        code = fail(str(error))
    except KeyboardInterrupt:
        code = fail("interrupted")
    except Exception as error:
        # Usage errors; their class has moved between versions of the command-line library.
        if not hasattr(error, "format_message"):
            raise
        code = fail(f"{error.format_message()} See `twin --help`.")
    sys.exit(code if isinstance(code, int) else 0)


def fail(message: str) -> int:
    print(f"twin: {' '.join(message.split())}", file=sys.stderr)
    return 2
