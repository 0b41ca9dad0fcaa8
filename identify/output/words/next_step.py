"""The next step: the command, the experiment planned, the effect added, the body corrected."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from identify.dataset.body import INERTIAL, LINK_MASS
from identify.dataset.dataset import Dataset, Role
from identify.experiment_design.candidate_experiments import NotRun
from identify.experiment_design.discrimination import SimulatedExperiment
from identify.experiment_design.missing_excitation import Gap
from identify.experiment_design.plan import Plan
from identify.experiment_design.rival_hypotheses import STRENGTH
from identify.mechanism.bodies import WrongBody
from identify.output.numbers import DisplayUnit, arrow, listed, number, percent, quantity, with_band
from identify.output.words.fit import moved_in_words, nonparametric_in_words
from identify.results.grown import Addition
from identify.results.results import Diagnosis
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from twin.effects import load_catalogue
from twin.experiments.file import in_short
from twin.experiments.kinds import kind_of
from twin.model.machine import HistoryStep, MachineModel

OPTIONS = {Role.TRAINING: (), Role.SELECTION: ("--holdout",), Role.TEST: ("--test",)}
WRITE = "twin diagnose MODEL LOG... --model better.toml"  # the model with all that was found
Names = Mapping[Role, Sequence[str]]


@dataclass(frozen=True)
class Source:
    """What a result was made of: the command as typed, the model's name in it, the logs' folder.

    options: those of the command that the next one needs as well. written: the file of the model
    with all that was found, where it was written.
    """

    command: str = ""
    model: str = ""
    folder: Path = Path()
    options: tuple[str, ...] = ()
    written: str | None = None

    def filled(self, text: str, names: Names) -> str:
        """A command with this model and these logs in the place of MODEL and LOG...

        A plan reads no test logs. The last word, what is written, has another name than the model.
        Where no file is known of the model, it is a call from Python.
        """
        if not self.model:
            return _as_call(text)
        given = [
            word
            for role, logs in names.items()
            for name in logs
            if role is not Role.TEST or not text.startswith("twin plan")
            for word in (*OPTIONS[role], name)
        ]
        places = {"LOG...": [*given, *self.options], "MODEL": [self.model]}
        *words, last = text.split()
        written = Path(last)
        if again := re.fullmatch(rf"{written.stem}(?:_(\d+))?", Path(self.model).stem):
            last = f"{written.stem}_{int(again[1] or 1) + 1}{written.suffix}"
        return shlex.join([*(w for word in words for w in places.get(word, [word])), last])

    def still_to_do(self, commands: Sequence[str], names: Names) -> list[str]:
        """The commands, filled, less the one that writes what is written already."""
        done = [WRITE] if self.written else []
        return [self.filled(text, names) for text in commands if text not in done]


UNKNOWN = Source()


def _as_call(text: str) -> str:
    """A command of MODEL and LOG... as a call from Python, of a result that is called found."""
    _, command, *words = text.split()
    match command:
        case "add" if words[0] == LINK_MASS:
            return "identify.correct_body(model, logs, holdout, file='corrected.xml')"
        case "add":
            return f"identify.add({words[0]!r}, model, logs, holdout)"
        case "plan":
            axis = words[words.index("--axis") + 1]
            between = tuple(words[words.index("--between") + 1 : words.index("-o")])
            return f"identify.plan(model, logs, holdout, axis={axis!r}, between={between})"
    if text == WRITE:
        return f"twin.save_model(found.model, {words[-1]!r})"
    return f"identify.diagnose(model, logs).report({words[-1]!r})"


def names_of(dataset: Dataset) -> dict[Role, list[str]]:
    """Names of the logs of a dataset by role."""
    return {role: [log.motion.name for log in dataset.having(role)] for role in Role}


def fitted_curves() -> list[str]:
    """Effects that lower an error without explaining it."""
    every = load_catalogue().values()
    return [e.name for e in every if e.is_nonparametric and not e.free_shape]


def next_commands(found: AxisDiagnosis, plan: Plan | None = None) -> list[str]:
    """What to run next, of MODEL and LOG...: of what is named first, else of what is left.

    plan: that of the diagnosis, where there is one; none is run for what it is not known to decide.
    """
    if found.verdict is Verdict.NOTHING_MISSING:
        return []
    if not found.findings:
        curve = fitted_curves()[0]
        return [f"twin add {curve} MODEL LOG... -o better.toml"] if found.unexplained else []
    plans = [
        f"twin plan MODEL LOG... --axis {found.dataset.axis} --between {finding.effect} "
        f"{finding.tied[0]} -o next.toml"
        for finding in found.missing
        if finding.tied and plan is not None and plan.decides
        if {finding.effect, finding.tied[0]} <= set(plan.between)
    ]
    return [*plans[:1], WRITE]


def model_in_words(result: Diagnosis) -> str:
    """What the model is that a diagnosis writes."""
    named = [finding.effect for found in result.axes.values() for finding in found.findings]
    bodies = [f"body {found.body}" for found in result.bodies]
    if not (named or bodies):
        return "the fitted model, as nothing was found"
    return f"the model with {listed([*bodies, *dict.fromkeys(named)])}, fitted together"


def tell(logs: Sequence[str]) -> str:
    """E.g. "a tells", "a and b tell"."""
    return f"{listed(logs)} {'tell' if logs[1:] else 'tells'}"


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
    what = "decides (twin plan writes it)" if plan.decides else "comes nearest, but is too short"
    return (
        f"The experiment that {what}: {_run(plan.chosen)}. There "
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
    scale = DisplayUnit.of(gap.unit, [gap.low, gap.high])
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


# --- what is added to a model ---------------------------------------------------------------------


def errors_of_step(step: HistoryStep) -> dict[Role, tuple[float, float]]:
    """Errors before and after a step, on the logs of each role that there were."""
    pairs = {
        Role.TRAINING: (step.fit_error_before, step.fit_error_after),
        Role.SELECTION: (step.holdout_error_before, step.holdout_error_after),
        Role.TEST: (step.test_error_before, step.test_error_after),
    }
    return {
        role: (before, after)
        for role, (before, after) in pairs.items()
        if before is not None and after is not None
    }


def axis_in_words(
    effect: str, axis: str, tried: Sequence[str], having: Sequence[str]
) -> str | None:
    """Why an effect was added to an axis that nobody named, or None where there is no other.

    tried: axes that it was tried on. having: axes that have it already.
    """
    if having:
        return f"axis {', '.join(having)} has {effect} already, so it went to axis {axis}"
    if len(tried) > 1:
        return f"of axes {', '.join(tried)}, axis {axis} has the most evidence for it"
    return None


def notes_in_words(made: Addition) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What a reader should know of an added effect, one sentence each: for the model, and all."""
    added, reshaped, set_aside = made.candidate, made.reshaped, made.set_aside
    notes = [moved_in_words(m) for m in made.moved]
    if added.effect.is_nonparametric:
        notes.insert(0, nonparametric_in_words(added.fit.axis[added.effect.name]))
    if reshaped:
        beside = reshaped in added.fit.axis.names
        where = "beside" if beside else "in the place of"
        both = "; the force is that of both, so do not read the law's values alone"
        notes.insert(0, f"{added.effect.name} is {where} the law of {reshaped}{both * beside}")
    elif set_aside:
        notes.append(
            f"{', '.join(set_aside)} was removed before {added.effect.name} was added; add it "
            "again for the error that is left"
        )
    told = list(notes)
    if made.in_motion:
        errors = arrow(*made.in_motion, made.units.force)
        told.append(
            "one of both models says nothing of rests, so each error above is of its own parts of "
            f"the logs; where both tell of the training logs it is {errors}"
        )
    chose = also_chose_in_words(made.reported_on)
    told += [] if chose is None else [chose]
    return tuple(notes), tuple(told)


