"""Force noise with a memory: F' = -F/memory + white noise, of RMS ``size``.

First-order Markov process, stepped exactly; its numbers are those of S. K. Park, K. W. Miller,
"Random number generators: good ones are hard to find", CACM 31 (1988), from ``seed``.
"""

from math import exp, floor, sqrt

from twin.effect import DT, OUT, Effect, Kind, Parameter

MODULUS = 2147483647.0


def law(p, s, io):
    draw = s[1] if s[1] > 0.0 else p[2]
    total = 0.0
    for _ in range(4):
        draw *= 16807.0
        draw -= MODULUS * floor(draw / MODULUS)
        total += draw / MODULUS - 0.5
    s[1] = draw
    kept = exp(-io[DT] / p[1])
    s[0] = kept * s[0] + sqrt(3.0 * (1.0 - kept * kept)) * total  # the sum has variance 1/3
    io[OUT] = p[0] * s[0]


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="force noise with a memory",
    equation="F' = -F/memory + w",
    source="first-order Markov process; Park, Miller 1988",
    parameters=(
        Parameter("size", "N", 0.0, 0.0, 1e3, "RMS", strength=True),
        Parameter("memory", "s", 0.01, 1e-4, 10.0, "time after which 1/e is left"),
        Parameter("seed", "1", 1.0, 1.0, 2147483646.0, "first of its numbers", fixed=True),
    ),
    states=("force", "draw"),
    law=law,
    fingerprint="none",
    excited_by="any motion",
)
