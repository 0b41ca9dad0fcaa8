"""Force that is a sinusoid in time: floor vibration, a pump, the mains.

F = a sin(2 pi f t) + b cos(2 pi f t), t from the start of the log. Its mean over the
sample acts: the value in the middle times sinc(f dt), so that steps of any length give the same
impulse. One term of the Fourier series of a periodic force; D. J. Inman, Engineering Vibration,
section 3.3 (response to an arbitrary periodic input).
"""

from math import cos, pi, sin

from twin.effect import DT, MOST, OUT, TIME, Effect, Excitation, Kind, Parameter
from twin.knee import Imitated
from twin.law_parts import swings_at


def law(p, s, io):
    half = pi * p[0] * io[DT]
    phase = 2.0 * pi * p[0] * io[TIME] + half
    mean = sin(half) / half
    io[OUT] = mean * (p[1] * sin(phase) + p[2] * cos(phase))


def frequencies(e: Excitation) -> tuple[float, ...]:
    """Spectral lines in the force of the log; a coarse grid where there are none."""
    return e.lines or tuple(0.5 * 1.1**k for k in range(50))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="sinusoidal force in time: floor vibration, pump, mains",
    equation="F = a sin(2 pi f t) + b cos(2 pi f t)",
    source="Fourier series of a periodic force; Inman, Engineering Vibration, section 3.3",
    parameters=(
        Parameter("f", "Hz", 10.0, 1e-2, 5e3, "frequency", scan=frequencies),
        Parameter("a", "N", 0.0, -MOST, MOST, "sine term", strength=True),
        Parameter("b", "N", 0.0, -MOST, MOST, "cosine term", strength=True),
    ),
    law=law,
    knees=(swings_at("f", Imitated.DRIFT, Imitated.NOTHING),),
    several=True,
    fingerprint="residual repeats in time at one frequency, whatever the axis does",
    excited_by="any motion; a log of many periods, also at rest",
)
