"""How a result prints itself: as the text of its command, which ``identify.output`` makes."""

from __future__ import annotations

from functools import singledispatch


@singledispatch
def text_of(result: object) -> str:
    """The text of a result; ``identify.output.text`` has one for each kind of result."""
    return repr(result)


class Printed:
    """A result whose ``str`` is the text that its command prints."""

    def __str__(self) -> str:
        return text_of(self)
