"""The experiment that decides between explanations, or that tells most about a model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from identify.dataset.dataset import Dataset, datasets
from identify.estimation.channel_delay import fit_aligned
from identify.estimation.decision import RULE
from identify.experiment_design.candidate_experiments import NotRun, proposals
from identify.experiment_design.discrimination import (
    Arena,
    Explanation,
    Trial,
    contest,
    favoured,
    refitted,
)
from identify.experiment_design.missing_excitation import Gap, gap
from identify.experiment_design.rival_hypotheses import (
    Rival,
    differing_axis,
    explained,
    require_different,
    trial_dataset,
)
from identify.selection.candidates import Candidate, usable
from identify.selection.forward_selection import AxisDiagnosis, Verdict, diagnose_axis
from twin.effect import Effect
from twin.effects import Catalogue
from twin.errors import CannotRun, InputError
from twin.experiments.file import in_short
from twin.log import Log
from twin.model.machine import MachineModel

Logs = Mapping[str, Log]
Progress = Callable[[str, int, int], None]

DURATION = 20.0  # s of a planned experiment
NEXT_DURATION = 10.0  # s of the one that a diagnosis proposes
VERIFIED = 6  # experiments at most that are tried again with a full refit
NEXT_VERIFIED = 3  # the same for the one that a diagnosis proposes
MOST_RIVALS = 3  # explanations that a diagnosis asks one experiment to separate


@dataclass(frozen=True, eq=False)
class Plan:
    """The experiment that decides, and those that it was chosen from.

    axis: the one explained. between: names of the explanations; one, where the experiment is to
    constrain a model. ranking: trials by falling evidence; the first is chosen. gap: where the data
    lack motion. not_run: experiments that were left out as the stage cannot run them, and why.
    favoured: the explanation that the logs separate from the others already, if any.
    excited_by: effect -> the motion that shows it. supposed: whether the explanations
    are not fitted to any data.
    """

    axis: str
    between: tuple[str, ...]
    ranking: tuple[Trial, ...]
    gap: Gap
    favoured: str | None
    excited_by: Mapping[str, str]
    supposed: bool
    not_run: tuple[NotRun, ...] = ()

    @property
    def chosen(self) -> Trial:
        """The experiment that is planned."""
        return self.ranking[0]

    @property
    def decides(self) -> bool:
        """Whether it is expected to tell the explanations apart, or one model's parameters."""
        return self.chosen.gain > RULE.least_separation or len(self.between) == 1


