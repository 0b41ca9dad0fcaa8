"""The experiment that decides between explanations, or that constrains a model most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from identify.dataset.dataset import Dataset, Role
from identify.dataset.given_logs import require_moving
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.dataset.test_function import require_test_function
from identify.estimation.alignment import fit_aligned
from identify.estimation.offered import offered, require_shown, telling_beside
from identify.estimation.variable_projection import usable
from identify.experiment_design.candidate_experiments import NotRun, proposals
from identify.experiment_design.discrimination import (
    Arena,
    Explanation,
    SimulatedExperiment,
    contest,
    favoured,
    refitted,
)
from identify.experiment_design.missing_excitation import Gap, gap
from identify.experiment_design.rival_hypotheses import (
    Rival,
    differing_axis,
    explained,
    rivals_of,
    simulated_dataset,
)
from identify.printed import Printed
from identify.rules import RULE
from identify.selection.candidates import Candidate
from identify.selection.changes import Added
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from identify.selection.trying import try_effect
from twin.effect import Effect
from twin.effects import Catalogue, load_catalogue
from twin.errors import CannotRun
from twin.experiments.file import in_short
from twin.experiments.trajectory import require_length
from twin.logs import GivenLogs, logs_by_name
from twin.model.file import as_model
from twin.model.machine import MachineModel
from twin.parallel import Progress, Spread, parallel, silent, spread, within

DURATION = 20.0  # s of a planned experiment


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Printed):
    """The experiment that decides, and those that it was chosen from.

    axis: the axis that is explained. between: names of the explanations; a single one where the
    experiment is to constrain a model. ranking: simulated experiments by falling evidence; the
    first is chosen. gap: the motion that the logs lack. not_run: experiments that the machine
    cannot run. favoured: the explanation that the existing logs already separate from the others,
    if any. excited_by: effect -> the motion that excites it. supposed: whether the explanations
    have start values, as there are no logs to fit them to.
    """

    axis: str
    between: tuple[str, ...]
    ranking: tuple[SimulatedExperiment, ...]
    gap: Gap
    favoured_by_the_logs: str | None
    excited_by: Mapping[str, str]
    supposed: bool
    not_run: tuple[NotRun, ...] = ()

    @property
    def chosen(self) -> SimulatedExperiment:
        """The experiment that is planned."""
        return self.ranking[0]

    @property
    def decides(self) -> bool:
        """Whether it is expected to separate the explanations; with a single one, always."""
        # Two laws are told apart by the squares of what they leave, with a t of half the root of
        # the evidence: per sample these differ by d^2 + 2 d e, which scatters by 2 d sigma.
        return self.chosen.gain > 4.0 * RULE.least_bic or len(self.between) == 1


@parallel()
def plan(
    model: MachineModel | str | Path,
    logs: GivenLogs | None = None,
    holdout: GivenLogs | None = None,
    *,
    catalogue: Catalogue | None = None,
    between: Rival | str | Path | Sequence[Rival | str | Path] = (),
    axis: str | None = None,
    duration: float = DURATION,
    test_function: float | None = None,
    progress: Progress = silent,
    over: Spread = spread,
) -> Plan:
    """Find the experiment within the machine's limits that decides between explanations.

    between: effects or their names, each added to the model, or models or the paths of their files;
    refitted where there are logs. Where it is empty, the logs are diagnosed, and the plan is for
    the effects that the diagnosis cannot separate, or for the best and the runner-up; without logs
    or a missing effect, it is for the model's own parameters. duration: of the experiment, s. over:
    what the experiments are tried on, threads of this process or the workers of an engine. Raises
    InputError for an unknown axis, an axis whose travel is not known, and explanations that are the
    same.
    """
    catalogue = load_catalogue() if catalogue is None else catalogue
    model = as_model(model, catalogue)
    if axis is not None:
        model.axis(axis)
    require_length(duration, model.sample_rate)
    single = isinstance(between, str | Path | Effect | MachineModel)
    rivals = rivals_of([between] if single else between, catalogue)
    for rival in rivals:
        if isinstance(rival, Effect):
            model.require_usable(rival, axis or next(iter(model.axes)))
    if not logs:
        require_test_function(test_function, duration)
    catalogue = usable(catalogue, model)
    progress("preparing the logs and the rivals", 0, 1)
    dataset = _dataset(model, logs or {}, holdout or {}, rivals, axis, test_function, catalogue)
    arena = _arena(model, dataset, bool(logs), rivals, catalogue, test_function, progress)
    effects = {**catalogue, **{r.name: r for r in rivals if isinstance(r, Effect)}}
    verified = 6  # experiments at most that are judged again by full refits
    return _planned(arena, duration, verified, not logs, effects, progress, over)


def next_experiments(
    axes: Mapping[str, AxisDiagnosis], model: MachineModel, test_function: float | None = None
) -> tuple[dict[str, Plan], dict[str, str]]:
    """By axis, the experiment that decides an ambiguous diagnosis, or why the machine can run none.

    Both are empty for an axis where less than two explanations are left. test_function: length that
    the diagnosis used, s; None where chosen from the noise.
    """
    plans, not_planned = {}, {}
    for axis, found in axes.items():
        rivals = _rivals(found)
        if len(rivals) < 2:
            continue
        some = found.dataset.part  # as in a search: all of long logs would tell little more
        arena = _between_candidates(model, some, rivals, test_function)
        effects = {c.effect.name: c.effect for c in rivals}
        try:
            next_duration = 10.0  # s of the one that a diagnosis proposes
            next_verified = 2  # the same for the one that a diagnosis proposes
            plans[axis] = _planned(arena, next_duration, next_verified, False, effects)
        except CannotRun as why:
            not_planned[axis] = str(why)
    return plans, not_planned


def _planned(
    arena: Arena,
    duration: float,
    verified: int,
    supposed: bool,
    effects: Mapping[str, Effect],
    progress: Progress = silent,
    over: Spread = spread,
) -> Plan:
    arena.machine.require_mass()
    logs = arena.logs
    favourite, evidence = favoured(arena)
    if evidence > RULE.least_bic:
        # The logs already refute a rival, so they would decide whatever the new experiment is.
        arena = replace(arena, logs=())
    experiments, too_long = proposals(arena.machine, arena.name, duration)
    ranked, not_run = contest(arena, experiments, progress, over)
    if not ranked:
        first = f"{in_short(not_run[0].experiment, not_run[0].units)}: {not_run[0].reason}"
        raise CannotRun(
            f"axis {arena.name} can run none of the experiments; check its limits and force_limit; "
            f"the first: {first}"
        )
    progress("best experiments judged by refits", 0, 1)
    ranking = tuple(_verified(arena, ranked, verified, over))
    names = tuple(e.name for e in arena.explanations)
    return Plan(
        axis=arena.name,
        between=names,
        ranking=ranking,
        gap=gap(ranking[0].motion, ranking[0].where, logs),
        favoured_by_the_logs=favourite if evidence > RULE.least_bic else None,
        excited_by={n: effects[n].excited_by for n in names if n in effects},
        supposed=supposed,
        not_run=(*too_long, *not_run, *(t.not_run for t in ranking if t.not_run)),
    )


def _verified(
    arena: Arena, ranked: Sequence[SimulatedExperiment], most: int, over: Spread
) -> list[SimulatedExperiment]:
    """The experiments, the best of them judged again by full refits; the best of these is first.

    It stops when a refitted experiment leads. ranked: by falling evidence. most: refitted at most.
    """
    done: list[SimulatedExperiment] = []
    for i, one in enumerate(ranked[:most]):
        if i and done[0].gain >= one.gain:
            break
        done.append(refitted(arena, one, over))
        done.sort(key=lambda t: -t.gain)
    return [*done, *ranked[len(done) :]]


def _dataset(
    model: MachineModel,
    logs: GivenLogs,
    holdout: GivenLogs,
    between: Sequence[Rival],
    axis: str | None,
    test_function: float | None,
    catalogue: Catalogue,
) -> Dataset:
    """The dataset of the axis to be explained; of a simulated log where there are no logs."""
    if not logs:
        return simulated_dataset(model, axis or differing_axis(between, model))
    training = logs_by_name(logs, Role.TRAINING.value)
    selection = logs_by_name(holdout, Role.SELECTION.value)
    found = datasets(model, training, selection, test_function)
    name = axis or differing_axis(between, model)
    if axis is not None:
        require_moving(axis, found)
    dataset = found[name] if name in found else next(iter(found.values()))
    own, asked = model.axes[dataset.axis], [r for r in between if isinstance(r, Effect)]
    dataset = telling_beside(own, dataset, asked if between else catalogue.values())
    for effect in asked:
        require_shown(effect, {dataset.axis: (own, dataset)})
    return dataset


def _arena(
    model: MachineModel, dataset: Dataset, recorded: bool, between: Sequence[Rival],
    catalogue: Catalogue, test_function: float | None, progress: Progress,
) -> Arena:  # fmt: skip
    own, logs = model.axes[dataset.axis], tuple[PreparedLog, ...]()
    if recorded:
        dataset, base = fit_aligned(own, dataset)
        own, logs = base.axis, dataset.training
    known: tuple[Explanation, ...] = (Explanation(model.name, own),)
    if between:
        known = explained(between, model, dataset, recorded)
    elif recorded:
        told = offered(own, dataset, catalogue)
        found = diagnose_axis(base, dataset, told, within(progress, "diagnosis"))
        rivals = _rivals(found)
        if found.best is not None and len(rivals) < 2 <= len(found.ranking):
            # Of one that promised little only a linear step was taken: it is fitted now.
            rivals = [
                c if c.score is not None else try_effect(found.base, found.dataset, c.effect)
                for c in found.ranking[:2]
            ]
        if len(rivals) > 1:
            return _between_candidates(model, dataset, rivals, test_function)
    return Arena(model, dataset.axis, known, logs, test_function)


def _rivals(found: AxisDiagnosis) -> list[Candidate]:
    """The effect that is named first and those that are level with it, as they were tried."""
    if found.best is None:
        return []
    step = next(
        s for s in reversed(found.steps)
        if isinstance(s.change, Added) and s.change.name == found.named[0]
    )  # fmt: skip
    tied = {t.change.name: t.candidate for t in step.tied}
    others = [tied[name] for name in found.ambiguous_with if name in tied]
    most_rivals = 3  # explanations that a diagnosis asks one experiment to separate
    return [step.tried.candidate, *others][:most_rivals]


def _between_candidates(
    model: MachineModel, dataset: Dataset, rivals: Sequence[Candidate], test_function: float | None
) -> Arena:
    known = tuple(Explanation(c.effect.name, c.fit.axis) for c in rivals)
    return Arena(model, dataset.axis, known, dataset.training, test_function)
