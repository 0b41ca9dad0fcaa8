"""The stage stands on a vibration isolator: the frame, a mass on a spring and damper, recoils.

(M + m)(b'' + 2 damping w b' + w^2 b) = -m q'';  F_added = -m b'', q the axis as its encoder on the
frame reads it, b the frame, M + m all mass on the isolator, recoil = m/(M + m), w = 2 pi frequency.
From m (q'' + b'') = F and M b'' + C b' + K b = -F: limited mass of the stationary machine part in
A. M. Rankers, Machine Dynamics in Mechatronic Systems, PhD thesis, University of Twente (1997).
``frequency`` and ``damping`` are those of the isolator with everything aboard at rest.
For the encoder this equals a load on a spring with load = recoil (same poles and zeros); only the
frequency distinguishes the two.

The step is MuJoCo's: spring from the position, damper implicit. Its spring and damper are those for
which the whole, axis held, oscillates and decays over a sample exactly as the equation
(J. L. Cieslinski, B. Ratkiewicz, Adv. Difference Eq. 2006).
"""

from math import log

from twin.effect import DT, MOVED, NET, OUT, WHEN, Effect, Excitation, Kind, Parameter
from twin.knee import Imitated
from twin.law_parts import oscillator, swings_at


def law(p, s, io):
    spring, damper = oscillator(p[1], p[2], p[0], io[DT])
    rate = 1.0 / io[DT]
    pull = (spring * s[0] * rate + damper * s[1]) * rate
    acceleration = -(pull + p[0] * io[NET]) / (1.0 - p[0] + damper)
    if io[WHEN] > 0.0:
        s[1] += io[DT] * acceleration
        s[0] += io[DT] * s[1]
    io[OUT] = -io[MOVED] * acceleration


def attach(mount, values):
    mount.stand(values["recoil"], values["frequency"], values["damping"])


def frequencies(e: Excitation) -> tuple[float, ...]:
    """Frequencies to try: steps of a fifth, of what the log's length and its samples resolve."""
    lowest, highest = max(0.3, 2.0 / e.duration), min(100.0, 0.25 / e.period)
    return tuple(lowest * 1.2**k for k in range(max(int(log(highest / lowest) / log(1.2)) + 1, 1)))


EFFECT = Effect(
    kind=Kind.STRUCTURE,
    summary="the frame on its vibration isolator recoils from the stage's forces",
    equation="b'' + 2 damping w b' + w^2 b = -recoil q'';  F = -m b'';  w = 2 pi frequency",
    source="Rankers 1997, limited mass of the stationary part; step: Cieslinski, Ratkiewicz 2006",
    parameters=(
        Parameter(
            "recoil", "1", 0.0, 0.0, 0.9, "moved mass over all mass on the isolator", strength=True
        ),
        Parameter(
            "frequency", "Hz", 3.0, 0.05, 100.0, "of the isolator with everything aboard",
            scan=frequencies,
        ),
        Parameter(
            "damping", "1", 0.1, 1e-4, 0.5, "damping ratio of the isolator",
            scan=lambda e: (0.1,),
        ),
    ),
    states=("displacement", "speed"),
    law=law,
    knees=(swings_at("frequency", Imitated.INERTIA, Imitated.NOTHING),),
    of_joints=False,
    attach=attach,
    fingerprint="residual swings at a few hertz after every acceleration, also at rest",
    excited_by="fast moves with pauses of a second between them",
)  # fmt: skip
