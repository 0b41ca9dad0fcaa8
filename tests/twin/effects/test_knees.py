"""Every law says when it is itself, and what it is where the motion does not pass its knee."""

from __future__ import annotations

from dataclasses import replace

import pytest
from effect_runs import CATALOGUE

from twin.effect import Effect, Excitation
from twin.knee import Imitated

SEEN = Excitation(
    position_low=-0.1, position_high=0.2, speed_max=0.5, dry_level=1.0, duration=60.0, period=1e-3,
    force_max=10.0, force_usual=3.0, speed_least=5e-4, shortest=1e-6, longest=10.0,
    fewest_cycles=2.5, resolution=2e-6, other_joints=(1.0, 2.0),
)  # fmt: skip
TRAVEL = SEEN.travel
TURNING = replace(SEEN, position_low=-40.0, position_high=40.0)  # rad


def seen_by(name: str) -> Excitation:
    """A motion that shows the law: of a shaft several turns."""
    return TURNING if name == "unbalance" else SEEN


RIPPLE = [(2.0 * SEEN.resolution, Imitated.ROUNDING), (1e-9, Imitated.ROUNDING), (0.02, None)]
DELAY = [(1e-7, None), (4e-3, None)]
REACH = [  # over a level of half a newton
    (1e15, Imitated.DRY_FRICTION), (1e8, Imitated.DRY_FRICTION), (1e4, None), (100.0, None),
    (0.5 / (0.87 * TRAVEL), Imitated.SPRING), (1e-9, Imitated.SPRING),
]  # fmt: skip
LAYERS = [(1e-9, Imitated.DRY_FRICTION), (1e-3, None), (0.87 * TRAVEL, Imitated.SPRING)]
SPEED = [(1e-5, Imitated.DRY_FRICTION), (0.05, None), (5.0, Imitated.DRY_FRICTION)]

# Of each effect the parameter that moves its knee, and values of it with what the law is there.
CASES: dict[str, dict[str, list[tuple[float, Imitated | None]]]] = {
    "actuator_deadband": {"width": [(0.3, None), (4.0, Imitated.GAIN), (1e3, Imitated.GAIN)]},
    "actuator_delay": {"tau": [*DELAY, (6.0, Imitated.INERTIA)]},
    "actuator_lag": {"tau": [*DELAY, (6.0, Imitated.GAIN)]},
    "actuator_saturation": {
        "limit": [
            (1e-6, Imitated.GAIN), (0.7, Imitated.GAIN), (5.0, None), (9.7, None),
            (10.5, Imitated.NOTHING), (1e6, Imitated.NOTHING),
        ]
    },
    "backlash": {
        "play": [(1e-9, Imitated.LOAD_ON_SPRING), (2e-5, None), (0.4, Imitated.INERTIA)],
        "frequency": [(0.1, Imitated.INERTIA), (100.0, None), (1e4, None)],
    },
    "base_vibration": {
        "frequency": [(0.1, Imitated.INERTIA), (3.0, None), (2e3, Imitated.NOTHING)]
    },
    "cable_hysteresis": {"reach": LAYERS},
    "cogging": {"p": [*RIPPLE, (0.2, Imitated.OF_POSITION)]},
    "dahl": {"sigma0": REACH},
    "dwell_stiction": {
        "time": [(1e-6, Imitated.DRY_FRICTION), (1.0, None), (1e5, None)],
        "slip": [(1e-12, None), (1e-3, None), (1.0, Imitated.DRIFT)],
    },
    "encoder_delay": {"tau": [*DELAY, (6.0, Imitated.INERTIA)]},
    "encoder_ripple": {"period": [*RIPPLE, (0.2, Imitated.OF_POSITION)]},
    "end_stop": {
        "low": [(-0.09, None), (-0.05, Imitated.OF_POSITION)],
        "high": [(0.2, Imitated.NOTHING), (0.19, None), (0.1, Imitated.OF_POSITION)],
        "stiffness": [(1e-3, Imitated.NOTHING), (1e4, None)],
    },
    "flexible_mode": {
        "frequency": [(0.1, Imitated.INERTIA), (60.0, None), (2e3, Imitated.INERTIA)]
    },
    "force_constant_ripple": {"p": [*RIPPLE, (0.2, Imitated.GAIN)]},
    "friction_ripple": {"p": [*RIPPLE, (0.2, Imitated.DRY_FRICTION)]},
    "gms": {"sigma0": REACH},
    "leuven": {"sigma0": REACH},
    "lugre": {"sigma0": REACH},
    "modified_leuven": {"sigma0": REACH},
    "position_dependent_force_constant": {},  # by how the axis moved alone, below
    "position_dependent_friction": {},
    "periodic_disturbance": {
        "f": [(0.1, Imitated.DRIFT), (7.0, None), (3e3, Imitated.NOTHING)]
    },
    "presliding_hysteresis": {"reach": LAYERS},
    "roller_spikes": {
        "width": [(1e-9, Imitated.ROUNDING), (4e-3, None), (0.5, Imitated.CONSTANT)],
        "pitch": [(0.034, None), (0.25, Imitated.OF_POSITION)],
    },
    "shear_thinning": {"vt": [(1e-5, Imitated.OF_SPEED), (0.5, None), (50.0, Imitated.OF_SPEED)]},
    "stribeck": {"v0": SPEED},
    "thermal_drift": {"tau": [(1e-3, Imitated.OF_SPEED), (20.0, None), (1e4, None)]},
    "transmission_coupling": {"joint": [(1.0, None), (0.0, Imitated.OF_THIS_JOINT)]},
    "unbalance": {"gear": [(1.2, None), (10.0, None), (30.0, Imitated.SPRING)]},
    "varying_inertia": {"p": [(1e-9, Imitated.ROUNDING), (0.2, None), (4.0, Imitated.INERTIA)]},
}  # fmt: skip
PHYSICAL = [e for e in CATALOGUE.values() if not e.is_nonparametric]


