"""Part of the moved mass hangs on a spring and damper; motor and encoder are on the other part.

s'' + 2 damping w s' + w^2 s = -a;  F_added = -load m s'', s the load's displacement from the
motor side, a the acceleration of the motor side, w = 2 pi frequency. With the motor side held the
load swings at ``frequency`` (the antiresonance seen by the motor); free, both swing at frequency/
sqrt(1 - load) (the resonance). Two-mass model of actuator flexibility: A. M. Rankers, Machine
Dynamics in Mechatronic Systems, PhD thesis, University of Twente (1997), chapter on basic dynamic
phenomena.

The step is MuJoCo's: spring from the position, damper implicit. Its spring and damper are those for
which the held load oscillates and decays over a sample exactly as the equation (J. L. Cieslinski,
B. Ratkiewicz, "On simulations of the classical harmonic oscillator equation by difference
equations", Adv. Difference Eq. 2006); above a third of the sampling rate they are held where the
step is stable.
"""

from math import log

from twin.effect import Effect, Excitation, Kind, Parameter
from twin.knee import Imitated
from twin.law_parts import hung_load, swings_at


def law(p, s, io):
    hung_load(s, io, p[0], p[1], p[2], s[0])


def attach(mount, values):
    mount.hang(values["load"], values["frequency"], values["damping"])


def frequencies(e: Excitation) -> tuple[float, ...]:
    """Frequencies to try: steps of an eighth, up to what the log's blocks resolve.

    From those of joints behind gears on.
    """
    highest = max(min(400.0, 0.25 / e.period), 20.0)
    return tuple(4.0 * 1.125**k for k in range(int(log(highest / 4.0) / log(1.125)) + 1))


EFFECT = Effect(
    kind=Kind.STRUCTURE,
    summary="part of the moved mass hangs on a spring and damper",
    equation="s'' + 2 damping w s' + w^2 s = -a;  F = -load m s'';  w = 2 pi frequency",
    source="Rankers 1997, actuator flexibility; step: Cieslinski, Ratkiewicz 2006",
    parameters=(
        Parameter("load", "1", 0.0, 0.0, 0.9, "part of the mass behind the spring", strength=True),
        Parameter(
            "frequency", "Hz", 60.0, 0.05, 2000.0, "of the load with the motor side held",
            scan=frequencies,
        ),
        Parameter(
            "damping", "1", 0.03, 1e-4, 0.5, "damping ratio with the motor side held",
            scan=lambda e: (0.03,),
        ),
    ),
    states=("displacement", "speed"),
    law=law,
    knees=(swings_at("frequency", Imitated.INERTIA, Imitated.INERTIA),),
    attach=attach,
    fingerprint="residual rings at one frequency after every change of acceleration",
    excited_by="moves with high jerk, and a force sweep through the resonance",
)  # fmt: skip
