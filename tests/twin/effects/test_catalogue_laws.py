"""Every effect of the catalogue obeys the laws of twin/laws, and broken effects do not.

No effect is named here: one that is added later is held to the same laws.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import copysign, sin

import numpy as np
import pytest
from axis_runs import BOTH, Stepper
from effect_runs import FRICTIONS
from machines import CATALOGUE, PROTON

from twin.effect import DRY, INDEX, OUT, READING, TIME, VISCOUS, Effect, Kind, Parameter, V, X
from twin.laws import checks, physics
from twin.laws.checks import LawBroken
from twin.laws.trials import absent, moderate
from twin.laws.verdict import LAWS, Law
from twin.logs import Log
from twin.model.machine import Fitted
from twin.simulation.simulate import simulate

# What a modifier does to the work of every friction is tried from the friction's side.
PAIRS = [
    (law, e)
    for law in LAWS
    for e in CATALOGUE.values()
    if e.kind in law.kinds
    and not (law.check is physics.check_takes_energy and e.kind is Kind.MODIFIER)
]


# These laws try each parameter by itself. The forty knots of a curve are alike: three tell as much.
ONE_BY_ONE = (checks.check_declared, checks.check_finite)
FEW_KNOTS = 3


@pytest.mark.parametrize(
    ("law", "effect"), PAIRS, ids=[f"{law.check.__name__}-{e.name}" for law, e in PAIRS]
)
def test_law(law: Law, effect: Effect) -> None:
    few = law.check in ONE_BY_ONE and effect.is_nonparametric and effect.of_size
    law.check(few(FEW_KNOTS) if few else effect)


def test_some_forces_depend_on_position_alone() -> None:
    rng = np.random.default_rng(31)
    alone = [
        e for e in CATALOGUE.values() if physics.depends_on_position_alone(e, moderate(e, rng))
    ]
    assert alone
    assert all(e.kind is Kind.FORCE and not e.states for e in alone)


def logged(effects: Sequence[Fitted], stage: Stepper) -> Log:
    """A log of the stage with those effects on x."""
    model = PROTON.with_axis("x", replace(PROTON.axes["x"], effects=tuple(effects)))
    return simulate(model, "moves", seed=3, duration=0.1, simulator=stage)


ALL_BUT_FRICTIONS = tuple(
    e for e in CATALOGUE.values() if e.kind is not Kind.FRICTION and not e.channels
)


@pytest.mark.parametrize("stage", BOTH)
@pytest.mark.parametrize(
    "effects", [ALL_BUT_FRICTIONS, *((f,) for f in FRICTIONS)], ids=lambda es: es[-1].name
)
def test_simulation_with_zero_strength_is_that_without(effects, stage):
    """Each friction in the place of the stage's, and all other effects at once."""
    kinds = {e.kind for e in effects}
    beside = [f for f in PROTON.axes["x"].effects if f.effect.kind not in kinds]
    zero = logged([*beside, *(Fitted.at_start(e, absent(e)) for e in effects)], stage)
    assert len(zero) > 500
    for axis, wanted in logged(beside, stage).axes.items():
        for name in ("position", "force"):
            found = zero.axes[axis].columns[name]
            np.testing.assert_array_equal(found, wanted.columns[name], f"{axis} {name}")


GAIN = 1.0


def broken(kind: Kind, law: Callable, states: tuple[str, ...] = ()) -> Effect:
    return Effect(
        kind=kind, summary="broken", equation="F = c", source="none", law=law, fingerprint="none",
        excited_by="none", states=states,
        parameters=(Parameter("c", "N", 0.1, 0.0, 1e3, "strength", strength=True),),
    )  # fmt: skip


def left_over(p, s, io):
    io[OUT] = -p[0] * io[V] - 1e-12


def idle(p, s, io):
    io[OUT] = 0.0


def halving(p, s, io):
    io[DRY] *= 0.5


def singular(p, s, io):
    io[OUT] = p[0] / io[V]


def frozen_global(p, s, io):
    io[OUT] = p[0] * io[X] * GAIN


def drifting(p, s, io):
    io[OUT] = p[0] * io[X]
    p[0] += 1e-9


