"""Weight of what hangs beside the axis of a shaft behind a gear: an arm or an unbalanced load.

F = -(sine sin(q/gear) + cosine cos(q/gear)), a torque, with q the angle of the motor. M. W. Spong,
S. Hutchinson, M. Vidyasagar, Robot Modeling and Control (2006), sections 6.1 (gear) and 6.4 (single
link). Without a gear it is gravity; where the load turns by little, any spring makes its force.
"""

from math import cos, pi, sin

from twin.effect import MOST, OUT, Effect, Kind, Parameter, X
from twin.knee import Imitated, Knee

GEARED = 1.1  # turns of the motor in one of the load, below which it is gravity


def law(p, s, io):
    angle = io[X] / p[0]
    io[OUT] = -(p[1] * sin(angle) + p[2] * cos(angle))


def turns(e):
    """Of the motor, from end to end of the logs."""
    low, high = e.been
    return (high - low) / (2.0 * pi)


def gears_to_try(e):
    """Of what repeats, and of a load that goes round a few times at most or half round."""
    largest = 2.0 * max(turns(e), GEARED)
    repeating = (p / (2.0 * pi) for p in e.pitches)
    apart = 2.0**0.5  # so near that the next one is found from each
    ladder = (largest / apart**k for k in range(7))
    return sorted({gear for gear in (*repeating, *ladder) if gear >= GEARED})


# Half a turn of the load is the least that no spring makes.
ROUND = Knee(
    "gear", "1", lambda v, e: v["gear"], lambda v, e: (GEARED, 2.0 * turns(e)),
    above=Imitated.SPRING,
)  # fmt: skip

EFFECT = Effect(
    kind=Kind.FORCE,
    summary="weight of an arm or unbalanced load behind a gear",
    equation="F = -(sine sin(q/gear) + cosine cos(q/gear))",
    source="Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, sections 6.1 and 6.4",
    parameters=(
        Parameter(
            "gear", "1", 10.0, GEARED, 1e5, "turns of the motor in one of the load",
            scan=gears_to_try,
        ),
        Parameter("sine", "N", 0.0, -MOST, MOST, "m g l cos q0 over the gear", strength=True),
        Parameter("cosine", "N", 0.0, -MOST, MOST, "-m g l sin q0 over the gear", strength=True),
    ),
    law=law,
    knees=(ROUND,),
    of_joints=False,
    fingerprint="residual is a sine of the angle over turns of the motor, alike in both directions",
    excited_by="slow moves over at least half a turn of the load",
    suits=lambda present, turns: turns,
)  # fmt: skip