def values_of(effect: Effect) -> dict[str, float]:
    """Values of a law that acts: its start on this motion, with strengths of a half but a few."""
    values = {**effect.starts(SEEN), **dict.fromkeys((p.name for p in effect.strengths), 0.5)}
    given = {
        "low": -0.11, "high": 0.19, "stiffness": 1e4, "joint": 1.0, "width": 1e-3,
        "f1": 0.1, "f2": 0.1, "f3": 0.1,
    }  # fmt: skip
    return {**values, **{n: v for n, v in given.items() if n in values}}


def test_every_law_with_a_knee_has_a_case():
    assert {e.name for e in PHYSICAL if e.knees} == set(CASES)


@pytest.mark.parametrize("effect", PHYSICAL, ids=lambda e: e.name)
def test_a_law_that_is_not_linear_in_what_is_free_says_when_it_is_itself(effect):
    shapes = [p for p in effect.parameters if not (p.strength or p.fixed or p.lower == p.upper)]
    assert not shapes or effect.knees
    assert effect.imitation(values_of(effect), seen_by(effect.name)) is None


@pytest.mark.parametrize("name", CASES)
def test_a_law_whose_knee_the_motion_does_not_pass_is_another(name):
    effect = CATALOGUE[name]
    for parameter, cases in CASES[name].items():
        for value, imitated in cases:
            found = effect.imitation({**values_of(effect), parameter: value}, seen_by(name))
            assert (found and found.of) is imitated, (parameter, value)
            if found:
                assert (found.size < found.edge) or (found.size > found.edge)


@pytest.mark.parametrize(
    "name",
    ["position_dependent_friction", "friction_ripple", "position_dependent_force_constant"],
)
def test_what_varies_along_the_track_is_a_force_of_position_where_the_axis_moves_one_way(name):
    effect = CATALOGUE[name]
    for share, imitated in [(0.0, Imitated.OF_POSITION), (0.2, Imitated.OF_POSITION), (1.0, None)]:
        found = effect.imitation(values_of(effect), replace(SEEN, both_ways=share))
        assert (found and found.of) is imitated


def test_the_reach_of_layers_is_that_of_those_that_carry():
    """A first layer without force reaches nowhere."""
    effect = CATALOGUE["presliding_hysteresis"]
    values = {"reach": 0.87 * TRAVEL, "f0": 0.0, "f1": 0.0, "f2": 1.0, "f3": 1.0}
    assert effect.imitation(values, SEEN) is None


def test_a_dahl_without_a_bound_is_a_spring():
    values = {"Fc": 5e14, "sigma2": 0.0, "sigma0": 150.0, "n": 1.0}
    found = CATALOGUE["dahl"].imitation(values, SEEN)
    assert found is not None
    assert (found.of, found.knee.name) == (Imitated.SPRING, "reach")
    assert found.edge == pytest.approx(0.5 * TRAVEL)


def test_contacts_that_only_bend_do_not_age_anew():
    """Beside a friction with memory: named under an encoder's steps with a slip of 2.3 of 18 um."""
    bends = CATALOGUE["lugre"].presliding({**values_of(CATALOGUE["lugre"]), "sigma0": 25e3}, SEEN)
    assert bends == pytest.approx(0.5 / 25e3)
    assert CATALOGUE["stribeck"].presliding(values_of(CATALOGUE["stribeck"]), SEEN) == 0.0
    dwell, seen = CATALOGUE["dwell_stiction"], replace(SEEN, presliding=bends)
    for slip, imitated in [(0.2 * bends, Imitated.WITHOUT_PEAK), (5.0 * bends, None)]:
        found = dwell.imitation({**values_of(dwell), "slip": slip}, seen)
        assert (found and found.of) is imitated
