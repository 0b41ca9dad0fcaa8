"""Logs made ready for identification: a dataset for each axis that moves in them.

Logs that say nothing of a model are left out, and which and why is told.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import islice

from identify.dataset.bodies import Bodies, bodies_along
from identify.dataset.clipped import Mask, clipped_in
from identify.dataset.coordinates import Covered
from identify.dataset.dataset import Dataset, Role
from identify.dataset.given_logs import (
    Given,
    apart,
    is_driven,
    none_informative,
    require_channels,
    require_one_kind,
    require_samples,
    telling_in,
)
from identify.dataset.motion import LONGEST_BLOCK, Motion, motion_of
from identify.dataset.prepared_log import PreparedLog, independent, moving, within_reach
from identify.dataset.readings import noise_of_most, ripples_of_widest
from identify.dataset.test_function import LEAST_BLOCKS, require_test_function
from identify.dataset.time_scale import beginnings, choose_length
from twin.errors import InputError
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel
from twin.parallel import spread
from twin.telling import tell

LONGER = "give a log in which it moves for longer at a time, or shorter test functions (s)"


def datasets(
    model: MachineModel,
    logs: Mapping[str, Log],
    holdout: Mapping[str, Log],
    test_function: float | None = None,
    test: Mapping[str, Log] | None = None,
) -> dict[str, Dataset]:
    """A dataset for each axis of the model that the logs hold and in which it moves.

    logs, holdout, test: by name, of the roles training, selection, test. test_function: length in
    s; where None, chosen from what the training and selection logs hold. Raises InputError where no
    axis of the model moves in any training log, where a log has no samples, where a signal is not a
    number, and where a log has two roles.
    """
    parts = (logs, holdout, test or {})
    given: Given = {role: dict(part) for role, part in zip(Role, parts, strict=True)}  # read once
    training = given[Role.TRAINING].values()
    require_test_function(test_function, max((len(g) * g.period for g in training), default=0.0))
    for logs in given.values():
        require_samples(logs)
    given, copied = apart(given)
    bodies = {n: bodies_along(model, log, n) for logs in given.values() for n, log in logs.items()}
    out: dict[str, Dataset] = {}
    unused: list[dict[str, str]] = []
    for name, axis in model.axes.items():
        for logs in given.values():
            require_one_kind(logs, name, axis)
            require_channels(logs, name, axis)
        driven, machine = is_driven(axis), tuple(model.axes)
        found = {role: telling_in(g, name, machine, driven=driven) for role, g in given.items()}
        going = {role: telling for role, (telling, _) in found.items()}
        if going[Role.TRAINING]:
            silent = {log: why for _, reasons in found.values() for log, why in reasons.items()}
            silent = {**copied, **silent}
            own = {log: along[name] for log, along in bodies.items() if name in along}
            out[name] = replace(_of_axis(model, name, going, test_function, own), left_out=silent)
            out[name].forget()  # the next axis needs the memory
        unused.append(found[Role.TRAINING][1])
    if not out:
        raise none_informative(model.axes, given[Role.TRAINING].values(), unused)
    return out


def _of_axis(
    model: MachineModel,
    name: str,
    going: Given,
    test_function: float | None,
    bodies: Mapping[str, Bodies],
) -> Dataset:
    """The dataset of one axis from the logs in which it moves; test logs decide nothing of it.

    bodies: of a joint what its bodies take in each log.
    """
    axis, machine = model.axes[name], tuple(model.axes)
    ripples = ripples_of_widest(going[Role.TRAINING].values(), name)
    deciders = [*going[Role.TRAINING].values(), *going[Role.SELECTION].values()]
    noise = noise_of_most(deciders, name)
    clipped = {} if bodies else _clipped(going, name)

    def motions_at(*roles: Role) -> Callable[[float | None], tuple[list[Motion], ...]]:
        logs = [going[r] for r in roles]
        made = cache(partial(_motions, logs, name, machine, ripples, noise, bodies, clipped))
        return partial(_long_enough, made)

    deciding = motions_at(Role.TRAINING, Role.SELECTION)
    length = test_function or _kept(axis, deciders)
    length = length or choose_length(deciding, imposed=axis.is_imposed)
    fit, held = deciding(length)
    (test,) = motions_at(Role.TEST)(length)
    begun = {} if axis.is_imposed else _begun(fit, held, test)
    fit, held, test = (
        [m.after(begun[m.name]) if m.name in begun else m for m in some]
        for some in (fit, held, test)
    )
    training, selection, others = (
        tuple(spread(partial(PreparedLog.of, length=length), some)) for some in (fit, held, test)
    )
    return Dataset(
        axis=name,
        training=training,
        selection=within_reach(selection, training),
        test=within_reach(others, training),
        covered=Covered(tuple(fit), axis.hardware.travel),
        begun=begun,
        asked=length,
    )


def _kept(axis: AxisModel, logs: Sequence[Log]) -> float | None:
    """The length (s) that an axis was found at, where the samples of the logs allow it."""
    shortest = LEAST_BLOCKS * max(log.period for log in logs)
    longest = max(len(log) * log.period for log in logs)
    length = axis.test_function
    return length if length and shortest <= length < longest else None


def _clipped(going: Given, axis: str) -> dict[str, Mask]:
    """Where more force acted than was recorded, by log; test logs tell that of none but them."""
    test = going[Role.TEST]
    deciders = {**going[Role.TRAINING], **going[Role.SELECTION]}
    among_all = clipped_in({**deciders, **test}, axis) if test else {}
    theirs = {name: where for name, where in among_all.items() if name in test}
    return {**theirs, **clipped_in(deciders, axis)}


def _begun(
    fit: Sequence[Motion], held: Sequence[Motion], test: Sequence[Motion]
) -> dict[str, float]:
    """Ends (s) of beginnings that are left out, by log; test logs tell those of none but them."""
    begun = dict(beginnings([*fit, *held]))
    if test:
        names = {m.name for m in test}
        own = beginnings([*fit, *test])
        begun.update({name: end for name, end in own.items() if name in names})
    return begun


def _long_enough(
    made: Callable[[float], tuple[list[Motion], ...]], length: float | None
) -> tuple[list[Motion], ...]:
    """Motions whose blocks suit test functions of a length (s), made anew only where they do not.

    None: in blocks as long as their noise asks for.
    """
    usual = made(LONGEST_BLOCK)
    longest = max((m.period for some in usual for m in some), default=0.0)
    if length is None or length >= LEAST_BLOCKS * longest:
        return usual
    return made(length / LEAST_BLOCKS)


def _motions(
    parts: Sequence[Mapping[str, Log]],
    axis: str,
    machine: tuple[str, ...],
    ripples: tuple[float, ...],
    noise: float,
    bodies: Mapping[str, Bodies],
    clipped: Mapping[str, Mask],
    longest: float,
) -> tuple[list[Motion], ...]:
    """Motions of each part of the logs, in blocks of at most a length (s); ripples, noise: m."""

    def motion(given: tuple[str, Log]) -> Motion:
        name, log = given
        return motion_of(
            log, axis, name, machine, longest, ripples, bodies.get(name), noise, clipped.get(name)
        )

    made = iter(spread(motion, [given for some in parts for given in some.items()]))
    return tuple([*islice(made, len(some))] for some in parts)


def telling(dataset: Dataset, sticks: bool, parameters: int = 0) -> Dataset:
    """The dataset less the logs without a test function that counts; each is told in one line.

    sticks: whether the axis has static friction, whose force at rest the motion does not determine.
    parameters: how many are to be fitted. Raises InputError as ``require_informative`` does.
    """
    silent = {
        log.motion.name: _why(log, dataset.axis)
        for role in Role
        for log in dataset.having(role)
        if not moving([log], sticks).any()
    }
    fit, holdout, test = (
        tuple(log for log in dataset.having(role) if log.motion.name not in silent) for role in Role
    )
    require_informative(dataset, sticks, parameters)
    left_out = {**dataset.left_out, **silent}
    tell_left_out(left_out)
    return replace(dataset, training=fit, selection=holdout, test=test, left_out=left_out)


def tell_left_out(logs: Mapping[str, str]) -> None:
    """Say which logs are left out, and why, a line each; logs: the reasons by name."""
    for name, why in logs.items():
        tell(f"{name} is left out: {why}")


def informative_logs(logs: Mapping[str, Log], why: Mapping[str, str | None]) -> dict[str, Log]:
    """The logs without a reason to leave them out; the others are told. InputError where all are.

    why: by name.
    """
    left_out = {name: reason for name, reason in why.items() if reason is not None}
    if len(left_out) == len(logs):
        raise InputError(": ".join(next(iter(left_out.items()))))
    tell_left_out(left_out)
    return {name: log for name, log in logs.items() if name not in left_out}


def is_informative(dataset: Dataset, sticks: bool, parameters: int = 0) -> bool:
    """Whether the training logs say more than so many numbers.

    A fit of as many parameters would leave nothing, and prove nothing. sticks: as ``telling`` has
    it.
    """
    return independent(dataset.training, sticks) > parameters


def require_informative(dataset: Dataset, sticks: bool, parameters: int = 0) -> None:
    """Raise InputError where they do not."""
    if is_informative(dataset, sticks, parameters):
        return
    logs, told = dataset.training, independent(dataset.training, sticks)
    why = _why(logs[0], dataset.axis)
    if told:
        why = (
            f"axis {dataset.axis} moves throughout {told} of the test functions of "
            f"{dataset.test_function_length:g} s that share no instant, too few for {parameters} "
            f"free parameters; {LONGER}"
        )
    raise InputError(f"{', '.join(log.motion.name for log in logs)}: {why}")


def _why(log: PreparedLog, axis: str) -> str:
    """Why a log has no test function that counts, and what to give instead."""
    length = f"{log.test_function.length:g} s"
    if not len(log):
        return f"it is shorter than a test function of {length}; {LONGER}"
    if not log.reached.any():
        return f"axis {axis} is nowhere where a training log has been; give one on the same travel"
    return (
        f"axis {axis} comes to rest within every test function of {length}, and at rest its "
        f"friction is unknown; {LONGER}"
    )
