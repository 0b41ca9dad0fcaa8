"""Forces outside the catalogue, for tests: a file of each, and machines that have them."""

from __future__ import annotations

from pathlib import Path

from twin.effect import Effect
from twin.effects import load_catalogue

HEAD = '''\
"""A force of no known effect, for tests."""

from math import exp, sin

from twin.effect import OUT, Effect, Kind, Parameter, V, X


def law(p, s, io):
    place = (io[X] - 0.02) / 0.03
    {body}


EFFECT = Effect(
    kind=Kind.FORCE, summary="test", equation="F = a f(x, v)", source="test", law=law,
    parameters=(Parameter("a", "N", 0.0, -10.0, 10.0, "height", strength=True),),
    fingerprint="none", excited_by="none",
)
'''

BODIES = {
    "hill": "io[OUT] = -p[0] * exp(-place * place) * io[V] / 0.1",
    "sawtooth": "io[OUT] = p[0] * (2.0 * ((io[X] / 0.09) % 1.0) - 1.0)",
    "chirp": "io[OUT] = p[0] * sin(10.0 * (io[X] + 0.15) + 200.0 * (io[X] + 0.15) ** 2)",
    "bend": "io[OUT] = -p[0] * exp(-0.25 * place * place) * 100.0 * io[V] * abs(io[V])",
}


def foreign(name: str, folder: Path) -> Effect:
    """The effect of that name, written into a folder as a user's own file."""
    file = folder / f"{name}.py"
    file.write_text(HEAD.format(body=BODIES[name]))
    return load_catalogue([file])[name]
