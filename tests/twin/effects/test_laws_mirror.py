"""Space has no preferred direction: seen in a mirror, an effect with mirrored parameters is itself.

Positions, speeds, accelerations and forces change sign; a factor does not. So do whole runs of the
stage, in both simulations, and setpoints.
"""

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pytest
from effect_runs import CATALOGUE
from reference_kit import Columns, Values
from test_laws_effects import columns, stepped, values_of

from twin.effect import DRY, OUT, READING, STATIC, VISCOUS, Kind, U

VECTORS = ("x", "v", "u", "x_other", "v_other", "a_other", "friction", "hold", "reading", "net",
           "acc")  # fmt: skip


def negated(*names: str) -> Callable[[Values], dict[str, float]]:
    return lambda p: {n: -v if n in names else v for n, v in p.items()}


def mirrored_track(p: Values) -> dict[str, float]:
    """cos(k pi (1 - s)) = (-1)^k cos(k pi s)."""
    odd = {f"c{k}": -p[f"c{k}"] for k in (1, 3, 5)}
    return {**p, **odd, "start": -p["start"] - p["length"]}


def mirrored_map(p: Values) -> dict[str, float]:
    """A, B and C change sign; D and E, which go with the direction, do not; knots turn round."""
    turned = {**p, "start": -p["start"] - p["length"]}
    for key, sign in (("x", -1.0), ("d", 1.0), ("e", 1.0), ("v", -1.0)):
        names = [n for n in p if n.startswith(f"{key}_")]
        turned |= {n: sign * p[m] for n, m in zip(names, names[::-1], strict=True)}
    return turned | {n: -v for n, v in p.items() if n.startswith("t_")}


def mirrored_residual(p: Values) -> dict[str, float]:
    """Each term is odd or even in place, speed and each memory."""
    turned = {**p, "start": -p["start"] - p["length"]}
    for n, v in p.items():
        if n.startswith("c_"):
            turned[n] = v * -((-1.0) ** sum(map(int, n.split("_")[1:])))
    return turned


def mirrored_curve(p: Values) -> dict[str, float]:
    """E changes sign, O goes with the direction and does not; the knots turn round."""
    turned = {**p, "offset": -p["offset"] - 1.0}
    for key, sign in (("e", -1.0), ("o", 1.0)):
        names = [n for n in p if n.startswith(f"{key}_")]
        turned |= {n: sign * p[m] for n, m in zip(names, names[::-1], strict=True)}
    return turned


# What a mirror does to the parameters; nothing where the effect is not listed.
MIRRORS = {
    "asymmetric_friction": negated("coulomb", "viscous"),
    "cable_slab": negated("offset", "k2"),
    "cogging": negated("b1", "b2", "b3"),
    "constant_force": negated("F0"),
    "encoder_ripple": negated("b1", "b2"),
    "force_constant_ripple": negated("a1", "a2"),
    "gravity": negated("cosine"),
    "load_dependent_friction": negated("offset"),
    "periodic_disturbance": negated("a", "b"),
    "spring": negated("middle", "offset", "k2"),
    "end_stop": lambda p: {**p, "low": -p["high"], "high": -p["low"]},
    "roller_spikes": lambda p: {
        **p, "phase": -p["phase"], "ahead": p["behind"], "behind": p["ahead"],
    },
    "position_dependent_friction": mirrored_track,
    "empirical_map": mirrored_map,
    "free_curve": mirrored_curve,
    "learned_residual": mirrored_residual,
}  # fmt: skip
# At exact halves of a step rounding is upwards on both sides; no other law knows its direction.
SIGNS = {OUT: -1.0, U: -1.0, READING: -1.0, DRY: 1.0, STATIC: 1.0, VISCOUS: 1.0}


def mirrored(name: str, values: Values) -> dict[str, float]:
    return MIRRORS.get(name, dict)(values)


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_mirrored_law_gives_the_mirrored_force(name: str) -> None:
    effect = CATALOGUE[name]
    q = columns(0.5, effect.kind is Kind.FRICTION)
    seen = replace(q, **{f.name: -getattr(q, f.name) for f in fields(Columns) if f.name in VECTORS})
    values = values_of(effect)
    turned = mirrored(name, values)
    assert mirrored(name, turned) == values, "a mirror's mirror"
    _, one = stepped(effect, values, q)
    _, other = stepped(effect, turned, seen)
    for slot, sign in SIGNS.items():
        size = 1e-12 * np.abs(one[:, slot]).max()
        np.testing.assert_allclose(other[:, slot], sign * one[:, slot], rtol=0, atol=size)
    if name in MIRRORS:  # its parameters do matter
        _, plain = stepped(effect, values, seen)
        assert any(not np.allclose(plain[:, s], SIGNS[s] * one[:, s]) for s in SIGNS), "blind"
