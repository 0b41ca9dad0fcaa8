"""Force whose frequency rises in time: F = a sin(2 pi (f t + 1/2 rate t^2))."""

from math import pi, sin

from twin.effect import OUT, TIME, Effect, Kind, Parameter


def law(p, s, io):
    time = io[TIME]
    io[OUT] = p[0] * sin(2.0 * pi * time * (p[1] + 0.5 * p[2] * time))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="force whose frequency rises in time",
    equation="F = a sin(2 pi (f t + rate t^2 / 2))",
    source="this project's choice",
    parameters=(
        Parameter("a", "N", 0.0, -1e3, 1e3, "amplitude", strength=True),
        Parameter("f", "Hz", 1.5, 0.1, 100.0, "frequency at the start"),
        Parameter("rate", "Hz/s", 0.8, 0.01, 100.0, "rise of the frequency"),
    ),
    law=law,
    fingerprint="none",
    excited_by="any motion",
)
