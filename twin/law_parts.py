"""What several laws of the catalogue share: parameters of one meaning, and pieces of equations.

Compiled into each law that calls them, so they are plain functions of numbers and of p, s and io.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from math import copysign, cos, exp, expm1, hypot, pi, sin, sqrt
from typing import Any

from twin.effect import (
    ACC,
    COLUMNS,
    DRY,
    DT,
    INDEX,
    LEAST,
    MOST,
    MOVED,
    OUT,
    STATIC,
    WHEN,
    Effect,
    Excitation,
    Parameter,
    V,
)
from twin.knee import REACH, Imitated, Knee

# --- what makes a law itself ----------------------------------------------------------------------

SHOWN_PEAK = 1.1  # of the Coulomb friction; a static friction that is less above it is none
COUNTS = 3.0  # of the readings; a period of one or two is their rounding, in whatever harmonic


def at(
    parameter: str,
    unit: str,
    shown: Callable[[Excitation], tuple[float, float]],
    below: Imitated | None = None,
    above: Imitated | None = None,
) -> Knee:
    """The knee that a parameter is."""
    return Knee(parameter, unit, lambda v, e: v[parameter], lambda v, e: shown(e), below, above)


def repeats_after(period: str, else_: Imitated = Imitated.OF_POSITION) -> Knee:
    """A period along the track of which the motion has some cycles, and the readings some steps."""
    return at(
        period, "m", lambda e: (COUNTS * e.resolution, e.longest_period),
        Imitated.ROUNDING, else_,
    )  # fmt: skip


def slips_after(size: Callable[[Mapping[str, float]], float]) -> Knee:
    """A reach until what sticks slips; from a reversal on it is twice as long.

    Rounded readings turn up to a count after the axis did, and as much before it, so that dry
    friction by them is a reach of about a count: what is to be told from it is clearly longer.
    """
    clearly = 1.5  # counts
    return Knee(
        REACH, "m", lambda v, e: size(v),
        lambda v, e: (max(e.shortest, clearly * e.resolution), 0.5 * (e.been[1] - e.been[0])),
        Imitated.DRY_FRICTION, Imitated.SPRING,
    )  # fmt: skip


DEFLECTION = slips_after(lambda v: v["Fc"] / v["sigma0"])


PEAK = Knee(
    # what the axis may as well rest at: noise of the path makes speeds as low, and no peak
    "v0", "m/s", lambda v, e: v["v0"] if v["Fs"] > SHOWN_PEAK * v["Fc"] else e.speed_least,
    lambda v, e: (e.speed_least, e.speed_max), Imitated.WITHOUT_PEAK,
)  # fmt: skip


def swings_at(frequency: str, below: Imitated, above: Imitated | None) -> Knee:
    """A frequency that the logs show."""
    return at(frequency, "Hz", lambda e: e.frequencies, below, above)


def late_by(time: str, as_: Imitated) -> Knee:
    """A delay within a stroke; a short one is little, and nothing else."""
    return at(time, "s", lambda e: (0.0, e.stroke), above=as_)


def at_speed(speed: str, as_: Imitated) -> Knee:
    """A speed between rest and the highest."""
    return at(speed, "m/s", lambda e: (e.speed_least, e.speed_max), as_, as_)


def turns_with_direction(as_: Imitated) -> Knee:
    """Places passed both ways; where all are passed one way, what turns with it turns never."""
    most = 0.5  # of the places: what most of them tell, the law has at the others
    return Knee(
        "share of places passed both ways", "1", lambda v, e: e.both_ways,
        lambda v, e: (most, 1.0), below=as_,
    )  # fmt: skip


# --- friction -------------------------------------------------------------------------------------

COULOMB_LEVEL = Parameter(
    "Fc", "N", 0.3, 0.0, MOST, "Coulomb friction", strength=True, dry=True,
    start_rule=lambda e: e.dry_level,
)  # fmt: skip
STATIC_LEVEL = Parameter(
    "Fs", "N", 0.35, 0.0, MOST, "static friction", strength=True, dry=True, at_least="Fc",
    start_rule=lambda e: 1.15 * e.dry_level,
)  # fmt: skip
STRIBECK_VELOCITY = Parameter(
    "v0", "m/s", 0.01, LEAST, MOST, "Stribeck velocity",
    start_rule=lambda e: 0.05 * e.speed_max,
    scan=lambda e: (0.02 * e.speed_max, 0.1 * e.speed_max),
)  # fmt: skip
STRIBECK_EXPONENT = Parameter("n", "1", 2.0, 0.5, 4.0, "Stribeck exponent", fixed=True)
VISCOUS_PART = Parameter("sigma2", "N s/m", 0.0, 0.0, MOST, "viscous friction", strength=True)
BRISTLE_DAMPING = Parameter(
    "sigma1", "N s/m", 0.5, LEAST, MOST, "bristle damping",
    start_rule=lambda e: 0.5 * e.dry_level / e.speed_max,
)  # fmt: skip
STRIBECK_CURVE = (COULOMB_LEVEL, STATIC_LEVEL, STRIBECK_VELOCITY)


def dry_and_viscous(values: Mapping[str, float]) -> dict[str, float]:
    """What a joint of MuJoCo holds of a friction: its Coulomb and its viscous part."""
    return {"frictionloss": values["Fc"], "damping": values["sigma2"]}


def stiffness_at_rest(meaning: str, tried: Sequence[float] = (3e-3, 3e-4, 3e-5)) -> Parameter:
    """``sigma0`` of a pre-sliding; tried: deflections at the dry level, parts of the travel."""
    return Parameter(
        "sigma0", "N/m", 300.0, LEAST, MOST, meaning,
        start_rule=lambda e: 300.0 * e.dry_level / e.travel,
        scan=lambda e: tuple(e.dry_level / (z * e.travel) for z in tried),
    )  # fmt: skip


GONE = 230.0  # exponent of a fall to 1e-100, which is none: what divides by less overflows


def stribeck_level(io, coulomb, static, velocity, exponent):
    """g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n), N, with what modifiers make of both levels."""
    q = abs(io[V]) / velocity
    power = q * q if exponent == 2.0 else q**exponent
    fall = exp(-power) if power < GONE else 0.0
    return io[DRY] * (coulomb + (static * io[STATIC] - coulomb) * fall)


# --- Maxwell-slip elements: springs side by side, each slips at a force of its own ----------------


def of_elements(count: int) -> Parameter:
    """The parameter that tells the number of elements."""
    return Parameter("elements", "1", count, count, count, "number N, from the model file")


SPREAD = Parameter("spread", "1", 10.0, 1.0, 1e6, "last yield deflection over the first")


def relative_parts(count: int) -> tuple[Parameter, ...]:
    """``share_i`` and ``stiff_i``: each element's part of the force and of the stiffness."""
    return tuple(
        Parameter(
            f"{part}_{i}", "1", 1.0, 1e-6, 1e6, f"element {i}: relative part of the {what}",
            fixed=True,
        )
        for part, what in (("share", "force"), ("stiff", "stiffness"))
        for i in range(1, count + 1)
    )  # fmt: skip


