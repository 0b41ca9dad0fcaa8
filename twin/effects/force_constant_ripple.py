"""Force constant of the motor that varies with position at the magnet pitch.

u_actual = u (1 + sum_{k=1,2} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p)), p the magnet pitch.
Ripple of the thrust constant in proportion to current, beside the cogging that does not depend on
it: C. Rohrig, A. Jochheim, "Identification and compensation of force ripple in linear permanent
magnet motors", Proc. American Control Conference 2001.
"""

from math import cos, pi, sin

from twin.effect import LEAST, MOST, Effect, Excitation, Kind, Parameter, U, X

CYCLES = 70  # most over the travel that are tried before a model tells them


def law(p, s, io):
    phase = 2.0 * pi * io[X] / p[0]
    sine = sin(phase)
    cosine = cos(phase)
    twice = 2.0 * sine * cosine
    ripple = p[1] * sine + p[2] * cosine + p[3] * twice + p[4] * (cosine * cosine - sine * sine)
    io[U] += io[U] * ripple


def pitches(e: Excitation) -> tuple[float, ...]:
    """Pitches to try: those at which force over thrust repeats, which may be those of a harmonic.

    Before a model tells them, half a cycle apart over the travel, from three cycles on.
    """
    if e.thrust_pitches:
        return tuple(k * pitch for pitch in e.thrust_pitches for k in (1, 2))
    return tuple(2.0 * e.travel / k for k in range(6, 2 * CYCLES + 1))


EFFECT = Effect(
    kind=Kind.ACTUATION,
    summary="force constant varies with position at the magnet pitch",
    equation="u_actual = u (1 + sum_{k=1,2} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p))",
    source="Rohrig, Jochheim 2001, force ripple in proportion to current",
    parameters=(
        Parameter("p", "m", 0.024, LEAST, MOST, "magnet pitch", scan=pitches, period=True),
        *(
            Parameter(f"{c}{k}", "1", 0.0, -0.5, 0.5, f"{f} term of harmonic {k}", strength=True)
            for k in (1, 2)
            for c, f in (("a", "sine"), ("b", "cosine"))
        ),
    ),
    law=law,
    several=True,
    fingerprint="residual repeats along the track in proportion to the motor force there",
    excited_by="strong accelerations both ways at many places, over many magnet pitches",
)
