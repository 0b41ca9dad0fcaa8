"""How this installation gets the packages that only some commands need."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

PACKAGE = "proton-twin"


def pip_install(extra: str) -> str:
    """The command that installs an extra; from the folder where the package comes from one."""
    editable, folder = _source()
    if folder is None:
        return f'pip install "{PACKAGE}[{extra}]"'
    return f"pip install {'-e ' if editable else ''}{shlex.quote(f'{folder}[{extra}]')}"


def _source() -> tuple[bool, Path | None]:
    """Whether it is installed as it lies there, and its folder; None where it is from an index."""
    # They take a tenth of the start of `twin`, and are asked for by what is missing alone.
    from importlib.metadata import PackageNotFoundError, distribution
    from urllib.parse import urlparse
    from urllib.request import url2pathname

    try:
        text = distribution(PACKAGE).read_text("direct_url.json")
    except PackageNotFoundError:
        beside = Path(__file__).resolve().parent.parent
        return True, beside if (beside / "pyproject.toml").exists() else None
    given = json.loads(text or "{}")
    url = urlparse(given.get("url", ""))
    if url.scheme != "file" or "dir_info" not in given:
        return False, None
    return bool(given["dir_info"].get("editable")), Path(url2pathname(url.path))