def sums_of_parts(p, first, count, ratio):
    """Sums that share_i and stiff_i are parts of; ``ratio``: of a stiffness to the one before."""
    shares, springs, taper = 0.0, 0.0, 1.0
    for i in range(count):
        shares += p[first + i]
        springs += p[first + count + i] * taper
        taper *= ratio
    return shares, springs


def _mean_yield(values: Mapping[str, float]) -> float:
    """Deflection at which elements slip that carry Fc together, m, on average of their forces."""
    count = int(values["elements"])
    steps = range(1, count + 1)
    shares, stiff = ([values[f"{part}_{i}"] for i in steps] for part in ("share", "stiff"))
    taper = values["spread"] ** (-1.0 / max(count - 1, 1))
    springs = [own * taper**i for i, own in enumerate(stiff)]
    parts = sum(share**2 / spring for share, spring in zip(shares, springs, strict=True))
    return values["Fc"] / values["sigma0"] * parts * sum(springs) / sum(shares) ** 2


ELEMENTS_SLIP = slips_after(_mean_yield)

LAYERS = (
    Parameter(
        "reach", "m", 5e-3, LEAST, MOST, "travel from no force until every layer slips",
        scan=lambda e: tuple(part * e.travel for part in (3e-3, 9e-3, 0.03, 0.09)),
    ),
    *(
        Parameter(
            f"f{i}", "N", 0.0, 0.0, MOST, f"force of the layer that slips at reach/{2**i}",
            strength=True,
        )
        for i in range(4)
    ),
)  # fmt: skip


