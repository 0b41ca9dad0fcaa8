"""A body of a mechanism whose inertia is not what its MuJoCo file says: a payload, a wrong link.

What the bodies take of the forces at the joints is linear in the ten inertial parameters of each
body, and a body changes the forces of every joint that carries it. So those of one body at a time
are tried over all joints together, each joint in units of its noise floor, by the same acceptance
test as any effect (``selection``). It is asked before the effects of single joints, which would
imitate it: a motor that saturates, a constant force. What is told in the end is the better of two
answers, that with the body and that without.

Another torque constant of one motor is a rival of the bodies: each takes a part of what the other
makes. So a diagnosis offers it only on a joint where it takes more than any body does, and more
than a constant force, of which it makes a part as well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import Columns, PreparedLog, sticks
from identify.estimation.evidence import effective_samples
from identify.estimation.fit import Errors, Fit, fit_axis
from identify.estimation.force_balance import residual
from identify.estimation.intervals import half_widths_by
from identify.estimation.least_squares import unabsorbed
from identify.rules import RULE
from identify.selection.acceptance import Judged, Score, least_t, part_of, taken
from identify.selection.controls import ControlTest, unit_penalty
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import confidence
from identify.selection.trying import NEARLY_ALL
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel, MachineModel
from twin.parallel import Progress, silent
from twin.signals import Array

if TYPE_CHECKING:
    from twin.mujoco.mechanism import Mechanism

LINK_MASS = "link_mass"  # by which `twin add` knows it, as it knows an effect by its name
INERTIAL = {
    "mass": "kg", "first moment x": "kg m", "first moment y": "kg m", "first moment z": "kg m",
    "inertia xx": "kg m^2", "inertia yy": "kg m^2", "inertia zz": "kg m^2",
    "inertia xy": "kg m^2", "inertia xz": "kg m^2", "inertia yz": "kg m^2",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class WrongBody:
    """A body whose inertial parameters are not those of the file.

    body: its name; axis: that moves it. tied: names of others that explain as much. axes: whose
    forces it changes.
    inertial, change, band (10,): each of INERTIAL as the file has it, by how much it is more, and
    half the 90 % band of that; no number where the logs do not tell it. score: over all joints.
    errors: N, of each axis without and with it. datasets, fits: with it as it was found, by axis.
    """

    body: str
    axis: str
    tied: tuple[str, ...]
    axes: tuple[str, ...]
    inertial: Array
    change: Array
    band: Array
    score: Score
    errors: Mapping[str, Errors]
    datasets: Mapping[str, Dataset]
    fits: Mapping[str, Fit]

    @property
    def differing(self) -> dict[str, tuple[float, float]]:
        """Parameters that differ from the file by more than their band: change and band."""
        each = zip(INERTIAL, self.change.tolist(), self.band.tolist(), strict=True)
        return {name: (value, band) for name, value, band in each if band < abs(value)}

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Parameters that these joints do not tell, or only together with others."""
        return tuple(n for n, band in zip(INERTIAL, self.band, strict=True) if np.isnan(band))

    @property
    def explains_all(self) -> bool:
        """Whether it takes so much, of more than one joint, that no effect of one can take more."""
        shares = [e.share_of(e.before, 0.0) for e in self.errors.values()]
        several = sum(share >= RULE.least_part for share in shares) > 1
        return several and self.score.part >= NEARLY_ALL

    @property
    def element(self) -> tuple[float, Array, Array] | None:
        """Mass kg, centre (3,) m and inertia (3, 3) kg m^2 about it that the body has by the logs.

        Where these tell nothing, as in the file. None where no body can have these.
        """
        mass, first, about = np.split(self.inertial + self.change, [1, 4])
        if mass[0] <= 0.0:
            return None
        centre, (xx, yy, zz, xy, xz, yz) = first / mass, about
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        matrix -= mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        moments = np.linalg.eigvalsh(matrix)
        possible = moments[0] > 0.0 and moments[2] <= moments[0] + moments[1]
        return (float(mass[0]), centre, matrix) if possible else None

    @property
    def confidence(self) -> float:
        """How often answers with such a score were right, 0..1."""
        return confidence(self.score.part, self.score.t)


@dataclass(frozen=True, eq=False)
class Suspects:
    """What is wrong of a mechanism before any effect of a joint: a body, or a motor's constant.

    body: where one is accepted. motor: the axis whose torque constant takes more than any body.
    """

    body: WrongBody | None = None
    motor: str | None = None

    def offered(self, catalogue: Catalogue, axis: str) -> Catalogue:
        """The effects that a diagnosis of that axis may name."""
        return Catalogue([e for e in catalogue.values() if axis == self.motor or not _is_gain(e)])


