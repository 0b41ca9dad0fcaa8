"""What signals say of each other: lags, wrong units and signs, swapped axes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from twin.checks.axis import PHYSICAL, READINGS, Axis
from twin.checks.explain import fit_dynamics
from twin.checks.report import Fault, LogFinding
from twin.signals import Array

CAUSED = "the motion that it causes"
DEAD_TIME = ", unless the drive has that dead time"


def check_timing(axis: Axis) -> Iterator[LogFinding]:
    """Command, measured velocity and setpoint against the position."""
    if not axis.moves:
        return
    # s of lag, which a filter or a bus makes; two samples at least, where so long is fewer
    allowed = max(3e-3, 2.0 / axis.sample_rate)
    columns = axis.log.columns
    hold = axis.force_held / axis.sample_rate  # s; on average a held force is late by half of it
    force = axis.lag if abs(axis.lag - 0.5 * hold) >= 0.5 * hold else 0.0
    if abs(force) > allowed:
        dead_time = -PHYSICAL <= force < 0.0
        what, remedy = _lagging(axis, "the force", force, CAUSED, "force", "position")
        told = axis.warning if dead_time else axis.error
        yield told(Fault.LAG, what, remedy + DEAD_TIME * dead_time)
    elif not hold:
        yield from _steady(axis)
    if "velocity" in columns:
        lag = _lag(axis, axis.smoother.rate(columns["velocity"]), axis.velocity)
        if abs(lag) > allowed:
            yield axis.warning(Fault.LAG, *_lagging(axis, "velocity", lag, "the rate of position",
                                                    "velocity", "position"))  # fmt: skip
    if "setpoint_position" in columns:
        lag = _lag(axis, axis.velocity, axis.smoother.velocity(columns["setpoint_position"]))
        # Where the force is not late, all readings are: the position alone would then be wrong to
        # correct, above all where a slow position loop is the cause.
        apart = abs(force) > allowed
        late = "position" if apart else " and ".join(n for n in READINGS if n in columns)
        following = 30e-3  # s, what a slow position loop may account for
        loops = axis.soft_loop or (lag > 0.0 and axis.follows_late(lag))
        slow = lag > max(allowed, following) and not loops
        if lag < -allowed or slow:
            yield axis.warning(Fault.LAG, *_lagging(axis, "position", lag, "its setpoint", late,
                                                    "setpoint_position"))  # fmt: skip


def _steady(axis: Axis) -> Iterator[LogFinding]:
    """A lag or a drift too small to be seen at once, but the same in all parts of the log."""
    sure_lag = 5.0  # times its error, that a lag or a drift must be
    trend = axis.trend
    if trend is None or not axis.dynamics.explains:
        return
    without, steady, drifting = trend.left
    drift = 60e-6  # s/s; two quartz clocks differ by less
    sure = abs(trend.drift) > max(drift, sure_lag * trend.drift_error)
    if sure and _takes_off(axis, steady, drifting, 1.0):  # of the same a drift takes off 0.2
        yield axis.warning(
            Fault.DRIFT,
            f"the force gets {abs(trend.drift) * 1e3:.2g} ms a second "
            f"{'later' if trend.drift > 0.0 else 'earlier'} against the position "
            f"({abs(trend.drift) * 1e6:.3g} ppm, +- {trend.drift_error * 1e6:.2g}): two clocks",
            "record both with one clock, or import each with time stamps",
        )
        return
    # s, what friction that the check does not know may account for; a sample and a half at least
    least = max(1.5 / axis.sample_rate, 0.25e-3)
    sure = max(least, sure_lag * trend.error) < abs(trend.seconds) < PHYSICAL
    # ripple, backlash and vibration are answered by a loop: of what is left beside the noise a lag
    # takes off 1.7 there
    if sure and _takes_off(axis, without, steady, 2.0) and axis.may_be_late(trend.seconds):
        what, remedy = _lagging(axis, "the force", trend.seconds, CAUSED, "force", "position")
        told = f"{what}, +- {trend.error * 1e3:.2g} ms"
        yield axis.warning(Fault.LAG, told, remedy + DEAD_TIME)


def _takes_off(axis: Axis, before: float, after: float, times: float) -> bool:
    """Whether a lag takes off so many times as much (N rms) as it leaves beside the noise.

    What another effect leaves, as a ripple or backlash, is in part explained by a lag too. And more
    than the noise of the readings makes of the force that accelerates: a loop answers that noise a
    moment later, which is no lag.
    """
    noise = axis.smoother.held_noise(axis.force_noise)
    answered = (axis.dynamics.mass or 0.0) * axis.smoother.acceleration_noise(axis.position_noise)
    return before**2 - after**2 > max(times**2 * (after**2 - noise**2), answered**2)


def _lag(axis: Axis, signal: Array, other: Array) -> float:
    """Seconds by which a signal trails the one it should equal; 0 where that is not clear."""
    return axis.lag_of(signal, np.column_stack([other, np.ones_like(other)]))


def _lagging(
    axis: Axis, name: str, lag: float, other: str, late: str, early: str
) -> tuple[str, str]:
    """That a signal is so many s behind the other, and the remedy for the column which is late."""
    side, column = ("behind", late) if lag > 0.0 else ("ahead of", early)
    samples = abs(lag) * axis.sample_rate
    what = f"{name} is {abs(lag) * 1e3:.3g} ms ({samples:.3g} samples) {side} {other}"
    return what, f"give {column} delay_samples = {round(samples)} in the import map"


SLIPS: Mapping[float, str] = {
    1e3: "a unit a thousand times smaller, as mm for m",
    1e6: "a unit a million times smaller, as um for m",
    180.0 / np.pi: "degrees for radians",
}


def check_units(axis: Axis) -> Iterator[LogFinding]:
    """Unit slips and reversed signs."""
    for name in ("position", "setpoint_position"):
        travel = np.ptp(axis.log.columns[name]) if name in axis.log.columns else 0.0
        longest_travel = 10.0  # m; farther, the unit is wrong
        if travel > longest_travel and not axis.log.kind.rotary:
            yield axis.warning(
                Fault.UNIT,
                f"{name} travels {travel:.4g} m, more than {longest_travel:g} m; "
                f"in mm it would be {travel / 1e3:.4g} m",
                "if it is none of so long a rail, correct its unit in the import map",
            )
    if not axis.moves:
        return
    yield from _ratios(axis)
    fit, units = axis.dynamics, axis.log.kind
    against = fit.explains and fit.mass_matters and fit.mass is not None and fit.mass < 0.0
    if against and axis.pushed_back:
        yield axis.error(
            Fault.SIGN,
            f"the force acts against the acceleration, as if the "
            f"{units.mass_name} were {fit.mass:.3g} {units.mass}",
            "give the force or the position the sign -1 in the import map",
        )


def _ratios(axis: Axis) -> Iterator[LogFinding]:
    """Signals that state the same in two sizes."""
    columns, smoother = axis.log.columns, axis.smoother
    setpoint = columns.get("setpoint_position")
    rates = {"velocity": ("position", axis.velocity)}
    if setpoint is not None:
        goal = smoother.position(setpoint)
        # allowed ratios, from and to: off by more, no controller follows at all
        yield from _compare(axis, "position", smoother.position(columns["position"]),
                            "setpoint_position", goal, (0.5, 2.0), follows=True)  # fmt: skip
        rates["setpoint_velocity"] = ("setpoint_position", smoother.velocity(setpoint))
    for name, (of, rate) in rates.items():
        if name in columns:
            # a velocity and the rate of a position, which the low-pass rounds alike
            same_rate = (0.95, 1.05)
            yield from _compare(axis, name, smoother.rate(columns[name]), f"the rate of {of}", rate,
                                same_rate, zero=True)  # fmt: skip
    if setpoint is not None and "setpoint_acceleration" in columns:
        name = "setpoint_acceleration"
        same_second_rate = (0.9, 1.1)  # an acceleration and the second rate, whose noise is larger
        yield from _compare(axis, name, smoother.rate(columns[name]),
                            "the second rate of setpoint_position", smoother.acceleration(setpoint),
                            same_second_rate)  # fmt: skip
    if {"force", "current"} <= set(columns) and axis.log.force_constant is not None:
        same_force = (0.98, 1.02)  # a force and its current: one scale, with no filter between
        yield from _compare(axis, "force", columns["force"], "force constant x current",
                            axis.log.force_constant * columns["current"], same_force)  # fmt: skip


def _compare(
    axis: Axis, name: str, one: Array, other_name: str, other: Array,
    allowed: tuple[float, float], *, follows: bool = False, zero: bool = False,
) -> Iterator[LogFinding]:  # fmt: skip
    """Of a signal and the one that states the same, their ratio where it is not within ``allowed``.

    follows: whether the other is a setpoint. zero: whether 0 is the same on both sides.
    """
    if not zero:
        one, other = one - one.mean(), other - other.mean()
    power, product = float(other @ other), float(one @ other)
    related = 0.9  # correlation of two signals that state the same
    if power == 0.0 or abs(product) < related * np.sqrt(power * float(one @ one)):
        return
    ratio = product / power
    if allowed[0] <= ratio <= allowed[1]:
        return
    wrong = "one of them is reversed"
    if ratio > 0.0:
        off = abs(np.log(ratio))
        looks_like = 0.3  # of the logarithm: how near to a known slip of units a ratio is named so
        near = [text for s, text in SLIPS.items() if abs(off - np.log(s)) < looks_like]
        if not near and follows and axis.soft_loop:
            return
        wrong = f"it looks like {near[0]}" if near else "a scale or the sample rate is wrong"
    fault = Fault.SIGN if ratio < 0.0 else Fault.UNIT
    what = f"{name} is {ratio:.4g} times {other_name}: {wrong}"
    yield axis.error(fault, what, "correct unit, scale, sign or sample rate in the import map")


def check_crossed(axes: Sequence[Axis]) -> Iterator[LogFinding]:
    """Swapped positions or forces, for each pair of axes that move.

    Of many axes only pairs are asked each of whose motions explains the other's force best.
    """
    moving = [a for a in axes if a.moves]
    others = [_explained_by(one, moving) for one in moving]
    for one, other in zip(moving, others, strict=True):
        first = other is not None and moving.index(one) < moving.index(other)
        if other is None or not first or others[moving.index(other)] is not one:
            continue
        own = min(_left(one, one), _left(other, other))
        crossed = max(_left(one, other), _left(other, one))
        worse = 1.2  # times what the motion of the other axis leaves of a force, its own leaves
        explained_crossed = 0.6  # largest part that the motion of the other axis leaves
        if own < worse * crossed or crossed > explained_crossed:
            continue
        what = "positions" if _follows(one, other) and _follows(other, one) else "forces"
        yield one.error(
            Fault.SWAPPED,
            f"the motion of axis {other.name} leaves {100 * crossed:.2g} % of this force, "
            f"its own {100 * own:.2g} %: {what} of axes {one.name} and {other.name} are swapped",
            f"exchange the columns of the {what} of both axes in the import map",
        )


def _explained_by(one: Axis, axes: Sequence[Axis]) -> Axis | None:
    """The other axis whose motion leaves least of this force by least squares, if any can."""
    alike = (a for a in axes if a is not one and a.log.kind == one.log.kind)
    others = [a for a in alike if len(a.force) == len(one.force)]
    if len(others) < 2:
        return next(iter(others), None)
    rows_of_a_glance = 4000  # of a force, enough to tell which of many motions explains it best
    rows = slice(None, None, -(-len(one.force) // rows_of_a_glance))
    explained = [float(np.linalg.norm(a.span(rows).T @ one.force[rows])) for a in others]
    return others[int(np.argmax(explained))]


def _left(force: Axis, motion: Axis) -> float:
    """The part of a force that a motion does not explain."""
    kept = np.minimum(force.kept, motion.kept)
    fit = fit_dynamics(force.force, motion.regressors, kept, 0, motion.rare)
    return float(np.median(np.abs(fit.residual)) / np.median(np.abs(_centred(force.force))))


def _follows(position: Axis, setpoint: Axis) -> bool:
    """Whether the position of one axis is where another was told to be."""
    told = setpoint.log.columns.get("setpoint_position")
    if told is None:
        return False
    x, r = _centred(position.log.position), _centred(told)
    alike_setpoint = 0.98  # correlation of a position and the setpoint that it follows
    return float(x @ r) > alike_setpoint * float(np.linalg.norm(x) * np.linalg.norm(r))


def _centred(x: Array) -> Array:
    return np.asarray(x - x.mean())
