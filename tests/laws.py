"""Laws that every physical effect obeys, as checks that raise AssertionError.

The checks take an Effect and know none by name, so they hold for an effect added later, and for a
user's own. tests/test_catalogue_laws.py applies them to the catalogue, and to broken effects.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from effect_runs import (
    FRICTIONS,
    Array,
    Motion,
    Values,
    absent,
    action,
    companion,
    forces,
    legal,
    moderate,
    trace,
)

from twin.effect import DRY, OUT, READING, STATIC, VISCOUS, Effect, Kind, U
from twin.model.machine import Fitted

RESULTS = {
    Kind.SENSING: {READING},
    Kind.ACTUATION: {U},
    Kind.FORCE: {OUT},
    Kind.MODIFIER: {DRY, STATIC, VISCOUS},
    Kind.FRICTION: {OUT},
    Kind.STRUCTURE: {OUT, U},
}
STEPS = (1e-5, 1e-4, 1e-3)  # s


def extremes(effect: Effect, rng: np.random.Generator) -> Iterator[dict[str, float]]:
    """Values at and near the bounds: all at once, one at a time, and drawn over all decades."""
    start = effect.starts()
    choices = {
        p.name: (p.lower, p.upper, float(np.clip(1e-300, p.lower, p.upper)), p.start)
        for p in effect.parameters
    }
    for which in range(4):
        yield legal(effect, {name: c[which] for name, c in choices.items()})
    for name, choice in choices.items():
        for value in choice:
            yield legal(effect, {**start, name: value})
    for _ in range(20):
        sizes = 10.0 ** rng.uniform(-12.0, 9.0, len(start)) * rng.choice([-1.0, 1.0], len(start))
        yield legal(effect, dict(zip(start, sizes, strict=True)))


def check_zero_is_absent(effect: Effect) -> None:
    """With every strength zero the effect changes no force and no reading, to the bit."""
    motion = replace(Motion.cycles(), u=Motion.cycles().u + 0.3)
    nothing = absent(effect)
    for friction in FRICTIONS if effect.kind is not Kind.FRICTION else (None,):
        around = [companion(friction)] if friction else []
        found = forces([*around, Fitted.at_start(effect, nothing)], motion)
        assert not found.pop(effect.name).any(), "a force is left at zero strength"
        for name, row in forces(around, motion).items():
            np.testing.assert_array_equal(found[name], row, "zero strength changes the friction")
    if effect.kind is Kind.SENSING:
        seen = trace(effect, nothing, motion)
        np.testing.assert_array_equal(seen.after[:, READING], seen.before[:, READING])


def check_acts(effect: Effect) -> None:
    """Within its bounds the effect can act with a force, or on a reading, that matters."""
    rng = np.random.default_rng(11)
    assert action(effect, moderate(effect, rng)) > 0.02, "the effect does nothing"


def check_finite(effect: Effect) -> None:
    """Finite at rest, for tiny and huge speeds, parameters at their bounds, and all steps."""
    rng = np.random.default_rng(12)
    v = np.array([0.0, 0.0, 1e-300, -1e-300, 1e-9, -1e-9, 0.0, 0.1, 0.1, -0.1, 0.0, 5.0, -5.0, 0.0])
    x = np.array([0.0, 0.0, 0.0, 0.0, 1e-9, 0.0, 0.0, 0.1, 0.2, -0.1, -0.2, 1.0, -1.0, 0.0])
    for dt in STEPS:
        motion = Motion(dt, x, v, 10.0 * v)
        for values in extremes(effect, rng):
            found = trace(effect, values, motion)
            assert np.isfinite(found.after).all(), f"not finite, dt = {dt} s, {values}"
            assert np.isfinite(found.states).all(), f"states not finite, dt = {dt} s, {values}"


def check_compiled_equals_python(effect: Effect) -> None:
    """The native law is the plain Python law, to rounding, on lists as on arrays."""
    rng = np.random.default_rng(13)
    for _ in range(2):
        values, motion = moderate(effect, rng), Motion.random(rng, samples=200)
        native = trace(effect, values, motion)
        plain = trace(effect, values, motion, law=effect.law)
        listed = trace(effect, values, motion, law=_on_lists(effect.law))
        for found, wanted in ((native.after, plain.after), (native.states, plain.states)):
            size = np.abs(wanted).max(axis=0, initial=0.0)
            assert np.all(np.abs(found - wanted) <= 1e-11 * size), "compiled and plain law differ"
        np.testing.assert_array_equal(listed.after, plain.after)


def _on_lists(law: Callable) -> Callable[[Array, Array, Array], None]:
    def step(p: Array, s: Array, io: Array) -> None:
        lists = p.tolist(), s.tolist(), io.tolist()
        law(*lists)
        for array, changed in zip((p, s, io), lists, strict=True):
            array[:] = changed

    return step


def check_writes_only_its_result(effect: Effect) -> None:
    """A law writes its kind's results and its own states, nothing else."""
    rng = np.random.default_rng(14)
    found = trace(effect, moderate(effect, rng), Motion.random(rng))
    changed = np.flatnonzero(np.any(found.after != found.before, axis=0))
    assert set(changed.tolist()) <= RESULTS[effect.kind], f"writes io slots {changed}"
    assert not found.spilled, "writes behind its states"
    assert not found.p_changed, "writes its parameters"


def check_dissipative(friction: Effect, modifier: Effect | None = None) -> None:
    """Friction takes work out of every closed cycle, large or within its pre-sliding."""
    rng = np.random.default_rng(15)
    around: list[list[Fitted]] = [[]]
    if modifier:  # with a moderate action, and at its most
        around = [[Fitted.at_start(modifier, moderate(modifier, rng, w))] for w in (0.3, 1e9)]
    for values in (friction.starts(), moderate(friction, rng)):
        for amplitude, changed in product((1e-6, 1e-4, 1e-2, 0.15), around):
            motion = Motion.cycles(amplitude)
            force = forces([Fitted.at_start(friction, values), *changed], motion)[friction.name]
            given = np.sum(force * motion.v) * motion.dt
            size = np.sum(np.abs(force * motion.v)) * motion.dt
            assert given <= 1e-9 * size, f"friction gives {given} J, amplitude {amplitude} m"


def depends_on_position_alone(effect: Effect, values: Values) -> bool:
    """Whether a force effect has no state and the same force at any speed, time and command."""
    if effect.kind is not Kind.FORCE or effect.states:
        return False
    motion = Motion.random(np.random.default_rng(16))
    other = Motion(2.0 * motion.dt, motion.x, motion.v[::-1], motion.u[::-1])
    return np.array_equal(
        trace(effect, values, motion).after[:, OUT], trace(effect, values, other).after[:, OUT]
    )


def check_conservative(effect: Effect, values: Values) -> None:
    """No net work around a loop in position, whatever the speeds out and back."""
    motion = Motion.cycles(0.15, cycles=1, samples=20_000)
    power = forces([Fitted.at_start(effect, values)], motion)[effect.name] * motion.v
    assert abs(np.sum(power)) <= 1e-9 * np.sum(np.abs(power)), "work is left around a loop"
