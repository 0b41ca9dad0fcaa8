"""`twin app`: the loop in a browser."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from typer import Argument, Exit, Option

from identify.cli.shared import app
from twin.errors import InputError


@app.command("app")
def app_(
    folder: Annotated[Path, Argument(metavar="[FOLDER]", help="The project's folder.")] = Path(),
    port: Annotated[int, Option(help="Port of this computer; any that is free if 0.")] = 0,
    browse: Annotated[bool, Option("--open/--no-open", help="Open the browser.")] = True,
    host: Annotated[str, Option(help="Address to listen on: this computer's own alone.")] = (
        "127.0.0.1"
    ),
    upload: Annotated[int, Option(min=1, help="MB of a file that is dropped, at most.")] = 2000,
) -> None:
    """Open the whole loop in a browser: each click runs a command, which is shown.

    Example: twin app servo
    """
    if host not in ("127.0.0.1", "localhost"):
        raise InputError(
            f"--host {host}: the page has neither a password nor TLS, so it is served to this "
            "computer alone; from another one use `ssh -L PORT:127.0.0.1:PORT` and --port PORT"
        )
    try:
        from identify.app.server import serve
    except ImportError as error:
        from twin.installed import pip_install

        raise InputError(
            f"twin app needs {error.name}, which is not here; install it with: {pip_install('app')}"
        ) from error
    from identify.project.folder import Folder
    from identify.project.history import note

    project = Folder(folder)
    if not project.file.exists():
        project.begin()
        note(project, ["project", "init"])
    project.read()  # raises where it is damaged

    def ready(address: str) -> None:
        print(address, flush=True)
        print("twin: Ctrl-C ends it, and what runs in it", file=sys.stderr, flush=True)
        if browse:
            import webbrowser

            webbrowser.open(address)

    serve(project, port, upload * 1_000_000, ready)
    raise Exit
