"""A load put on during the log: F = a from ``begin`` on, risen within 50 ms."""

from math import tanh

from twin.effect import OUT, TIME, Effect, Kind, Parameter


def law(p, s, io):
    io[OUT] = 0.5 * p[0] * (1.0 + tanh((io[TIME] - p[1]) / 0.05))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="a load put on during the log",
    equation="F = a for t > begin",
    source="this project's choice",
    parameters=(
        Parameter("a", "N", 0.0, -1e3, 1e3, "load", strength=True),
        Parameter("begin", "s", 6.0, 0.0, 1e4, "when it is put on"),
    ),
    law=law,
    fingerprint="none",
    excited_by="any motion",
)
