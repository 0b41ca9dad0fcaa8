"""The weak form of all joints of a mechanism as one linear regression.

A row is a test function of one joint on one log; rows are in the order of time, so that a block of
them holds all joints. Each joint is weighed by what nothing here can explain: its noise floor, or
what all groups together leave of it where that is more. The free parameters of the joints' models
are columns in every regression, and groups in those that are asked.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.dataset.body import ACCURACY
from identify.dataset.dataset import Dataset
from identify.dataset.test_function import OVERLAP
from identify.estimation.evidence import blocks_of, effective_samples, rms
from identify.estimation.force_balance import jacobian
from identify.estimation.least_squares import RIDGE, ROUNDING
from identify.mechanism.bodies import possible
from identify.mechanism.groups import Group
from identify.rules import RULE
from identify.selection.acceptance import Judged, Score, taken
from identify.selection.what import What
from twin.signals import Array


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of some logs: force (n,), torque (n,) of the motor and columns (n, p), over a weight.

    force: what the model lacks, the residual's opposite, so that columns times changes make it.
    joint, log (n,): number of the joint and of the log of each. time (n,): s, by which they are in
    order within a log.
    """

    force: Array
    torque: Array
    columns: Array
    joint: NDArray[np.int_]
    log: NDArray[np.int_]
    time: Array

    @classmethod
    def together(cls, parts: Sequence[Rows]) -> Rows:
        """In the order of time."""
        names = [f.name for f in fields(cls)]
        every = cls(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))
        return every.some(np.lexsort((every.time, every.log)))

    def some(self, which: NDArray[Any]) -> Rows:
        """Those of some places, or where a mask says so."""
        return Rows(*(getattr(self, f.name)[which] for f in fields(self)))

    def over(self, weights: Array) -> Rows:
        """Each over the weight (n_joints,) of its joint."""
        by = weights[self.joint]
        force, torque, columns = self.force / by, self.torque / by, self.columns / by[:, None]
        return replace(self, force=force, torque=torque, columns=columns)

    @cached_property
    def gram(self) -> Array:
        """Inner products (p + 1, p + 1), of the force first."""
        both = np.column_stack([self.force, self.columns])
        return np.asarray(both.T @ both)

    def halved(self) -> tuple[Rows, Rows]:
        """Every second block of time, and the others."""
        spans = blocks_of(len(self.force))
        odd = np.repeat(np.arange(len(spans)) % 2, [s.stop - s.start for s in spans]) == 1
        return self.some(~odd), self.some(odd)


@dataclass(frozen=True, eq=False)
class GroupSolution:
    """Values (p,) of all columns, zero where they were not asked, and the squares that are left.

    training, other: of the two groups of logs. parameters: beside the free ones of the joints, the
    effective number.
    """

    values: Array
    training: float
    other: float
    parameters: float


