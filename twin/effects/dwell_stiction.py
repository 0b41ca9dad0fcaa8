"""Breakaway force that grows with the time at rest.

Fs -> Fs (1 + growth a/(a + time)), with a the age of the contacts: da/dt = 1 - |v| a/slip.
The growth is the rising static friction of B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit,
"A survey of models, analysis tools and compensation methods for the control of machines with
friction", Automatica 30 (1994), with Fs the level of fresh contacts. There the time at rest counts;
here the age does, which is the same at rest and is forgotten over a sliding distance ``slip``
(aging law: J. H. Dieterich, J. Geophys. Res. 84 (1979); as a state, A. Ruina 1983), so that no
threshold of speed is needed. The age is exact over a sample of constant speed.
"""

from math import exp, expm1

from twin.effect import DT, LEAST, MOST, STATIC, Effect, Kind, Parameter, V
from twin.knee import Imitated
from twin.law_parts import at


def law(p, s, io):
    io[STATIC] *= 1.0 + p[0] * s[0] / (s[0] + p[1])
    slid = abs(io[V]) * io[DT] / p[2]
    grown = -expm1(-slid) / slid if slid > 0.0 else 1.0
    s[0] = s[0] * exp(-slid) + io[DT] * grown


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="breakaway force grows with the time at rest",
    equation="Fs -> Fs (1 + growth a/(a + time));  da/dt = 1 - |v| a/slip",
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994 (rising static friction); "
    "Dieterich 1979, Ruina 1983 (age of contacts)",
    parameters=(
        Parameter("growth", "1", 0.0, 0.0, 200.0, "growth after a long rest", strength=True),
        Parameter(
            "time", "s", 1.0, 0.02, 1e5, "rest after which half of it is there",
            scan=lambda e: (0.1, 1.0, 10.0),
        ),
        Parameter(
            "slip", "m", 1e-3, LEAST, MOST, "sliding that renews the contacts",
            scan=lambda e: tuple(part * e.travel for part in (3e-5, 3e-4, 3e-3)),
        ),
    ),
    states=("age",),
    law=law,
    knees=(
        at("time", "s", lambda e: (e.period, e.duration), Imitated.DRY_FRICTION),
        # contacts are renewed as they slide, not as they bend: a shorter slip has no peak to show
        at(
            "slip", "m", lambda e: (e.presliding, e.travel),
            Imitated.WITHOUT_PEAK, Imitated.DRIFT,
        ),
    ),
    fingerprint="residual peak at the start of a motion, higher the longer the rest before it",
    excited_by="slow starts after rests of very different lengths",
)  # fmt: skip
