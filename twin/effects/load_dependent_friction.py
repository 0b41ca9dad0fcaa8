"""Dry friction that follows the normal load on the bearings.

Fc, Fs -> Fc, Fs (1 + motor |u| + corner |a_other| + offset x_other), never below a hundredth.
Dry friction is proportional to the normal load (Amontons, Coulomb); the load of a preloaded guide
changes with the motor force, whose line passes beside the guide and whose attraction follows the
current (motor), with the inertia of the other axis when it accelerates (corner), and with the place
of the other axis' carriage, whose weight moves between the rails (offset). Robot joints show the
same: A. C. Bittencourt et al., "An extended friction model to capture load and temperature effects
in robot joints", IROS 2010. That the load is linear in these three is an assumption.
"""

from twin.effect import A_OTHER, DRY, MOST, X_OTHER, Effect, Kind, Parameter, U


def law(p, s, io):
    load = 1.0 + p[0] * abs(io[U]) + p[1] * abs(io[A_OTHER]) + p[2] * io[X_OTHER]
    io[DRY] *= max(load, 0.01)  # friction cannot turn negative


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="dry friction grows with the load that motor force and other axis put on the guide",
    equation="Fc, Fs -> Fc, Fs (1 + motor |u| + corner |a_other| + offset x_other)",
    source="Amontons' law of friction; Bittencourt et al. 2010 (load-dependent joint friction); "
    "linear loads are an assumption",
    parameters=(
        Parameter("motor", "1/N", 0.0, 0.0, MOST, "growth by motor force", strength=True),
        Parameter(
            "corner", "s^2/m", 0.0, 0.0, MOST, "growth by the other axis' acceleration",
            strength=True,
        ),
        Parameter(
            "offset", "1/m", 0.0, -MOST, MOST, "growth by the other axis' position", strength=True
        ),
    ),
    law=law,
    of_joints=False,
    fingerprint="residual opposes motion where motor force or the other axis' acceleration is high",
    excited_by="fast moves of both axes at once, with the other axis at both ends of its travel",
)  # fmt: skip
