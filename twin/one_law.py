"""Laws of two names: one of a cable, for a machine whose model has a cable, and one of any machine.

A diagnosis offers a law by one of them (``suits`` of an effect).
"""

from __future__ import annotations

from collections.abc import Collection

from twin.effect import DT, LEAST, MOST, OUT, WHEN, Effect, Parameter, V

LAYERS = (
    Parameter(
        "reach", "m", 5e-3, LEAST, MOST, "travel from no force until every layer slips",
        scan=lambda e: tuple(part * e.travel for part in (3e-3, 9e-3, 0.03, 0.09)),
    ),
    *(
        Parameter(
            f"f{i}", "N", 0.0, 0.0, MOST, f"force of the layer that slips at reach/{2**i}",
            strength=True,
        )
        for i in range(4)
    ),
)  # fmt: skip


def on_a_cable(present: Collection[Effect], turns: bool) -> bool:
    """Whether an axis with these effects has a cable: an effect that is offered only there."""
    return any(effect.suits is on_a_cable for effect in present)


def without_a_cable(present: Collection[Effect], turns: bool) -> bool:
    """Whether an axis with these effects has none."""
    return not on_a_cable(present, turns)


def slipping_layers(p, s, io):
    """Force of layers that stick to each other and slip one after another; steps their states."""
    step = io[V] * io[DT]
    limit = p[0]
    force = 0.0
    for i in range(4):  # from the layer that slips last to the one that slips first
        now = min(max(s[i] + io[WHEN] * step, -limit), limit)
        s[i] = min(max(s[i] + step, -limit), limit)
        force -= p[1 + i] * now / limit
        limit *= 0.5
    io[OUT] = force