@dataclass(frozen=True, eq=False)
class Regression:
    """The rows of the training logs and of logs that are not fitted, and what may be asked.

    base: columns of the joints' own free parameters. spans: columns of each group. samples: the
    effective number of rows of each group of logs. logs: names of all.
    """

    training: Rows
    other: Rows
    base: slice
    groups: Sequence[Group]
    spans: Sequence[slice]
    samples: tuple[float, float]
    logs: Sequence[str]

    def solved(
        self, chosen: Iterable[int], held: Mapping[int, Array] | None = None
    ) -> GroupSolution:
        """The least squares with some groups beside the base; held: groups at these values."""
        asked, held = sorted(chosen), held or {}
        every, training, other = self._beside_base
        values = np.zeros(len(training) - 1)
        for g, own in held.items():
            values[self._of_group(g)] = own
        free = np.concatenate([np.arange(0), *(self._of_group(g) for g in asked if g not in held)])
        effective = float(sum(map(len, held.values())))
        if len(free):
            gram = training[1:, 1:][np.ix_(free, free)]
            pull = training[1:, 0][free] - training[1:, 1:][free] @ values
            inner = gram + np.diag(self._penalty[self.base.stop + free])
            size = np.sqrt(np.diag(inner))
            scaled = inner / size / size[:, None] + ROUNDING * np.eye(len(free))
            both = np.linalg.solve(scaled, np.column_stack([pull, gram]) / size[:, None])
            values[free] = both[:, 0] / size
            effective += float(np.trace(both[:, 1:] / size[:, None]))
        whole = every @ np.concatenate([[1.0], values])
        return GroupSolution(whole, _squares(training, values), _squares(other, values), effective)

    def _of_group(self, g: int) -> NDArray[np.int_]:
        """The columns of a group, counted from the first of all groups."""
        return _range(self.spans[g]) - self.base.stop

    @cached_property
    def _beside_base(self) -> tuple[Array, Array, Array]:
        """The base solved beside whatever values (q,) the groups have.

        The matrix (p, q + 1) that makes all values of 1 and these, and the inner products (q + 1,
        q + 1) of what is then left of the training logs and of the others.
        """
        gram, stop = self.training.gram, self.base.stop
        inner = gram[1:, 1:][:stop, :stop] + np.diag(self._penalty[:stop])
        size = np.sqrt(np.diag(inner))
        scaled = inner / size / size[:, None] + ROUNDING * np.eye(stop)
        right = np.column_stack([gram[1 : stop + 1, 0], -gram[1 : stop + 1, stop + 1 :]])
        base = np.linalg.solve(scaled, right / size[:, None]) / size[:, None]
        groups = np.eye(base.shape[1])[1:]
        every = np.vstack([base, groups])
        change = np.vstack([np.eye(base.shape[1])[:1], every])
        change[1:, 0] *= -1.0  # of the force what the base leaves, of columns what is beside it
        training, other = (
            np.asarray(change.T @ rows.gram @ change) for rows in (self.training, self.other)
        )
        return every, training, other

    @cached_property
    def _penalty(self) -> Array:
        """Of each column (p,): weak, and of a body such that it may be off as far as its scale."""
        norms = np.linalg.norm(self.training.columns, axis=0)
        out = (RIDGE * norms) ** 2 + np.finfo(float).tiny
        rows = len(self.training.force)
        for group, span in zip(self.groups, self.spans, strict=True):
            # As many rows as tell one thing weigh as one.
            out[span] += rows / self.samples[0] / group.scale**2
        return np.asarray(out)

    def feasible(self, chosen: Iterable[int]) -> GroupSolution:
        """The same with values that bodies, rotors and frictions can have."""
        asked = sorted(chosen)
        found = self.solved(asked)
        held: dict[int, Array] = {}
        for g in asked:
            least, own = self.groups[g].least, found.values[self.spans[g]]
            if np.any(own < least):
                held[g] = np.maximum(own, least)
        found = self.solved(asked, held) if held else found
        bodies = [g for g in asked if self.groups[g].what is What.BODY]
        if not bodies:
            return found
        begun = [_inertial(self.groups[g]) for g in bodies]
        where = np.concatenate([_range(self.spans[g]) for g in bodies])
        wanted = np.concatenate(begun) + found.values[where]
        near = possible(wanted, self._information(asked, where), begun)
        if near is wanted:
            return found
        changes = np.split(near - np.concatenate(begun), len(bodies))
        again = self.solved(asked, held | dict(zip(bodies, changes, strict=True)))
        return replace(again, parameters=found.parameters)

    def _information(self, chosen: Sequence[int], where: Array) -> Array:
        """Of some columns, beside all others of a regression: its Schur complement."""
        free = [np.arange(self.base.stop), *(_range(self.spans[g]) for g in chosen)]
        others = np.setdiff1d(np.concatenate(free), where).astype(int)
        full = self.training.gram[1:, 1:] + np.diag(self._penalty)
        cross = full[np.ix_(others, where)]
        # 1e-13, below which a combination of columns is rounding
        inner = np.linalg.pinv(full[np.ix_(others, others)], rcond=1e-13, hermitian=True)
        return np.asarray(full[np.ix_(where, where)] - cross.T @ inner @ cross)

    def known_by_data(self, chosen: Sequence[int], span: slice) -> NDArray[np.bool_]:
        """Which parameters (k,) of a body the logs tell, and not what is known of bodies before.

        Beside the other columns of a regression.
        """
        # 0.1 of what is known of a parameter, from which it is not by the logs alone
        most = 0.1
        where = _range(span)
        whole, prior = self._information(chosen, where), self._penalty[where]
        size = np.sqrt(np.diag(whole))
        inverse = np.linalg.inv(whole / size / size[:, None]) / size / size[:, None]
        return np.asarray(np.diag(inverse) * prior < most)

    def disagreeing(self, chosen: Sequence[int], found: GroupSolution, group: int) -> list[str]:
        """Names of the logs that by themselves tell another change of a group than all together.

        Beside the same other groups, and the joints' own parameters as each log has them. It
        is the same that differs by less than files do: an unknown friction moves it as far.
        """
        span = self.spans[group]
        own, out = found.values[span], list[str]()
        numbers = np.unique(np.concatenate([self.training.log, self.other.log]))
        for number in numbers if numbers[1:].size else []:
            both = [r.some(r.log == number) for r in (self.training, self.other)]
            rows = max(both, key=lambda r: len(r.force))
            alone = replace(self, training=rows, other=rows)
            held, free = alone.solved(chosen, {group: own}), alone.solved(chosen)
            score = alone.score(held, free, len(numbers))
            whole, more = own + self.groups[group].corrected, free.values[span] - own
            told, more = (rows.columns[:, span] @ by for by in (whole, more))
            is_other = rms(more) > ACCURACY * rms(told)
            if is_other and replace(score, other=score.training).accepted:
                out.append(self.logs[number])
        return out

    def left(self, found: GroupSolution) -> tuple[Array, Array]:
        """What a solution leaves of the rows of both groups of logs, in their weights."""
        both = (self.training, self.other)
        one, other = (rows.force - rows.columns @ found.values for rows in both)
        return one, other

    def is_noise(self, found: GroupSolution) -> bool:
        """Whether a solution leaves of every joint about what nothing here can explain."""
        each = zip(self.left(found), (self.training, self.other), strict=True)
        return all(
            rms(left[rows.joint == joint]) < RULE.at_floor
            for left, rows in each
            for joint in np.unique(rows.joint)
        )

    def score(self, before: GroupSolution, after: GroupSolution, among: int = 1) -> Score:
        """What one solution takes of what another leaves, over all joints (``acceptance``)."""
        first, then = self.left(before), self.left(after)
        charge = max(after.parameters - before.parameters, 0.0) / self.samples[0]
        return Score(
            taken(first[0], then[0], 1.0, charge), taken(first[1], then[1], 1.0), among=among
        )

    def criterion(self, found: GroupSolution) -> float:
        """How much speaks against a solution: Schwarz's criterion, on both groups of logs."""
        counts = (len(self.training.force), len(self.other.force))
        squares = (found.training, found.other)
        # Never less than the weights, which is noise
        mean = [max(s / n, 1.0) for s, n in zip(squares, counts, strict=True)]
        fits = (m * np.log(s) for m, s in zip(self.samples, mean, strict=True))
        return float(sum(fits) + found.parameters * np.log(self.samples[0]))