def _is_gain(effect: Effect) -> bool:
    """Whether it is a torque constant: an actuation effect that joints alone have."""
    return effect.kind is Kind.ACTUATION and effect.of_joints is True


def suspects_of(
    model: MachineModel,
    fits: Mapping[str, Fit],
    datasets: Mapping[str, Dataset],
    progress: Progress = silent,
) -> Suspects:
    """The body or the motor that explains what the joints' models leave, where there is one.

    fits, datasets: of the axes that move. Of long logs the beginnings tell it. Asked are the bodies
    and motors of joints that are above their noise floor.
    """
    if not model.joints:
        return Suspects()
    from twin.mujoco.mechanism import mechanism_in  # MuJoCo takes long to load

    mechanism = mechanism_in(model)
    before = {axis: _on_beginnings(fits[axis], datasets[axis]) for axis in fits}
    left = [a for a in mechanism.axes if a in before and not before[a].at_floor]
    if not left:
        return Suspects()
    bodies = [_Body(mechanism, mechanism.axes.index(axis)) for axis in left]
    rivals: list[_Body | _Motor] = [*bodies, *(_Motor(a, before[a].fit.axis) for a in left)]
    trial = _Trial.beside(before)
    parts = []
    for i, rival in enumerate(rivals):
        progress("trying bodies and motors", i, len(rivals))
        parts.append(trial.part(rival))
        rival.forget()
    first, *others = (rivals[i] for i in np.argsort(parts)[::-1])
    if max(parts) < RULE.promise * RULE.least_part:
        return Suspects()
    if isinstance(first, _Motor):
        is_less = trial.part(_Constant(first.axis, first.model)) > max(parts)
        return Suspects(motor=None if is_less else first.axis)
    next_body = [rival for rival in others if isinstance(rival, _Body)][:1]
    return Suspects(_accepted(first, next_body, len(rivals), trial, fits, datasets))


def _accepted(
    body: _Body,
    rivals: Sequence[_Body],
    among: int,
    trial: _Trial,
    fits: Mapping[str, Fit],
    datasets: Mapping[str, Dataset],
) -> WrongBody | None:
    """A body as it was found, if the logs prove it; among: of how many it was chosen."""
    before, change = trial.before, trial.change(body)
    after = trial.after(body, change)
    score = _score(before, after, among)
    if score.accepted:
        score = replace(score, control=trial.control(body))
    if not score.accepted:
        return None

    def is_tied(rival: _Body) -> bool:
        other = _training(trial.after(rival, trial.change(rival)), before)
        gain = taken(other, _training(after, before), 1.0)
        return gain.t < least_t(1) or gain.part < RULE.least_part

    found = {axis: body.corrected(datasets[axis], change) for axis in fits}
    refits = {a: _refitted(fits[a], d) for a, d in found.items()}
    return WrongBody(
        body=body.name,
        axis=body.mechanism.axes[body.index],
        tied=tuple(r.name for r in rivals if is_tied(r)),
        axes=tuple(axis for axis in body.axes if axis in fits),
        inertial=body.mechanism.inertial(body.index),
        change=change,
        band=_bands(body, trial, after),
        score=score,
        errors={a: _errors(fits[a], datasets[a], refits[a], found[a]) for a in fits},
        datasets=found,
        fits=refits,
    )


def corrected(model: MachineModel, found: WrongBody, element: str, file: str) -> MachineModel:
    """A model with that inertial element in a MuJoCo file of another name, its joints refitted."""
    from twin.mujoco.mechanism import joints_of
    from twin.mujoco.written import in_mjcf, with_inertial

    text, name, wanted = model.mjcf or "", model.mjcf_name or "", found.inertial + found.change
    text = in_mjcf(text, name)
    text = with_inertial(text, name, model.joints, found.axis, element, wanted)
    bodies = joints_of(text, file, model.joints)
    refitted = {axis: fit.axis for axis, fit in found.fits.items()}
    axes = {a: replace(refitted.get(a, x), mass=bodies[a].inertia) for a, x in model.axes.items()}
    return replace(model, axes=axes, mjcf=text, mjcf_name=file, intervals={})


