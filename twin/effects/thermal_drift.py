"""Friction that falls while the bearing warms, with friction work and with the machine.

dE/dt = |F v| + idle - E/tau;  Fc, Fs -> exp(-dry E) Fc, Fs;  sigma2 -> exp(-viscous E) sigma2.
E (J) is the heat that the bearing has taken up since the log began and still holds, tau (s) its
cooling time, idle (W) what else warms it: the motor that holds a load, the drive, the room. A
temperature inferred from friction power alone, without a sensor: L. Simoni et al., "Modelling the
temperature in joint friction of industrial manipulators", Robotica 37 (2019); their friction is a
polynomial in temperature, the exponential here is Reynolds' viscosity law, taken for the dry part
too, where it is an assumption. Heat that comes at one rate is an assumption as well: a machine that
warms up does so whether it moves or not. E is exact over a sample of constant power; friction keeps
a twentieth at least.
"""

from math import exp

from twin.effect import DRY, DT, FRICTION, LEAST, MOST, VISCOUS, Effect, Kind, Parameter, V
from twin.knee import Imitated
from twin.law_parts import at

LARGEST = 3.0  # exponent at which the loss ends: 1/20 of the friction is left


def law(p, s, io):
    io[DRY] *= exp(-min(p[0] * s[0], LARGEST))
    io[VISCOUS] *= exp(-min(p[1] * s[0], LARGEST))
    kept = exp(-io[DT] / p[2])
    s[0] = s[0] * kept + (abs(io[FRICTION] * io[V]) + p[3]) * p[2] * (1.0 - kept)


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="friction falls while the bearing warms with friction work and with the machine",
    equation="dE/dt = |F v| + idle - E/tau;  Fc, Fs -> exp(-dry E) Fc, Fs;  "
    "sigma2 -> exp(-viscous E) sigma2",
    source="Simoni, Beschi, Legnani, Visioli 2019 (heat from friction power); Reynolds 1886 "
    "(exponential viscosity), extended to the dry part by assumption",
    parameters=(
        Parameter("dry", "1/J", 0.0, 0.0, MOST, "loss of dry friction by heat", strength=True),
        Parameter(
            "viscous", "1/J", 0.0, 0.0, MOST, "loss of viscous friction by heat", strength=True
        ),
        Parameter(
            "tau", "s", 300.0, 0.1, 1e5, "cooling time",
            start_rule=lambda e: 0.5 * e.duration,
            scan=lambda e: tuple(e.duration * part for part in (0.05, 0.2, 0.7, 3.0)),
        ),
        Parameter(
            "idle", "N m/s", 0.01, LEAST, MOST, "heat that comes without friction",
            start_rule=lambda e: e.dry_level * e.speed_max,
        ),
    ),
    states=("heat",),
    law=law,
    knees=(at("tau", "s", lambda e: (e.stroke, e.duration), Imitated.OF_SPEED),),
    fingerprint="residual opposes friction and grows with the work done so far, fades after rests",
    excited_by="minutes of steady motion from cold, then a rest, then motion again",
)  # fmt: skip