def regression_of(before: Mapping[str, Judged], groups: Sequence[Group]) -> Regression:
    """The regression of fitted joints, whose weights are by what all groups leave."""
    begun = [j.fit.jacobian.shape[1] for j in before.values()]
    ends = np.cumsum([0, *begun, *(g.count for g in groups)]).tolist()
    spans = [slice(a, b) for a, b in pairwise(ends)]
    floors = np.array([j.fit.floor for j in before.values()])
    holdout = all(j.dataset.selection for j in before.values())
    names = _names(j.dataset for j in before.values())

    def rows(fitted: bool) -> Rows:
        each = enumerate(zip(before.values(), spans, strict=False))
        parts = [_rows_of(i, own, span, groups, ends, fitted, names) for i, (own, span) in each]
        return Rows.together(parts).over(floors)

    first, second = (rows(True), rows(False)) if holdout else rows(True).halved()
    own, of_groups = slice(0, sum(begun)), spans[len(begun) :]
    apart = len(first.force) / OVERLAP, len(second.force) / OVERLAP  # that share no instant
    plain = Regression(first, second, own, groups, of_groups, apart, names)
    return _by_what_is_left(_with_torques(plain))


def _rows_of(
    joint: int, judged: Judged, span: slice, groups: Sequence[Group], ends: Sequence[int],
    fitted: bool, names: Sequence[str],
) -> Rows:  # fmt: skip
    """The rows of one joint, of the training logs or of those that are not fitted, in N.

    span: columns of its own free parameters. ends: of all columns. names: of all logs.
    """
    fit, dataset = judged.fit, judged.dataset
    logs = dataset.training if fitted else dataset.selection
    force = judged.training if fitted else judged.other
    kept = np.isfinite(force)
    columns = np.zeros((int(kept.sum()), ends[-1]))
    columns[:, span] = jacobian(fit.axis, logs, fit.scaling.where, kept)
    first = len(ends) - 1 - len(groups)
    for g, group in enumerate(groups):
        own = slice(ends[first + g], ends[first + g + 1])
        columns[:, own] = np.concatenate([group.columns(log) for log in logs])[kept]
    torque = np.concatenate([log.fine.mean(log.motion.raw[1]) for log in logs])[kept]
    time = np.concatenate([log.time for log in logs])[kept]
    number = np.repeat([names.index(log.motion.name) for log in logs], [len(log) for log in logs])
    return Rows(-force[kept], torque, columns, np.full(len(time), joint), number[kept], time)


