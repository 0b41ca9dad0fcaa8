"""One axis of a log with the quantities that the checks need, each computed at first use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from twin.checks.explain import (
    KEPT_PART,
    UNUSUAL,
    Dynamics,
    Smoother,
    Trend,
    find_lag,
    find_trend,
    fit_dynamics,
    slower_refutes,
)
from twin.checks.report import WHOLE, Fault, LogFinding, Place, Severity
from twin.logs.log import AxisLog
from twin.signals import Array, count_of, median, usual_size, white_noise

PHYSICAL = 10e-3  # s of lag, what a slow drive may account for
READINGS = ("position", "velocity", "current", "force")


@dataclass(frozen=True, eq=False)
class Axis:
    """name: of the axis; sample_rate in Hz; log: its columns."""

    name: str
    sample_rate: float
    log: AxisLog

    def error(self, fault: Fault, what: str, remedy: str, where: Place = WHOLE) -> LogFinding:
        """A fault for which the log should not be fitted."""
        return LogFinding(Severity.ERROR, fault, self.name, what, where, remedy)

    def warning(self, fault: Fault, what: str, remedy: str, where: Place = WHOLE) -> LogFinding:
        """A fault that limits what a fit can identify."""
        return LogFinding(Severity.WARNING, fault, self.name, what, where, remedy)

    @property
    def duration(self) -> float:
        """Length of the log in s."""
        return len(self.log) / self.sample_rate

    @cached_property
    def smoother(self) -> Smoother:
        """The low-pass at which signals are compared."""
        return Smoother(1.0 / self.sample_rate)

    @cached_property
    def position_step(self) -> float:
        """Smallest change of the position in m, its count; 0 where none shows."""
        steps = np.abs(np.diff(self.log.position))
        rounding = 4.0 * np.finfo(float).eps * float(np.abs(self.log.position).max())
        steps = steps[steps > rounding]  # less is made by units and gears, and none of the encoder
        least = float(steps.min()) if len(steps) else 0.0
        rests = 0.05  # part of the samples that repeat the one before, as of a reading in steps
        repeated = len(self.log) - 1 - len(steps) > rests * len(self.log)
        if not (repeated or _are_whole(steps, least)):
            least = 0.0
        return least if self.position_held else max(count_of(self.log.position), least)

    @cached_property
    def position_white(self) -> float:
        """White part of the position, m rms."""
        return white_noise(self.log.position)

    @cached_property
    def position_noise(self) -> float:
        """Noise of the position in m rms: its white part, or the rounding to its step."""
        return max(self.position_white, self.position_step / 12**0.5)

    @cached_property
    def position_held(self) -> int:
        """For how many samples each value of the position is held, where it is; else 0."""
        return held_samples(self.log.position)

    @cached_property
    def force_held(self) -> int:
        """The same of the force; of long holds only where the motion does not answer to them."""
        longest = 400  # samples, of which a log of some length has enough
        count = held_samples(self.log.force, longest)
        return count if count <= 20 or not self._answers_steps(count) else 0

    def _answers_steps(self, count: int) -> bool:
        """Whether the motion goes with the force as it is, better than with one between its values.

        So it does where a command goes in steps, and not where a reading was held.
        """
        force = self.log.force
        change = np.flatnonzero(np.diff(force)) + 1
        smooth = np.interp(np.arange(len(force)), change, force[change])
        left = (
            float(np.std(fit_dynamics(f, self.regressors, self.kept, 0, self.rare).residual))
            for f in (self.force, self.smoother.held(smooth))
        )
        stepped, between = left
        return stepped < between

    @cached_property
    def force_noise(self) -> float:
        """White part of the command, N rms."""
        return white_noise(self.log.force)

    @cached_property
    def noise_of_force(self) -> float:
        """That part of it, N rms, which neither position nor setpoint has within a few samples.

        A loop makes a rough command of a rough reading, and a mass answers it: both are no noise.
        """
        around = np.arange(-3, 4)  # samples in which a loop answers, and a mass
        rough = np.diff(self.log.force, 4)
        signals = (self.log.columns.get(n) for n in ("position", "setpoint_position"))
        sources = [np.diff(signal, 4) for signal in signals if signal is not None]
        if len(rough) < 100 * len(around):  # of which so many columns tell nothing
            return self.force_noise
        columns = np.column_stack([np.roll(one, k) for one in sources for k in around])
        columns /= np.abs(columns).max(axis=0) + np.finfo(float).tiny
        gains = np.linalg.lstsq(columns.T @ columns, columns.T @ rough, rcond=1e-12)[0]
        return min(usual_size(rough - columns @ gains) / 70**0.5, self.force_noise)

    @cached_property
    def force_size(self) -> float:
        """What 99 % of the command stays within about its median, N."""
        force = self.log.force
        return float(np.quantile(np.abs(force - median(force)), 0.99))

    @cached_property
    def velocity(self) -> Array:
        """(m,) low-passed velocity of the position, m/s."""
        return self.smoother.velocity(self.log.position)

    @cached_property
    def acceleration(self) -> Array:
        """(m,) low-passed acceleration of the position, m/s^2."""
        return self.smoother.acceleration(self.log.position)

    @cached_property
    def force(self) -> Array:
        """(m,) low-passed command, N."""
        return self.smoother.held(self.log.force)

    @property
    def still(self) -> float:
        """Speed in m/s below which the noise of the position may be all there is."""
        moving = 5.0  # speed, in units of its noise
        return moving * self.smoother.velocity_noise(self.position_noise)

    @cached_property
    def moves(self) -> bool:
        """Whether the position covers more than its noise can, and is in motion for 0.3 s in all.

        An axis that is held at rest covers a little while its loop settles.
        """
        covered = 15.0  # rms of noise; of 3 million samples white noise covers 10
        if not np.ptp(self.log.position) > covered * self.position_noise:
            return False
        moving = np.count_nonzero(np.abs(self.velocity) > self.still)
        least_motion = 0.3  # s; a loop that is closed at rest settles within half of that
        return bool(moving * self.smoother.block > least_motion)

    @cached_property
    def possible_jump(self) -> float:
        """Largest second difference of the position, in m, that motion and noise explain."""
        usual = float(np.quantile(np.abs(self.acceleration), 0.99))
        noise = 10.0 * 6**0.5 * self.position_noise  # times the rms of noise
        impossible = 4.0  # times the acceleration that 99 % of the samples stay below
        possible = impossible * usual / self.sample_rate**2 + noise
        # What swings within the samples that were smoothed bends as much at half of them all.
        return max(possible, UNUSUAL * usual_size(np.diff(self.log.position, 2)))

    @cached_property
    def jumps(self) -> Array:
        """(n - 2,) second difference of the position in m where it is impossible, else 0.

        Nor does a jump have neighbours of its size: those of a fast motion are alike.
        """
        second = np.abs(np.diff(self.log.position, 2))
        unlikely = second > self.possible_jump
        reach = round(max(20e-3 * self.sample_rate, 25))  # longer than a break, shorter than a move
        unlikely[unlikely] = second[unlikely] > UNUSUAL * _usual_about(second, unlikely, reach)
        return np.where(unlikely, second, 0.0)

    @cached_property
    def curved_at(self) -> NDArray[np.intp]:
        """(k,) samples at which the second difference of the position is impossible."""
        return np.flatnonzero(self.jumps) + 1

    @cached_property
    def kept(self) -> Array:
        """(m,) 1.0 where the motion has no impossible jumps, else 0.0; 1.0 if little is left."""
        if not len(self.curved_at):
            return np.ones(len(self.velocity))
        jumps = np.zeros(len(self.log))
        jumps[self.curved_at] = 1.0
        hit = np.convolve(jumps, np.ones(4 * self.smoother.samples + 1), "same")
        free = self.smoother.held((hit > 0.5).astype(float)) == 0.0
        return free.astype(float) if free.mean() > 0.5 else np.ones(len(free))

    @cached_property
    def going(self) -> Array:
        """(m,) 1.0 where the axis keeps moving one way and its motion is believed, else 0.0.

        It stops gently and breaks loose at once, which looks like a force ahead of its motion.
        """
        full_friction = 0.95  # of Coulomb friction: a low-pass with less of it holds a standstill
        return self.kept * (np.abs(self.regressors[:, 2]) > full_friction)

    @cached_property
    def lag(self) -> float:
        """Lag of the command behind the motion that it causes, s; 0 where none is clear.

        Nor where friction with a memory explains it: what lags by a distance and not by a time is
        none, nor what slower motion has no part in. How long it is, is told away from standstill.
        """
        found = self.lag_of(self.force, self.regressors) if self._changes_often else 0.0
        beside = self.lag_of(self.force, self.remembering) if found else 0.0
        same_lag = 0.3  # largest difference of a lag with and without a memory, as a part of it
        if not beside or abs(beside - found) >= same_lag * abs(found):
            return 0.0
        going, _ = find_lag(self.force, self.regressors, self.going, self.smoother.block)
        lag = going if self._keeps_going and abs(going - found) < PHYSICAL else found
        return lag if self.may_be_late(lag) else 0.0

    def may_be_late(self, seconds: float) -> bool:
        """Whether the force may be so many s late: slower motion is not better without it."""
        kept = self.going if self._keeps_going else self.kept
        return not slower_refutes(seconds, self.force, self.regressors, kept, self.smoother)

    @property
    def _keeps_going(self) -> bool:
        """Whether enough of the log moves one way to tell a lag."""
        return bool(self.going.mean() > KEPT_PART)

    @property
    def _changes_often(self) -> bool:
        """Whether the force changes in several parts of the log: what lags one step is no lag.

        A single step is explained by many things.
        """
        parts = np.array_split(self.force, 8)
        lively = 0.04 * float(np.ptp(self.force))  # least range of a part, of that of the whole
        return sum(float(np.ptp(part)) > lively for part in parts) >= 3  # more than a step's two

    def lag_of(self, signal: Array, explained_by: Array) -> float:
        """Lag (s) of a signal (m,) behind its regressors (m, k); 0 where that is not clear."""
        seconds, clear = find_lag(signal, explained_by, self.kept, self.smoother.block)
        return seconds if clear else 0.0

    @property
    def trend(self) -> Trend | None:
        """The same in each part of the log, beside friction with a memory."""
        return find_trend(self.force, self.remembering, self.going, self.smoother.block)

    @property
    def rare(self) -> float:
        """Part of the log that a burst may be: a hundredth, more in one so short that one is."""
        return max(0.01, 3.0 * self.smoother.length / self.duration)

    @cached_property
    def dynamics(self) -> Dynamics:
        """The command explained by the motion, with the lag between them removed."""
        shift = round(self.lag / self.smoother.block)
        span = slice(max(-shift, 0), len(self.force) - max(shift, 0))
        force = self.force[span.start + shift : span.stop + shift]
        return fit_dynamics(force, self.regressors[span], self.kept[span], span.start, self.rare)

    @property
    def pushed_back(self) -> bool:
        """Whether force and acceleration are opposed in each third of the log that tells it.

        What the check does not know, such as a joint that another moves, may oppose them in all.
        """
        fits = (
            fit_dynamics(self.force[p], self.regressors[p], self.kept[p], 0, self.rare)
            for p in np.array_split(np.arange(len(self.force)), 3)
        )
        masses = [fit.mass for fit in fits if fit.mass is not None and fit.mass_matters]
        return max(masses, default=-1.0) < 0.0

    def is_kicked(self, first: int, last: int) -> bool:
        """Whether an unusual force makes the change of speed at samples ``first`` to ``last``.

        Such is a setpoint whose speed jumps: force and motion agree, and neither is off. A loop
        that answers a wrong reading pushes back.
        """
        near = 10  # samples either way, from which a course is told
        begin, end = max(first - near, 0), min(last + near, len(self.log) - 1)
        force, x = self.log.force[begin : last + 1], self.log.position
        pushed = force - median(force)
        most = float(pushed[np.argmax(np.abs(pushed))])
        before, after = (float(x[k] - x[max(k - near // 2, 0)]) for k in (first - 1, end))
        made = 2.0 * (after - before) / near  # m a sample
        bend = float(self.jumps[max(first - 1, 0) : last].max(initial=0.0))
        lasting = 0.2  # of a bend, that is a change of speed and not taken back in the next sample
        return abs(most) > self.force_size and made * np.sign(most) > lasting * bend

    def span(self, rows: slice) -> Array:
        """Orthonormal basis (r, k) of what its motion can explain, at some of the samples."""
        used = self.regressors[rows] * self.kept[rows, None]
        return np.linalg.qr(used / (np.linalg.norm(used, axis=0) + np.finfo(float).tiny))[0]

    @cached_property
    def regressors(self) -> Array:
        """(m, 5) regressors of a command: mass, damping, Coulomb friction, bias, stiffness."""
        fast = float(np.quantile(np.abs(self.velocity), 0.99))
        position = self.smoother.position(self.log.position)
        slow_speed = 0.02  # times the highest speed: below, Coulomb friction is not yet full
        slow = max(slow_speed * fast, float(np.finfo(float).tiny))
        direction, one = self.smoother.direction(self.log.position, slow), np.ones_like(position)
        centred = position - position.mean()
        return np.column_stack([self.acceleration, self.velocity, direction, one, centred])

    @cached_property
    def remembering(self) -> Array:
        """(m, 5 + k) regressors of a command, with friction that builds up over k distances."""
        position = self.smoother.position(self.log.position)
        # of the way covered, over which friction may build up
        presliding = (0.003, 0.01, 0.03, 0.1, 0.3)
        widths = np.ptp(position) * np.array(presliding)
        return np.column_stack([self.regressors, *(_built_up(position, w) for w in widths)])

    def follows_late(self, lag: float) -> bool:
        """Whether a position that lags its setpoint (by s) does so as a loop does.

        The error of a loop goes with speed and acceleration; late readings are the setpoint of an
        earlier time.
        """
        samples = round(lag * self.sample_rate)
        goal = self.log.columns["setpoint_position"]
        position = self.log.position[samples:]
        error = self.smoother.position(goal[samples:] - position)
        left = self.smoother.position(goal[: len(position)] - position)
        rates = [self.smoother.velocity(position), self.smoother.acceleration(position)]
        as_loop = _fitted(error, np.column_stack([*rates, np.ones_like(error)]))[1]
        as_good = 2.0  # times what late readings leave, that a loop may leave
        return as_loop < as_good * float(np.std(left))

    @cached_property
    def soft_loop(self) -> bool:
        """Whether the command is that of a spring and damper between setpoint and position.

        Then the position falls short of its setpoint under a load, and no scale is wrong. With a
        wrong one the loop, which knows better, weighs setpoint and position differently.
        """
        setpoint = self.log.columns["setpoint_position"]
        goal, position = self.smoother.position(setpoint), self.smoother.position(self.log.position)
        falls_short = 0.8  # of the setpoint's spread, up to which a position falls short of it
        if np.std(position) > falls_short * np.std(goal):
            return False
        rates = [np.ones_like(goal), self.velocity, self.smoother.velocity(setpoint)]
        spring, left = _fitted(self.force, np.column_stack([goal - position, *rates]))
        apart = _fitted(self.force, np.column_stack([goal, position, *rates]))[1]
        size = float(np.std(self.force))
        as_good_gains = 1.5  # times what is left with two gains, that one may leave
        well = 0.03  # or that part of the command
        as_good = left < max(as_good_gains * apart, well * size)
        # largest part of a command that a spring to the setpoint leaves
        return spring > 0.0 and left < 0.3 * size and as_good


def _fitted(signal: Array, columns: Array) -> tuple[float, float]:
    """The gain of the first of some columns (m, k) in a signal (m,), and the RMS that is left."""
    size = np.abs(columns).max(axis=0)
    scaled = columns / np.where(size > 0.0, size, 1.0)
    gains = np.linalg.lstsq(scaled, signal, rcond=1e-12)[0]
    return float(gains[0]), float(np.std(signal - scaled @ gains))


def _built_up(position: Array, width: float) -> Array:
    """(m,) in -1..1: what has built up since the last reversals, full after a distance (m).

    The stop operator: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, 1989.
    """
    held, out, way = 0.0, [], position / width
    for step in np.diff(way, prepend=way[0]).tolist():
        held += step  # compared, as to call min and max takes most of a check
        if held > 1.0:
            held = 1.0
        elif held < -1.0:
            held = -1.0
        out.append(held)
    return np.array(out)


def _usual_about(sizes: Array, at: NDArray[np.bool_], reach: int) -> Array:
    """(k,) the usual one of some sizes (n,) within ``reach`` samples of each of k of them."""
    places = np.flatnonzero(at)
    first = np.clip(places - reach, 0, max(len(sizes) - 2 * reach - 1, 0))
    return np.array([np.median(sizes[k : k + 2 * reach + 1]) for k in first])


def _are_whole(steps: Array, least: float) -> bool:
    """Whether steps are whole ones of the least; a motion that never rests has any."""
    few = steps[steps < 20.0 * least]  # of more, rounding adds up
    off = np.abs(few / (least or 1.0) - np.round(few / (least or 1.0)))
    return len(few) >= 5 and float(np.mean(off < 0.05)) > 0.9  # as of the ways of ``count_of``


def held_samples(signal: Array, most: int = 20) -> int:
    """For how many samples each value of a signal is held, where it is; else 0.

    most: such samples; longer holds may be those of a command that goes in steps.
    """
    changes = np.diff(signal) != 0.0
    if 3 * np.count_nonzero(changes) > 2 * len(signal):  # most from each sample to the next
        return 0
    change = np.flatnonzero(changes)
    if len(change) < 50:  # of which that part is told
        return 0
    steps = np.diff(change)
    if np.count_nonzero(steps == 1) > len(steps) // 2:  # so is their median
        return 0
    count = int(np.median(steps))
    if not 2 <= count <= most:
        return 0
    share = np.bincount(change % count).max() / len(change)
    phase = 0.95  # of the changes fall on one of every m samples where a signal is held
    return count if share >= phase else 0
