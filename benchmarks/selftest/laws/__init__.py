"""Laws that only the self-test knows: what a machine has in another form, or has besides.

The diagnosis never sees them. A file is one law, as in the catalogue.
"""

from __future__ import annotations

from benchmarks.selftest.laws import (
    bulging_bumps,
    chirp,
    coloured_force,
    cubic_drag,
    folding_cable,
    gaussian_bumps,
    lone_bump,
    saturating_drag,
    sudden_load,
    tightening_cable,
)

# Each takes the place of the effect that assumes a curve of the same kind.
BUMPS = (gaussian_bumps.EFFECT, bulging_bumps.EFFECT)
CABLES = (folding_cable.EFFECT, tightening_cable.EFFECT)
NOISE = coloured_force.EFFECT
# Nothing in the catalogue is one of these. No motion parts one that is a force over position or
# speed from another shape of a law over the same coordinate, which is as right an answer.
OUTSIDE = {
    e.name: e
    for e in (
        chirp.EFFECT,
        cubic_drag.EFFECT,
        lone_bump.EFFECT,
        saturating_drag.EFFECT,
        sudden_load.EFFECT,
    )
}
