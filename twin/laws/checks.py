"""What every law must be: declared, absent at zero strength, finite, compiled as it is written.

A check raises LawBroken with one sentence. The order matters: compiled code does not look where it
writes, so ``check_declared`` comes before all that runs it.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from twin import effect as slots
from twin.core.user_effect import RESULT, Guarded, Outside, outside_words
from twin.effect import DRY, OUT, READING, STATIC, VISCOUS, Effect, Kind, U
from twin.laws.trials import (
    Array,
    Trace,
    TrialMotion,
    Values,
    absent,
    action,
    companion,
    extremes,
    forces,
    legal,
    moderate,
    of_kind,
    sampled,
    trace,
)
from twin.model.machine import Fitted
from twin.model.units import LINEAR

RESULTS = {
    Kind.SENSING: {READING},
    Kind.ACTUATION: {U},
    Kind.FORCE: {OUT},
    Kind.MODIFIER: {DRY, STATIC, VISCOUS},
    Kind.FRICTION: {OUT},
    Kind.STRUCTURE: {OUT, U},
}

_SLOTS = {number: name for name, number in vars(slots).items() if isinstance(number, int)}


class LawBroken(Exception):
    """One sentence: which law an effect breaks, with the value and its unit."""


def with_values(effect: Effect, values: Values) -> str:
    """The values in words: those that are not at their start, the first few."""
    named_values = 3  # in a message
    changed = [p for p in effect.parameters if values[p.name] != p.start]
    told = [f"{p.name} = {values[p.name]:g} {p.unit}" for p in changed[:named_values]]
    more = [f"{len(changed) - named_values} more values"] * (len(changed) > named_values)
    return f"with {', '.join(told + more)}" if told else "with every value at its start"


def check_declared(effect: Effect) -> None:
    """The law uses no parameter, state or slot beyond those declared, in any of its branches.

    The plain law runs on guarded arrays; where a number is out of its range it ends early, as that
    is not finite's business here.
    """
    rng = np.random.default_rng(10)
    guarded_samples = 40  # plain Python is slow, and each value is one more run
    samples = sampled(TrialMotion.random(rng, guarded_samples)).tolist()
    present = {p.name: p.start or 0.1 if p.strength else p.start for p in effect.parameters}
    for values in (legal(effect, present), *extremes(effect, rng)):
        p = Guarded("p", [values[q.name] for q in effect.parameters])
        s = Guarded("s", [0.0] * len(effect.states))
        try:
            with suppress(ArithmeticError, ValueError):
                for sample in samples:
                    effect.law(p, s, Guarded("io", list(sample)))
        except Outside as touched:
            said = outside_words(effect, str(touched))
            raise LawBroken(f"{said} (seen {with_values(effect, values)})") from None
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise LawBroken(f"its law fails {with_values(effect, values)}: {reason}") from error


def check_writes_only_its_result(effect: Effect) -> None:
    """A law writes its kind's results and its own states, nothing else."""
    rng = np.random.default_rng(14)
    found = trace(effect, moderate(effect, rng), TrialMotion.random(rng))
    changed = set(np.flatnonzero(np.any(found.after != found.before, axis=0)).tolist())
    if others := sorted(changed - RESULTS[effect.kind]):
        raise LawBroken(
            f"it writes {', '.join(f'io[{_SLOTS[i]}]' for i in others)}; a "
            f"{effect.kind.name.lower()} effect writes {RESULT[effect.kind]} alone"
        )
    if found.spilled:
        raise LawBroken("it writes behind its states; add a name to states=(...)")
    if found.p_changed:
        raise LawBroken("it changes its parameters; keep what must last in a state, s")


