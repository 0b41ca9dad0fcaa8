"""Hysteresis in pre-sliding: frictions that remember where they turned close inner loops."""

from dataclasses import replace

import numpy as np
import pytest
from friction_runs import PAPER, along, at_turns, friction, time

from twin.laws.trials import Motion, trace

A, B, D = 9e-6, 5e-6, 12e-6  # m; turning points within the pre-sliding


@pytest.mark.parametrize("name", ["leuven", "modified_leuven", "gms"])
def test_an_inner_loop_closes_and_leaves_no_trace(name: str) -> None:
    """Back at A the force is what it was; beyond A it goes on as if there had been no loop."""
    first, inside, again = at_turns(friction(name), (A, B, A))
    assert first - inside > 0.2  # a loop worth the name
    assert again == pytest.approx(first, abs=2e-4)
    straight = at_turns(friction(name), (D,))[-1]
    with_loops = at_turns(friction(name), (A, B, A, B, A, 0.8 * A, A, D))[-1]
    assert with_loops == pytest.approx(straight, abs=1e-3)


SHARP = {"Fc": 1.5, "Fs": 1.5, "b": 1.5, "m": 50.0}  # z follows x but close to sliding
TURNS = 16  # that the stack holds


def madelung(turns: list[float]) -> list[float]:
    """Force at each turn by Madelung's rules, with the list of all turns, on the law's curve."""
    scale = SHARP["Fs"] / SHARP["b"]

    def curve(z: float) -> float:
        return scale * np.log1p(PAPER["sigma0"] * z / scale)

    kept: list[tuple[float, float]] = []
    out, before = [], 0.0
    for x in turns:
        way = 1 if x > before else -1
        while kept and way * x >= way * (kept[-2][0] if len(kept) > 1 else -kept[-1][0]):
            del kept[-2:]
        if kept:
            at, force = kept[-1]
            out.append(force + way * 2.0 * curve(way * (x - at) / 2.0))
        else:
            out.append(way * curve(way * x))
        kept.append((x, out[-1]))
        before = x
    return out


def spiral(turns: int, shrink: float = 0.8) -> list[float]:
    """Ever smaller swings, none of which closes a loop, and back to where they began."""
    return [*(1e-5 * shrink**i * (-1) ** i for i in range(turns)), 1e-5]


def test_leuven_follows_madelungs_rules() -> None:
    rng = np.random.default_rng(5)
    turns = [rng.uniform(0.0, 1e-5) * (-1) ** i for i in range(60)]
    found = at_turns(friction("leuven", **SHARP), turns, leg=200)
    np.testing.assert_allclose(found, madelung(turns), atol=2e-4)


@pytest.mark.parametrize("turns", [16, 40])
def test_leuvens_stack_drops_the_smallest_loops_when_it_is_full(turns: int) -> None:
    found = at_turns(friction("leuven", **SHARP), spiral(turns), leg=200)
    kept = min(turns, TURNS)
    np.testing.assert_allclose(found[:kept], madelung(spiral(turns))[:kept], atol=2e-4)
    assert np.all(np.abs(found) < SHARP["Fs"])
    assert found[-1] == pytest.approx(found[0], abs=5e-4)  # the outermost loop closes


def test_leuvens_loops_close_nearly_where_large_ones_had_to_be_dropped() -> None:
    """Forty swings that hardly shrink: the force errs by less than the smallest loop is high."""
    found = at_turns(friction("leuven", **SHARP), spiral(40, shrink=0.97), leg=200)
    assert abs(found[-1] - found[0]) < 0.1 * np.ptp(found[-3:-1])


@pytest.mark.parametrize(("turns", "least", "most"), [(10, 9, 9), (40, 14, 16)])
def test_leuvens_stack_is_bounded(turns: int, least: int, most: int) -> None:
    leuven = friction("leuven", **SHARP)
    v = np.repeat([1e-4 * (1.0 - i / 60) * (-1) ** i for i in range(turns)], 10)
    still = np.zeros_like(v)
    states = trace(leuven.effect, leuven.values, Motion(1e-3, still, v, still)).states[-1]
    assert least <= states[leuven.effect.states.index("depth")] <= most


@pytest.mark.parametrize("name", ["dahl", "lugre", "gms", "leuven", "modified_leuven"])
def test_a_hundredth_of_a_change_makes_a_hundredth_of_the_force(name: str) -> None:
    """Sliding, where rounding must not decide what is remembered: a fit follows derivatives."""
    rng, t = np.random.default_rng(8), time(1.0)
    slow = sum(a * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for a, f in ((1, 2), (1, 7)))
    law = friction(name)
    free = [p.name for p in law.effect.parameters if law.values[p.name] and not p.fixed]

    def change(parameter: str, part: float) -> np.ndarray:
        more = replace(law, values={**law.values, parameter: law.values[parameter] * (1 + part)})
        return along(more, 5e-3 * slow, 1e-4) - along(law, 5e-3 * slow, 1e-4)

    for parameter in free:
        large, small = change(parameter, 1e-5), change(parameter, 1e-7)
        assert np.linalg.norm(small) < 0.02 * np.linalg.norm(large) + 1e-12, parameter
