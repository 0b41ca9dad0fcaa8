"""Interpolation error of the encoder, periodic in position within its signal period.

reading = x + sum_{k=1,2} a_k sin(2 pi k x/period) + b_k cos(2 pi k x/period). Offsets of the two
quadrature signals give the first harmonic, unequal amplitudes and a phase error the second:
P. L. M. Heydemann, "Determination and correction of quadrature fringe measurement errors in
interferometers", Applied Optics 20 (1981), 3382-3384, to first order in the errors; the constant
of a phase error is left out, a shift of zero.
"""

from math import cos, pi, sin

from twin.effect import COLUMNS, LEAST, MOST, READING, Effect, Excitation, Kind, Parameter

SCALES = (2e-6, 4e-6, 8e-6, 1e-5, 1.6e-5, 2e-5, 4e-5, 1e-4)  # m; longer ones show as ripples


def waves(p, io):
    """Sine and cosine of each harmonic, in the order of the strengths."""
    phase = 2.0 * pi * io[READING] / p[0]
    sine = sin(phase)
    cosine = cos(phase)
    return sine, cosine, 2.0 * sine * cosine, cosine * cosine - sine * sine


def law(p, s, io):
    sine, cosine, sine2, cosine2 = waves(p, io)
    io[READING] += p[1] * sine + p[2] * cosine + p[3] * sine2 + p[4] * cosine2


def columns(p, s, io):
    io[COLUMNS] = 4
    for j, wave in enumerate(waves(p, io)):
        io[COLUMNS + 1 + 2 * j], io[COLUMNS + 2 + 2 * j] = j, wave


def periods(e: Excitation) -> tuple[float, ...]:
    """Signal periods of common scales, and those at which this log repeats."""
    return (*SCALES, *e.ripples)


EFFECT = Effect(
    kind=Kind.SENSING,
    summary="interpolation error of the encoder, periodic in position",
    equation="reading = x + sum_{k=1,2} a_k sin(2 pi k x/period) + b_k cos(2 pi k x/period)",
    source="Heydemann 1981, quadrature errors to first order",
    parameters=(
        Parameter(
            "period", "m", 2e-5, LEAST, MOST, "signal period of the scale", scan=periods,
            period=True,
        ),
        *(
            Parameter(
                f"{c}{k}", "m", 0.0, -MOST, MOST, f"{f} term of harmonic {k}", strength=True,
                screened=k == 1,
            )
            for k in (1, 2)
            for c, f in (("a", "sine"), ("b", "cosine"))
        ),
    ),
    law=law,
    columns=columns,
    fingerprint="command and speed ripple at a frequency of speed over the signal period",
    excited_by="slow constant speeds over many signal periods",
)  # fmt: skip
