"""Results of the workflow, complete and frozen: whatever is told of them has been computed."""

from __future__ import annotations

from functools import singledispatch
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.model.machine import MachineModel


@singledispatch
def text_of(result: object) -> str:
    """The text of a result; ``identify.output.text`` has one for each kind of result."""
    return repr(result)


class Printed:
    """A result whose ``str`` is the text that its command prints."""

    model: MachineModel

    def __str__(self) -> str:
        return text_of(self)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.model.name}; print it to read it>"
