"""Where the position breaks off its course, and what no machine can produce.

Each break looks different around it. Missing samples take the position and its setpoint as far on
as the motion went meanwhile. An encoder that stands still is caught up with in one sample. A
counter that wraps goes back by nearly the whole travel. A single sample that is off leaves the
course as it was, and so does a clock that skips, by less than a sample's motion. Joined logs differ
in everything.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.checks.axis import Axis
from twin.checks.explain import UNUSUAL, contradicted
from twin.checks.report import Fault, LogFinding, Place
from twin.signals import Array, stretches

CLUSTER = 3  # samples between two jumps of one break
ALIKE_SPEEDS = 0.3  # difference of two speeds, as a part of the larger
SHORT_GAP = 0.05  # s, over which the speed may change, and which makes two breaks one
CUT = "cut the log there (was an end stop hit, the carriage touched?)"
# From there on the position is another one; of a few samples a fit takes no harm.
SPOILING = {Fault.STUCK, Fault.WRAPPED, Fault.JOINED, Fault.STEP}


@dataclass(frozen=True)
class Break:
    """From sample ``first`` to ``last``; size: m or missing samples; step: m, of the course."""

    fault: Fault
    first: int
    last: int
    size: float
    step: float = 0.0


def check_breaks(axis: Axis) -> Iterator[LogFinding]:
    """What breaks the position, each kind once."""
    if count := axis.position_held:
        yield held(axis, "the position", count)
        return
    if len(curved := uneven_curvature(axis)):
        size = f"{axis.jumps[curved - 1].max():.3g} {axis.log.kind.position}"
        yield axis.warning(
            Fault.UNEVEN,
            f"the position bends by up to {size} at {len(curved)} samples all over the log: the "
            "clock jitters, or samples are missing",
            "record with the drive's own clock, or import with the time stamps",
            Place((curved[0] - 1) / axis.sample_rate),
        )
        return
    breaks = find_breaks(axis)
    for fault in dict.fromkeys(b.fault for b in breaks):
        yield _finding(axis, fault, [b for b in breaks if b.fault is fault])


def find_breaks(axis: Axis) -> list[Break]:
    """All breaks in the order of time; none where the position is held for some samples each."""
    if not len(axis.curved_at) or axis.position_held:
        return []
    stuck = list(_stuck(axis))
    curved = _outside(stuck, axis.curved_at)
    if not len(curved):
        return stuck
    clusters = np.split(curved, np.flatnonzero(np.diff(curved) > CLUSTER) + 1)
    single = [_classified(axis, int(c[0]), int(c[-1])) for c in clusters]
    return _undone(sorted([*stuck, *(b for b in single if b)], key=lambda b: b.first), axis)


def _outside(breaks: Iterable[Break], samples: NDArray[np.intp]) -> NDArray[np.intp]:
    """The samples that none of these breaks is about."""
    for b in breaks:
        samples = samples[(samples < b.first - 2) | (samples > b.last + 2)]
    return samples


def _undone(breaks: list[Break], axis: Axis) -> list[Break]:
    """A step that is soon taken back is an offset of the samples between; so are two samples."""
    out: list[Break] = []
    for b in breaks:
        last = out[-1] if out else None
        if last is not None and b.first - last.last < SHORT_GAP * axis.sample_rate:
            opposed = abs(last.step + b.step) < ALIKE_SPEEDS * abs(b.step)
            if opposed or {last.fault, b.fault} <= {Fault.OUTLIERS, Fault.UNEVEN}:
                size = max(abs(last.size), abs(b.step or b.size))
                skips = last.fault is b.fault is Fault.UNEVEN
                fault = Fault.UNEVEN if skips else Fault.OUTLIERS
                out[-1] = Break(fault, last.first, b.last, size)
                continue
        out.append(b)
    return out


def _stuck(axis: Axis) -> Iterator[Break]:
    """One value for long, with a jump where it begins and where it ends."""
    x = axis.log.position
    # s of one value; five samples at least, where so long is fewer
    least = max(5e-3 * axis.sample_rate, 5)
    usual = float(
        np.quantile(np.abs(np.diff(x)), 0.99)
    )  # m in a sample, of what moves or is coarse
    for first, last in stretches(np.diff(x) == 0.0):
        at_ends = all(axis.jumps[max(end - 3, 0) : end + 1].any() for end in (first, last))
        caught_up = abs(x[min(last + 1, len(x) - 1)] - x[last])
        if last - first >= least and at_ends and caught_up > 2.0 * usual:
            yield Break(Fault.STUCK, int(first), int(last), float(caught_up))


def _classified(axis: Axis, first: int, last: int) -> Break | None:
    """What jumps at samples ``first`` to ``last`` are; None where it cannot be told."""
    x, dt = axis.log.position, 1.0 / axis.sample_rate
    course = _around(x, first, last)
    longest = 4 * CLUSTER  # samples of a break; what takes longer is a motion
    if course is None or last - first > longest or axis.is_kicked(first, last):
        return None
    step, before, after = course
    speed = 0.5 * (before + after) / dt
    larger = max(abs(before), abs(after))
    alike = abs(before - after) <= ALIKE_SPEEDS * larger + axis.possible_jump
    if abs(step) <= 6.0 * axis.possible_jump:  # times the jump that motion allows
        if last - first > CLUSTER:
            return None
        off = _off_course(x[first - 1 : last + 2])
        fault = Fault.UNEVEN if off < abs(speed) * dt else Fault.OUTLIERS  # a sample's motion
        return Break(fault, first, last, off)
    setpoint = axis.log.columns.get("setpoint_position")
    follows = _around(setpoint, first, last) if setpoint is not None else None
    with_setpoint = follows is not None and abs(follows[0]) > 0.5 * abs(step)
    whole_travel = 0.8  # of the travel; a counter that wraps goes back by nearly all of it
    if abs(step) >= whole_travel * np.ptp(x) and alike and not with_setpoint:
        return Break(Fault.WRAPPED, first, last, abs(step))
    if setpoint is not None and not with_setpoint:
        return Break(Fault.STEP, first, last, step, step)
    samples = step / (speed * dt) if speed else np.inf
    gap = 2.0 if alike else SHORT_GAP  # s of missing samples
    if 0.5 < samples <= gap * axis.sample_rate:
        return Break(Fault.MISSING, first, last, float(round(samples)), step)
    return Break(Fault.STEP if alike else Fault.JOINED, first, last, step, step)


def _off_course(x: Array) -> float:
    """How far samples (n,) m are at most from the straight line between the first and the last."""
    return float(np.abs(x - np.linspace(x[0], x[-1], len(x))).max())


def _around(x: Array, first: int, last: int) -> tuple[float, float, float] | None:
    """The step of a signal's course, and its slopes a sample before and behind."""
    course = 10  # samples on either side from which the course is told
    begin, end = first - 1, last + 1  # the last sample before, the first behind
    if begin - course < 0 or end + course >= len(x):
        return None
    before = float(x[begin] - x[begin - course]) / course
    after = float(x[end + course] - x[end]) / course
    expected = 0.5 * (before + after) * (end - begin)
    return float(x[end] - x[begin]) - expected, before, after


