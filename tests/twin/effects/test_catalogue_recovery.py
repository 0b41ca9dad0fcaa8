"""Every effect of the catalogue, as the explanation of its own log, comes back with its values.

From its own start rules and scans, with every interval covering the truth, or with the tool saying
why there is none. No effect is named here but for its cost; descriptions of what no physics
explains have their own tests.
"""

import pytest
from machines import CATALOGUE
from recovery import SETTINGS, recovered

from identify.estimation.intervals import refusal
from twin.effect import Effect

OFFERED = SETTINGS[0].stage().axes["x"].can_have  # what is another's law there is never tried
PHYSICS = tuple(e for e in CATALOGUE.values() if not e.is_nonparametric and OFFERED(e))
LONG = "encoder_ripple"  # the search for its period takes as long as all the others do
EVERY = pytest.mark.parametrize(
    "effect",
    [pytest.param(e, marks=pytest.mark.slow) if e.name == LONG else e for e in PHYSICS],
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