def check_zero_is_absent(effect: Effect) -> None:
    """With every strength zero the effect changes no force and no reading, to the bit."""
    cycles = TrialMotion.cycles()
    motion, nothing = replace(cycles, u=cycles.u + 0.3), absent(effect)
    beside = of_kind(Kind.FRICTION) if effect.kind is not Kind.FRICTION else (None,)
    for friction in beside:
        around = [companion(friction)] if friction else []
        found = forces([*around, Fitted.at_start(effect, nothing)], motion)
        left = np.abs(found.pop(effect.name)).max()
        if left != 0.0:
            raise LawBroken(f"a force of {left:g} {LINEAR.force} is left at zero strength")
        for name, row in forces(around, motion).items():
            if not np.array_equal(found[name], row, equal_nan=True):
                moved = np.abs(found[name] - row).max()
                raise LawBroken(
                    f"at zero strength it changes the friction {name} by {moved:g} {LINEAR.force}"
                )
    if effect.kind is Kind.SENSING:
        seen = trace(effect, nothing, motion)
        left = np.abs(seen.after - seen.before)[:, READING].max()
        if left != 0.0:
            raise LawBroken(f"the reading is off by {left:g} {LINEAR.position} at zero strength")


def check_acts(effect: Effect) -> None:
    """Within its bounds the effect can act with a force, or on a reading, that matters."""
    most = action(effect, moderate(effect, np.random.default_rng(11)))
    if not most > 0.02:  # N rms, or um of a reading
        sensing = effect.kind is Kind.SENSING
        unit = f"u{LINEAR.position}" if sensing else LINEAR.force
        reach = np.abs(TrialMotion.cycles().x).max()
        raise LawBroken(
            f"it does nothing: its action is {most:.2g} {unit} rms over +-{reach:g} "
            f"{LINEAR.position}, whatever its strengths; give starts and bounds that let it act"
        )


def check_finite(effect: Effect) -> None:
    """Finite at rest, for tiny and huge speeds, parameters at their bounds, and all steps."""
    rng = np.random.default_rng(12)
    v = np.array([0.0, 0.0, 1e-300, -1e-300, 1e-9, -1e-9, 0.0, 0.1, 0.1, -0.1, 0.0, 5.0, -5.0, 0.0])
    x = np.array([0.0, 0.0, 0.0, 0.0, 1e-9, 0.0, 0.0, 0.1, 0.2, -0.1, -0.2, 1.0, -1.0, 0.0])
    for dt in (1e-5, 1e-4, 1e-3):  # s
        motion = TrialMotion(dt, x, v, 10.0 * v)
        for values in extremes(effect, rng):
            found = trace(effect, values, motion)
            for what, rows in (("result", found.after), ("state", found.states)):
                at = np.flatnonzero(~np.isfinite(rows).all(axis=1))
                if at.size:
                    raise LawBroken(
                        f"its {what} is not finite at x = {x[at[0]]:g} {LINEAR.position}, v = "
                        f"{v[at[0]]:g} {LINEAR.velocity}, sampled every {dt:g} s, "
                        f"{with_values(effect, values)}"
                    )


def check_compiled_equals_python(effect: Effect) -> None:
    """The native law is the plain Python law, to rounding, on lists as on arrays."""
    rng = np.random.default_rng(13)
    for _ in range(2):
        values, motion = moderate(effect, rng), TrialMotion.random(rng, samples=200)
        native = trace(effect, values, motion)
        plain = trace(effect, values, motion, law=effect.law)
        rounding = 1e-11  # between the compiled and the plain law, of the largest value
        _require_equal(native, plain, rounding, "compiled and as plain Python")
        listed = trace(effect, values, motion, law=_on_lists(effect.law))
        _require_equal(listed, plain, 0.0, "on lists and on arrays")


def _require_equal(found: Trace, wanted: Trace, tolerance: float, how: str) -> None:
    for one, other in ((found.after, wanted.after), (found.states, wanted.states)):
        size = np.abs(other).max(axis=0, initial=0.0)
        off = np.argwhere(~(np.abs(one - other) <= tolerance * size))
        if off.size:
            at = tuple(off[0])
            raise LawBroken(
                f"{how} its law gives different numbers, {one[at]:.6g} and {other[at]:.6g}; a "
                "number that changes while the program runs belongs in p or s"
            )


def _on_lists(law: Callable) -> Callable[[Array, Array, Array], None]:
    def step(p: Array, s: Array, io: Array) -> None:
        lists = p.tolist(), s.tolist(), io.tolist()
        law(*lists)
        for array, changed in zip((p, s, io), lists, strict=True):
            array[:] = changed

    return step
