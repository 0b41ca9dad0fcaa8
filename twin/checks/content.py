"""Whether a log can be checked and fitted at all: its signals, its motion, what its map assumed."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import pairwise
from math import ceil

import numpy as np
from numpy.typing import NDArray

from twin.checks.axis import READINGS, Axis
from twin.checks.breaks import held
from twin.checks.report import WHOLE, Fault, LogFinding, Place, Severity
from twin.signals import Array, held_at_extreme, median, stretches

# A proposed import map has this word in the comment of a line that the file does not prove.
# Whoever knows it to be right takes the word away.
ASSUMED = "ASSUMED"
MAP = "import_map"  # entry of a log's metadata: the map as it was written
PARTIAL = "partial."  # the same of an axis, "partial.x": a part of its force is missing for sure
DOUBT = "doubt."  # the same of an axis, "doubt.x.0": what its signals say against the map
COUNTER = "counter."  # such an entry of an axis' signal, "counter.x.current": that it begins again
_TABLE = re.compile(r"\[axes\.\"?(\w+)\"?\]")
_ENTRY = re.compile(r"(\w+)\s*=\s*([^#]*)#(.*)")
_UNIT = re.compile(r"unit\s*=\s*\"([^\"]*)\"(?:.*\b((?:scale|counts_per_\w+)\s*=\s*[^\s,}]+))?")


def check_content(axis: Axis) -> Iterator[LogFinding]:
    """Findings without which no other check makes sense."""
    yield from _missing(axis)
    for name, column in axis.log.columns.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            what = f"{name} is not a finite number in {len(bad)} of {len(column)} samples"
            remedy = "cut the log there, or leave the signal out if it was not recorded"
            where = Place(bad[0] / axis.sample_rate)
            yield axis.error(Fault.NOT_FINITE, what, remedy, where)
    yield from _unchanging(axis)
    slowest = 10.0  # Hz; no motion of an axis shows at fewer samples
    if axis.sample_rate < slowest:
        what = (
            f"the log has {axis.sample_rate:.3g} samples a second and lasts {axis.duration:.4g} s; "
            f"a fit needs {slowest:g} Hz"
        )
        yield axis.error(Fault.UNIT, what, "correct the unit of the time, or record faster")
    shortest = 0.5  # s, least duration for identification
    if axis.duration < shortest:
        what = f"the log lasts {axis.duration:.3g} s, a fit needs {shortest:g} s"
        yield axis.error(Fault.TOO_SHORT, what, "record longer")


def _unchanging(axis: Axis) -> Iterator[LogFinding]:
    """Readings that are one value: of an axis at rest, of a constant force, of a dead channel."""
    columns = axis.log.columns
    flat = {n: c[0] for n, c in columns.items() if len(c) and np.all(c == c[0])}
    told = {n: f"{n} is {flat[n]:.6g} {axis.log.unit(n)} throughout" for n in READINGS if n in flat}
    if "position" in told:
        fault = Fault.WEAK_EXCITATION if "setpoint_position" in flat else Fault.FLAT
        remedy = "leave the axis out of the fit, or check that the channel was connected and mapped"
        yield axis.warning(fault, told["position"], remedy)
        return
    driving = "force" if "force" in columns else "current"
    if flat.get(driving):
        yield axis.warning(Fault.FLAT, *_shared(axis, told.pop(driving)))
    for name, what in told.items():
        spoils = name in (driving, "velocity")
        tell = axis.error if spoils else axis.warning
        yield tell(Fault.FLAT, what, "check that the channel was connected and mapped")


def _missing(axis: Axis) -> Iterator[LogFinding]:
    columns = axis.log.columns
    if "position" not in columns:
        yield axis.error(Fault.INCOMPLETE, "there is no position", "record the encoder")
    if "force" not in columns and not ("current" in columns and axis.log.force_constant):
        what = "there is no force, nor a current with a force constant"
        remedy = f"add the command, or force_constant ({axis.log.kind('N/A')}) to the axis"
        yield axis.error(Fault.INCOMPLETE, what, remedy)


def assumptions(map_text: str, axis: str) -> list[str]:
    """What the lines of a map assume of an axis, or of all axes: "position in mm"."""
    found, table = [], None
    for line in map_text.splitlines():
        if header := _TABLE.match(line.strip()):
            table = header[1]
        entry = _ENTRY.match(line.strip())
        if entry is None or ASSUMED not in entry[3] or table not in (None, axis):
            continue
        unit = _UNIT.search(entry[2])
        scale = f" with {unit[2]}" if unit and unit[2] else ""
        what = f" in {unit[1]}{scale}" if unit else f" = {entry[2].strip()}"
        found.append(entry[1] + what)
    return found


def check_assumed(axis: str, metadata: Mapping[str, str]) -> Iterator[LogFinding]:
    """What the import of an axis knows: what its map assumes, and counters that begin again."""
    for key, what in metadata.items():
        if key.startswith(f"{COUNTER}{axis}."):
            field = key.rpartition(".")[2]
            size = what.rpartition(" ")[2]
            remedy = f"give wraps = {size} for its {field} in the map and import again"
            yield LogFinding(Severity.ERROR, Fault.WRAPPED, axis, what, WHOLE, remedy)
        said, _, remedy = what.partition(": ")[2].rpartition("; ")
        if key == f"{PARTIAL}{axis}":
            yield LogFinding(Severity.ERROR, Fault.PARTIAL, axis, said, WHOLE, remedy)
        if key.startswith(f"{DOUBT}{axis}."):
            yield LogFinding(Severity.WARNING, Fault.ASSUMED, axis, said, WHOLE, remedy)
    if found := assumptions(metadata.get(MAP, ""), axis):
        yield LogFinding(
            Severity.WARNING, Fault.ASSUMED, axis,
            f"the import map assumes {', '.join(found)}", WHOLE,
            f"if that is right, take the word {ASSUMED} out of these lines of the map and import "
            "again; if not, correct them",
        )  # fmt: skip


def check_excitation(axis: Axis) -> Iterator[LogFinding]:
    """Weak excitation and coarse position."""
    unit = axis.log.kind.position
    often = float(np.quantile(np.abs(axis.velocity), 0.9)) > axis.still  # a tenth of the log
    if not (axis.moves and often):
        yield axis.warning(
            Fault.WEAK_EXCITATION,
            f"the axis hardly moves: {np.ptp(axis.log.position):.2g} {unit} in all, most of the "
            f"time too slowly for the noise of its position ({axis.position_noise:.2g} {unit} "
            "rms); a fit leaves this log out",
            "move it, or leave it out of the fit",
        )
        return
    yield from _constant(axis)
    yield from _directions(axis)
    share = axis.dynamics.inertial_share
    # share of the force, below which friction that the check does not know hides it
    inertial = 0.005
    if axis.dynamics.explains and axis.dynamics.mass is not None and share < inertial:
        mass = axis.log.kind.mass_name
        yield axis.warning(
            Fault.WEAK_EXCITATION,
            f"acceleration makes {100.0 * share:.2g} % of the force that varies, so that the "
            f"{mass} cannot be identified; with it go all forces in proportion to acceleration",
            f"add faster changes of speed, or give the {mass} and hold it (fixed)",
        )
    noise = axis.smoother.acceleration_noise(axis.position_noise)
    rms = float(np.sqrt(np.mean(axis.acceleration**2)))
    rounded = axis.position_white < axis.position_step  # noise of rounding is at most its step
    # as a part of the acceleration; rounding is no noise and does not average out
    if noise >= (0.05 if rounded else 0.3) * rms:
        step = f"its smallest change is {axis.position_step:.2g} {unit}" * bool(axis.position_step)
        yield axis.warning(
            Fault.COARSE_POSITION,
            f"the position is good to {axis.position_noise:.2g} {unit} rms"
            f"{f' ({step})' * bool(step)}, which over {axis.smoother.length * 1e3:.2g} ms makes "
            f"{noise:.2g} of the {rms:.2g} {axis.log.kind.acceleration} seen",
            "use a finer encoder or a livelier motion",
        )
    yield from _aliased(axis, rounded)


def _aliased(axis: Axis, rounded: bool) -> Iterator[LogFinding]:
    """A motion at speeds of a whole number of encoder steps a sample.

    Rounding is a tone of speed over step, Hz, folded at the sample rate: there it is as slow as the
    motion, in the reading and in what a controller makes of it. rounded: whether the steps show.
    """
    slow = 10.0  # Hz, what test functions pass
    most = 0.25 + 2.0 * slow / axis.sample_rate  # of the motion: a quarter more than by chance
    few = 20.0  # steps a sample; of more, rounding is a small part of what a sample moves
    if not rounded:
        return
    speed = np.abs(axis.velocity)
    tone = speed[speed > axis.still] / axis.position_step
    steps = np.rint(tone / axis.sample_rate)
    beside = (steps > 0.0) & (steps <= few) & (np.abs(tone - steps * axis.sample_rate) < slow)
    if not np.mean(beside) > most:
        return
    often = float(np.median(steps[beside]))
    each, kind = axis.position_step * axis.sample_rate, axis.log.kind
    yield axis.warning(
        Fault.ALIASED,
        f"in {100.0 * np.mean(beside):.0f} % of the motion the reading moves by whole steps of "
        f"{axis.position_step:.3g} {kind.position} a sample (speeds that are multiples of "
        f"{each:.3g} {kind.velocity}): what rounding makes is slow there, and looks like a force",
        f"move at other speeds, such as {(often + 0.4) * each:.3g} {kind.velocity}, or log at "
        "another rate",
    )


def _constant(axis: Axis) -> Iterator[LogFinding]:
    """A force that is one value but for its noise, which a mass and its friction share."""
    noise, spread = axis.smoother.held_noise(axis.force_noise), float(np.std(axis.force))
    level = float(np.median(axis.log.force))
    of_noise, of_level = 3.0, 0.01  # times the noise, or that part of the level, is no excitation
    if spread < min(of_noise * noise, of_level * abs(level)):
        what = f"force is {level:.3g} {axis.log.kind.force} throughout but for noise"
        yield axis.warning(Fault.WEAK_EXCITATION, *_shared(axis, what))


def _shared(axis: Axis, what: str) -> tuple[str, str]:
    """What a constant force does not tell, and the remedy."""
    return (
        f"{what}: with no other force the {axis.log.kind.mass_name} and the friction are not told "
        "apart, only what they are to each other and to that force",
        "add logs of other forces; if it was no constant force, check that the channel was "
        "connected and mapped",
    )


def _directions(axis: Axis) -> Iterator[LogFinding]:
    fastest = float(np.quantile(np.abs(axis.velocity), 0.999))
    creep = 0.02  # of the highest speed; slower motion counts as standstill
    moving = axis.velocity[np.abs(axis.velocity) > creep * fastest]
    forward = float(np.mean(moving > 0.0))
    one_way = max(forward, 1.0 - forward)
    if one_way > 1.0 - 0.02:  # share of the moving time
        yield axis.warning(
            Fault.WEAK_EXCITATION,
            f"the axis moves only {'forwards' if forward > 0.5 else 'backwards'} "
            f"({100.0 * one_way:.3g} % of its moving time), so that a constant force "
            "and the Coulomb friction cannot be told apart",
            "move both ways",
        )
    yield from _strokes(axis, np.abs(axis.velocity) > creep * fastest)
    low, middle, high = np.quantile(np.abs(moving), (0.1, 0.5, 0.9))
    if high - low < 0.05 * middle:  # spread of the speeds as a part of their median
        yield axis.warning(
            Fault.WEAK_EXCITATION,
            f"there is one speed only, {middle:.3g} {axis.log.kind.velocity}, so that the "
            "Coulomb and the viscous friction cannot be told apart",
            "add other speeds",
        )


def _strokes(axis: Axis, going: NDArray[np.bool_]) -> Iterator[LogFinding]:
    """A log that rests but for a stroke or two: each value is told by these alone."""
    few, part = 2, 0.5  # one each way; of the log, that a motion fills
    strokes = stretches(going)
    lasting = [b - a for a, b in strokes if (b - a) * axis.smoother.block > axis.smoother.length]
    if 0 < len(lasting) <= few and going.mean() < part:
        seconds = float(sum(lasting)) * axis.smoother.block
        many = "one stroke" if len(lasting) == 1 else "two strokes"
        yield axis.warning(
            Fault.WEAK_EXCITATION,
            f"the axis makes {many} only, of {seconds:.3g} s in all of {axis.duration:.4g} s, so "
            f"that the {axis.log.kind.mass_name} and the viscous friction are weakly told",
            "add strokes of other speeds",
        )


# --- the command ----------------------------------------------------------------------------------


def check_command(axis: Axis) -> Iterator[LogFinding]:
    """Held values, noise, and single samples."""
    if not axis.moves:
        return
    force, unit = axis.log.force, axis.log.kind.force
    if count := axis.force_held:
        yield held(axis, "the force", count)
        return
    least = 0.3 * axis.force_size  # of the command
    steps = np.abs(np.diff(force)).max()  # a sample off its neighbours is off one beside it
    off = off_course(force) if steps > least else force
    single = [k for k in _single(off, least) if not axis.is_kicked(k, k)] if steps > least else []
    if single:
        what = f"single samples of the force are off by up to {off.max():.3g} {unit}"
        where = Place.first_of([(k / axis.sample_rate, k / axis.sample_rate) for k in single])
        remedy = "repair these samples, or cut the log there"
        yield axis.warning(Fault.OUTLIERS, what, remedy, where)
    yield from _unanswered(axis)
    # noise that hides what the motion does not explain, even when it is averaged
    noise, averaged = axis.force_noise, axis.smoother.held_noise(axis.force_noise)
    noisy = 0.03  # averaged noise of the command, as a part of it; 1 % of its rating leaves 0.02
    if averaged <= noisy * float(np.std(force)):
        return
    noise, averaged = axis.noise_of_force, axis.smoother.held_noise(axis.noise_of_force)
    left = float(np.median(np.abs(axis.dynamics.residual)))
    # averaged noise, as a part of what the motion leaves unexplained
    hides = axis.dynamics.explains and averaged >= 0.4 * left
    if hides and averaged > noisy * float(np.std(force)):
        yield axis.warning(
            Fault.NOISE,
            f"the force has noise of {noise:.3g} {unit} rms from sample to sample, {averaged:.2g} "
            f"{unit} over {axis.smoother.length * 1e3:.2g} ms: about all that is left of it beside "
            "the motion",
            "record the command that the controller computed, at its rate, or shield the cable",
        )


def _unanswered(axis: Axis) -> Iterator[LogFinding]:
    """A force that leaves its range within a sample and comes back as fast; no motion answers."""
    far, longest = 2.0, 0.05  # times what 99 % of the force stays within; s
    force, size, rate = axis.log.force - median(axis.log.force), axis.force_size, axis.sample_rate
    jumps = np.diff(force)
    edges = np.flatnonzero(np.abs(jumps) > far * size)
    usual = float(np.quantile(np.abs(axis.acceleration), 0.99)) / size if size else 0.0
    seen = []
    for first, last in pairwise(edges.tolist()):  # the samples before each edge
        kept = force[first + 1 : last + 1]
        brief = 2 <= len(kept) <= max(longest * rate, 5)
        if not brief or jumps[first] * jumps[last] > 0.0 or np.abs(kept).min() < far * size:
            continue
        x, near = axis.log.position, len(kept)
        begin, end = max(first - near, 0), min(last + near, len(x) - 1)
        made = (x[end] - x[last] - x[first] + x[begin]) * rate / near
        asked = usual * float(kept.sum()) / rate  # change of speed, as far as forces here make any
        if made * np.sign(asked) < 0.5 * abs(asked):
            seen.append((first, last, float(kept[np.argmax(np.abs(kept))])))
    if seen:
        most, unit = seen[0][2], axis.log.kind.force
        yield axis.warning(
            Fault.OUTLIERS,
            f"the force jumps by {most:.3g} {unit} and back, which no motion answers",
            "repair these samples, or cut the log there",
            Place.first_of([((a + 1) / rate, b / rate) for a, b, _ in seen]),
        )


def _single(off: Array, least: float) -> NDArray[np.intp]:
    """Samples (k,) that are off their neighbours by more than ``least``, few of them together."""
    bad = off > least
    if not bad.any():
        return np.flatnonzero(bad)
    single_sample = 60.0  # times what 99 % of the samples are off their neighbours
    # A sample at a steep edge is off by as much as its neighbours.
    bad &= off > single_sample * float(np.quantile(off, 0.99))
    together = np.convolve(bad, np.ones(21), "same")  # in so many samples
    return np.flatnonzero(bad & (together <= 3))  # more are a burst: noise is no single sample


def off_course(signal: Array) -> Array:
    """(n,) by how much each sample is off the median of the five around it; 0 at the ends."""
    off = np.zeros(len(signal))
    if len(signal) > 5:
        a, b, c, d = signal[:-4], signal[1:-3], signal[3:-1], signal[4:]
        # The median of five is that of one and of the middle two of the other four.
        low = np.maximum(np.minimum(a, b), np.minimum(c, d))
        high = np.minimum(np.maximum(a, b), np.maximum(c, d))
        low, high = np.minimum(low, high), np.maximum(low, high)
        off[2:-2] = np.abs(signal[2:-2] - np.clip(signal[2:-2], low, high))
    return off


def check_saturation(axis: Axis) -> Iterator[LogFinding]:
    """Saturation of the command; a force that goes in steps has its extremes by itself."""
    force, in_steps = axis.log.force, _goes_in_steps(axis)
    for sign, extreme in ((1.0, force.max()), (-1.0, force.min())):
        if extreme == 0.0:  # a drive that is off
            continue
        stuck = None if in_steps else _exactly(axis, force, extreme)
        stuck = stuck or _piled(axis, force, extreme)
        if stuck is None and not in_steps and not axis.force_held:
            stuck = _but_for_noise(axis, sign * axis.force)
        if stuck:
            first, seconds = stuck
            yield axis.warning(
                Fault.SATURATION,
                f"the force stays at its extreme of {extreme:.4g} {axis.log.kind.force} for "
                f"{seconds:.3g} s in all",
                "move more gently if the drive was at its limit, and record its actual force",
                Place(first),
            )


def _goes_in_steps(axis: Axis) -> bool:
    """Whether a force that follows no setpoint changes at few instants, and hardly between them.

    A loop that is at its limit changes its force slowly where it is not.
    """
    if {"setpoint_position", "setpoint_velocity"} & axis.log.columns.keys():
        return False
    changes = np.abs(np.diff(axis.force))  # low-passed, m - 1
    noise = 6.0 * axis.smoother.held_noise(axis.force_noise)  # a change of noise alone is less
    changes[changes < max(noise, 1e-9 * float(np.ptp(axis.force)))] = 0.0
    few, most = 0.1, 0.95  # of the blocks, in which that part of all changes is
    largest = np.sort(changes)[::-1][: max(round(few * len(changes)), 1)]
    return float(largest.sum()) >= most * float(changes.sum())


def _piled(axis: Axis, force: Array, extreme: float) -> tuple[float, float] | None:
    """Likewise, of a rough force whose samples have values of their own, but for many there.

    It comes to its limit and leaves it again from sample to sample.
    """
    few, own = 20, 0.5  # samples that are no pile; part of all that no other one equals
    at_it = np.flatnonzero(held_at_extreme(force, extreme, 1))
    if len(at_it) <= few or len(np.unique(force)) < own * len(force):
        return None
    return at_it[0] / axis.sample_rate, len(at_it) / axis.sample_rate


def _exactly(axis: Axis, force: Array, extreme: float) -> tuple[float, float] | None:
    """Start of the first interval at the extreme and length of all, s."""
    # s at one value exactly; five samples at least, where so long is fewer
    least = max(ceil(5e-3 * axis.sample_rate), 5, 2 * axis.force_held)
    held = np.flatnonzero(held_at_extreme(force, extreme, least))
    return (held[0] / axis.sample_rate, len(held) / axis.sample_rate) if len(held) else None


def _but_for_noise(axis: Axis, height: Array) -> tuple[float, float] | None:
    """Likewise, of a low-passed command (m,): a level with steep edges at its top."""
    smoother = axis.smoother
    noise = smoother.held_noise(axis.force_noise)
    if np.ptp(height) < 200.0 * noise:  # least range of a command, times the noise
        return None
    starts, near = _runs(height >= height.max() - 10.0 * noise)  # times the noise
    wide_level = 40.0  # the same for the edges beside the level
    wide = _runs(height >= height.max() - wide_level * noise)[1]
    longest = int(np.argmax(near))
    inside = 0 < starts[longest] < len(height) - near[longest]
    # s at one value but for noise, after the low-pass; ten blocks at least, where so long is fewer
    level = max(20e-3 / smoother.block, 10)
    edge_blocks = 3  # a limited command leaves its level at once, a smooth one slowly
    if not inside or near[longest] < level or wide.max() - near[longest] > edge_blocks:
        return None
    return smoother.time(starts[:1])[0], float(near.sum() * smoother.block)


def _runs(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and lengths of the intervals of True."""
    starts, stops = stretches(mask).T
    return starts, stops - starts
