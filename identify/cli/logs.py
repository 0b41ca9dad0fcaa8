"""The command that tells what is in logs."""

from __future__ import annotations

from identify.cli.shared import Json, Logs, app, say


@app.command()
def info(logs: Logs, as_json_: Json = False) -> None:
    """Tell what is in logs: length, rate, axes, signals with units and ranges, and faults.

    Example: twin info fit.mcap
    """
    from identify.output.log_info import info_json, info_text
    from twin.checks.long import log_info

    found = {str(path): log_info(path) for path in logs}
    say(info_text(found), info_json(found), as_json_)
