"""Resolution of the encoder: the reading is the nearest multiple of a step.

reading = step floor(x/step + 1/2).
B. Widrow, I. Kollar, Quantization Noise (2008), section 1.1: uniform rounding quantizer.
Rounding a reading again does not change it, so the force residual does not depend on the step: it
is determined from the readings and not fitted.
"""

from math import floor

from twin.effect import MOST, READING, Effect, Kind, Parameter

EXACT = 2.0**52  # steps above which a double has no digits left to round


def law(p, s, io):
    if p[0] > 0.0 and abs(io[READING]) < EXACT * p[0]:
        io[READING] = p[0] * floor(io[READING] / p[0] + 0.5)


EFFECT = Effect(
    kind=Kind.SENSING,
    summary="resolution step of the encoder",
    equation="reading = step floor(x/step + 1/2)",
    source="Widrow, Kollar, Quantization Noise, section 1.1",
    parameters=(
        Parameter(
            "step", "m", 0.0, 0.0, MOST, "resolution", strength=True, fixed=True,
            start_rule=lambda e: e.resolution,
        ),
    ),
    law=law,
    fingerprint="readings take few values; speed and command are rough, most so at low speed",
    excited_by="slow motion, where a step lasts many samples",
)  # fmt: skip
