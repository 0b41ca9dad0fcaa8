"""Results as text, JSON and HTML report; every sentence about a result is made here.

Nothing here computes a result. ``words`` makes the sentences that text, JSON and report share.
``shown`` tells what is shown of each result, as ``blocks``; ``text`` writes blocks for a terminal,
``report`` for a page or a notebook, and neither knows a result. Pictures become files here.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import InputError
from twin.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")
INKS = ("#2f6db3", "#b4530f")  # without and with, or measured and model, as on a page


def require_picture(path: Path) -> str:
    """The format of a picture by its name; raises InputError where it ends otherwise."""
    kind = path.suffix.lstrip(".")
    if kind not in FORMATS:
        raise InputError(f"{path}: cannot draw '{path.suffix}'; end the name in .png, .svg or .pdf")
    return kind


def save_picture(figure: Figure, path: Path) -> None:
    """Write a picture, whole or not at all; raises InputError as ``require_picture`` does."""
    content = io.BytesIO()
    figure.savefig(content, format=require_picture(path), dpi=130)
    write_atomically(path, content.getvalue())
