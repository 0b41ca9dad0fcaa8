"""Moved mass other than nominal: a payload, or a nominal mass that is not quite right.

(1 + ratio) m a = F;  the force this adds on the nominal mass m is -ratio m a, with a the
acceleration in space. Newton's second law.
"""

from twin.effect import ACC, MOVED, OUT, Effect, Kind, Parameter


def law(p, s, io):
    io[OUT] = -p[0] * io[MOVED] * io[ACC]


def added_mass(values, mass):
    return values["ratio"] * mass


EFFECT = Effect(
    kind=Kind.STRUCTURE,
    summary="moved mass other than nominal",
    equation="(1 + ratio) m a = F",
    source="Newton's second law",
    parameters=(
        # A nominal mass may be any number of times too large: what moves is more than nothing.
        Parameter(
            "ratio", "1", 0.0, -0.99, 10.0, "payload over the nominal moved mass", strength=True
        ),
    ),
    law=law,
    added_mass=added_mass,
    of_joints=False,
    fingerprint="residual is proportional to acceleration, everywhere and in both directions",
    excited_by="moves with strong acceleration, on an axis whose nominal mass is held",
)  # fmt: skip
