"""One answer whatever the roles of the logs: all that decide are one set, and what is told of it.

Which of two like logs is given to fit and which to choose is a user's choice, and no property of
the machine. So what a model lacks is asked of all of them together: each law is fitted to all, and
judged on every block by a fit to the other logs (``evidence.left_out``). The values that are told,
the errors and the final model are those of the roles, as any other command tells them: fitted to
the training logs alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identify.dataset.dataset import Dataset
from identify.estimation.alignment import aligned_as
from identify.estimation.fit import Fit, fit_axis
from identify.selection.acceptance import Judged
from identify.selection.doubts import Conclusion
from identify.selection.findings import Finding, findings_of
from identify.selection.search import Found


def in_roles(ended: Conclusion, base: Fit, dataset: Dataset) -> Conclusion:
    """What all logs that decide come to, with the values and errors that their roles tell.

    base: the fit of the given model to the training logs of the dataset.
    """
    if not dataset.selection:
        return ended
    found = ended.found
    there = aligned_as(found.dataset, dataset)
    same = all(a is b for a, b in zip(there.training, dataset.training, strict=True))
    first = base if same else replace(fit_axis(base.axis, there.training), begun=base.begun)
    final = first
    if found.steps:
        final = replace(fit_axis(found.final.fit.axis, there.training), begun=base.begun)
    told = replace(found, dataset=there, base=Judged(first, there), final=Judged(final, there))
    return replace(ended, found=told, findings=_proved_as(ended.findings, told))


def _proved_as(findings: Sequence[Finding], found: Found) -> tuple[Finding, ...]:
    """The findings as the roles tell them; what proves them is the test on all logs."""
    proofs = {f.effect: f for f in findings}
    return tuple(
        replace(f, score=p.score, doubt=p.doubt, tied=p.tied, kind=p.kind)
        for f in findings_of(found)
        if (p := proofs.get(f.effect))
    )
