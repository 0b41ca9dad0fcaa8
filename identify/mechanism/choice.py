"""Which groups of a mechanism must move away from its file: one search, one acceptance test.

Sets of groups are grown from the best of each size, by Schwarz's criterion; bodies have what a body
can have. Of the best set each group has to be accepted beside all others of it. What stands in the
place of one in another set that explains as much is told with it: a body that is felt at one joint
alone is a rotor there, and a torque constant what all weights of its joint have in common.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.mechanism.groups import Group
from identify.mechanism.regression import Regression, Rows, Solution
from identify.rules import RULE
from identify.selection.acceptance import Score, least_t
from identify.estimation.residual_noise import SHIFTS
from twin.signals import Array

Chosen = frozenset[int]  # numbers of groups
WIDE = 4  # sets of each size that are grown
MOST = 6  # groups that may move


@dataclass(frozen=True, eq=False)
class Moved:
    """A group that must move away from the file.

    tied: others that explain as much in its place. values (k,): its change. score: over all joints,
    beside all else that moved.
    """

    group: Group
    tied: tuple[Group, ...]
    values: Array
    score: Score


@dataclass(frozen=True, eq=False)
class Choice:
    """The sets of groups of a regression that were looked at."""

    regression: Regression

    @cached_property
    def _known(self) -> dict[Chosen, Solution]:
        return {}

    def solution(self, chosen: Chosen) -> Solution:
        """With values that are possible."""
        if chosen not in self._known:
            self._known[chosen] = self.regression.feasible(chosen)
        return self._known[chosen]

    def criterion(self, chosen: Chosen) -> float:
        """What speaks against a set."""
        return self.regression.criterion(self.solution(chosen))

    def moved(self) -> list[Moved]:
        """The groups that must move, those that explain most first."""
        best = self._needed(self._grown())
        found = [self._moved(g, best) for g in best]
        return sorted(found, key=lambda m: -m.score.part)

    def _grown(self) -> Chosen:
        """The best set of all that were grown."""
        every = range(len(self.regression.groups))
        layer: list[Chosen] = [frozenset()]
        best = layer[0]
        for _ in range(MOST):
            larger = {own | {g} for own in layer for g in every if g not in own}
            rough = {own: self._roughly(own) for own in larger}
            first = sorted(larger, key=lambda own: rough[own])[: 2 * WIDE]
            layer = sorted(first, key=self.criterion)[:WIDE]
            if self.criterion(layer[0]) >= self.criterion(best):
                break
            best = layer[0]
        return best

    def _roughly(self, chosen: Chosen) -> float:
        """What speaks against a set, whether its values are possible or not."""
        return self.regression.criterion(self.regression.solved(chosen))

    def _needed(self, chosen: Chosen) -> Chosen:
        """The set less what is not accepted beside the rest of it, the weakest first."""
        scores = {g: self._score(g, chosen) for g in chosen}
        refused = {g: s for g, s in scores.items() if not s.accepted}
        if not refused:
            refused = {g: s for g, s in self._beside_controls(scores, chosen) if not s.accepted}
        if not refused:
            return chosen
        return self._needed(chosen - {min(refused, key=lambda g: refused[g].part)})

    def _score(self, g: int, chosen: Chosen) -> Score:
        """What a group takes beside the others of a set."""
        among = len(self.regression.groups)
        return self.regression.score(self.solution(chosen - {g}), self.solution(chosen), among)

    def _beside_controls(
        self, scores: dict[int, Score], chosen: Chosen
    ) -> Iterator[tuple[int, Score]]:
        for g, score in scores.items():
            yield g, replace(score, control=self._control(g, chosen))

    def _control(self, g: int, chosen: Chosen) -> float:
        """The part that all but one in twenty of a group's controls take: shifted in time."""
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
        return float(np.quantile(parts, 1.0 - RULE.chance, method="inverted_cdf"))

    def _moved(self, g: int, chosen: Chosen) -> Moved:
        found = self.solution(chosen)
        ((_, score),) = self._beside_controls({g: self._score(g, chosen)}, chosen)
        others = self.regression.groups
        tied = tuple(others[r] for r in self._in_its_place(g, chosen))
        return Moved(others[g], tied, found.values[self.regression.spans[g]], score)

    def _in_its_place(self, g: int, chosen: Chosen) -> list[int]:
        """The groups that explain as much in the place of one, those that explain most first."""
        rest = chosen - {g}
        rivals = [r for r in range(len(self.regression.groups)) if r not in chosen]
        alike = [r for r in rivals if self._is_as_good(rest | {r}, chosen)]
        return sorted(alike, key=lambda r: self.criterion(rest | {r}))

    def _is_as_good(self, one: Chosen, best: Chosen) -> bool:
        """Whether the logs do not clearly prefer the best set to another."""
        by = self.regression.score(self.solution(one), self.solution(best))
        return by.part < RULE.least_part or by.t < least_t(1)


def _shifted(rows: Rows, span: slice, rng: np.random.Generator) -> Rows:
    """Rows with some columns moved in time, each joint's own by as much of its rows."""
    columns, by = rows.columns.copy(), rng.uniform(*SHIFTS)
    for joint in np.unique(rows.joint):
        own = np.flatnonzero(rows.joint == joint)
        columns[own, span] = np.roll(columns[own, span], round(by * len(own)), axis=0)
    return replace(rows, columns=columns)


