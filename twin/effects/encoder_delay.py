"""Reading older than its stamp.

reading(t) = x(t - tau), a straight line between the samples.
A dead time, as the actuator's (K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd ed.,
section 2.3, where the input is held instead); the straight line is a choice.
"""

from twin.effect import DT, INDEX, READING, Effect, Kind, Parameter

SLOTS = 64  # past positions kept; the longest delay is SLOTS - 2 samples


def law(p, s, io):
    if io[INDEX] == 0.0:  # before the log began the axis stood where it is at its start
        for i in range(SLOTS):
            s[i] = io[READING]
    now = int(io[INDEX]) % SLOTS
    s[now] = io[READING]
    samples = min(p[0] / io[DT], SLOTS - 2.0)
    whole = int(samples)
    part = samples - whole
    if samples > 0.0:
        newer = s[(now - whole + SLOTS) % SLOTS]
        older = s[(now - whole - 1 + SLOTS) % SLOTS]
        io[READING] = newer + part * (older - newer)


EFFECT = Effect(
    kind=Kind.SENSING,
    summary="reading older than its stamp",
    equation="reading(t) = x(t - tau)",
    source="Astrom and Wittenmark, Computer-Controlled Systems, section 2.3",
    parameters=(Parameter("tau", "s", 0.0, 0.0, 6e-3, "age of the reading", strength=True),),
    states=tuple(f"past_{i}" for i in range(SLOTS)),
    law=law,
    fingerprint="residual follows the jerk: the force comes before the acceleration it causes",
    dead_time=True,
    excited_by="moves with high jerk: the acceleration must change fast",
)
