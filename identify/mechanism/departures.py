"""What of a mechanism has to move away from its file, before any effect of a single joint is asked.

The bodies that must move are corrected in the datasets of all joints. Of rotors, torque constants,
friction with load and springs a diagnosis of a joint may name those that must move there, and no
others: as a joint alone they imitate each other and the bodies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identify.dataset.body import ACCURACY, Body
from identify.dataset.dataset import Dataset
from identify.estimation.alignment import fit_aligned
from identify.estimation.errors import Errors, error_in
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.found_shape import held_strengths
from identify.estimation.intervals import half_widths_by
from identify.mechanism.bodies import WrongBody
from identify.mechanism.choice import Choice, Moved
from identify.mechanism.groups import Group, groups_of
from identify.mechanism.regression import GroupSolution, Regression, regression_of
from identify.rules import RULE
from identify.selection.acceptance import Judged
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.what import What
from twin.effects import Catalogue
from twin.model.machine import AxisModel, MachineModel
from twin.parallel import Progress, silent
from twin.signals import Array


@dataclass(frozen=True, eq=False)
class Departures:
    """What must move, and the joints beside the bodies as they were found.

    names: of the laws by which groups are told. groups: all that were asked; none of plain axes,
    and where only noise is left of every joint. disputed: where nothing moved, bodies of which the
    logs tell each another change, and those logs.
    """

    datasets: Mapping[str, Dataset]
    fits: Mapping[str, Fit]
    moved: Sequence[Moved] = ()
    bodies: tuple[WrongBody, ...] = ()
    names: Mapping[What, str] = field(default_factory=dict)
    groups: Sequence[Group] = ()
    disputed: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def offered(self, catalogue: Catalogue, axis: str) -> Catalogue:
        """The effects that a diagnosis of that axis may name.

        Friction that follows the load is a matter of one joint, and so is a rotor of which the file
        says nothing: what the model lacks otherwise on a joint may hide them here.
        """
        if not self.datasets[axis].beside_bodies:
            return catalogue
        own = {m.group.what for m in self.moved if m.group.axis == axis} | {What.LOAD}
        own |= {What.ROTOR} if self.fits[axis].begun.weighed is self.fits[axis].begun else set()
        others = [what for what in What if what not in own]
        return Catalogue([e for e in catalogue.values() if not any(w.covers(e) for w in others)])

    def with_ties(self, found: AxisDiagnosis) -> AxisDiagnosis:
        """The diagnosis of an axis, with what of other joints explains as much as a finding."""
        own = [m for m in self.moved if m.group.axis == found.dataset.axis]
        laws = {f.effect.name: f.effect for f in found.final.axis.effects}

        def tied(name: str) -> list[str]:
            alike = (m.tied for m in own if name in laws and m.group.what.covers(laws[name]))
            return [self.named(together) for rivals in alike for together in rivals]

        findings = tuple(
            replace(f, tied=tuple(dict.fromkeys((*f.tied, *tied(f.effect)))))
            for f in found.findings
        )
        return replace(found, findings=findings)

    def beside(self, fits: Mapping[str, Fit], datasets: Mapping[str, Dataset]) -> Departures:
        """The bodies once more, beside all that was found of the joints since: their fits now.

        What a joint lacked had been a part of their values, and no part of their bands. What it may
        lack still is as likely to move them as far: so far they moved is within the bands. Joints
        are fitted again beside the bodies that are told; where these explain less, both stay.
        """
        now = replace(self, fits=fits, datasets=datasets)
        if not self.bodies:
            return now
        gains = [g for g in self.groups if g.what is What.GAIN]
        moved = self._corrected
        told = _Estimated.of(
            _regression(_all_on_beginnings(fits, datasets), [*moved, *gains]), moved
        )
        own = {g.place: g.body for g in moved if g.body is not None}
        others = _with_changed(datasets, [(own[n], more) for n, more in told.changes.items()])
        again = {a: _refitted(fits[a], dataset) for a, dataset in others.items()}
        less = sum(f.ratio**2 for f in again.values()) > sum(f.ratio**2 for f in fits.values())
        if not less:
            now = replace(self, fits=again, datasets=others)

        def anew(body: WrongBody) -> WrongBody:
            more = told.changes[body.body]
            errors = {
                axis: replace(e, after=error_in(e.on, now.fits[axis], now.datasets[axis]))
                for axis, e in body.errors.items()
            }
            return replace(
                body, change=body.change if less else body.change + more, errors=errors,
                band=np.hypot(told.bands[body.body], more),
                disagreeing=told.disagreeing[body.body],
            )  # fmt: skip

        return replace(now, bodies=tuple(map(anew, self.bodies)))

    def asked_again(
        self, axes: Mapping[str, AxisDiagnosis], progress: Progress = silent
    ) -> tuple[Departures, tuple[str, ...]]:
        """What must move too beside all that was found of the joints, and the joints it is of.

        A law that a joint lacked, such as a friction, may have hidden what else moves: a group that
        a joint cannot have by itself was asked only without it. Nothing is asked where the joints
        lacked nothing, or where only noise is left of every one.
        """
        if not self.groups or not any(d.steps for d in axes.values()):
            return self, ()
        ends = {a: _on_beginnings(d.final, d.dataset) for a, d in axes.items()}
        if all(judged.at_floor for judged in ends.values()):
            return self, ()
        progress("bodies, rotors and motors beside what was found", 0, 1)
        regression = _regression(ends, self._beside({a: j.fit.axis for a, j in ends.items()}))
        known = {(m.group.what, m.group.place) for m in self.moved}
        moved = Choice(regression).moved()
        new = [m for m in moved if (m.group.what, m.group.place) not in known]
        found = _with_bodies(replace(self, moved=new, bodies=()), regression)
        where = found.fits if found.bodies else (m.group.axis for m in new)
        both = (*self.moved, *new), (*self.bodies, *found.bodies)
        return replace(found, moved=both[0], bodies=both[1]), tuple(dict.fromkeys(where))

    @property
    def _corrected(self) -> list[Group]:
        """The bodies that moved, as they were corrected."""
        changes = {body.body: body.change for body in self.bodies}
        own = (g for g in self.groups if g.what is What.BODY and g.place in changes)
        return [replace(g, corrected=changes[g.place]) for g in own]

    def _beside(self, axes: Mapping[str, AxisModel]) -> list[Group]:
        """The groups that may move beside joints as they were found, with bodies as corrected.

        Those of which a joint has a law by now are among its own parameters.
        """

        def has_it(group: Group) -> bool:
            free = (f.effect for f in axes[group.axis].effects if not held_strengths(f))
            return any(group.what.covers(effect) for effect in free)

        corrected = {g.place: g for g in self._corrected}
        return [
            corrected.get(g.place, g) if g.what is What.BODY else g
            for g in self.groups
            if g.what is What.BODY or not has_it(g)
        ]

    def named(self, together: Sequence[Group], *, beside_body: bool = False) -> str:
        """E.g. "rotor_inertia of elbow with link_mass of fore"; beside a body, one is "fore"."""
        each = (
            g.place if beside_body and g.body else f"{self.names[g.what]} of {g.place}"
            for g in together
        )
        return " with ".join(each)


def departures_of(
    model: MachineModel,
    fits: Mapping[str, Fit],
    datasets: Mapping[str, Dataset],
    catalogue: Catalogue,
    progress: Progress = silent,
) -> Departures:
    """What must move away from the file of a mechanism; catalogue: of whose laws it is told.

    fits, datasets: of the axes that move. Of long logs the beginnings tell it. Nothing is asked
    where only noise is left of every joint.
    """
    nothing = Departures(datasets, fits)
    if not model.joints:
        return nothing
    before = _all_on_beginnings(fits, datasets)
    if all(judged.at_floor for judged in before.values()):
        return nothing
    from twin.model.bodies import mechanism_in  # MuJoCo takes long to load

    mechanism = mechanism_in(model)
    bodies = [Body(mechanism, mechanism.axes.index(axis)) for axis in before]
    progress("bodies, rotors and motors of all joints", 0, 1)
    axes = {axis: judged.fit.axis for axis, judged in before.items()}
    reaches = {axis: _reach(judged.dataset) for axis, judged in before.items()}
    regression = _regression(before, groups_of(bodies, axes, reaches))
    choice = Choice(regression)
    moved = choice.moved()
    disputed = {} if moved else choice.disputed()
    names = {what: what.named(catalogue) for what in What}
    beside = {axis: replace(own, beside_bodies=True) for axis, own in datasets.items()}
    groups = regression.groups
    found = Departures(beside, fits, moved, names=names, groups=groups, disputed=disputed)
    return _with_bodies(found, regression)


def _regression(before: Mapping[str, Judged], groups: Sequence[Group]) -> Regression:
    """The regression of joints, whose bodies then let go of what they know of the logs."""
    regression = regression_of(before, groups)
    for group in groups:
        if group.body is not None:
            group.body.forget()
    return regression


def _all_on_beginnings(
    fits: Mapping[str, Fit], datasets: Mapping[str, Dataset]
) -> dict[str, Judged]:
    return {axis: _on_beginnings(fits[axis], datasets[axis]) for axis in fits}


def _on_beginnings(fit: Fit, dataset: Dataset) -> Judged:
    part = dataset.part
    return Judged(fit if part is dataset else _refitted(fit, part), part)


def _refitted(fit: Fit, dataset: Dataset) -> Fit:
    return replace(fit_axis(fit.axis, dataset.training), begun=fit.begun)


def _reach(dataset: Dataset) -> tuple[float, float]:
    ends = [log.extent[1] for log in dataset.training]
    return min(low for low, _ in ends), max(high for _, high in ends)


def _with_bodies(found: Departures, regression: Regression) -> Departures:
    """With the bodies that moved corrected in the datasets, and the joints refitted beside them."""
    own = [m for m in found.moved if m.group.what is What.BODY]
    if not own:
        return found
    told = _Estimated.of(regression, [m.group for m in found.moved])
    changes = [(m.group.body, told.changes[m.group.place]) for m in own if m.group.body]
    datasets = _with_changed(found.datasets, changes)
    # A wrong body hides by how much the channels of a log are apart.
    again = {a: fit_aligned(found.fits[a].axis, d) for a, d in datasets.items()}
    datasets = {a: dataset for a, (dataset, _) in again.items()}
    fits = {a: replace(fit, begun=found.fits[a].begun) for a, (_, fit) in again.items()}
    errors = {a: _errors(found.fits[a], found.datasets[a], fits[a], datasets[a]) for a in fits}
    bodies = tuple(_wrong_body(found, m, told, errors) for m in own)
    return replace(found, datasets=datasets, fits=fits, bodies=bodies)


def _with_changed(
    datasets: Mapping[str, Dataset], changes: Sequence[tuple[Body, Array]]
) -> dict[str, Dataset]:
    """The datasets of joints with bodies changed by so much (10,)."""
    for body, change in changes:
        datasets = {axis: body.corrected(own, change) for axis, own in datasets.items()}
    return dict(datasets)


def _wrong_body(
    found: Departures, moved: Moved, told: _Estimated, errors: Mapping[str, Errors]
) -> WrongBody:
    body, name = moved.group.body, moved.group.place
    assert body is not None
    return WrongBody(
        body=name,
        axis=body.axis,
        tied=tuple(found.named(together, beside_body=True) for together in moved.tied),
        axes=tuple(axis for axis in body.axes if axis in errors),
        inertial=body.inertial,
        change=told.changes[name],
        band=told.bands[name],
        disagreeing=told.disagreeing[name],
        score=moved.score,
        errors=errors,
    )


@dataclass(frozen=True, eq=False)
class _Estimated:
    """What a regression tells of bodies, by name.

    Changes (10,), half their 90 % bands (10,), and the logs that tell another change.
    """

    changes: Mapping[str, Array] = field(default_factory=dict)
    bands: Mapping[str, Array] = field(default_factory=dict)
    disagreeing: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, regression: Regression, moved: Sequence[Group]) -> _Estimated:
        """Beside all that moved. The bands are by the scatter between stretches of time.

        Of all joints together. Where the logs ask for other torque constants, which no file knows
        well, what the values are beside these is within the bands.
        """
        groups = regression.groups
        asked = [i for i, g in enumerate(groups) if g in moved]
        found, beside = regression.feasible(asked), _beside_gains(regression, asked)
        left, _ = regression.left(found)
        where = np.concatenate(
            [np.arange(regression.base.stop), *(_range(regression.spans[i]) for i in asked)]
        )
        columns, weights = regression.training.columns[:, where], np.eye(len(where))
        bands = half_widths_by(columns.copy(), left, weights)
        changes, told, apart = {}, {}, {}
        for i in (i for i in asked if groups[i].what is What.BODY):
            span = regression.spans[i]
            own, other = found.values[span], (beside or found).values[span]
            band = np.hypot(bands[np.isin(where, _range(span))], other - own)
            known = regression.known_by_data(asked, span)
            changes[groups[i].place], told[groups[i].place] = own, np.where(known, band, np.nan)
            apart[groups[i].place] = tuple(regression.disagreeing(asked, found, i))
        return cls(changes, told, apart)


def _beside_gains(regression: Regression, asked: Sequence[int]) -> GroupSolution | None:
    """The same beside the torque constants of all joints; None where the logs ask for none."""
    known = np.full(1, ACCURACY)
    groups = [replace(g, scale=known) if g.what is What.GAIN else g for g in regression.groups]
    free = replace(regression, groups=groups)
    gains = [i for i, g in enumerate(groups) if g.what is What.GAIN and i not in asked]
    alone, both = (free.feasible(own) for own in (asked, [*asked, *gains]))
    return both if free.criterion(both) < free.criterion(alone) - RULE.least_bic else None


def _range(span: slice) -> Array:
    return np.arange(span.start, span.stop)


def _errors(before: Fit, given: Dataset, after: Fit, found: Dataset) -> Errors:
    """Of one axis without and with what was found, on the logs that are reported."""
    first, second = (Errors.of(f, f, d, d.tested_on) for f, d in ((before, given), (after, found)))
    return replace(first, after=second.after)
