"""Interpolation error of the encoder, periodic in position within its signal period.

reading = x + sum_{k=1,2} a_k sin(2 pi k x/period) + b_k cos(2 pi k x/period). Offsets of the two
quadrature signals give the first harmonic, unequal amplitudes and a phase error the second:
P. L. M. Heydemann, "Determination and correction of quadrature fringe measurement errors in
interferometers", Applied Optics 20 (1981), 3382-3384, to first order in the errors; the constant
of a phase error is left out, a shift of zero.
"""

from twin.effect import LEAST, MOST, READING, Effect, Kind, Parameter
from twin.law_parts import columns_of, harmonic_terms, harmonics, repeats_after, ripple

SCALES = (2e-6, 4e-6, 8e-6, 1e-5, 1.6e-5, 2e-5, 4e-5, 1e-4)  # m; longer ones show as ripples


def law(p, s, io):
    io[READING] += ripple(p, io[READING])


def columns(p, s, io):
    columns_of(io, harmonics(io[READING], p[0])[:4])


EFFECT = Effect(
    kind=Kind.SENSING,
    summary="interpolation error of the encoder, periodic in position",
    equation="reading = x + sum_{k=1,2} a_k sin(2 pi k x/period) + b_k cos(2 pi k x/period)",
    source="Heydemann 1981, quadrature errors to first order",
    parameters=(
        Parameter(
            "period", "m", 2e-5, LEAST, MOST, "signal period of the scale", period=True,
            scan=lambda e: (*SCALES, *e.ripples),  # and those at which this log repeats
        ),
        *harmonic_terms(2, "m"),
    ),
    law=law,
    knees=(repeats_after("period"),),
    columns=columns,
    fingerprint="command and speed ripple at a frequency of speed over the signal period",
    excited_by="slow constant speeds over many signal periods",
)  # fmt: skip
