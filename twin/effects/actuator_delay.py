"""Dead time between command and force, also a fraction of a sample.

u_actual(t) = u(t - tau). The command is held over each sample, so its mean over a sample, delayed
by n + f samples, is exactly (1 - f) u[k-n] + f u[k-n-1].
K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3 (sampling a delay).
"""

from twin.effect import DT, INDEX, Effect, Kind, Parameter, U

SLOTS = 64  # past commands kept; the longest delay is SLOTS - 2 samples


def law(p, s, io):
    if io[INDEX] == 0.0:  # before the log began the command was what it is at its start
        for i in range(SLOTS):
            s[i] = io[U]
    now = int(io[INDEX]) % SLOTS
    s[now] = io[U]
    samples = min(p[0] / io[DT], SLOTS - 2.0)
    whole = int(samples)
    part = samples - whole
    if samples > 0.0:
        newer = s[(now - whole + SLOTS) % SLOTS]
        older = s[(now - whole - 1 + SLOTS) % SLOTS]
        io[U] = newer + part * (older - newer)


EFFECT = Effect(
    kind=Kind.ACTUATION,
    summary="dead time between command and force",
    equation="u_actual(t) = u(t - tau)",
    source="Astrom and Wittenmark, Computer-Controlled Systems, section 2.3",
    parameters=(
        Parameter("tau", "s", 0.0, 0.0, 6e-3, "dead time", strength=True),
    ),
    states=tuple(f"past_{i}" for i in range(SLOTS)),
    law=law,
    fingerprint="residual follows the rate of change of the command, at every speed and place",
    dead_time=True,
    excited_by="moves with high jerk: the command must change fast",
)  # fmt: skip
