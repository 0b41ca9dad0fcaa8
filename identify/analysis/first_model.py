"""A model to begin with, from logs alone: mass, the simplest friction, a constant force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identify.dataset.excitation import excitation
from identify.dataset.given_logs import require_samples
from identify.dataset.motion import Motion, motion_of
from identify.dataset.reading_ripple import ripples_of_widest
from identify.dataset.test_function import TestFunction
from identify.estimation.first_values import FirstValues, first_values
from twin.checks import moves
from twin.effect import Effect, Excitation, Kind
from twin.effects import Catalogue
from twin.errors import InputError
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.model.units import AxisUnits

TEST_FUNCTION = 0.02  # s, over which the acceleration that was reached is averaged
MARGIN = 0.05  # of the way that was covered, beyond its ends


def first_model(logs: Mapping[str, Log], name: str, catalogue: Catalogue) -> MachineModel:
    """A model to begin with: of each axis that moves its mass and the simplest friction.

    And a constant force where the logs ask for it. Static friction is that of Coulomb where the
    axis does not break away from rest (``not_determined``). Hardware is what the logs show: travel,
    speed, acceleration and force that were reached, the step and the noise of the encoder. Raises
    InputError where no axis moves, where the logs differ in sample rate, and where they do not tell
    the mass.
    """
    require_samples(logs)
    rates = sorted({log.sample_rate for log in logs.values()})
    if len(rates) != 1:
        raise InputError(
            f"the logs are sampled at {', '.join(f'{r:g}' for r in rates)} Hz; give one rate"
        )
    names = dict.fromkeys(axis for log in logs.values() for axis in log.axes)
    axes = {}
    for axis in names:
        going = {n: log for n, log in logs.items() if axis in log.axes and moves(log, axis)}
        if going:
            ripples = ripples_of_widest(going.values(), axis)
            motions = [motion_of(log, axis, n, ripples=ripples) for n, log in going.items()]
            constant = next(iter(going.values())).axes[axis].force_constant
            axes[axis] = _first_axis(axis, motions, constant, catalogue)
    if not axes:
        raise InputError(f"no axis moves in {', '.join(logs)}; give a log in which one does")
    return MachineModel(name, axes, rates[0])


def not_determined(axis: AxisModel) -> list[str]:
    """Labels of what the logs did not tell of a first model: it has the value of something else."""
    return [
        f"{f.effect.name}.{p.name}"
        for f in axis.effects
        for p in f.effect.parameters
        if p.at_least is not None and f.values[p.name] == f.values[p.at_least]
    ]


def _first_axis(
    axis: str, motions: Sequence[Motion], force_constant: float | None, catalogue: Catalogue
) -> AxisModel:
    found, covered, units = first_values(motions), excitation(motions, None), motions[0].units
    if found.mass is None:
        names = ", ".join(m.name for m in motions)
        raise InputError(
            f"axis {axis}: {names} cannot tell the {units.mass_name}, as acceleration makes too "
            "little of the force; give a log with faster changes of speed"
        )
    window = [TestFunction.at_least(TEST_FUNCTION, m.period) for m in motions]
    reached = max(
        float(np.abs(w.acceleration(m.velocity)).max())
        for w, m in zip(window, motions, strict=True)
    )
    margin = MARGIN * covered.travel
    low, high = covered.position_low - margin, covered.position_high + margin
    hardware = Hardware(
        travel=(_shown(low), _shown(high)),
        force_constant=1.0 if force_constant is None else force_constant,
        force_limit=_shown(2.0 * covered.force_max),
        encoder_resolution=_shown(covered.resolution),
        encoder_noise=_shown(max(m.position_noise for m in motions)),
        velocity=_shown(covered.speed_max),
        acceleration=_shown(reached),
        jerk=_shown(reached / TEST_FUNCTION),
    )
    effects = _first_effects(found, catalogue, covered, units)
    return AxisModel(_shown(found.mass), hardware, effects, rotary=units.rotary)


def _first_effects(
    found: FirstValues, catalogue: Catalogue, covered: Excitation, units: AxisUnits
) -> tuple[Fitted, ...]:
    """The simplest friction, and a constant force where there is one, with what was found."""
    friction = _simplest_friction(catalogue)
    static = found.coulomb if found.static is None else found.static
    values = {"Fc": found.coulomb, "Fs": static, "sigma2": found.viscous}
    own = {n: _shown(v) for n, v in values.items() if n in friction.starts(covered)}
    effects = [Fitted.at_start(friction, {**friction.starts(covered), **own}, units)]
    for force in filter(_is_constant, catalogue.values() if found.constant else ()):
        (own_force,) = force.parameters
        effects.append(Fitted.at_start(force, {own_force.name: _shown(-found.constant)}, units))
    return tuple(effects)


def _is_constant(effect: Effect) -> bool:
    """Whether an effect is one force, N, and nothing else."""
    force = effect.kind is Kind.FORCE and not effect.states and not effect.is_nonparametric
    return force and [p.unit for p in effect.parameters] == ["N"]


def _shown(value: float) -> float:
    return float(f"{value:.3g}")


def _simplest_friction(catalogue: Catalogue) -> Effect:
    """The friction of the catalogue with the fewest parameters and states."""
    frictions = [
        e for e in catalogue.values() if e.kind is Kind.FRICTION and not e.is_nonparametric
    ]
    return min(frictions, key=lambda e: (len(e.parameters), len(e.states)))