def _mean_reach(values: Mapping[str, float]) -> float:
    """Of the layers, m, each by its force; that of the first where none has any."""
    forces = [values[f"f{i}"] for i in range(4)]
    parts = sum(force / 2**i for i, force in enumerate(forces))
    return values["reach"] * (parts / sum(forces) if any(forces) else 1.0)


LAYERS_SLIP = slips_after(_mean_reach)


def slipping_layers(p, s, io):
    """Force of layers that stick to each other and slip one after another; steps their states."""
    step = io[V] * io[DT]
    limit = p[0]
    force = 0.0
    for i in range(4):  # from the layer that slips last to the one that slips first
        now = min(max(s[i] + io[WHEN] * step, -limit), limit)
        s[i] = min(max(s[i] + step, -limit), limit)
        force -= p[1 + i] * now / limit
        limit *= 0.5
    io[OUT] = force


# A cable's law has a general name too. A diagnosis offers it by one of the two.


def on_a_cable(present: Collection[Effect], turns: bool) -> bool:
    """Whether an axis with these effects has a cable: an effect that is offered only there."""
    return any(effect.suits is on_a_cable for effect in present)


def without_a_cable(present: Collection[Effect], turns: bool) -> bool:
    """Whether an axis with these effects has none."""
    return not on_a_cable(present, turns)


# --- what repeats along the track -----------------------------------------------------------------


def harmonics(position, period):
    """Sine and cosine of the first, second and third harmonic of a period, m."""
    phase = 2.0 * pi * position / period
    sin1 = sin(phase)
    cos1 = cos(phase)
    sin2 = 2.0 * sin1 * cos1
    cos2 = cos1 * cos1 - sin1 * sin1
    return sin1, cos1, sin2, cos2, sin2 * cos1 + cos2 * sin1, cos2 * cos1 - sin2 * sin1


def ripple(p, position):
    """Two harmonics of the period p[0], m, with the strengths p[1] to p[4]."""
    sine, cosine, sine2, cosine2, _, _ = harmonics(position, p[0])
    return p[1] * sine + p[2] * cosine + p[3] * sine2 + p[4] * cosine2


def along_track(p, position):
    """Smooth profile along a track that begins at p[0], m, and is p[1], m, long: five cosines.

    Their strengths are p[2] to p[6]. Over the track their mean is zero, so that they do not compete
    with what they change; beyond it the profile stays as it is.
    """
    along = min(max((position - p[0]) / p[1], 0.0), 1.0)
    double = 2.0 * cos(pi * along)
    # Clenshaw's recurrence for a cosine series
    last = p[6]
    b4 = p[5] + double * last
    b3 = p[4] + double * b4 - last
    b2 = p[3] + double * b3 - b4
    b1 = p[2] + double * b2 - b3
    return 0.5 * double * b1 - b2


TRACK = (
    Parameter(
        "start", "m", -0.17, -MOST, MOST, "where the profile begins", fixed=True,
        start_rule=lambda e: e.position_low,
    ),
    Parameter(
        "length", "m", 0.34, LEAST, MOST, "length of the profile", fixed=True,
        start_rule=lambda e: e.travel,
    ),
)  # fmt: skip


def cosine_terms(most: float) -> tuple[Parameter, ...]:
    """Strengths of a profile along the track, none larger than ``most``."""
    return tuple(
        Parameter(f"c{k}", "1", 0.0, -most, most, f"cosine term {k}", strength=True)
        for k in range(1, 6)
    )


RIPPLE_CYCLES = 70  # most over the travel of a ripple, that are tried before a model tells them


def columns_of(io, waves):
    """Write these waves as the columns of the strengths, in their order."""
    io[COLUMNS] = len(waves)
    for j, wave in enumerate(waves):
        io[COLUMNS + 1 + 2 * j], io[COLUMNS + 2 + 2 * j] = j, wave


def harmonic_terms(count: int, unit: str, most: float = MOST) -> tuple[Parameter, ...]:
    """``a_k`` and ``b_k`` of so many harmonics."""
    return tuple(
        Parameter(
            f"{c}{k}", unit, 0.0, -most, most, f"{f} term of harmonic {k}", strength=True
        )
        for k in range(1, count + 1)
        for c, f in (("a", "sine"), ("b", "cosine"))
    )  # fmt: skip


