"""All laws put to one effect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.effect import RUBBING, Effect, Kind
from twin.laws import checks, physics
from twin.laws.checks import LawBroken

EVERY, FORCES = frozenset(Kind), frozenset({Kind.FORCE})


@dataclass(frozen=True)
class Law:
    """A law in words, the check that raises LawBroken, and the kinds of effect it is for."""

    says: str
    check: Callable[[Effect], None]
    kinds: frozenset[Kind] = EVERY


LAWS = (
    Law("uses only what it declares", checks.check_declared),
    Law("writes only its result and its states", checks.check_writes_only_its_result),
    Law("changes nothing at zero strength", checks.check_zero_is_absent),
    Law("acts within its bounds", checks.check_acts),
    Law("is finite at every bound, speed and sample period", checks.check_finite),
    Law("is the same compiled and as plain Python", checks.check_compiled_equals_python),
    Law("is the same however often it is sampled", physics.check_sample_rate),
    Law("takes energy in every closed cycle", physics.check_takes_energy, frozenset(RUBBING)),
    Law(
        "leaves no work around a loop, where it depends on position alone",
        physics.check_of_position_alone,
        FORCES,
    ),
    Law("is the same in other units of force, length and time", physics.check_units),
    Law(
        "is its equation, where that is a formula of x, v, t and its parameters",
        physics.check_equation,
        FORCES,
    ),
    Law(
        "gives no energy, where it is a force of speed with one sign",
        physics.check_takes_speed,
        FORCES,
    ),
)


@dataclass(frozen=True)
class LawOutcome:
    """A law put to an effect. holds: None where it was not tried; fault: why not, one sentence."""

    law: str
    holds: bool | None
    fault: str = ""


@dataclass(frozen=True)
class LawReport:
    """What each law made of one effect."""

    effect: str
    outcomes: tuple[LawOutcome, ...]

    @property
    def ok(self) -> bool:
        """Whether all laws hold."""
        return all(o.holds for o in self.outcomes)

    def __str__(self) -> str:
        said = {True: "ok", False: "FAILED", None: "not tried"}
        return "\n".join(
            f"{self.effect}: {said[o.holds]}: {o.law}{'' if o.holds else f': {o.fault}'}"
            for o in self.outcomes
        )


def check_effect(effect: Effect) -> LawReport:
    """Try every law that holds for effects of this kind on the effect; takes a second or two.

    A broken law is part of the report and raises nothing. Where the effect uses what it has not
    declared, nothing else is tried: compiled, it would write anywhere.
    """
    outcomes: list[LawOutcome] = []
    for law in (law for law in LAWS if effect.kind in law.kinds):
        if outcomes and outcomes[0].holds is False:
            outcomes.append(LawOutcome(law.says, None, "not tried before the first law holds"))
        else:
            outcomes.append(_tried(law, effect))
    return LawReport(effect.name, tuple(outcomes))


def _tried(law: Law, effect: Effect) -> LawOutcome:
    try:
        with np.errstate(all="ignore"):
            law.check(effect)
    except LawBroken as broken:
        return LawOutcome(law.says, False, str(broken))
    except (ArithmeticError, ValueError) as error:  # of the law, run as plain Python
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        return LawOutcome(law.says, False, f"its law fails as plain Python: {reason}")
    return LawOutcome(law.says, True)
