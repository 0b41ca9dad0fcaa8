"""Sentences about a recording that is another than a mechanism's file needs."""

from __future__ import annotations

from identify.analysis.recording import Recording
from identify.output.numbers import percent


def recording_in_words(found: Recording) -> str:
    """In what it is another, what to change, and what bodies and friction leave without and with.

    Of the torque of the joint of which it makes most.
    """
    before, after = percent(found.before), percent(found.after)
    return (
        f"{found.said}: bodies and friction then leave {after} of the torque of {found.axis}, in "
        f"place of {before}; correct the import map, or the file"
    )


def read_otherwise_in_words(found: Recording) -> list[str]:
    """The same, and that the answers are about logs that are read so."""
    said = recording_in_words(found)
    return [
        f"The recording is not what the model needs: {said}.",
        "All that follows is of the logs as they are then.",
    ]
