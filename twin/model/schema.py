"""What a machine model's TOML file may hold. Which effects there are is the catalogue's matter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, ConfigDict, Field, create_model

from twin.effect import LEAST, MOST, Effect
from twin.entries import Entries
from twin.model.machine import Hardware, HistoryStep
from twin.model.units import ROTARY

AXIS_NAME = r"^[A-Za-z_][A-Za-z0-9_]*$"
MOST_AXES = 64
Name = Annotated[str, Field(max_length=80)]
Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Ratio = Annotated[float, Field(ge=0.0)]
Place = Annotated[float, Field(ge=-1e6, le=1e6)]


def _quantity(unit: str, meaning: str, *, zero: bool = False, most: float = 1e12) -> Any:
    """A hardware entry: a number above 0 (or 0 too), with its unit on either kind of axis."""
    bounds: dict[str, Any] = {"ge": 0.0} if zero else {"gt": 0.0}
    least = "a number from 0" if zero else "a number above 0"
    rotary = ROTARY(unit)
    units = unit if rotary == unit else f"{unit} ({rotary} on a rotary axis)"
    if most != float("inf"):
        bounds["le"] = most
        least += f" to {most:g}" if zero else f", at most {most:g}"
    bounds["allow_inf_nan"] = most == float("inf")
    return Field(None, **bounds, description=f"{least}, in {units}: {meaning}")


def _moved(unit: str, what: str, force: str) -> Any:
    """A moved mass: 0, of an axis whose motion is imposed, or a number from the least one."""
    return Field(
        None, ge=0.0, le=MOST,
        description=f"a number from {LEAST:g} to {MOST:g}, in {unit}: the {what}; or 0, where the "
        f"motion is imposed and the {force} that it takes was measured",
    )  # fmt: skip


def _imposed_or_heavy(mass: float) -> float:
    if 0.0 < mass < LEAST:
        raise ValueError
    return mass


def _ordered(travel: tuple[float, float]) -> tuple[float, float]:
    if not travel[0] < travel[1]:
        raise ValueError
    return travel


Travel = Annotated[tuple[Place, Place], AfterValidator(_ordered)]
Moved = Annotated[float, AfterValidator(_imposed_or_heavy)]


def _with_hardware(kind: type[Entries]) -> type[Entries]:
    """The same entries, and those of the hardware: numbers, and of the travel a pair."""
    given: dict[str, Any] = {
        name: (float | None, _quantity(e.unit, e.meaning, zero=e.zero, most=e.most))
        for name, e in Hardware.entries().items()
    }
    given["travel"] = (
        Travel | None,
        Field(
            None,
            strict=False,
            description="two numbers, the low one first, in m (rad on a rotary axis)",
        ),
    )
    return create_model(kind.__name__, __base__=kind, __module__=__name__, **given)


class EffectTable(Entries):
    """Parameters by name; each number is checked against the effect's own bounds."""

    model_config = ConfigDict(extra="allow")

    fixed: list[str] | None = None
    """a list of names of parameters, such as ["pitch"], that a fit holds"""


@_with_hardware
class _MovedEntry(Entries):
    """What an axis moves, and its hardware."""

    mass: Moved | None = _moved("kg", "moved mass", "force")
    inertia: Moved | None = _moved("kg m^2", "moment of inertia", "torque")
    joint: str | None = Field(
        None, min_length=1, max_length=200,
        description="the name of a hinge or slide joint of the MJCF or URDF file, or of a fixed "
        "tendon, whose bodies the axis moves, in place of a mass or inertia",
    )  # fmt: skip
    fixed: list[Name] | None = None
    """["mass"] (["inertia"] on a rotary axis), where a fit holds it"""


class AxisEntry(_MovedEntry):
    """One axis, with ``mass`` or with ``inertia``; what is left out has the default of Hardware."""

    test_function: float | None = _quantity(
        "s", "over which a fit averages forces; where left out, chosen from the logs", most=1e3
    )
    channel_delay: float | None = _quantity(
        "s", "by which the force is stamped later than it acts", zero=True, most=1.0
    )
    effects: dict[str, EffectTable] = Field({})
    """a table for each effect, as in [axes.x.effects.cogging]"""


class HistoryEntry(Entries):
    """A step of the model's growth. What a later version writes as well is passed over."""

    model_config = ConfigDict(extra="ignore")

    action: str = Field(description='a text, such as "add"')
    effect: str = Field(description="the name of an effect")
    axis: str = Field(description="the name of an axis")
    fit_error_before: float = Field(description="a finite number")
    fit_error_after: float = Field(description="a finite number")
    holdout_error_before: float | None = Field(None, description="a finite number")
    holdout_error_after: float | None = Field(None, description="a finite number")
    test_error_before: float | None = Field(None, description="a finite number")
    test_error_after: float | None = Field(None, description="a finite number")
    unit: str = Field("N", description="a unit in quotes")
    notes: list[str] = Field([], description="a list of texts")

    def step(self) -> HistoryStep:
        """As the model holds it."""
        values: dict[str, Any] = {**self.model_dump(), "notes": tuple(self.notes)}
        return HistoryStep(**values)


class ModelFile(Entries):
    """A whole machine model."""

    name: str | None = Field(None, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")
    """a text of up to 200 characters on one line"""
    mujoco: str | None = Field(None, pattern=r"^[^/\\\x00]+$")
    """the name of an MJCF or URDF file that is beside this one, without folders"""
    sample_rate: float = Field(10_000.0, gt=0.0, le=1e7)
    """a number above 0, at most 1e+07, in Hz"""
    axes: dict[Annotated[str, Field(pattern=AXIS_NAME, max_length=40)], AxisEntry] = Field(
        min_length=1, max_length=MOST_AXES
    )
    """a table for each of 1 to 64 axes, as [axes.x]; a name has letters, digits and underscores"""
    intervals: dict[str, dict[str, Pair | Ratio]] = Field({})
    """two finite numbers, low and high, by axis and parameter, from the last fit"""
    history: list[HistoryEntry] = Field([], description="the model's growth, as [[history]]")


def json_schema(catalogue: Mapping[str, Effect]) -> dict[str, Any]:
    """The JSON schema of a model file, with the effects of a catalogue and their parameters."""
    schema = ModelFile.model_json_schema()
    schema["title"] = "Machine model of the Proton twin"
    effects = schema["$defs"]["AxisEntry"]["properties"]["effects"]
    effects["properties"] = {name: _effect_schema(effect) for name, effect in catalogue.items()}
    return schema


def _effect_schema(effect: Effect) -> dict[str, Any]:
    names = [p.name for p in effect.parameters]
    parameters = {
        p.name: {
            "type": "number",
            **{k: b for k, b in (("minimum", p.lower), ("maximum", p.upper)) if abs(b) < 1e300},
            "default": p.start,
            "description": f"{p.unit}, {p.meaning}",
        }
        for p in effect.parameters
    }
    fixed = {"type": "array", "items": {"enum": names} if effect.of_size is None else {}}
    return {
        "type": "object",
        "description": f"{effect.summary}: {effect.equation}",
        "properties": {**parameters, "fixed": fixed},
        # A larger size has more parameters than the catalogue's own.
        "additionalProperties": effect.of_size is not None,
    }
