"""The JSON of a body of a mechanism whose inertia is not that of its file."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from identify.dataset.body import INERTIAL
from identify.dataset.dataset import Role
from identify.mechanism.bodies import WrongBody
from identify.output.answers import Answer, Entry, answer_of, read
from identify.results.grown import CorrectedBody
from twin.model.machine import MachineModel
from twin.record import Number


class InertialEntry(Entry):
    """An inertial parameter of a body, about the body's own frame."""

    more: Number
    """Than in the file."""
    band_90: Number
    """Half of its 90 % band."""
    unit: str


class BodyErrorsEntry(Entry):
    """RMS force errors of an axis without and with a change."""

    before: Number
    after: Number
    on: Role
    unit: str


class BodyEntry(Entry):
    """A body of a mechanism whose inertia is not that of its file."""

    body: str
    ambiguous_with: list[str] = read("tied")
    axes: list[str]
    """Whose forces it changes."""
    confidence: Number
    part: Number = read("score.part")
    t: Number = read("score.t")
    control: Number = read("score.control")
    parameters: dict[str, InertialEntry]
    """That differ from the file by more than their band."""
    not_told: list[str] = read("undetermined")
    """By these joints, or only together with others."""
    disagreeing: list[str]
    """Logs that by themselves tell another change."""
    errors: dict[str, BodyErrorsEntry]


class BodyAnswer(Answer, BodyEntry):
    """What `twin add link_mass` prints: the body that was corrected, and what was written."""

    element: str
    mujoco: str
    """The file that has it."""
    left_out: list[str] = Field([])


@answer_of.register
def _(result: CorrectedBody, **more: Any) -> BodyAnswer:
    own, file = values_of_body(result.body, result.given), result.model.mjcf_name
    return BodyAnswer.of(result.body, element=result.element, mujoco=file, **own, **more)


def values_of_body(found: WrongBody, model: MachineModel) -> dict[str, Any]:
    """Its parameters and errors, with their units."""
    told = {
        name: InertialEntry(more=value, band_90=band, unit=INERTIAL[name])
        for name, (value, band) in found.differing.items()
    }
    errors = {
        axis: BodyErrorsEntry.of(own, unit=model.axes[axis].units.force)
        for axis, own in found.errors.items()
    }
    return {"parameters": told, "errors": errors}
