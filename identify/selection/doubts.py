"""The end of a search: what is doubted goes, and the search resumes, until nothing is.

Every finding has to be proved beside all others. One that is not is taken out, all else is fitted
again from the base, and the search goes on from there: what it had hidden is asked for again. So
beyond the base the final model holds what the findings name, and nothing else. A law that was
doubted may be asked for once more, when another was found since.

The test logs decide nothing of what is proposed. They can refuse it: what makes their error larger
is contradicted, and the final model is without it. A test log that was recorded otherwise than the
others, beside all that these prove, is no witness.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from identify.dataset.dataset import Dataset
from identify.estimation.alignment import SETTLED, fit_aligned, realigned
from identify.estimation.disagreement import odd_in
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, finished
from identify.estimation.residual_noise import with_own_noise
from identify.rules import RULE
from identify.selection.acceptance import Judged
from identify.selection.findings import Confirmation, Finding, findings_of, without_law
from identify.selection.refusal import Instead, Refusal
from identify.selection.roles import with_turns
from identify.selection.search import Found, on_final_dataset, resumed, search
from identify.selection.ties import with_ties
from twin.effects import Catalogue
from twin.parallel import Progress, silent

MOST_REFITS = 5  # of the final model; most models stay where the first ends


@dataclass(frozen=True)
class Doubt:
    """Why a law was taken out, and the laws of which changes were found beside it then.

    again: whether it was asked for once more since.
    """

    why: Refusal
    beside: frozenset[str]
    again: bool = False


@dataclass(frozen=True, eq=False)
class Conclusion:
    """What a search found at its end, and what each of it explains.

    doubted: by name of each law that was taken out, why. contradicted: findings that the test logs
    refuse, beside which the others are as they are without.
    """

    found: Found
    findings: tuple[Finding, ...]
    doubted: Mapping[str, Refusal] = field(default_factory=dict)
    contradicted: tuple[Finding, ...] = ()


def concluded(
    base: Fit, dataset: Dataset, catalogue: Catalogue, progress: Progress = silent
) -> Conclusion:
    """What a search of one fitted axis comes to."""
    found = search(base, dataset, catalogue, progress)
    doubts: dict[str, Doubt] = {}
    while True:
        progress("what each finding explains", 0, 1)
        found = _at_its_best(with_ties(found))
        ended = _explained(found)
        if weakest := _weakest(ended, found):
            name, found = weakest.effect, without_law(weakest.effect, found)
            doubts[name] = Doubt(_why(weakest), laws_of(found), again=name in doubts)
        asked = {n for n, d in doubts.items() if not d.again and d.beside != laws_of(found)}
        if not weakest and not asked:
            told = {name: doubt.why for name, doubt in doubts.items() if name not in laws_of(found)}
            return _refused(replace(ended, doubted=told), found)
        barred = doubts.keys() - asked
        doubts |= {name: replace(doubts[name], again=True) for name in asked}
        found = resumed(replace(found, barred=frozenset(barred)), catalogue, progress)


def _at_its_best(found: Found) -> Found:
    """What was found, its final fit where whoever fits that model anew ends.

    Its channel delay and its time origins were found on the way, and its shapes beside other laws.
    Who fits it anew begins without the delay, and with priors about the values of the model.
    """
    if not found.steps:
        return found
    final, dataset, fit = found.final, found.dataset, found.final.fit
    for _ in range(MOST_REFITS):
        before, delay = fit, dataset.channel_delay
        dataset, fit = fit_aligned(fit.axis, realigned(dataset, 0.0))
        later = abs(dataset.channel_delay - delay) / dataset.training[0].motion.sample_period
        if later < SETTLED and _is_level(before, fit, dataset):
            break
    if RULE.fallen * fit.error > final.fit.error:
        return found
    better = Judged(replace(fit, begun=final.fit.begun), dataset)
    return on_final_dataset(better, replace(found, dataset=dataset, final=better))


def _is_level(one: Fit, other: Fit, dataset: Dataset) -> bool:
    """Whether two fits of a model say the same of all logs; the test logs' force decides nothing.

    A parameter that the logs hardly tell goes on a little with every fit.
    """
    # of the error, by which no error that is told is another by a hundredth, be it of logs that
    # leave a third of it
    same = 0.003
    moved = error_on(one.axis, dataset.logs) - error_on(other.axis, dataset.logs)
    return rms(moved) < same * other.error


def laws_of(found: Found) -> frozenset[str]:
    """Names of the laws of which a change was found."""
    return frozenset(s.change.name for s in found.steps)


def _explained(found: Found) -> Conclusion:
    """What each finding explains, with what is left at the end as noise where it is."""
    ended = _with_own_noise(found)
    return Conclusion(ended, with_turns(ended, findings_of(ended)))


def _weakest(ended: Conclusion, found: Found) -> Finding | None:
    """The finding that is doubted most; None where none is.

    First one whose values cannot be its own, as the others may be refused for it. A curve whose
    band holds the law everywhere tells nothing beside other findings, unless these need it.
    """
    findings = ended.findings
    if refused := [f for f in findings if f.refused]:
        return min(refused, key=lambda f: (f.doubt is None, f.score.part))
    unsure = [f for f in findings if not f.is_sure]
    if not unsure or len(unsure) == len(findings):
        return None
    weakest = min(unsure, key=lambda f: f.score.part)
    rest = _explained(without_law(weakest.effect, found))
    return None if any(f.refused for f in rest.findings) else weakest


def _why(weakest: Finding) -> Refusal:
    return weakest.refused or Instead.LAW_WITHIN_BAND


def _refused(ended: Conclusion, found: Found) -> Conclusion:
    """The conclusion without what the test logs contradict, what they contradict most first.

    And without what is not proved any more where it is gone.
    """
    against = [f for f in ended.findings if f.state is Confirmation.CONTRADICTED]
    if not against:
        return ended
    if (spoiled := _spoiled_witness(found)) is not None:
        found = replace(found, dataset=found.dataset.without(spoiled))
        again = replace(_explained(found), doubted=ended.doubted, contradicted=ended.contradicted)
        return _refused(again, found)
    worst = max(against, key=lambda f: f.tested.after / f.tested.before)
    found, doubted = _at_its_best(without_law(worst.effect, found)), dict(ended.doubted)
    rest = _explained(found)
    while weakest := _weakest(rest, found):
        doubted[weakest.effect] = _why(weakest)
        found = _at_its_best(without_law(weakest.effect, found))
        rest = _explained(found)
    told = replace(rest, doubted=doubted, contradicted=(*ended.contradicted, worst))
    return _refused(told, found)


def _spoiled_witness(found: Found) -> str | None:
    """The test log that is surely otherwise than the others, beside what they prove, if one is."""
    odd = odd_in(found.final.fit.axis, found.dataset)
    if odd is None or not found.dataset.is_test(odd.log):
        return None
    return odd.log if odd.is_sure_beside(laws_of(found)) else None


def _with_own_noise(found: Found) -> Found:
    """What a search found, with what is left at the end as noise, where nothing predicts it."""
    noisy, final = with_own_noise(found.final.fit, found.dataset)
    if noisy is found.dataset:
        return found
    begun, ended = found.base.fit, Judged(final, noisy)
    if found.final.fit is begun:
        return replace(found, dataset=noisy, base=ended, final=ended)
    base = finished(begun.axis, begun.begun, noisy.training, begun.outcome)
    return replace(found, dataset=noisy, base=Judged(base, noisy), final=ended)
