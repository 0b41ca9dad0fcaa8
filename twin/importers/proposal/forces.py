"""Of one axis the force or current that moves it, and what is told of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from twin.importers.proposal.axes import DRIVING
from twin.importers.proposal.courses import distinct, follows, same, sign_of, sums
from twin.importers.proposal.lexicon import AHEAD, Quantity, SignalRole
from twin.importers.proposal.motion import Explained
from twin.importers.proposal.names import Name, words_of
from twin.importers.proposal.positions import TOLD
from twin.importers.proposal.signals import Certainty, File, ProposedAxis, Signal
from twin.importers.units import is_unit

SI = ("N", "N m")
CLOSE = 0.1  # of a force, by which the motion may explain one better, and the other be the drive's


@dataclass(frozen=True)
class ForceCandidate:
    """A column that may be the force, and what the motion explains of it."""

    name: Name
    motion: Explained

    @property
    def rank(self) -> tuple[bool, bool, bool]:
        """By its name: a measured force before a current, both before what was asked for."""
        asked, is_force = self.name.role is SignalRole.ASKED, self.name.quantity is Quantity.FORCE
        return not asked, is_force, not self.name.smoothed

    @property
    def share(self) -> str:
        return f"{100.0 * self.motion.best:.0f} %"


def with_force(file: File, axis: ProposedAxis) -> ProposedAxis:
    """The axis with its force or current, which is asked for where the columns do not tell it."""
    axis, called = _drives_called(file, axis)
    if called:
        return _of_those_called(file, axis, called)
    free = [n for n in file.some(axis.free, None, *Quantity) if _may_drive(n)]
    position = axis.signals["position"].name
    return _by_motion(file, axis, _candidates(file, position, free))


def _may_drive(name: Name) -> bool:
    """Whether a name leaves open that it is a force; a letter may stand for anything."""
    if name.quantity in (None, Quantity.DRIVE, *DRIVING):
        return True
    return not name.sure and name.role is None and name.unit is None


def _candidates(file: File, position: Name, names: Sequence[Name]) -> list[ForceCandidate]:
    found = zip(names, file.explained(position, names), strict=True)
    return [ForceCandidate(name, motion) for name, motion in found]


def _drives_called(file: File, axis: ProposedAxis) -> tuple[ProposedAxis, list[Name]]:
    """The columns that names call a force or a current, less those that are a part of one."""
    called = [n for n in file.some(axis.free, *DRIVING) if n.sure or n.unit]
    parts = {
        n.column: "a part of the command, by its name" for n in called if n.role is SignalRole.PART
    }
    for total, *others in sums([file.column(n) for n in called]):
        why = f"{total.name} is the sum of {' and '.join(c.name for c in others)}"
        parts = {**{n: w for n, w in parts.items() if n != total.name},
                 **{c.name: why for c in others}}  # fmt: skip
    whole = [n for n in called if n.column not in parts]
    # A part may be all there is of a command, but where something is fed forward beside it.
    if not whole and not any(AHEAD & set(words_of(n.column)) for n in called):
        return axis, called
    return axis.without(parts), whole


# --- forces that names tell -----------------------------------------------------------------------


def _of_those_called(file: File, axis: ProposedAxis, names: Sequence[Name]) -> ProposedAxis:
    """Of several the measured ones that the motion explains; asked for where they are level."""
    candidates = _candidates(file, axis.signals["position"].name, names)
    axis, candidates = _without_feedforward(file, axis, candidates)
    most = max(c.motion.best for c in candidates)
    viable = [c for c in candidates if c.motion.best > most - CLOSE or _driven(file, c, candidates)]
    forces = [c for c in viable if c.name.quantity is Quantity.FORCE]
    currents = [c for c in viable if c.name.quantity is Quantity.CURRENT]
    first = max(viable, key=lambda c: c.rank)
    if first.name.quantity is Quantity.CURRENT:
        # Commands beside a measured current say what that makes where they go with it.
        forces = [c for c in forces if _driven(file, c, candidates) and is_unit(c.name.unit, *SI)]
    for field, some in (("force", forces), ("current", currents)):
        best = [c for c in some if c.rank == max(o.rank for o in some)]
        best = [c for c in best if _driven(file, c, candidates)] or best
        groups = distinct([file.column(c.name) for c in best])
        if len(groups) > 1 and not (best := _clearly_best(best)):
            axis = _undecided(axis, field, [c for c in some if c.rank == max(o.rank for o in some)])
        elif best:
            axis = _taken(file, axis, field, best[0])
    return axis


def _without_feedforward(
    file: File, axis: ProposedAxis, candidates: list[ForceCandidate]
) -> tuple[ProposedAxis, list[ForceCandidate]]:
    """Less what is made of the setpoint alone, where something else is left."""
    setpoint, position = axis.signals.get("setpoint_position"), axis.signals["position"]
    asked = [c for c in candidates if c.name.role is SignalRole.ASKED]
    if setpoint is None or len(asked) == len(candidates):
        return axis, candidates
    by_setpoint = file.explained(setpoint.name, [c.name for c in asked])
    made = {
        c.name.column: f"made of {setpoint.column}, not of {position.column}: a feedforward"
        for c, e in zip(asked, by_setpoint, strict=True)
        # of what the measured motion leaves
        if e.free > 0.99 and 1.0 - e.free < 0.2 * (1.0 - c.motion.free)
    }
    return axis.without(made), [c for c in candidates if c.name.column not in made]


def _driven(file: File, one: ForceCandidate, others: Sequence[ForceCandidate]) -> bool:
    """Whether a force goes with a current: then it is the drive's, and no sensor's."""
    currents = [c for c in others if c.name.quantity is Quantity.CURRENT]
    return one.name.quantity is Quantity.FORCE and any(
        same(file.column(one.name), file.column(c.name)) for c in currents
    )


def _clearly_best(candidates: Sequence[ForceCandidate]) -> list[ForceCandidate]:
    """The one of which the motion leaves far less than of the others, if there is one."""
    best, second = sorted(candidates, key=lambda c: -c.motion.best)[:2]
    far = 0.5  # of what is left of the second
    clear = 1.0 - best.motion.best < far * (1.0 - second.motion.best)
    return [best] if clear and best.motion.best > TOLD else []


def _undecided(
    axis: ProposedAxis, field: str, candidates: Iterable[ForceCandidate]
) -> ProposedAxis:
    shares = ", ".join(f"{c.name.column} ({c.share})" for c in candidates)
    return axis.asking({
        field: f"axis {axis.name}: the motion explains {shares} alike; which of them is the {field}"
               " that the drive makes?"
    })  # fmt: skip


def _taken(file: File, axis: ProposedAxis, field: str, one: ForceCandidate) -> ProposedAxis:
    """With a column that its name tells, and what the motion says of it."""
    if one.motion.explains:
        sure, why = Certainty.SURE, f"so called, the motion explains {one.share} of it"
    else:
        sure, why = Certainty.UNSURE, f"so called, but the motion explains {one.share} of it only"
    signal = Signal(field, one.name, sure, (why,))
    if one.name.role is SignalRole.PART:
        signal = replace(signal, certainty=Certainty.UNSURE, assumed="that it is all of the force")
    return _with_sign(file, axis, signal, one.motion)


def _with_sign(file: File, axis: ProposedAxis, signal: Signal, motion: Explained) -> ProposedAxis:
    """With a force or current, and what the motion tells of its sign."""
    position = file.column(axis.signals["position"].name)
    sign = sign_of(motion, position, file.column(signal.name))
    if sign < 0:
        why = (
            f"reversed, as it moves the mass with its sign -1: {100.0 * motion.backward:.0f} % "
            f"explained, as it is {max(100.0 * motion.forward, 0.0):.0f} %"
        )
        signal = replace(signal, sign=-1).because(why, Certainty.LIKELY)
    elif motion.pushes:
        why = "it helps the motion where friction resists it: a part of the force is missing in it"
        signal = signal.because(why, Certainty.UNSURE)
    axis = axis.having(signal)
    return axis if axis.motion else replace(axis, motion=motion, sign=sign)


# --- forces that only the motion tells ------------------------------------------------------------


def _by_motion(
    file: File, axis: ProposedAxis, candidates: Sequence[ForceCandidate]
) -> ProposedAxis:
    """Of columns without such a name, the one that the motion explains as a force."""
    position = axis.signals["position"].name
    told = [
        c
        for c in candidates
        # of a column that no name tells the motion makes most
        if c.motion.best > TOLD and (c.name.quantity in DRIVING or c.motion.explains)
    ]
    if len(candidates) > 1:  # what goes as the position may be a spring's, where nothing else is
        told = [c for c in told if not file.course(position, c.name)]
    if not told:
        what = f"no column{axis.among} looks like a force"
        return axis.asking({"force": f"axis {axis.name}: {what}"})
    named = [c for c in told if c.name.quantity is not None] or told
    groups = distinct([file.column(c.name) for c in named])
    firsts = [next(c for c in named if c.name.column == g[0].name) for g in groups]
    best = firsts if len(firsts) == 1 else _clearly_best(firsts)
    if not best:
        return _undecided(axis, "force", firsts)
    if not any(c.motion.both_ways for c in firsts):
        return _undecided(axis, "force", firsts)
    one = best[0]
    field = "current" if one.name.quantity is Quantity.CURRENT else "force"
    why, sure = f"the motion explains {one.share} of it", Certainty.LIKELY
    if one.name.quantity in DRIVING:
        why, sure = f"so called, {why}", Certainty.SURE
    signal = Signal(field, one.name, sure, (why,))
    return _with_sign(file, axis, signal, one.motion)


# --- what the force tells of the position ---------------------------------------------------------


def exchanged(file: File, axis: ProposedAxis) -> ProposedAxis:
    """The axis with setpoint and position exchanged where the numbers say that they are."""
    position, setpoint = (axis.signals.get(f) for f in ("position", "setpoint_position"))
    if position is None:
        return axis
    others = [setpoint.name] if setpoint is not None else list(axis.twins)
    votes = {n.column: _votes(file, axis, position.name, n) for n in others}
    if setpoint is not None and votes[setpoint.column] > 0:
        why = f"rougher and later than {setpoint.column}, as a reading is"
        return axis.having(position.because(why, Certainty.SURE))
    least = min(others, key=lambda n: votes[n.column], default=None)
    if (
        setpoint is not None
        and votes[setpoint.column] == -1
        and _is_later(file, position, setpoint)
    ):
        why = f"although {setpoint.column} is later, as a reading is"
        return axis.having(
            replace(position.because(why, Certainty.UNSURE), assumed="which of both is measured"),
            replace(setpoint, certainty=Certainty.UNSURE, assumed="which of both is asked for"),
        )
    if least is None or votes[least.column] > -2:
        named = position.name.quantity is not None
        sure = named and axis.motion is not None and axis.motion.explains
        why = "its motion makes the force"
        return axis.having(position.because(why, Certainty.SURE)) if sure else axis
    why = f"although {position.column} is called so, that is smooth, and no force answers to it"
    return axis.having(
        Signal("position", least, Certainty.UNSURE, (why,)),
        Signal("setpoint_position", position.name, Certainty.UNSURE, ("exchanged",)),
    )


def _is_later(file: File, position: Signal, setpoint: Signal) -> bool:
    """Whether what is called a setpoint comes later than the position, which none does."""
    found = file.course(position.name, setpoint.name)
    return found is not None and found.behind < 0.0


def _votes(file: File, axis: ProposedAxis, position: Name, other: Name) -> int:
    """How surely another column is the setpoint of a position, and not the other way round."""
    force = axis.signals.get("force") or axis.signals.get("current")
    column = None if force is None else file.column(force.name)
    if not file.course(position, other):
        return 0
    return follows(file.column(position), file.column(other), column, axis.sign)
