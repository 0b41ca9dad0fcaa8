"""What is said of a frequency response, of made-up numbers that are all different."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan, pi

import numpy as np
import pytest

from identify.frequency.of_logs import AxisFrequency, Bias, Shown
from identify.frequency.plant import Banded, Loop, Mode, Plant
from identify.frequency.response import Response
from identify.output.as_json import json_of
from identify.output.printing import to_text  # noqa: F401 - results print themselves
from identify.output.shown.frequency import read_off
from identify.results.frequency import FrequencyResponse
from twin.model.units import LINEAR, ROTARY

COUNT = 5
ONES = np.ones(COUNT)
TELLING = np.array([False, True, True, True, False])
RESPONSE = Response(
    frequency=np.array([1.0, 2.5, 6.0, 17.3, 40.0]), plant=ONES * (0.6 + 0.8j), spread=0.5 * ONES,
    noise=0.4 * ONES, closed=0j * ONES, coherence=0.9 * ONES,
    band=np.where(TELLING, 0.1, 0.7), strength=100.0 * ONES, period=1e-3,
)  # fmt: skip
MODE = Mode(Banded(77.5, 0.31), Banded(0.023, 0.0017), Banded(0.5, 0.1))
PLANT = Plant(
    mass=Banded(3.1, 0.02), damping=Banded(4.2, 0.3), stiffness=Banded(510.0, 11.0),
    delay=Banded(1.3e-3, 2e-5), modes=(MODE,), fitted=RESPONSE.plant, misfit=1.0,
)  # fmt: skip
LOOP = Loop(RESPONSE.plant, 13.7, 0.25 * pi, 4.3, 1.61, False)
SHOWN = Shown(RESPONSE, PLANT, LOOP)
AXIS = AxisFrequency(LINEAR, SHOWN, None)


def told(shown: Shown, axis: AxisFrequency = AXIS) -> dict[str, str]:
    return dict(read_off(shown, axis))


def test_what_is_read_off_is_told_with_its_band() -> None:
    assert told(SHOWN) == {
        "frequencies": "3 of 5 usable, 2.50 to 17.3 Hz",
        "spread": (
            "50 % of the response, of whose variance 36 % repeats and so is no noise (medians)"
        ),
        "mass": "3.100 ± 0.020 kg",
        "viscous damping": "4.20 ± 0.30 N·s/m",
        "stiffness": "510 ± 11 N/m",
        "delay": "1.300 ± 0.020 ms, 1.30 samples",
        "resonance": (
            "77.50 ± 0.31 Hz, damping ratio 0.0230 ± 0.0017, motor and encoder on one side"
        ),
        "loop by the setpoint, if nothing is fed forward": (
            "crossover 13.7 Hz, phase margin 45 degrees, gain margin 4.30, largest sensitivity 1.61"
        ),
    }


def test_of_a_rotary_axis_it_has_its_own_units() -> None:
    turning = told(SHOWN, replace(AXIS, units=ROTARY))
    assert turning["inertia"] == "3.100 ± 0.020 kg·m²"
    assert turning["viscous damping"].endswith("N·m·s/rad")
    assert turning["stiffness"].endswith("N·m/rad")


def test_what_a_band_does_not_tell_from_zero_is_not_told() -> None:
    for name, value in (("damping", 0.59), ("stiffness", 21.9)):
        band = getattr(PLANT, name).band
        unsure = replace(PLANT, **{name: Banded(value, band)})
        sure = replace(PLANT, **{name: Banded(2.01 * band, band)})
        words = {"damping": "viscous damping"}.get(name, name)
        assert words not in told(replace(SHOWN, plant=unsure))
        assert words in told(replace(SHOWN, plant=sure))


def test_several_resonances_are_counted_and_each_has_its_side() -> None:
    beyond = replace(MODE, frequency=Banded(120.0, 2.0), gain=Banded(-0.4, 0.1))
    both = told(replace(SHOWN, plant=replace(PLANT, modes=(MODE, beyond))))
    assert both["resonance 1"].endswith("motor and encoder on one side")
    assert both["resonance 2"].startswith("120.0 ± 2.0 Hz")
    assert both["resonance 2"].endswith("beyond the spring")


@pytest.mark.parametrize(
    ("loop", "name", "said"),
    [
        (None, "loop", "not told, as the setpoint is fed forward, or there is none"),
        (
            replace(LOOP, crossover=nan, phase_margin=nan, gain_margin=nan, by_controller=True),
            "loop of the model's controller",
            "no crossover in the band, largest sensitivity 1.61",
        ),
    ],
)
def test_a_loop_is_told_by_what_it_is_known(loop: Loop | None, name: str, said: str) -> None:
    assert told(replace(SHOWN, loop=loop))[name] == said


def test_what_does_not_tell_is_said_to() -> None:
    nothing = replace(SHOWN, response=replace(RESPONSE, band=0.7 * ONES))
    (said,) = read_off(nothing, AXIS)
    assert said == (
        "frequencies",
        "none tells; the band of the response reaches zero at each",
    )
    few = told(replace(SHOWN, plant=None))
    assert few["mass"].startswith("too few frequencies to read it off")
    assert "delay" not in few
    unknown = told(replace(SHOWN, response=replace(RESPONSE, noise=nan * ONES)))
    assert "spread" not in unknown
    without = told(replace(SHOWN, response=replace(RESPONSE, closed=nan * ONES)))
    assert "what noise makes of the force in a closed one counts" in without["setpoint"]
    early = told(replace(SHOWN, plant=replace(PLANT, delay=Banded(-2.2e-3, 1e-3))))["delay"]
    assert early.endswith("none can be; the force is logged late, or its sign is reversed")
    endless = replace(PLANT, mass=Banded(3.1, inf))
    assert told(replace(SHOWN, plant=endless))["mass"] == "not told"
    assert told(SHOWN, replace(AXIS, bias=Bias(3.0, None))).keys() == {
        "frequencies",
        "spread",
    }


def caution(axis: AxisFrequency) -> str:
    return str(FrequencyResponse(("run 1", "run 2"), {"x": axis}))


def test_it_says_what_friction_does_to_its_values() -> None:
    alone = caution(AXIS)
    assert alone.startswith("force to position, from run 1 and run 2")
    assert "friction adds to these values; with MODEL, whose simulation shows how much" in alone
    assert ", in simulation on the same setpoint" not in alone
    modelled = replace(AXIS, modelled=SHOWN)
    beside = caution(modelled)
    assert "friction adds to these values; the model's own mass comes back from" in beside
    assert beside.count("model, in simulation on the same setpoint") == 1
    assert beside.count("measured, in simulation") == 0
    biased = Bias(3.0, Banded(3.6, 0.1))
    assert "of the model's own 3.00 kg its simulation on this motion shows 3.60 ± 0.10 kg" in (
        caution(replace(modelled, bias=biased))
    )
    least = caution(replace(AXIS, bias=Bias(3.0, None)))
    assert "of the 3.00 kg that least squares with friction find this response shows none" in least


def test_its_json_has_the_response_and_what_it_shows_in_the_units_of_the_axis() -> None:
    modelled = replace(SHOWN, plant=None, loop=None)
    axes = {"x": replace(AXIS, modelled=modelled), "a": replace(AXIS, units=ROTARY)}
    told = json_of(FrequencyResponse(("run 1",), axes))
    assert told["logs"] == ["run 1"]
    x, a = (told["axes"][name] for name in "xa")
    assert (x["measured"]["unit"], a["measured"]["unit"]) == ("m/N", "rad/(N m)")
    shown = x["measured"]
    assert shown["frequency"] == RESPONSE.frequency.tolist()
    assert (shown["real"], shown["imaginary"]) == ([0.6] * COUNT, [0.8] * COUNT)
    assert shown["band_90"] == RESPONSE.band.tolist()
    assert shown["noise"] == [0.4] * COUNT
    assert shown["distortion"] == pytest.approx([0.3] * COUNT)  # with the noise it is the spread
    assert shown["plant"]["mass"] == {"value": 3.1, "band": 0.02}
    assert (shown["plant"]["mass_unit"], a["measured"]["plant"]["mass_unit"]) == ("kg", "kg m^2")
    (mode,) = shown["plant"]["modes"]
    assert mode["gain"] == {"value": 0.5, "band": 0.1}
    assert shown["loop"]["phase_margin"] == pytest.approx(0.25 * pi)
    assert x["modelled"]["plant"] is x["modelled"]["loop"] is None
    assert a["modelled"] is None
    assert x["bias"] is None
    biased = json_of(FrequencyResponse(("r",), {"x": replace(AXIS, bias=Bias(3.0, None))}))
    assert biased["axes"]["x"]["bias"] == {"own": 3.0, "back": None}
