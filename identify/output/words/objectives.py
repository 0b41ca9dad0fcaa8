"""The alarm where the fit of the force and that of simulated motion do not agree."""

from __future__ import annotations

from identify.results.results import SimulationFit


def objectives_in_words(result: SimulationFit) -> list[str]:
    """A sentence for each parameter that the two objectives give far apart."""
    return [
        f"alarm: axis {axis}: {label} is {_shown(result, axis, label, after)}, and "
        f"{_shown(result, axis, label, before)} by the fit of the force; where two objectives "
        "disagree so, the model lacks something or the logs do not tell the parameter: use neither "
        "value before `twin diagnose` has said which"
        for axis, label, before, after in result.disagreeing
    ]


def _shown(result: SimulationFit, axis: str, label: str, value: float) -> str:
    own = result.axes[axis].axis
    effect, _, name = label.rpartition(".")
    unit = own.parameter_units(effect)[name] if effect else own.units.mass
    return f"{value:.4g} {unit}"
