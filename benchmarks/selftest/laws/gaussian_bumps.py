"""Roller bumps of Gaussian form that let go at standstill.

F = -ahead t b(x) forwards, -behind t b(x) backwards, b = exp(-(d / 0.3 width)^2), d the distance
from the nearest bump, t = tanh(v / 0.2 mm/s). Width and heights mean what they mean for the bumps
of the model; the form is unlike theirs.
"""

from math import exp, floor, tanh

from twin.curve import Coordinate, Curve
from twin.effect import OUT, Effect, Kind, Parameter, V, X

SLIDES = 2e-4  # m/s


def law(p, s, io):
    turns = (io[X] - p[2]) / p[0]
    r = (turns - floor(turns + 0.5)) * p[0] / (0.3 * p[1])
    height = p[3] if io[V] > 0.0 else p[4]
    io[OUT] = -height * tanh(io[V] / SLIDES) * exp(-min(r * r, 40.0))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="Gaussian roller bumps that let go at standstill",
    equation="F = -height(direction) tanh(v/0.2 mm/s) exp(-(d/(0.3 width))^2)",
    source="this project's choice",
    parameters=(
        Parameter("pitch", "m", 0.03, 1e-4, 10.0, "distance between bumps", fixed=True),
        Parameter("width", "m", 0.004, 1e-4, 0.1, "full width of a bump"),
        Parameter("phase", "m", 0.0, -1.0, 1.0, "position of one bump"),
        Parameter("ahead", "N", 0.0, -1e3, 1e3, "height moving forwards", strength=True),
        Parameter("behind", "N", 0.0, -1e3, 1e3, "height moving backwards", strength=True),
    ),
    law=law,
    curves=(Curve(Coordinate.POSITION, period="pitch", by_direction=True),),
    fingerprint="none",
    excited_by="any motion",
)