def _finding(axis: Axis, fault: Fault, found: list[Break]) -> LogFinding:
    first, largest = found[0], max(found, key=lambda b: abs(b.size))
    size = f"{abs(largest.size):.3g} {axis.log.kind.position}"
    still = (first.last - first.first) / axis.sample_rate
    what = {
        Fault.MISSING: f"{largest.size:.0f} samples are missing, the motion goes on behind",
        Fault.STUCK: f"the position stands still for {still:.3g} s and is {size} farther in the "
        "next sample: the encoder was stuck",
        Fault.WRAPPED: f"the position goes back by {size} in one sample: its counter wraps",
        Fault.OUTLIERS: f"samples of the position are off by up to {size}",
        Fault.JOINED: f"position and motion differ on both sides by {size}: logs were joined",
        Fault.STEP: f"the position steps by {size} and goes on as before: counts were lost",
        Fault.UNEVEN: f"the position is off by {size}, less than a sample's motion: a clock "
        "skipped",
    }[fault]
    remedy = {
        Fault.MISSING: "import the file with its time stamps, or cut the log there",
        Fault.WRAPPED: f"add {size} behind each wrap before the import, as wraps does in a map",
        Fault.OUTLIERS: "repair these samples, or cut the log there",
        Fault.JOINED: "import each part as a log of its own",
        Fault.UNEVEN: "record with the drive's own clock",
    }.get(fault, "cut the log there, and check the encoder's connection")
    told = axis.error if fault in SPOILING else axis.warning
    spans = [(b.first / axis.sample_rate, b.last / axis.sample_rate) for b in found]
    return told(fault, what, remedy, Place.first_of(spans))