def plan(
    model: MachineModel,
    logs: Logs | None = None,
    holdout: Logs | None = None,
    *,
    catalogue: Catalogue,
    between: Sequence[Rival] = (),
    axis: str | None = None,
    duration: float = DURATION,
    window: float | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Find the experiment within the stage's limits that decides between explanations.

    between: effects, each added to the model, or models; refitted where there are logs. Without it,
    what a diagnosis of the logs cannot tell apart, or its best explanation and the runner-up;
    without logs or a missing effect, the experiment that says most about the model's own
    parameters. duration: about that of the experiment, s. Raises InputError for an unknown axis,
    an axis whose travel is not known, and two explanations that are one.
    """
    if axis is not None:
        model.axis(axis)
    require_different(between)
    for rival in between:
        if isinstance(rival, Effect):
            model.require_usable(rival, axis or next(iter(model.axes)))
    catalogue = usable(catalogue, model)
    dataset = _dataset(model, logs or {}, holdout or {}, between, axis, window)
    arena = replace(_arena(model, dataset, bool(logs), between, catalogue), window=window)
    return _planned(arena, duration, VERIFIED, not logs, _named(between, catalogue), progress)


def next_experiment(
    found: AxisDiagnosis, model: MachineModel, window: float | None = None
) -> Plan | None:
    """The experiment that separates the explanations that an ambiguous diagnosis left.

    window: the one that the diagnosis was asked to use, s.

    None for any other verdict, and where the model does not say how far its axes may travel.
    """
    if found.verdict is not Verdict.AMBIGUOUS or found.best is None:
        return None
    names = (found.best.effect.name, *found.ambiguous_with)[:MOST_RIVALS]
    rivals = [c for c in found.ranking if c.effect.name in names]
    if len(rivals) < 2:
        return None
    arena = replace(_between_candidates(model, found.dataset, rivals), window=window)
    try:
        return _planned(
            arena, NEXT_DURATION, NEXT_VERIFIED, False, {c.effect.name: c.effect for c in rivals}
        )
    except CannotRun:
        return None


def _planned(
    arena: Arena,
    duration: float,
    verified: int,
    supposed: bool,
    effects: Mapping[str, Effect],
    progress: Progress | None = None,
) -> Plan:
    logs = arena.logs
    favourite, evidence = favoured(arena)
    if evidence > RULE.least_separation:
        # A rival that the logs refute already would lose by them alone, on any experiment.
        arena = replace(arena, logs=())
    experiments, too_long = proposals(arena.stage, arena.name, duration)
    trials, not_run = contest(arena, experiments, progress)
    if not trials:
        first = f"{in_short(not_run[0].experiment, not_run[0].units)}: {not_run[0].reason}"
        raise CannotRun(
            f"axis {arena.name} can run none of the experiments; check its limits and force_limit; "
            f"the first: {first}"
        )
    chosen, *others = _verified(arena, trials, verified)
    names = tuple(e.name for e in arena.explanations)
    return Plan(
        axis=arena.name,
        between=names,
        ranking=(chosen, *others),
        gap=gap(chosen.motion, chosen.where, logs),
        favoured=favourite if evidence > RULE.least_separation else None,
        excited_by={n: effects[n].excited_by for n in names if n in effects},
        supposed=supposed,
        not_run=(*too_long, *not_run, *(t.not_run for t in (chosen, *others) if t.not_run)),
    )


def _verified(arena: Arena, trials: Sequence[Trial], most: int) -> list[Trial]:
    """The trials with the best truly refitted, until one of those refitted leads; it comes first.

    trials: by falling evidence. most: how many are refitted at most.
    """
    waiting = list(trials)
    done: list[Trial] = []
    while waiting and len(done) < most:
        done.append(refitted(arena, waiting.pop(0)))
        done.sort(key=lambda t: -t.gain)
        if waiting and done[0].gain >= waiting[0].gain:
            break
    return [*done, *waiting]


def _named(between: Sequence[Rival], catalogue: Catalogue) -> dict[str, Effect]:
    return {**catalogue, **{r.name: r for r in between if isinstance(r, Effect)}}


def _dataset(
    model: MachineModel,
    logs: Logs,
    holdout: Logs,
    between: Sequence[Rival],
    axis: str | None,
    window: float | None,
) -> Dataset:
    """The dataset of the axis in question; of a simulated log where there are none."""
    if not logs:
        return trial_dataset(model, axis or differing_axis(between, model))
    found = datasets(model, logs, holdout, window)
    name = axis or differing_axis(between, model)
    if name in found:
        return found[name]
    if axis is None:
        return next(iter(found.values()))
    raise InputError(f"axis {axis} does not move in the logs; give a log in which it does")


def _arena(
    model: MachineModel,
    dataset: Dataset,
    recorded: bool,
    between: Sequence[Rival],
    catalogue: Catalogue,
) -> Arena:
    logs = dataset.fit if recorded else ()
    if between:
        known = explained(between, model, dataset, recorded)
        return Arena(model, dataset.axis, known, logs)
    own = model.axes[dataset.axis]
    if recorded:
        dataset, base = fit_aligned(own, dataset)
        found = diagnose_axis(base, dataset, catalogue)
        own = base.axis
        if found.best is not None and len(found.ranking) > 1:
            names = (found.best.effect.name, *found.ambiguous_with)[:MOST_RIVALS]
            rivals = [c for c in found.ranking if c.effect.name in names]
            return _between_candidates(
                model, dataset, rivals if len(rivals) > 1 else found.ranking[:2]
            )
    return Arena(model, dataset.axis, (Explanation(model.name, own),), logs)


def _between_candidates(
    model: MachineModel, dataset: Dataset, rivals: Sequence[Candidate]
) -> Arena:
    known = tuple(Explanation(c.effect.name, c.fit.axis) for c in rivals)
    return Arena(model, dataset.axis, known, dataset.fit)
