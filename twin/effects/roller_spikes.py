"""Force bumps where a bearing roller enters or leaves the loaded zone, every pitch of travel.

F = -(ahead + behind)/2 d b(x) - (ahead - behind)/2 b(x), with b a smooth bump of full width
``width`` centred at phase + k pitch, and d in [-1, 1] the direction of motion. Moving forwards the
bump brakes with ``ahead``, moving backwards with ``behind``; equal values brake both ways, opposite
values make the bump conservative. d follows the motion within a 200th of the width, so that the
force has no jump at rest. L. Jia 2023: rollers 34 mm apart make force spikes every 34 mm; the
bump's form (1 - r^2)^2 is this project's choice.
"""

from math import floor

from twin.curve import Coordinate, Curve
from twin.effect import LEAST, MOST, OUT, Effect, Kind, Parameter, X
from twin.knee import Imitated, Knee
from twin.law_parts import repeats_after, turned

TURN = 5e-3  # of a bump's width, the travel over which a reversal turns the braking part round
PITCH = 0.1  # of the travel, where no design tells it
WIDTHS = (0.06, 0.18, 0.44)  # of the pitch
# Bumps wider than their distance leave nothing between them.
APART = Knee(
    "width", "m", lambda v, e: v["width"], lambda v, e: (e.resolution, v["pitch"]),
    Imitated.ROUNDING, Imitated.CONSTANT,
)  # fmt: skip


def law(p, s, io):
    pitch = p[0]
    direction = turned(s, io, TURN * p[1])
    turns = (io[X] - p[2]) / pitch
    distance = (turns - floor(turns + 0.5)) * pitch
    r = 2.0 * distance / p[1]
    bump = 0.0
    if abs(r) < 1.0:
        bump = (1.0 - r * r) * (1.0 - r * r)
    io[OUT] = -0.5 * ((p[3] + p[4]) * direction + (p[3] - p[4])) * bump


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="force bump each time a roller enters or leaves the loaded zone",
    equation="F = -[(ahead + behind)/2 d + (ahead - behind)/2] b(x);  b = (1 - r^2)^2, "
    "r = 2 (x - phase - k pitch)/width",
    source="L. Jia 2023, force spikes every 34 mm; bump form is an assumption",
    parameters=(
        Parameter(
            "pitch", "m", 0.034, LEAST, MOST, "distance between rollers", fixed=True, period=True,
            start_rule=lambda e: PITCH * e.travel,
        ),
        Parameter(
            "width", "m", 0.004, LEAST, MOST, "full width of a bump",
            scan=lambda e: tuple(part * PITCH * e.travel for part in WIDTHS),
        ),
        Parameter(
            "phase", "m", 0.0, -MOST, MOST, "position of one bump",
            scan=lambda e: tuple(PITCH * e.travel * k / 24 for k in range(24)),
        ),
        Parameter("ahead", "N", 0.0, -MOST, MOST, "braking height forwards", strength=True),
        Parameter("behind", "N", 0.0, -MOST, MOST, "braking height backwards", strength=True),
    ),
    states=("direction",),
    law=law,
    knees=(APART, repeats_after("pitch")),
    curves=(Curve(Coordinate.POSITION, period="pitch", by_direction=True),),
    fingerprint="narrow peaks of the residual at equal distances along the track",
    excited_by="constant-speed passes over several pitches in both directions",
)  # fmt: skip
