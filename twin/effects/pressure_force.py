"""Force of a pressure on a piston: a cylinder, a bellows, a vacuum preload.

F = area p + area_2 p_2, with the pressures as logged; the second is that of the other chamber, and
its area has the other sign. On a rotary axis an area is a displacement, m^3 a radian.
"""

from twin.effect import MOST, OUT, PRESSURE, PRESSURE_2, Effect, Kind, Parameter


def law(p, s, io):
    io[OUT] = p[0] * io[PRESSURE] + p[1] * io[PRESSURE_2]


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="force in proportion to a logged pressure",
    equation="F = area p + area_2 p_2",
    source="H. E. Merritt, Hydraulic Control Systems, 1967, force balance of a piston",
    parameters=(
        Parameter("area", "N/Pa", 0.0, -MOST, MOST, "area under the pressure", strength=True),
        Parameter(
            "area_2", "N/Pa", 0.0, -MOST, MOST, "area under the second pressure", strength=True
        ),
    ),
    law=law,
    fingerprint="residual follows the pressure, whatever the motion",
    excited_by="several pressures, best while the axis moves alike",
)
