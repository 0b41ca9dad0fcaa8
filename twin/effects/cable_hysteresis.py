"""Hysteresis of the cable slab: layers that stick to each other and slip one after another.

F = -sum_{i=1..4} f_i e_i/d_i,  e_i = stop_{d_i}(x): e_i follows x and stays within +-d_i,
d_i = reach (1, 1/2, 1/4, 1/8). f_i (N) is the force at which layer i slips, reach (m) the travel
until all slip of a cable that lay without force; after a reversal it is twice that (Masing's rule).
Maxwell-slip elements: W. D. Iwan, "A distributed-element model for hysteresis and its steady-state
dynamic response", J. Appl. Mech. 33 (1966), 893-900; F. Al-Bender et al., IEEE TAC 50 (2005), less
its velocity dependence. Rate-independent, keeps the memory of inner loops, linear in the forces,
and exact for motion in one direction within a sample.
"""

from twin.effect import Effect, Kind
from twin.law_parts import LAYERS, LAYERS_SLIP, on_a_cable, slipping_layers


def law(p, s, io):
    slipping_layers(p, s, io)


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="rate-independent hysteresis of the cable slab over millimetres of travel",
    equation="F = -sum_i f_i e_i/d_i;  e_i follows x within +-d_i;  d_i = reach (1, 1/2, 1/4, 1/8)",
    source="Iwan 1966, distributed elements; Al-Bender, Lampaert, Swevers 2005, Maxwell-slip",
    parameters=LAYERS,
    states=("e0", "e1", "e2", "e3"),
    law=law,
    knees=(LAYERS_SLIP,),
    fingerprint="residual bends over millimetres after each reversal, at every speed alike",
    excited_by="slow passes with reversals at many places, and inner loops of millimetres",
    suits=on_a_cable,
)
