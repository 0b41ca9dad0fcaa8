"""Which groups of a mechanism must move away from its file: one search, one acceptance test.

Sets of groups are grown from the best of each size, by Schwarz's criterion, beside what the file
does not state though it is there; bodies have what a body can have. Of the best set each group has
to be accepted beside all others of it. What stands in the place of one in the best set without it,
where that explains as much, is told with it: a body that is felt at one joint alone is a rotor
there, and a torque constant what all weights of its joint have in common.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.estimation.residual_noise import SHIFTS
from identify.mechanism.groups import Group
from identify.mechanism.regression import GroupSolution, Regression, Rows
from identify.rules import RULE
from identify.selection.acceptance import Score
from twin.signals import Array

Chosen = frozenset[int]  # numbers of groups
WIDE = 4  # sets of each size that are grown
MOST = 6  # groups that may move


@dataclass(frozen=True, eq=False)
class Moved:
    """A group that must move away from the file.

    tied: what explains as much in its place, another group or several of them together. values
    (k,): its change. score: over all joints, beside all else that moved.
    """

    group: Group
    tied: tuple[tuple[Group, ...], ...]
    values: Array
    score: Score


@dataclass(frozen=True, eq=False)
class Choice:
    """The sets of groups of a regression that were looked at."""

    regression: Regression

    @cached_property
    def _known(self) -> dict[Chosen, GroupSolution]:
        return {}

    @cached_property
    def _controls(self) -> dict[tuple[int, Chosen], float]:
        return {}

    @cached_property
    def _rough(self) -> dict[Chosen, float]:
        return {}

    def solution(self, chosen: Chosen) -> GroupSolution:
        """With values that are possible."""
        if chosen not in self._known:
            self._known[chosen] = self.regression.feasible(chosen)
        return self._known[chosen]

    def criterion(self, chosen: Chosen) -> float:
        """What speaks against a set."""
        return self.regression.criterion(self.solution(chosen))

    def moved(self) -> list[Moved]:
        """The groups that must move, those that explain most first."""
        best = self._real(self._grown())
        found = [self._moved(g, best) for g in best]
        return sorted(found, key=lambda m: -m.score.part)

    def disputed(self) -> dict[str, tuple[str, ...]]:
        """Bodies that the training logs by themselves prove and the others refuse; by name, the
        logs that tell another change of one.
        """
        out = {}
        groups = self.regression.groups
        for g in (g for g in self._grown() if groups[g].body is not None):
            alone = frozenset({g})
            own = self._score(g, alone)
            if own.accepted or not replace(own, other=own.training).accepted:
                continue
            logs = self.regression.disagreeing([g], self.solution(alone), g)
            if logs:
                out[groups[g].place] = tuple(logs)
        return out

    def _grown(self, barred: Chosen = frozenset()) -> Chosen:
        """The best set of all that were grown; barred: groups that are in none."""
        groups = self.regression.groups
        every = frozenset(range(len(groups))) - barred
        layer: list[Chosen] = [frozenset(g for g in every if groups[g].unstated)]
        best = layer[0]
        for _ in range(0 if self._is_noise(best) else MOST):
            larger = {own | {g} for own in layer for g in every - own}
            first = sorted(larger, key=self._roughly)[: 2 * WIDE]
            layer = sorted(first, key=self.criterion)[:WIDE]
            if not layer or self.criterion(layer[0]) >= self.criterion(best):
                break
            best = layer[0]
            if self._is_noise(best):
                break
        return best

    def _is_noise(self, chosen: Chosen) -> bool:
        """Whether a set leaves noise alone, so that nothing beside it can be needed."""
        return self.regression.is_noise(self.solution(chosen))

    def _roughly(self, chosen: Chosen) -> float:
        """What speaks against a set, whether its values are possible or not."""
        if chosen not in self._rough:
            self._rough[chosen] = self.regression.criterion(self.regression.solved(chosen))
        return self._rough[chosen]

    def _needed(self, chosen: Chosen) -> Chosen:
        """The set less what is not accepted beside the rest of it, the weakest first."""
        scores = {g: self._score(g, chosen) for g in chosen}
        refused = {
            g: s for g, s in scores.items() if not s.accepted or self._is_noise(chosen - {g})
        }
        if not refused:
            return chosen
        return self._needed(chosen - {min(refused, key=lambda g: refused[g].part)})

    def _real(self, chosen: Chosen) -> Chosen:
        """The same less what takes no more than its controls."""
        chosen = self._needed(chosen)
        scores = {g: self._with_control(g, chosen) for g in chosen}
        refused = {g: s for g, s in scores.items() if not s.accepted}
        if not refused:
            return chosen
        return self._real(chosen - {min(refused, key=lambda g: refused[g].part)})

    def _score(self, g: int, chosen: Chosen) -> Score:
        """What a group takes beside the others of a set."""
        among = len(self.regression.groups)
        return self.regression.score(self.solution(chosen - {g}), self.solution(chosen), among)

    def _with_control(self, g: int, chosen: Chosen) -> Score:
        return replace(self._score(g, chosen), control=self._control(g, chosen))

    def _control(self, g: int, chosen: Chosen) -> float:
        """The part that all but one in twenty of a group's controls take: shifted in time."""
        if (g, chosen) in self._controls:
            return self._controls[g, chosen]
        count, parts = round(1.0 / RULE.chance), []
        span = self.regression.spans[g]
        without = self.solution(chosen - {g})
        for i in range(count):
            rng = np.random.default_rng(i)
            training, other = (
                _shifted(rows, span, rng)
                for rows in (self.regression.training, self.regression.other)
            )
            false = replace(self.regression, training=training, other=other)
            parts.append(false.score(without, false.solved(chosen)).part)
        most = float(np.quantile(parts, 1.0 - RULE.chance, method="inverted_cdf"))
        return self._controls.setdefault((g, chosen), most)

    def _moved(self, g: int, chosen: Chosen) -> Moved:
        found = self.solution(chosen)
        score = self._with_control(g, chosen)
        others = self.regression.groups
        tied = tuple(tuple(others[r] for r in rivals) for rivals in self._in_its_place(g, chosen))
        return Moved(others[g], tied, found.values[self.regression.spans[g]], score)

    def _in_its_place(self, g: int, chosen: Chosen) -> list[list[int]]:
        """What explains as much in the place of one group, of the best sets without it.

        Without it and those found already, as each may hide another that does as well.
        """
        barred, found = frozenset({g}), list[list[int]]()
        while True:
            other = self._needed(self._grown(barred))
            new = sorted(other - chosen)
            if not new or not self._level(other, chosen):
                return found
            barred, found = barred | {*new}, [*found, new]

    def _level(self, other: Chosen, chosen: Chosen) -> bool:
        """Whether a set explains as much as a better one, or leaves no part more that matters."""
        if self.criterion(other) <= self.criterion(chosen) + RULE.least_bic:
            return True
        more = self.regression.score(self.solution(other), self.solution(chosen), 1)
        return max(more.training.part, more.other.part) < RULE.least_part


def _shifted(rows: Rows, span: slice, rng: np.random.Generator) -> Rows:
    """Rows with some columns moved in time, each joint's own by as much of its rows."""
    columns, by = rows.columns.copy(), rng.uniform(*SHIFTS)
    for joint in np.unique(rows.joint):
        own = np.flatnonzero(rows.joint == joint)
        columns[own, span] = np.roll(columns[own, span], round(by * len(own)), axis=0)
    return replace(rows, columns=columns)
