"""Hysteresis of contacts that stick and slip one after another: joints, seals, guides, belts.

F = -sum_{i=1..4} f_i e_i/d_i,  e_i = stop_{d_i}(x): e_i follows x and stays within +-d_i,
d_i = reach (1, 1/2, 1/4, 1/8). The Maxwell-slip elements of W. D. Iwan, "A distributed-element
model for hysteresis and its steady-state dynamic response", J. Appl. Mech. 33 (1966), as in
F. Al-Bender et al., IEEE TAC 50 (2005). On a machine whose model has a cable, the layers of the
cable slab are the same law.
"""

from dataclasses import replace

from twin.effects.cable_hysteresis import EFFECT as LAYERS
from twin.effects.cable_hysteresis import law as layers
from twin.effects.cable_slab import on_a_cable


def law(p, s, io):
    layers(p, s, io)


EFFECT = replace(
    LAYERS,
    summary="rate-independent hysteresis of contacts that slip one after another",
    law=law,
    fingerprint="residual bends over a distance after each reversal, at every speed alike",
    excited_by="slow passes with reversals at many places, and inner loops",
    suits=lambda present, turns: not on_a_cable(present, turns),
)
