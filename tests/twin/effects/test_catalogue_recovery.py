"""Every effect of the catalogue, as the explanation of its own log, comes back with its values.

From its own start rules and scans, with every interval covering the truth, or with the tool saying
why there is none. No effect is named here but for its cost; descriptions of what no physics
explains have their own tests.
"""

from dataclasses import replace

import pytest
from effect_runs import CATALOGUE
from recovery import SETTINGS, Recovered, attempts, recovered

from identify.estimation.intervals import refusal
from twin.effect import OUT, Effect, Kind, Parameter, V
from twin.model.machine import AxisModel, Fitted

OFFERED = SETTINGS[0].stage().axes["x"].can_have  # what is another's law there is never tried
PHYSICS = tuple(e for e in CATALOGUE.values() if not e.is_nonparametric and OFFERED(e))
LONG = "encoder_ripple"  # the search for its period takes as long as all the others do
EVERY = pytest.mark.parametrize(
    "effect",
    [pytest.param(e, marks=pytest.mark.slow) if e.name == LONG else e for e in PHYSICS],
    ids=lambda e: e.name,
)
SOME = pytest.mark.parametrize(
    "effect",
    [
        e if i == 0 else pytest.param(e, marks=pytest.mark.slow)
        for i, e in enumerate(PHYSICS[10::7])
    ],
    ids=lambda e: e.name,
)
SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))]


@EVERY
@pytest.mark.parametrize("seed", SEEDS)
def test_an_effect_is_recovered_from_its_own_log(effect: Effect, seed: int) -> None:
    done = recovered(effect, seed)
    if done.shown:
        assert done.misses() == []
        assert refusal(done.found.fit) is None or seed != 1
        return
    # No force shows it: then what it is comes from the log's readings, or no interval is given.
    if done.own():
        assert all(e.reason for e in done.own())
        assert seed != 1
        return
    for p in effect.strengths:
        true = done.truth[effect.name].values[p.name]
        assert done.found.fit.axis[effect.name].values[p.name] == pytest.approx(true, rel=1e-4)


def other_values(axis: AxisModel) -> AxisModel:
    """The effect planted last, a fifth stronger than is claimed."""
    last = axis.effects[-1]
    values = {p.name: 1.2 * last.values[p.name] for p in last.effect.strengths}
    return axis.with_effect(replace(last, values={**last.values, **values}))


def wrong(done: Recovered) -> bool:
    """Whether a truth is missed, or every interval refused."""
    return bool(done.misses()) or refusal(done.found.fit) is not None


@SOME
def test_other_values_than_claimed_are_missed(effect: Effect) -> None:
    assert wrong(recovered(effect, 1, other_values))


def cubic(p, s, io):
    io[OUT] = -p[0] * io[V] ** 3


CUBIC = Effect(
    kind=Kind.FORCE, summary="none of the catalogue", equation="F = -c v^3", source="this test",
    parameters=(Parameter("c", "N s^3/m^3", 50.0, 0.0, 1e3, "strength", strength=True),),
    law=cubic, fingerprint="none", excited_by="none",
)  # fmt: skip


@SOME
def test_a_law_that_the_machine_does_not_have_is_missed(effect: Effect) -> None:
    """Beside the effect acts another law: at 0.25 m/s up to 0.8 N, a thousand times the noise."""
    assert SETTINGS[0].velocity == 0.25
    lie = Fitted.at_start(CUBIC)
    assert wrong(next(attempts(effect, 1, lambda axis: axis.with_effect(lie))))