def uneven_curvature(axis: Axis) -> NDArray[np.intp]:
    """Samples where the position jumps, if it does everywhere: by the clock, and by no wrap."""
    curved = axis.curved_at
    curved = curved[axis.jumps[curved - 1] < 0.5 * float(np.ptp(axis.log.position))]
    places = 1 + np.count_nonzero(np.diff(curved) > SHORT_GAP * axis.sample_rate)
    # a jump a second at least, and so many that it is not this and that, but the clock
    everywhere = places >= max(12, axis.duration)
    return curved if everywhere else curved[:0]


def held(axis: Axis, name: str, count: int) -> LogFinding:
    """A signal that is held for ``count`` samples."""
    rate = axis.sample_rate / count
    what = f"{name} changes at every {count}th sample only: it was sampled at {rate:g} Hz and held"
    remedy = f"record it at {axis.sample_rate:g} Hz, or the log at {rate:g} Hz"
    return axis.warning(Fault.HELD, what, remedy)


def check_outliers(axis: Axis) -> Iterator[LogFinding]:
    """Outliers in position and command."""
    unexplained = not axis.position_held and not len(uneven_curvature(axis))
    jumps = _outside(find_breaks(axis), axis.curved_at)
    jumps = jumps[[not axis.is_kicked(int(k), int(k)) for k in jumps]]
    if unexplained and len(jumps):
        unit = axis.log.kind.position
        yield _outliers(
            axis,
            jumps / axis.sample_rate,
            f"position bends by up to {axis.jumps[jumps - 1].max():.3g} {unit} within a sample, "
            f"its usual motion and noise allow {axis.possible_jump:.2g} {unit}",
            "cut the log there (was the carriage touched?) or repair the samples",
        )
    if not axis.moves:
        return
    rough = _rough_command(axis)
    if len(rough):
        yield _outliers(axis, rough, "the force jumps to and fro from sample to sample")
    else:
        yield from _contradictions(axis)


def _rough_command(axis: Axis) -> Array:
    """Times (k,) in s within bursts of noise on the command."""
    force = axis.log.force
    second = np.abs(np.diff(force, 2))
    rough = second > 0.1 * axis.force_size  # least roughness, as a part of the command
    rough_span = 10e-3  # s, in which half of the samples are rough; a commanded step is only a few
    fewest_rough = 5  # samples, where so long is fewer
    span = max(round(rough_span * axis.sample_rate), 2 * fewest_rough)
    if np.count_nonzero(rough) >= span // 2:
        rough &= second > UNUSUAL * float(np.quantile(second, 1.0 - axis.rare))
    if np.count_nonzero(rough) < span // 2:
        return np.empty(0)
    dense = np.convolve(rough, np.ones(span), "same") > span // 2
    return (np.flatnonzero(rough & dense) + 1) / axis.sample_rate


def _contradictions(axis: Axis) -> Iterator[LogFinding]:
    """Where command and motion contradict each other, except at jumps of the position."""
    fit = axis.dynamics
    if not fit.explains:
        return
    error = np.abs(fit.residual) * axis.kept[fit.first : fit.first + len(fit.residual)]
    unusual = error > contradicted(error, axis.force, axis.rare)
    bad = np.flatnonzero(unusual & pushes(fit.residual, unusual, len(axis.smoother.weights)))
    if len(bad):
        usual, unit = float(np.quantile(error, 1.0 - axis.rare)), axis.log.kind.force
        what = (
            f"force and motion contradict each other by up to {error.max():.3g} {unit}, "
            f"elsewhere by less than {usual:.2g} {unit}"
        )
        yield _outliers(axis, axis.smoother.time(bad + fit.first), what)


def pushes(force: Array, bad: NDArray[np.bool_], around: int) -> NDArray[np.bool_]:
    """(n,) the samples of bursts in which a force (n,) pushes one way, with so many about each.

    What swings to and fro about nothing is no push from outside: a load on a spring, or a mass
    that is not quite right in a move that speeds up and slows down.
    """
    one_way = 0.5  # of the sum of its size, that the sum of a push is at least
    out = np.zeros(len(force), dtype=bool)
    for first, last in stretches(np.convolve(bad, np.ones(2 * around + 1), "same") > 0.0):
        burst = force[first:last] - np.median(force)
        out[first:last] = abs(burst.sum()) >= one_way * np.abs(burst).sum()
    return out


def _outliers(axis: Axis, times: Array, what: str, remedy: str = CUT) -> LogFinding:
    bursts_apart = 0.05  # s without an outlier ends a burst
    bursts = np.split(times, np.flatnonzero(np.diff(times) > bursts_apart) + 1)
    where = Place.first_of([(b[0], b[-1]) for b in bursts])
    return axis.warning(Fault.OUTLIERS, what, remedy, where)