def spilling(p, s, io):
    s[1] = io[X]
    io[OUT] = p[0] * s[0]


def hidden(p, s, io):
    io[OUT] = p[0] * (s[1] if io[X] > 0.19 else s[0])


def misspelt(p, s, io):
    io[OUT] = p[0] * (velocity if io[X] > 0.19 else io[V])  # noqa: F821


def counting(p, s, io):
    s[0] += io[V]  # without the sample period
    io[OUT] = p[0] * s[0]


def off_by_samples(p, s, io):
    io[READING] += 1e-6 * p[0] * io[INDEX]


def ageing(p, s, io):
    s[0] += 1.0
    io[DRY] *= 1.0 + p[0] * s[0]


def pushing(p, s, io):
    io[X] = p[0]


def driving(p, s, io):
    io[OUT] = copysign(p[0], -io[V])


def reversing(p, s, io):
    io[VISCOUS] *= -10.0 * p[0]


def damped_spring(p, s, io):
    io[OUT] = -p[0] * (io[X] + 0.01 * io[V])


def timed(p, s, io):
    io[OUT] = p[0] * sin(100.0 * io[TIME])


FAULTS = [
    (checks.check_zero_is_absent, broken(Kind.FORCE, left_over), "left at zero strength"),
    (checks.check_zero_is_absent, broken(Kind.FRICTION, left_over), "left at zero strength"),
    (checks.check_zero_is_absent, broken(Kind.MODIFIER, halving), "changes the friction"),
    (checks.check_acts, broken(Kind.FORCE, idle), "does nothing"),
    (checks.check_acts, broken(Kind.MODIFIER, idle), "does nothing"),
    (checks.check_finite, broken(Kind.FORCE, singular), "not finite"),
    (checks.check_declared, broken(Kind.FORCE, spilling), "s\\[1\\], but 0 states"),
    (checks.check_declared, broken(Kind.FORCE, hidden, ("own",)), "s\\[1\\], but 1 states"),
    (checks.check_declared, broken(Kind.FORCE, misspelt), "NameError"),
    (checks.check_writes_only_its_result, broken(Kind.FORCE, drifting), "its parameters"),
    (checks.check_writes_only_its_result, broken(Kind.FORCE, spilling, ("own",)), "behind"),
    (checks.check_writes_only_its_result, broken(Kind.ACTUATION, pushing), r"writes io\[X\]"),
    (physics.check_sample_rate, broken(Kind.FORCE, counting, ("own",)), "io\\[DT\\]"),
    (physics.check_sample_rate, broken(Kind.SENSING, off_by_samples), " m rms apart"),
    (physics.check_sample_rate, broken(Kind.MODIFIER, ageing, ("own",)), " N rms apart"),
    (physics.check_takes_energy, broken(Kind.FRICTION, driving), "gives"),
    (physics.check_takes_energy, broken(Kind.MODIFIER, reversing), "under test_catalogue_laws"),
]


@pytest.mark.parametrize(
    ("check", "effect", "fault"),
    FAULTS,
    ids=[f"{c.__name__}-{e.law.__name__}" for c, e, _ in FAULTS],
)
def test_a_broken_effect_fails(check: Callable[[Effect], None], effect: Effect, fault: str) -> None:
    with pytest.raises(LawBroken, match=fault):
        check(effect)


def test_a_law_that_reads_a_changing_global_fails() -> None:
    global GAIN
    effect = broken(Kind.FORCE, frozen_global)
    checks.check_compiled_equals_python(effect)
    GAIN = 2.0
    with pytest.raises(LawBroken, match="differ"):
        checks.check_compiled_equals_python(effect)
    GAIN = 1.0


def test_a_damped_spring_is_not_conservative() -> None:
    effect = broken(Kind.FORCE, damped_spring)
    assert not physics.depends_on_position_alone(effect, {"c": 1.0})
    assert not physics.depends_on_position_alone(broken(Kind.FORCE, timed), {"c": 1.0})
    with pytest.raises(LawBroken, match="loop"):
        physics.check_conservative(effect, {"c": 1.0})
