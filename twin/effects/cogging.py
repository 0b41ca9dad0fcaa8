"""Cogging of the linear motor: a force periodic in position, independent of current.

F = sum_{k=1..3} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p), p the pole pitch, or the slot pitch.
J. F. Gieras, Z. J. Piech, B. Tomczuk, "Linear Synchronous Motors", 2nd ed. (2011): the cogging
force is a Fourier series in position with period set by pole pitch and slot pitch.
"""

from collections.abc import Mapping
from math import cos, hypot, pi, sin

from twin.curve import Coordinate, Curve
from twin.effect import COLUMNS, LEAST, MOST, OUT, Effect, Excitation, Kind, Parameter, X

CYCLES = 120  # most over the travel that are tried before a model tells them


def waves(p, io):
    """Sine and cosine of each harmonic, in the order of the strengths."""
    phase = 2.0 * pi * io[X] / p[0]
    sin1 = sin(phase)
    cos1 = cos(phase)
    sin2 = 2.0 * sin1 * cos1
    cos2 = cos1 * cos1 - sin1 * sin1
    return sin1, cos1, sin2, cos2, sin2 * cos1 + cos2 * sin1, cos2 * cos1 - sin2 * sin1


def law(p, s, io):
    sin1, cos1, sin2, cos2, sin3, cos3 = waves(p, io)
    io[OUT] = p[1] * sin1 + p[2] * cos1 + p[3] * sin2 + p[4] * cos2 + p[5] * sin3 + p[6] * cos3


def columns(p, s, io):
    io[COLUMNS] = 6
    for j, wave in enumerate(waves(p, io)):
        io[COLUMNS + 1 + 2 * j], io[COLUMNS + 2 + 2 * j] = j, wave


def pitches(e: Excitation) -> tuple[float, ...]:
    """Pitches to try: those at which the force repeats, which may be those of a harmonic.

    Before a model tells them, half a cycle apart over the travel, from three cycles on.
    """
    if e.pitches:
        return tuple(k * pitch for pitch in e.pitches for k in (1, 2, 3))
    return tuple(2.0 * e.travel / k for k in range(6, 2 * CYCLES + 1))


def simplest(values: Mapping[str, float]) -> dict[str, float]:
    """The shorter pitch where only one higher harmonic of the pitch is present."""
    size = {k: hypot(values[f"a{k}"], values[f"b{k}"]) for k in (1, 2, 3)}
    for k in (2, 3):
        others = sum(size[j] for j in (1, 2, 3) if j != k)
        if others < 0.1 * size[k]:
            zero = {f"{c}{j}": 0.0 for c in "ab" for j in (2, 3)}
            return {"p": values["p"] / k, "a1": values[f"a{k}"], "b1": values[f"b{k}"], **zero}
    return dict(values)


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="force periodic in position at the magnet pitch, harmonics 1 to 3",
    equation="F = sum_{k=1..3} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p)",
    source="Gieras, Piech, Tomczuk, Linear Synchronous Motors, 2011 (cogging as a Fourier series)",
    parameters=(
        Parameter("p", "m", 0.024, LEAST, MOST, "magnet pitch", scan=pitches, period=True),
        *(
            Parameter(
                f"{c}{k}", "N", 0.0, -MOST, MOST, f"{f} term of harmonic {k}", strength=True,
                screened=k == 1,
            )
            for k in (1, 2, 3)
            for c, f in (("a", "sine"), ("b", "cosine"))
        ),
    ),
    law=law,
    columns=columns,
    simplest=simplest,
    curves=(Curve(Coordinate.POSITION, period="p"),),
    several=True,
    fingerprint="residual repeats along the track, the same in both directions and at every force",
    excited_by="constant-speed passes over many magnet pitches",
)  # fmt: skip