def also_chose_in_words(on: Role) -> str | None:
    """That the logs whose errors are told decided as well; None of test logs."""
    if on is Role.TEST:
        return None
    return (
        f"the errors told are of the {on.value} logs and optimistic, because these logs helped to "
        "choose; give --test a log of another run, on which nothing is decided"
    )


# --- a body whose inertia is not that of its file -------------------------------------------------


def body_in_words(result: Diagnosis, source: Source = UNKNOWN) -> list[str]:
    """What is said of the bodies, and the next command; nothing where there are none."""
    if not result.bodies:
        return []
    file, said = result.fitted.mjcf_name, list[str]()
    others = [f.effect for axis in result.axes.values() for f in axis.findings]
    for found in result.bodies:
        said += wrong_body_in_words(found, result.fitted, [*dict.fromkeys(others)])
    # Beside what joints lack a body is another than alone.
    command = WRITE if others else f"twin add {LINK_MASS} MODEL LOG... -o corrected.toml"
    filled = source.filled(command, names_of(next(iter(result.axes.values())).dataset))
    elements = " and ".join(f"{b.written} into {_of(b, result.bodies)}" for b in result.bodies)
    what = f"{source.written} has written" if source.written else f"Next: {filled} writes"
    return [*said, f"{what} {elements}, in a copy of {file}."]


def _of(body: WrongBody, among: Sequence[WrongBody]) -> str:
    return f"body {body.body}" if among[1:] else "the body"


def disputed_in_words(disputed: Mapping[str, Sequence[str]]) -> list[str]:
    """That the logs tell each another change of a body, so that none can be told."""
    return [
        f"The logs disagree about body {body}: {tell(logs)} another change of its inertia "
        "than the training logs, so that the load is not the same in all, or is held another way; "
        "diagnose them one by one."
        for body, logs in disputed.items()
    ]


def wrong_body_in_words(
    found: WrongBody, model: MachineModel, others: Sequence[str] = ()
) -> list[str]:
    """That a body is not as its file has it, by how much, and the errors without and with it.

    others: what was found beside it, with which the errors are too.
    """
    file, name = model.mjcf_name, " or ".join((found.body, *found.tied))
    score = found.score
    more = (f"{part} {with_band(*told, INERTIAL[part])}" for part, told in found.differing.items())
    said = [
        f"The inertia of body {name} is not as {file} has it (confidence "
        f"{percent(found.confidence)}): it removes {percent(score.part)} of what all joints leave "
        "above their noise floors; the same torques shifted in time, which cannot be real, at most "
        f"{percent(max(score.control, 0.0))} (19 of 20 times).",
        f"More than in the file, about its own frame: {', '.join(more)}."
        if found.differing
        else "Of no parameter alone do the joints tell it, of several together they do.",
    ]
    if found.undetermined:
        said.append(f"These joints do not tell its {listed(found.undetermined)}.")
    if found.disagreeing:
        said.append(
            f"The logs disagree about it: {tell(found.disagreeing)} another change, so that "
            "the load is not the same in all, or is held another way; diagnose them one by one."
        )
    errors = [
        f"{axis} {arrow(e.before, e.after, model.axes[axis].units.force)}"
        for axis, e in found.errors.items()
        if axis in found.axes
    ]
    on = found.errors[found.axes[0]].on.value
    what = listed(["it", *others])
    said.append(f"Error on the {on} logs without and with {what}: {', '.join(errors)}.")
    return said
