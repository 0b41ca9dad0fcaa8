"""Hysteresis in pre-sliding: which friction models remember where they turned, and which forget."""

import numpy as np
import pytest
from effect_runs import CATALOGUE
from friction_runs import MEMORY, PAPER, at_turns, friction

from twin.effect import Effect
from twin.laws.trials import Motion as Given
from twin.laws.trials import trace

A, B, D = 9e-6, 5e-6, 12e-6  # m; turning points within the pre-sliding
CLOSES = pytest.mark.parametrize("name", MEMORY)


@CLOSES
def test_an_inner_loop_closes(name: str) -> None:
    """Out to A, back to B and out again: the force at A is what it was."""
    first, inside, again = at_turns(friction(name), (A, B, A))
    assert first - inside > 0.2  # a loop worth the name
    assert again == pytest.approx(first, abs=2e-4)


@CLOSES
def test_a_closed_inner_loop_leaves_no_trace(name: str) -> None:
    """Beyond A the force goes on as if the inner loop had never been."""
    straight = at_turns(friction(name), (D,))[-1]
    with_loops = at_turns(friction(name), (A, B, A, B, A, 0.8 * A, A, D))[-1]
    assert with_loops == pytest.approx(straight, abs=1e-3)


# --- the stack of the Leuven model ----------------------------------------------------------------


class Masing:
    """Hysteresis by the list of all its turns: Madelung's rules on the curve of the law."""

    def __init__(self, softening: float, static: float, stiffness: float) -> None:
        self.b, self.static, self.stiffness = softening, static, stiffness
        self.turns: list[tuple[float, float]] = []

    def curve(self, z: float) -> float:
        """The first branch, N."""
        scale = self.static / self.b
        return scale * np.log1p(self.stiffness * z / scale)

    def force(self, x: float, way: int) -> float:
        """Force N at x while moving that way (1 or -1)."""
        while self.turns:
            outer = self.turns[-2][0] if len(self.turns) > 1 else -self.turns[-1][0]
            if way * x < way * outer:
                break
            del self.turns[-2:]
        if not self.turns:
            return way * self.curve(way * x)
        at, force = self.turns[-1]
        return force + way * 2.0 * self.curve(way * (x - at) / 2.0)


SHARP = {"Fc": 1.5, "Fs": 1.5, "b": 1.5, "m": 50.0}  # z follows x but close to sliding


def masing_at_turns(turns: list[float]) -> list[float]:
    memory = Masing(SHARP["b"], SHARP["Fs"], PAPER["sigma0"])
    out, before = [], 0.0
    for x in turns:
        way = 1 if x > before else -1
        out.append(memory.force(x, way))
        memory.turns.append((x, out[-1]))
        before = x
    return out


def test_leuven_follows_madelungs_rules() -> None:
    rng = np.random.default_rng(5)
    turns = []
    for i in range(60):
        turns.append(rng.uniform(0.0, 1e-5) * (-1) ** i)
    found = at_turns(friction("leuven", **SHARP), turns, leg=200)
    np.testing.assert_allclose(found, masing_at_turns(turns), atol=2e-4)


def spiral(turns: int, shrink: float = 0.8) -> list[float]:
    """Ever smaller swings, none of which closes a loop."""
    return [1e-5 * shrink**i * (-1) ** i for i in range(turns)]


@pytest.mark.parametrize("turns", [10, 16, 40])
def test_leuvens_stack_drops_the_smallest_loops_when_it_is_full(turns: int) -> None:
    swings = spiral(turns)
    found = at_turns(friction("leuven", **SHARP), [*swings, 1e-5], leg=200)
    kept = min(turns, 16)
    np.testing.assert_allclose(found[:kept], masing_at_turns(swings)[:kept], atol=2e-4)
    assert np.all(np.abs(found) < SHARP["Fs"])
    assert found[-1] == pytest.approx(found[0], abs=5e-4)  # the outermost loop closes


def test_leuvens_loops_close_nearly_where_large_ones_had_to_be_dropped() -> None:
    """Forty swings that hardly shrink: the force errs by less than the smallest loop is high."""
    swings = spiral(40, shrink=0.97)
    found = at_turns(friction("leuven", **SHARP), [*swings, 1e-5], leg=200)
    assert abs(found[-1] - found[0]) < 0.1 * np.ptp(found[-3:-1])


def stack_depth(effect: Effect, turns: int) -> float:
    v = np.repeat([1e-4 * (1.0 - i / 60) * (-1) ** i for i in range(turns)], 10)
    still = np.zeros_like(v)
    values = friction(effect.name, **SHARP).values
    return trace(effect, values, Given(1e-3, still, v, still)).states[-1, 2]


def test_leuvens_stack_is_bounded() -> None:
    leuven = CATALOGUE["leuven"]
    assert stack_depth(leuven, 10) == 9  # ten branches, nine turns
    assert stack_depth(leuven, 17) == 16
    assert 14 <= stack_depth(leuven, 40) <= 16
