"""A result prints itself, keeps itself in a file, and draws what it leaves.

How, is told by ``identify.output`` for each kind of result.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import singledispatch
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@singledispatch
def text_of(result: object) -> str:
    """The text of a result; ``identify.output.text`` has one for each kind of result."""
    return repr(result)


@singledispatch
def html_of(result: object) -> str | None:
    """A result as a piece of HTML; None of a kind that has none."""
    return None


@singledispatch
def figure_of(result: object, coordinate: str | None, axis: str | None) -> Figure:
    """The residual of an axis over a coordinate; the leading ones where None."""
    raise TypeError(f"a {type(result).__name__} has no residual")


@singledispatch
def report_of(result: object, path: Path) -> None:
    """Write a result as a page."""
    raise TypeError(f"a {type(result).__name__} has no page")


@singledispatch
def save_of(result: object, path: Path) -> None:
    """Write a result as the JSON of its command."""
    raise TypeError(f"a {type(result).__name__} has no JSON")


def hooked(hook: Callable[..., Any], *given: object) -> Any:
    """What a hook says of a result; one that was unpickled may be the first that is asked."""
    import_module("identify.output.printing")
    return hook(*given)


class Printed:
    """A result whose ``str`` is the text that its command prints; in a notebook, tables."""

    def __str__(self) -> str:
        return hooked(text_of, self)

    def __repr__(self) -> str:
        of = getattr(self, "model", None)
        name = f" of {of.name}" if of else ""
        return f"<{type(self).__name__}{name}; print it to read it>"

    def save(self, path: Path | str) -> None:
        """Write it as the JSON that its command prints; ``identify.load`` reads it again.

        It appears whole or not at all. Raises InputError where its folder does not exist.
        """
        hooked(save_of, self, Path(path))

    def _repr_html_(self) -> str | None:
        return hooked(html_of, self)


@dataclass(frozen=True)
class Residual:
    """The force residual of a result, to be drawn."""

    of: object

    def against(self, coordinate: str, axis: str | None = None) -> Figure:
        """It over a coordinate, such as "position"; of the leading axis where none is named."""
        return hooked(figure_of, self.of, coordinate, axis)


class Pictured(Printed):
    """A result with a residual."""

    def plot(self, axis: str | None = None) -> Figure:
        """The residual over the coordinate that the answer is about."""
        return hooked(figure_of, self, None, axis)

    def report(self, path: Path | str) -> None:
        """Write the page that ``twin compare`` and ``twin diagnose`` write with -o: one HTML file.

        It appears whole or not at all. Raises InputError where its folder does not exist.
        """
        hooked(report_of, self, Path(path))

    @property
    def residual(self) -> Residual:
        """E.g. ``found.residual.against("position")``."""
        return Residual(self)