def of_shortest_pitch(values: Mapping[str, float]) -> dict[str, float]:
    """Values with the shorter pitch p where only one higher harmonic of it is present."""
    count = sum(name.startswith("a") for name in values)
    size = {k: hypot(values[f"a{k}"], values[f"b{k}"]) for k in range(1, count + 1)}
    highest = max(size, key=lambda k: size[k])
    if highest == 1 or sum(size.values()) - size[highest] >= 0.1 * size[highest]:
        return dict(values)
    first = {"a1": values[f"a{highest}"], "b1": values[f"b{highest}"]}
    return {**dict.fromkeys(values, 0.0), "p": values["p"] / highest, **first}


def pitches_to_try(
    repeats: Sequence[float], travel: float, count: int, cycles: int
) -> tuple[float, ...]:
    """Pitches (m) at which the force repeats, which may be those of one of ``count`` harmonics.

    Before a model tells them, half a cycle apart over the travel (m), from three cycles on.
    """
    if repeats:
        return tuple(k * pitch for pitch in repeats for k in range(1, count + 1))
    return tuple(2.0 * travel / k for k in range(6, 2 * cycles + 1))


# --- memory of the direction, and of past samples -------------------------------------------------


def turned(s, io, reach):
    """The direction of motion as it follows a reversal within ``reach`` m; steps state 0."""
    direction = s[0]
    if io[V] != 0.0:
        change = copysign(1.0, io[V]) - s[0]
        if abs(change) > 1e-12:  # less of a turn than this is left when it is over
            change *= -expm1(-abs(io[V]) * io[DT] / reach)
        direction += io[WHEN] * change
        s[0] += change
    return direction


PAST = 64  # samples kept; the longest delay is PAST - 2 samples
PAST_STATES = tuple(f"past_{i}" for i in range(PAST))


def delayed(s, io, slot, delay):
    """What a slot of io was ``delay`` s ago, a straight line between samples; keeps it in s."""
    if io[INDEX] == 0.0:  # before the log began it was what it is at its start
        for i in range(PAST):
            s[i] = io[slot]
    now = int(io[INDEX]) % PAST
    s[now] = io[slot]
    samples = min(delay / io[DT], PAST - 2.0)
    if samples <= 0.0:
        return io[slot]
    whole = int(samples)
    newer = s[(now - whole + PAST) % PAST]
    older = s[(now - whole - 1 + PAST) % PAST]
    return newer + (samples - whole) * (older - newer)


# --- masses on a spring and damper ----------------------------------------------------------------


def oscillator(frequency, ratio, share, dt):
    """Spring and damper of a step of MuJoCo's that swings and decays as the exact motion does.

    In units of the step: 1/dt^2 and 1/dt for a mass of 1. See twin.simulation.spec.Spring.
    """
    angle = min(2.0 * pi * frequency * dt, 3.0)
    grown = expm1(ratio * angle)
    half = sin(0.5 * sqrt(1.0 - ratio * ratio) * angle)
    spring = min(grown * grown + 4.0 * (1.0 + grown) * half * half, 2.0 * (1.0 - share))
    return spring, grown * (2.0 + grown)


def hung_load(s, io, share, frequency, ratio, depth):
    """Force of a load on a spring pressed by ``depth`` m; steps its displacement and speed."""
    spring, damper = oscillator(frequency, ratio, share, io[DT])
    rate = 1.0 / io[DT]
    pull = (spring * depth * rate + damper * s[1]) * rate
    acceleration = -(pull + io[ACC]) / (1.0 + damper)
    if io[WHEN] > 0.0:
        s[1] += io[DT] * acceleration
        s[0] += io[DT] * s[1]
    io[OUT] = -share * io[MOVED] * acceleration


# --- fitted curves, which are valid only within the motion of the logs ----------------------------


def covered(name: str, unit: str, start: float, meaning: str,
            rule: Callable[[Excitation], float]) -> Parameter:  # fmt: skip
    """A number of the covered motion, held."""
    least = LEAST if start > 0.0 else -MOST
    return Parameter(name, unit, start, least, MOST, meaning, fixed=True, start_rule=rule)


COVERED_MOTION = (
    covered("start", "m", -0.15, "where the covered travel begins", lambda e: e.position_low),
    covered("length", "m", 0.3, "length of the covered travel", lambda e: e.travel),
    covered("speed", "m/s", 0.2, "highest speed covered", lambda e: e.speed_max),
)


def smooth(knots: int) -> Any:
    """Second differences, and the values over their number: rows (2 knots - 2, knots)."""
    import numpy as np  # the catalogue is listed without it

    return np.vstack([np.diff(np.eye(knots), 2, axis=0), np.eye(knots) / knots])
