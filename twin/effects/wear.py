"""Dry friction that grows slowly with the distance travelled.

Fc, Fs -> (1 + rate s) Fc, Fs, with s the distance travelled since the start of the log.
Worn volume is proportional to sliding distance (J. F. Archard, "Contact and rubbing of flat
surfaces", J. Appl. Phys. 24, 1953); that friction grows in proportion to it is an assumption, good
for the small growth within one log.
"""

from twin.effect import DRY, DT, MOST, WHEN, Effect, Kind, Parameter, V


def law(p, s, io):
    step = abs(io[V]) * io[DT]
    io[DRY] *= 1.0 + p[0] * (s[0] + io[WHEN] * step)
    s[0] += step


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="dry friction grows slowly with the distance travelled",
    equation="Fc, Fs -> (1 + rate s) Fc, Fs;  ds/dt = |v|",
    source="Archard 1953 (wear by distance); growth of friction in proportion is an assumption",
    parameters=(
        Parameter("rate", "1/m", 0.0, 0.0, MOST, "growth by distance travelled", strength=True),
    ),
    states=("distance",),
    law=law,
    fingerprint="residual opposes motion and grows steadily from the start to the end of a run",
    excited_by="a long run of the same motion over and over",
)  # fmt: skip
