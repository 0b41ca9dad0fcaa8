"""Force that falls behind the command above a limit: amplifier current limit, saturating iron.

u_actual = u - loss (u - clip(u, -limit, limit)). loss = 1 is a hard limit, a smaller loss the bend
of the force of a motor whose iron saturates. Saturation nonlinearity, H. K. Khalil, Nonlinear
Systems, 3rd ed., section 1.2.7; the partial loss is this project's choice.
"""

from twin.effect import LEAST, MOST, Effect, Kind, Parameter, U
from twin.knee import Imitated
from twin.law_parts import at


def law(p, s, io):
    io[U] -= p[1] * (io[U] - min(max(io[U], -p[0]), p[0]))


EFFECT = Effect(
    kind=Kind.ACTUATION,
    summary="force falls behind the command above a limit",
    equation="u_actual = u - loss (u - clip(u, -limit, limit))",
    source="Khalil, Nonlinear Systems, section 1.2.7 (loss = 1); partial loss is an assumption",
    parameters=(
        Parameter(
            "limit", "N", 1.0, LEAST, MOST, "force where the loss begins",
            start_rule=lambda e: 0.8 * e.force_max,
            scan=lambda e: tuple(e.force_max * part for part in (0.5, 0.65, 0.8, 0.9, 0.97)),
        ),
        # 1 is a hard limit; the bound lies beyond, so that a hard one does not end at it.
        Parameter("loss", "1", 0.0, 0.0, 1.5, "part lost of what is above", strength=True),
    ),
    law=law,
    knees=(
        at("limit", "N", lambda e: (e.force_usual, e.force_max), Imitated.GAIN, Imitated.NOTHING),
    ),
    fingerprint="residual opposes the command at its peaks and is zero below",
    excited_by="the strongest accelerations the machine is used with",
)  # fmt: skip
