"""Sentences about a recording that is another than a mechanism's file needs."""

from __future__ import annotations

from identify.analysis.motor_rotor import RotorBeforeGear
from identify.analysis.recording import Recording
from identify.output.numbers import percent
from twin.model.machine import MachineModel


def recording_in_words(found: Recording) -> str:
    """In what it is another, what to change, and what bodies and friction leave without and with.

    Of the torque of the joint of which it makes most.
    """
    before, after = percent(found.before), percent(found.after)
    return (
        f"{found.said}: bodies and friction then leave {after} of the torque of {found.axis}, in "
        f"place of {before}; correct the import map, or the file"
    )


def read_otherwise_in_words(found: Recording | None) -> list[str]:
    """The same, and that the answers are about logs read so; nothing where they are right."""
    if found is None:
        return []
    said = recording_in_words(found)
    return [
        f"The recording is not what the model needs: {said}.",
        "All that follows is of the logs as they are then.",
    ]


def rotor_in_words(found: RotorBeforeGear, model: MachineModel) -> str:
    """That a file states a rotor before its gear, and what to state in its place."""
    unit, file = model.axes[found.axis].units.mass, model.mjcf_name
    return (
        f"{file}: warning: axis {found.axis}: armature {found.stated:.3g} {unit} is that of the "
        f"rotor alone; behind the gear of {found.gear:g} the joint feels {found.gear:g}^2 times "
        f"that, {found.at_joint:.3g} {unit}, and the log asks for {found.asked:.3g} {unit}; state "
        f'armature="{found.at_joint:.3g}" in the file'
    )