def _with_torques(plain: Regression) -> Regression:
    """With the torque that all other groups predict as the column of each gain."""
    others = [g for g, group in enumerate(plain.groups) if group.what is not What.GAIN]
    joints = {axis: k for k, axis in enumerate(dict.fromkeys(g.axis for g in plain.groups))}

    def with_prediction(rows: Rows, found: GroupSolution) -> Rows:
        predicted = rows.torque + (rows.force - rows.columns @ found.values)
        columns = rows.columns.copy()
        for group, span in zip(plain.groups, plain.spans, strict=True):
            if group.what is What.GAIN:
                own = rows.joint == joints[group.axis]
                columns[:, span] = np.where(own, predicted, 0.0)[:, None]
        return replace(rows, columns=columns)

    # At first the other groups alone tell it, in part as the gain has it; then all of them do.
    for asked in (others, range(len(plain.groups))):
        found = plain.solved(asked)
        training, other = (with_prediction(rows, found) for rows in (plain.training, plain.other))
        plain = replace(plain, training=training, other=other)
    return plain


def _by_what_is_left(plain: Regression) -> Regression:
    """Each joint weighed by what all groups together leave of it, where that is above its floor."""
    left = plain.left(plain.solved(range(len(plain.groups))))
    both = (plain.training, plain.other)
    joints = np.unique(plain.training.joint)
    each = [
        [rms(own[rows.joint == j]) for own, rows in zip(left, both, strict=True)] for j in joints
    ]
    weights = np.maximum(np.min(each, axis=1), 1.0)
    count = [effective_samples(own / weights[r.joint]) for own, r in zip(left, both, strict=True)]
    return replace(
        plain, training=both[0].over(weights), other=both[1].over(weights),
        samples=(count[0], count[1]),
    )  # fmt: skip


def _names(datasets: Iterable[Dataset]) -> tuple[str, ...]:
    """Of all logs, each once."""
    return tuple(dict.fromkeys(log.motion.name for d in datasets for log in d.logs))


def _squares(gram: Array, values: Array) -> float:
    """What values (p,) leave of the squared force, by inner products (p + 1, p + 1)."""
    change = np.concatenate([[1.0], -values])
    return max(float(change @ gram @ change), 0.0)


def _range(span: slice) -> Array:
    return np.arange(span.start, span.stop)


def _inertial(group: Group) -> Array:
    assert group.body is not None
    return np.asarray(group.body.inertial + group.corrected)
