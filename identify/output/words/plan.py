"""The next step: the commands of a diagnosis, and sentences about planned experiments."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from identify.dataset.dataset import Dataset, Role
from identify.experiment_design.candidate_experiments import NotRun
from identify.experiment_design.discrimination import SimulatedExperiment
from identify.experiment_design.missing_excitation import Gap
from identify.experiment_design.plan import Plan
from identify.experiment_design.rival_hypotheses import STRENGTH
from identify.output.numbers import Scale, number, quantity
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from twin.effects import load_catalogue
from twin.experiments.file import in_short
from twin.experiments.kinds import kind_of

OPTIONS = {Role.TRAINING: "", Role.SELECTION: "--holdout ", Role.TEST: "--test "}
Names = Mapping[Role, Sequence[str]]


@dataclass(frozen=True)
class Source:
    """What a result was made of: the command as typed, the model's name in it, the logs' folder.

    options: those of the command that the next one needs as well.
    """

    command: str = ""
    model: str = "MODEL"
    folder: Path = Path()
    options: str = ""

    def filled(self, text: str, names: Names) -> str:
        """A command with this model and these logs in the place of MODEL and LOG...

        A plan reads no test logs. What is written has another name than the model.
        """
        given = [
            f"{OPTIONS[role]}{shlex.quote(name)}"
            for role, logs in names.items()
            for name in logs
            if role is not Role.TEST or not text.startswith("twin plan")
        ]
        every = " ".join([*given, *([self.options] if self.options else [])])
        begun, _, written = text.rpartition("-o ")
        if again := re.fullmatch(rf"{Path(written).stem}(?:_(\d+))?", Path(self.model).stem):
            name = f"{Path(written).stem}_{int(again[1] or 1) + 1}{Path(written).suffix}"
            text = f"{begun}-o {name}"
        return text.replace("LOG...", every).replace("MODEL", shlex.quote(self.model))


UNKNOWN = Source()


def names_of(dataset: Dataset) -> dict[Role, list[str]]:
    """Names of the logs of a dataset by role."""
    return {role: [log.motion.name for log in dataset.having(role)] for role in Role}


def fitted_curves() -> list[str]:
    """Effects that lower an error without explaining it."""
    every = load_catalogue().values()
    return [e.name for e in every if e.is_nonparametric and not e.free_shape]


def next_commands(found: AxisDiagnosis) -> list[str]:
    """What to run next, of MODEL and LOG...: of what is named first, else of what is left."""
    if found.verdict is Verdict.NOTHING_MISSING:
        return []
    for finding in found.missing:
        if finding.tied:
            pair = f"{finding.effect} {finding.tied[0]}"
            return [f"twin plan MODEL LOG... --between {pair} -o next.toml"]
        if finding.together:
            second = f"twin add {finding.together[0]} first.toml LOG... -o both.toml"
            return [f"twin add {finding.effect} MODEL LOG... -o first.toml", second]
    first = next((f for f in found.findings if not f.contradicted), None)
    if first is None:
        added = fitted_curves()[0] if found.unexplained else None
    elif first in found.missing:
        added = first.effect
    else:  # of a free exponent the model file has to be changed
        added = None if first.bend else f"--shape {first.effect}"
    return [f"twin add {added} MODEL LOG... -o better.toml"] if added else []


# --- planned experiments --------------------------------------------------------------------------


def in_order(plan: Plan) -> list[SimulatedExperiment]:
    """The chosen experiment, then those that can be run, by falling evidence."""
    chosen, *others = plan.ranking
    runnable = (t for t in others if t.not_run is None)
    return [chosen, *sorted(runnable, key=lambda t: -t.gain)]


def question_in_words(plan: Plan) -> str:
    """What an experiment is to decide, and whether one can."""
    what = " or ".join(plan.between)
    if len(plan.between) < 2:
        return f"the parameters of {what}, best constrained by"
    if plan.decides:
        return f"{what}, decided by"
    return f"{what}, not decided by any experiment of this length; the nearest is"


def experiment_in_words(t: SimulatedExperiment, plan: Plan) -> str:
    """Which experiment it is, how long it takes, and what it is expected to show.

    Only the leading ones are refitted, and the best of these is chosen: one with more evidence than
    the chosen has it from one linear step.
    """
    shows = f"{number(t.gain)} nats of information on the parameters"
    if len(plan.between) > 1:
        linear = " by one linear step" if t.gain > plan.chosen.gain else ""
        what = "expected evidence (difference of BIC)" if t is plan.chosen else "evidence"
        shows = f"{what} {number(t.gain)}{linear}, {_rival(t)}"
    return f"{_run(t)}: {shows}"


def _run(t: SimulatedExperiment) -> str:
    return f"{in_short(t.experiment, t.units)}; takes {quantity(t.duration, 's')}"


def _rival(t: SimulatedExperiment) -> str:
    """What the explanation that is wrong would leave."""
    left, noise = (quantity(size, t.units.force) for size in (t.difference, t.floor))
    return f"the rival leaves {left} RMS unexplained, noise on this motion is {noise}"


def next_step_in_words(plan: Plan) -> str:
    """The experiment that an ambiguous diagnosis asks for, in one paragraph."""
    what = "decides" if plan.decides else "comes nearest to deciding, but is too short"
    return (
        f"The experiment that {what} (twin plan writes it): {_run(plan.chosen)}. There "
        f"{_rival(plan.chosen)}; {gap_in_words(plan.gap)}."
    )


def supposed_in_words(plan: Plan) -> str | None:
    """What is assumed of the explanations where there are no logs; None where there are some."""
    if not plan.supposed or len(plan.between) < 2:
        return None
    if any(name in plan.excited_by for name in plan.between):
        return (
            "no logs given: each effect that the model lacks is assumed at "
            f"{STRENGTH:g} times the noise floor"
        )
    return "no logs given: the models are compared with the values in their files"


def gap_in_words(gap: Gap) -> str:
    """Which motion the logs lack."""
    scale = Scale.of(gap.unit, [gap.low, gap.high])
    low, high = (number(value / scale.size) for value in (gap.low, gap.high))
    where = f"{gap.feature} {low} to {high} {scale.unit}".rstrip()
    if gap.share is None:
        return f"the explanations differ most at {where}"
    held = f"{100.0 * gap.share:.1f} % of the data is there"
    if gap.missing:
        return f"missing motion: {where}; {held}"
    return f"no motion is missing, but more of it is needed at {where}; {held}"


def not_run_in_words(not_run: NotRun) -> str:
    """Which experiment cannot be run, and why."""
    return f"{in_short(not_run.experiment, not_run.units)}: {_why(not_run)}"


def _why(not_run: NotRun) -> str:
    return f"{not_run.reason} (with {not_run.truth})" if not_run.truth else not_run.reason


def all_not_run_in_words(not_run: Sequence[NotRun]) -> list[str]:
    """The same of several; those of one reason together, by how many there are of each kind."""
    alike: dict[str, list[NotRun]] = {}
    for one in not_run:
        alike.setdefault(_why(one), []).append(one)

    def kinds(same: list[NotRun]) -> str:
        count = Counter(kind_of(n.experiment) for n in same)
        return ", ".join(f"{number} {kind}" for kind, number in count.items())

    return [
        not_run_in_words(*same) if len(same) == 1 else f"{kinds(same)}: {why}"
        for why, same in alike.items()
    ]
