"""Hysteresis in pre-sliding: which friction models remember where they turned, and which forget."""

import numpy as np
import pytest
from effect_runs import CATALOGUE
from friction_runs import FORGETFUL, MEMORY, PAPER, along, at_turns, dragged, friction
from scipy.optimize import brentq

from twin.effect import Effect
from twin.laws.motion import Motion as Given
from twin.laws.stepping import trace

A, B, D = 9e-6, 5e-6, 12e-6  # m; turning points within the pre-sliding
CLOSES = pytest.mark.parametrize("name", MEMORY)
FORGETS = pytest.mark.parametrize("name", FORGETFUL)


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


@FORGETS
def test_an_inner_loop_stays_open_where_reversals_are_forgotten(name: str) -> None:
    first, _, again = at_turns(friction(name), (A, B, A))
    assert first - again > 0.05


def test_the_open_loop_of_dahl_is_the_one_its_equation_gives() -> None:
    fall = np.exp(-PAPER["sigma0"] * (A - B) / PAPER["Fc"])
    first = -np.expm1(-PAPER["sigma0"] * A / PAPER["Fc"])
    inside = -1.0 + (1.0 + first) * fall
    again = 1.0 - (1.0 - inside) * fall
    np.testing.assert_allclose(
        at_turns(friction("dahl"), (A, B, A)), [first, inside, again], rtol=1e-11
    )


def stiffness_at(name: str, force: float, turns: tuple[float, float]) -> float:
    """Stiffness N/m while rising through that force, after those two turns."""

    def beyond(x: float) -> float:
        return at_turns(friction(name), (*turns, x))[-1] - force

    x = brentq(beyond, turns[1] + 1e-9, 4e-5, xtol=1e-14)
    return (beyond(x + 2e-8) - beyond(x)) / 2e-8


@pytest.mark.parametrize("name", [*MEMORY, *FORGETFUL])
def test_memory_is_not_local(name: str) -> None:
    """The same force and direction, but other turns long before: with memory, another future."""
    one, other = (stiffness_at(name, 0.9, turns) for turns in ((2e-5, 1e-5), (1e-5, 5e-6)))
    if name in MEMORY:
        assert one > 1.5 * other  # the first is still inside its inner loop
    else:
        assert one == pytest.approx(other, rel=1e-3)


@CLOSES
def test_the_largest_turn_is_remembered_through_many_smaller_ones(name: str) -> None:
    spiral = [A * (1.0 - 0.9 * i / 12) if i % 2 == 0 else A * 0.1 * i / 12 for i in range(12)]
    force = at_turns(friction(name), (*spiral, A))
    assert force[-1] == pytest.approx(force[0], abs=2e-3)


def test_one_element_makes_the_parallelogram_of_an_elastoplastic_spring() -> None:
    """Loop area 4 g (amplitude - g/k)."""
    one = friction("gms", elements=1, Fc=1.0, Fs=1.0)
    x, force = dragged(one, (3e-5, -3e-5, 3e-5))
    loop = slice(-1003, None)
    area = np.trapezoid(force[loop], x[loop])
    assert area == pytest.approx(4.0 * (3e-5 - 1.0 / PAPER["sigma0"]), rel=2e-3)


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


def test_leuvens_force_does_not_jump_when_its_stack_is_full() -> None:
    _, force = dragged(friction("leuven", **SHARP, sigma1=1e-6), spiral(40), leg=200)
    step = 2e-5 / 200 * PAPER["sigma0"]  # the stiffest response to the longest step
    assert np.abs(np.diff(force)).max() < 1.01 * step


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


def test_sliding_wipes_leuvens_memory() -> None:
    """A small loop at high force, then fast: the level falls below where the branch began."""
    v = np.repeat([1e-5, -1e-5, 1e-5, 5e-3], [40_000, 2000, 500, 2000])
    force = along(friction("leuven", sigma1=1e-6, sigma2=0.0), v, 1e-4)
    assert force[42_000] > 1.1  # where the last branch begins; Fc is 1 N
    assert np.all(np.diff(force[42_500:]) <= 0.0)
    assert force[-1] == pytest.approx(1.0, abs=1e-9)


def test_leuvens_force_jumps_where_a_loop_closes_and_the_modified_one_does_not() -> None:
    """dz/dt = v (1 - r^m): r belongs to the branch in Leuven's model, to the force in the other."""
    damped = {"m": 2.0, "sigma1": 1e3, "Fc": 1.5, "Fs": 1.5, "sigma2": 0.0}
    speed, dt = 1e-4, 1e-5
    v = speed * np.repeat([1.0, -1.0, 1.0], [9000, 3000, 6000])
    jumps = {}
    for name in ("leuven", "modified_leuven"):
        force = along(friction(name, **damped), v, dt)
        jumps[name] = np.abs(force[12_502:] - force[12_500:-2]).max()
    before = at_turns(friction("leuven", **damped), (9e-6, 6e-6))
    top, low = before
    inner = (top - low) / (1.5 - low)
    outer = top / 1.5
    assert jumps["leuven"] == pytest.approx(1e3 * speed * (outer**2 - inner**2), rel=0.05)
    assert jumps["modified_leuven"] < 0.1 * jumps["leuven"]
