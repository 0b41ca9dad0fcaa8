"""Hysteresis of contacts that stick and slip one after another: joints, seals, guides, belts.

F = -sum_{i=1..4} f_i e_i/d_i,  e_i = stop_{d_i}(x): e_i follows x and stays within +-d_i,
d_i = reach (1, 1/2, 1/4, 1/8). The Maxwell-slip elements of W. D. Iwan, "A distributed-element
model for hysteresis and its steady-state dynamic response", J. Appl. Mech. 33 (1966), as in
F. Al-Bender et al., IEEE TAC 50 (2005). The layers of a cable are the same law.
"""

from twin.effect import Effect, Kind
from twin.law_parts import LAYERS, LAYERS_SLIP, slipping_layers, without_a_cable


def law(p, s, io):
    slipping_layers(p, s, io)


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="rate-independent hysteresis of contacts that slip one after another",
    equation="F = -sum_i f_i e_i/d_i;  e_i follows x within +-d_i;  d_i = reach (1, 1/2, 1/4, 1/8)",
    source="Iwan 1966, distributed elements; Al-Bender, Lampaert, Swevers 2005, Maxwell-slip",
    parameters=LAYERS,
    states=("e0", "e1", "e2", "e3"),
    law=law,
    knees=(LAYERS_SLIP,),
    fingerprint="residual bends over a distance after each reversal, at every speed alike",
    excited_by="slow passes with reversals at many places, and inner loops",
    suits=without_a_cable,
)
