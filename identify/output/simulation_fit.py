"""A fit of simulated motion as text and as a JSON object."""

from __future__ import annotations

from typing import Any

from identify.estimation.simulated_motion import MotionFit
from identify.output.words.estimation import MOTION_OUTCOMES, motion_fit_in_words
from identify.output.words.numbers import with_unit
from identify.results.results import SimulationFit
from twin.model.parameters import free_parameters, read

OBJECTIVE = "simulation"


def simulation_fit_text(result: SimulationFit) -> str:
    """The fit of each axis, one parameter a line: the value, and that of the force fit."""
    lines = []
    for axis, fit in result.axes.items():
        said = motion_fit_in_words(axis, fit, result.holdout_error[axis])
        lines += [said[0], *(f"  {line}" for line in said[1:])]
        lines += [
            f"  {label:34s} {with_unit(f'{value:.6g}', unit)} (force fit {before:.6g})"
            for label, value, before, unit in _values(fit)
        ]
    return "\n".join(lines)


def simulation_fit_json(result: SimulationFit) -> dict[str, Any]:
    """Per axis: parameters, beginnings of the logs, position errors on both kinds of logs."""
    return {
        "objective": OBJECTIVE,
        "axes": {axis: _axis(fit, result.holdout_error[axis]) for axis, fit in result.axes.items()},
        "not_fitted": list(result.force.not_fitted),
    }


def _axis(fit: MotionFit, held: tuple[float, float] | None) -> dict[str, Any]:
    units = fit.axis.units
    return {
        "outcome": MOTION_OUTCOMES[fit.outcome],
        "converged": fit.outcome.name != "NOT_CONVERGED",
        "position_error": fit.error,
        "position_error_of_force_fit": fit.error_begun,
        "holdout_position_error": None if held is None else held[1],
        "holdout_position_error_of_force_fit": None if held is None else held[0],
        "unit": units.position,
        "errors_of_starts": list(fit.starts),
        "parameters": {
            label: {"value": value, "force_fit": before, "unit": unit}
            for label, value, before, unit in _values(fit)
        },
        "beginnings": {
            log.motion.name: {
                "time": begun.first * log.motion.sample_period, "time_unit": "s",
                "position": begun.position, "position_unit": units.position,
                "velocity": begun.velocity, "velocity_unit": units("m/s"),
            }
            for log, begun in zip(fit.logs, fit.beginnings, strict=True)
        },
    }  # fmt: skip


def _values(fit: MotionFit) -> list[tuple[str, float, float, str]]:
    """Label, value, value of the force fit, unit of each free parameter."""
    where = free_parameters(fit.axis)
    pairs = zip(where, read(fit.axis, where), read(fit.begun, where), strict=True)
    return [(c.label, float(v), float(b), fit.axis.units(c.parameter.unit)) for c, v, b in pairs]
