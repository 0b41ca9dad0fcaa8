"""The explanations that a plan decides between, made from effects, models and logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from identify.dataset.dataset import Dataset
from identify.dataset.noise_floor import floor_of
from identify.dataset.preparation import datasets
from identify.estimation.fit import fit_axis
from identify.estimation.force_balance import residual
from identify.estimation.variable_projection import fit_multistart
from identify.estimation.variable_projection import starts as start_values
from identify.experiment_design.discrimination import Explanation
from identify.experiment_design.planting import strength_for
from identify.selection.trying import try_effect
from twin.checks import moves
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.errors import CannotRun, InputError
from twin.experiments.kinds import Tracking
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.signals import Array
from twin.simulation.simulate import simulate
from twin.simulation.simulators import quickest

STRENGTH = 10.0  # times the noise floor: assumed force of an effect when there are no logs

Rival = Effect | MachineModel


def simulated_dataset(machine: MachineModel, axis: str) -> Dataset:
    """A dataset of simulated random moves of the model, for use when there are no logs.

    Raises CannotRun where the drive does not move the axis.
    """
    simulated = 10.0  # s of simulated tracking on which such an effect is scaled to that force
    log = simulate(machine, Tracking(simulated), seed=0, simulator=quickest(machine))
    if not moves(log, axis):
        raise CannotRun(
            f"axis {axis}: its controller does not move it in a simulation of the model; check its "
            "friction, inertia (of a geared joint add rotor_inertia), bandwidth and force_limit"
        )
    return datasets(machine, {"simulated": log}, {})[axis]


def explained(
    rivals: Sequence[Rival], machine: MachineModel, dataset: Dataset, fitted: bool
) -> tuple[Explanation, ...]:
    """Each rival as an explanation of the dataset's axis.

    For an effect it is the machine's axis with this effect and without the other rivals, for a
    model its axis. fitted: whether they are refitted on the dataset's logs. Otherwise an effect has
    start values, and strengths that give STRENGTH times the noise floor. Raises InputError where a
    model lacks the axis.
    """
    own = machine.axis(dataset.axis)
    names = {r.name for r in rivals if isinstance(r, Effect)}
    base = replace(own, effects=tuple(f for f in own.effects if f.effect.name not in names))
    fit = fit_multistart(base, dataset) if fitted else None
    out = []
    for rival in rivals:
        if isinstance(rival, MachineModel):
            axis = replace(rival.axis(dataset.axis), hardware=own.hardware)
            axis = fit_multistart(axis, dataset).axis if fitted else axis
        elif fit is not None:
            axis = try_effect(fit, dataset, rival).fit.axis
        elif rival.name in own.names:
            axis = base.with_effect(own[rival.name])
        else:
            axis = _supposed(rival, base, dataset)
        out.append(Explanation(rival.name, axis))
    return tuple(out)


def _supposed(effect: Effect, axis: AxisModel, dataset: Dataset) -> AxisModel:
    """The axis with the effect at start values and a force above the noise floor."""
    if effect.kind is Kind.FRICTION:  # fitted, as it replaces the friction of the axis
        first = start_values(fit_axis(axis, dataset.training), dataset, effect)[0]
        return fit_axis(axis.with_effect(first.fitted), dataset.training).axis
    without = residual(axis, dataset.training)

    def added(fitted: Fitted) -> Array:
        return residual(axis.with_effect(fitted), dataset.training) - without

    force, starts = STRENGTH * floor_of(axis, dataset.training), effect.starts(dataset.excitation)
    return axis.with_effect(strength_for(effect, added, force, starts))


def differing_axis(rivals: Sequence[Rival], machine: MachineModel) -> str:
    """The first axis on which models among the rivals differ; the machine's first otherwise."""
    models = [r for r in rivals if isinstance(r, MachineModel)]
    for name in machine.axes:
        axes = [m.axis(name) for m in models]
        if any(a.effects != axes[0].effects or a.mass != axes[0].mass for a in axes[1:]):
            return name
    return next(iter(machine.axes))


def rivals_of(given: Sequence[Rival | str | Path], catalogue: Catalogue) -> tuple[Rival, ...]:
    """Effects and models by their names, where a file's path is that of a model.

    Models of one name get a number each. Raises InputError where two of them are the same.
    """
    rivals = [_rival(one, catalogue) for one in given]
    for i, rival in enumerate(rivals):
        if rival in rivals[:i]:
            raise InputError(f"{rival.name} is given twice; give two different explanations")
    names = [rival.name for rival in rivals]
    return tuple(
        replace(rival, name=f"{rival.name} ({names[: i + 1].count(rival.name)})")
        if isinstance(rival, MachineModel) and names.count(rival.name) > 1
        else rival
        for i, rival in enumerate(rivals)
    )


def _rival(given: Rival | str | Path, catalogue: Catalogue) -> Rival:
    if isinstance(given, Effect | MachineModel):
        return given
    if str(given).endswith(".toml"):
        return replace(load_model(given, catalogue), name=str(given))
    return catalogue[str(given)]