def is_better(with_body: Mapping[str, AxisDiagnosis], without: Mapping[str, AxisDiagnosis]) -> bool:
    """Whether the answer with a body leaves less, over all joints; or no more and says less.

    The body is one thing that is said, of more parameters than an effect of a joint has.
    """
    floors = {axis: d.base.floor for axis, d in without.items()}

    def squares(found: Mapping[str, AxisDiagnosis]) -> Array:
        """Mean over the axes of what is left on the training logs and those that chose, squared."""
        each = [(d.final.error / floors[a], d.chosen.after / floors[a]) for a, d in found.items()]
        return np.mean(np.square(each), axis=0)

    one, other = squares(without).tolist(), squares(with_body).tolist()
    for gains in (map(part_of, one, other, (1.0, 1.0)), map(part_of, other, one, (1.0, 1.0))):
        if min(gains) >= RULE.least_part:
            return bool(np.sum(other) < np.sum(one))
    said = [sum(len(d.findings) for d in found.values()) for found in (with_body, without)]
    return 1 + said[0] < said[1]


class _Rival(Protocol):
    """What is linear in some parameters, over all joints."""

    def forces(self, log: PreparedLog) -> Array:
        """Change (n, k) of the force residual, N per unit of each parameter."""

    def forget(self) -> None:
        """Let go of what it has computed for its forces."""


@dataclass(frozen=True)
class _Motor:
    """The torque constant of an axis, beside what its model was fitted to.

    What it makes of an error in the torque as it was logged is in proportion to the torque that the
    model tells; the measured one would explain itself.
    """

    axis: str
    model: AxisModel

    def forget(self) -> None:
        pass

    def forces(self, log: PreparedLog) -> Array:
        if log.motion.axis != self.axis:
            return np.zeros((len(log), 1))
        return (log.fine.mean(log.motion.raw[1]) - residual(self.model, [log]))[:, None]


@dataclass(frozen=True)
class _Constant(_Motor):
    """A constant force of an axis, of which a torque constant makes a part where weight pulls."""

    def forces(self, log: PreparedLog) -> Array:
        return np.full((len(log), 1), float(log.motion.axis == self.axis))


@dataclass(frozen=True, eq=False)
class _Body:
    """The body that an axis of a mechanism moves."""

    mechanism: Mechanism
    index: int

    @property
    def name(self) -> str:
        return self.mechanism.bodies[self.index]

    @property
    def axes(self) -> tuple[str, ...]:
        """Whose forces it changes."""
        return tuple(self.mechanism.axes[i] for i in self.mechanism.moved_by(self.index))

    @cached_property
    def _known(self) -> dict[tuple[int, int], Array]:
        return {}

    def forget(self) -> None:
        self._known.clear()

    def _per_unit(self, log: PreparedLog) -> Array:
        """Momentum and force (2, 10, n) of the log's own axis by each of INERTIAL, per unit."""
        bodies = log.motion.bodies
        assert bodies is not None
        # The joints of a log share their motion, unless they begin at other instants.
        first = bodies.readings[0]
        key = (first.__array_interface__["data"][0], len(first))
        if key not in self._known:
            motion = bodies.along()
            every = self.mechanism.per_unit(self.index, *motion)
            self._known[key] = every[:, :, self.mechanism.moved_by(self.index)]
        return np.asarray(self._known[key][:, :, self.axes.index(log.motion.axis)])

    def forces(self, log: PreparedLog) -> Array:
        if log.motion.axis not in self.axes:
            return np.zeros((len(log), len(INERTIAL)))
        momentum, force = self._per_unit(log)
        return -(log.fine.mean(force) + log.fine.acceleration(momentum)).T

    def corrected(self, dataset: Dataset, change: Array) -> Dataset:
        """A dataset in whose bodies this one is changed by so much (10,)."""

        def of(log: PreparedLog) -> PreparedLog:
            motion = log.motion
            assert motion.bodies is not None
            momentum, force = np.einsum("k,pkn->pn", change, self._per_unit(log))
            bodies = motion.bodies.with_more(momentum, force)
            command = log.command + self.forces(log) @ change
            return replace(log, motion=replace(motion, bodies=bodies), command=command)

        return dataset.with_logs(map(of, dataset.logs)) if dataset.axis in self.axes else dataset


@dataclass(frozen=True, eq=False)
class _Trial:
    """What is tried beside fits of all joints at once, each in units of its noise floor.

    resting: whether test functions with standstill tell nothing of some joint.
    """

    before: Mapping[str, Judged]
    trial: ControlTest
    resting: bool

    @classmethod
    def beside(cls, before: Mapping[str, Judged]) -> _Trial:
        """The trial beside fits by axis."""
        resting = any(sticks(judged.fit.axis) for judged in before.values())
        return cls(before, ControlTest.together([*before.values()]), resting)

    def forces(self, rival: _Rival, log: PreparedLog) -> Array:
        """Change (n, k) of what is left of a log by each parameter."""
        return rival.forces(log) / self.before[log.motion.axis].fit.floor

    def size(self, rival: _Rival) -> Array:
        """Of each parameter (k,), by which a weak penalty on it is one."""
        own = [self.forces(rival, w)[k] for j in self.before.values() for w, k in _kept(j)]
        return unit_penalty(np.concatenate(own))

    def columns(self, rival: _Rival) -> Columns:
        """The same, for a unit penalty."""
        size = self.size(rival)
        return lambda logs: [self.forces(rival, log) / size for log in logs]

    def part(self, rival: _Rival) -> float:
        """Part of what is left that one linear step takes."""
        return self.trial.part(self.columns(rival), sticking=self.resting)

    def control(self, rival: _Rival) -> float:
        """The part that controls take."""
        return self.trial.control(self.columns(rival), sticking=self.resting)

    def change(self, rival: _Rival) -> Array:
        """Its parameters (k,) as one linear step finds them."""
        return -self.trial.step(self.columns(rival), sticking=self.resting) / self.size(rival)

    def after(self, body: _Body, change: Array) -> dict[str, Judged]:
        """The fits beside a body that is changed by so much (10,)."""
        found = {a: body.corrected(j.dataset, change) for a, j in self.before.items()}
        return {a: Judged(_refitted(self.before[a].fit, d), d) for a, d in found.items()}


def _kept(judged: Judged) -> list[tuple[PreparedLog, NDArray[np.bool_]]]:
    ends = np.cumsum([len(log) for log in judged.fit.logs])[:-1]
    return [*zip(judged.fit.logs, np.split(judged.fit.kept, ends), strict=True)]


def _refitted(fit: Fit, dataset: Dataset) -> Fit:
    return replace(fit_axis(fit.axis, dataset.training), begun=fit.begun)


def _on_beginnings(fit: Fit, dataset: Dataset) -> Judged:
    part = dataset.part
    return Judged(fit if part is dataset else _refitted(fit, part), part)


def _training(found: Mapping[str, Judged], floors: Mapping[str, Judged]) -> Array:
    """What is left of all joints on the training logs, in units of the noise floors of fits."""
    return np.concatenate([j.training / floors[a].fit.floor for a, j in found.items()])


def _other(found: Mapping[str, Judged], floors: Mapping[str, Judged]) -> Array:
    """The same on logs that were not fitted."""
    return np.concatenate([j.other / floors[a].other_floor for a, j in found.items()])


def _score(before: Mapping[str, Judged], after: Mapping[str, Judged], among: int) -> Score:
    left = _training(after, before)
    charge = len(INERTIAL) / effective_samples(left[np.isfinite(left)])
    training = taken(_training(before, before), left, 1.0, charge)
    return Score(training, taken(_other(before, before), _other(after, before), 1.0), among=among)


def _bands(body: _Body, trial: _Trial, after: Mapping[str, Judged]) -> Array:
    """Half the 90 % band (10,) of each parameter; no number where the joints do not tell it.

    By the scatter between stretches of time, of all joints together: what friction leaves at its
    reversals is no noise, and differs from joint to joint.
    """
    # of the largest singular value; below, a direction of the parameters is not told
    resolved = 1e-6
    rows, left, time = [], [], []
    for axis, judged in after.items():
        own = np.concatenate([trial.forces(body, log)[kept] for log, kept in _kept(judged)])
        rows.append(unabsorbed(own, judged.fit.basis))
        left.append(judged.fit.residual / trial.before[axis].fit.floor)
        time.append(np.linspace(0.0, 1.0, len(left[-1])))
    order = np.argsort(np.concatenate(time), kind="stable")
    told, noise = np.concatenate(rows)[order], np.concatenate(left)[order]
    size = np.linalg.norm(told, axis=0)
    size[size < resolved * size.max()] = np.inf
    _, singular, turned = np.linalg.svd(told / size, full_matrices=False)
    clear = singular > resolved * singular[0]
    band = half_widths_by(told / size @ turned[clear].T, noise, turned[clear]) / size
    hidden = np.linalg.norm(turned[~clear], axis=0) > np.sqrt(resolved)
    return np.where(hidden | np.isinf(size), np.nan, band)


def _errors(before: Fit, given: Dataset, after: Fit, found: Dataset) -> Errors:
    """Of one axis without and with a body, on the logs that are reported."""
    first, second = (Errors.of(f, f, d, d.tested_on) for f, d in ((before, given), (after, found)))
    return replace(first, after=second.after)
