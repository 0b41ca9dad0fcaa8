"""One result of every chapter of the reproduced study, all of whose numbers are different."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from built_results import whiteness_of

from identify.estimation.cable_force import CableForce
from identify.estimation.passes import Passes
from identify.estimation.spikes import Pitch, Spike
from identify.estimation.stribeck_curve import StribeckCurve
from identify.estimation.velocity_map import VelocityMap
from identify.selection.diagnosis import Verdict
from identify.thesis.aging import Aging, Drift
from identify.thesis.cable import CableOfLogs, CableResult
from identify.thesis.chapter import Recovered
from identify.thesis.dynamic import DynamicResult, Trace
from identify.thesis.future import Beside, Elements, FutureResult, Slow
from identify.thesis.informed import Informed
from identify.thesis.models import Drawn, ModelsResult
from identify.thesis.residuals import Candidate, ResidualResult
from identify.thesis.simulation import Sensitivity, SimulationResult
from identify.thesis.track import Along, TrackResult
from identify.thesis.twin import TwinResult
from identify.validation.agreement import Agreement, AxisAgreement, Cause, Difference

RNG = np.random.default_rng(17)


def some(*shape: int, low: float = 0.2, high: float = 3.0) -> np.ndarray:
    """Numbers of which no two are alike."""
    return RNG.uniform(low, high, shape)


def recovered(unit: str, *off: float, true: float = 2.0, printed: float | None = None):
    return Recovered(true, true * (1.0 + np.array(off)), unit, printed)


def drawn(gap: float) -> Drawn:
    return Drawn(some(7), some(7), gap)


MODELS = ModelsResult(
    laws=("dahl", "gms", "lugre"),
    behaviours=("map", "drift"),
    ratios=np.array([
        [[1.01, 1.02], [5.3, 6.1], [1.11, 1.12]],
        [[31.0, 37.0], [1.03, 1.04], [2.3, 3.1]],
        [[41.0, 43.0], [7.1, np.nan], [1.06, 1.07]],
    ]),
    right=np.array([1.0, 0.5, 0.625]),
    seconds=np.array([0.31, 0.47, 0.62]),
    step=np.array([21e-9, 37e-9, 53e-9]),
    starts=8,
    loops={"dahl": drawn(0.0171), "gms": drawn(0.0), "lugre": drawn(0.0233)},
    nested={"dahl": drawn(0.0411), "gms": drawn(0.0013), "lugre": drawn(0.0377)},
)  # fmt: skip

STATIC_MAP = VelocityMap(
    np.array([0.01, -0.02, 0.2, -0.1, 0.05]), some(5), some(5), np.array([9.0, 8, 7, 6, 5])
)
FOUND = {
    "Fc": recovered("N", 1e-4, 3e-4, true=0.285, printed=0.2851),
    "Fs": recovered("N", -2e-4, -5e-4, true=0.335, printed=0.3349),
    "v0": recovered("m/s", 2e-2, 4e-2, true=0.01, printed=0.0103),
    "sigma2": recovered("N s/m", -1e-4, -6e-4, true=0.018, printed=0.0179),
    "sigma0": recovered("N/m", 3e-4, 1e-4, true=260.0, printed=259.9927),
    "sigma1": recovered("N s/m", 4e-4, 7e-4, true=0.6, printed=None),
}
SIMULATION = SimulationResult(
    map=STATIC_MAP,
    true=StribeckCurve(0.285, 0.335, 0.01, 0.018),
    by_snr={
        60.0: FOUND,
        30.0: {
            k: recovered(r.unit, 0.01 * i, 0.03, true=r.true)
            for i, (k, r) in enumerate(FOUND.items())
        },
    },
    sensitivity=Sensitivity(
        np.linspace(0.5, 1.5, 4), {name: (i + 1) * some(4) for i, name in enumerate(FOUND)}
    ),
    trials=2,
)

PASSES = Passes(np.linspace(-0.11, 0.13, 9), some(3, 9), some(3, 9))
CABLE_FOUND = CableForce(
    passes=PASSES, force=some(9), band=some(9, low=0.1, high=0.2), with_all=some(9),
    kept=np.array([True, True, False, False, True, True, True, False, True]),
    spikes=[Spike(0.0113, 0.0021, 0.031, 0.017), Spike(-0.0227, 0.0019, 0.023, -0.013)],
    pitch=Pitch(0.03407, 1.3e-5, 0.011),
)  # fmt: skip
CABLE = CableResult(
    CABLE_FOUND, CABLE_FOUND.force + np.array([0.05, -0.08, 0.31, 0.02, -0.4, 0.0, 0.01, 0.3, 0.2]),
    recovered("m", 0.002, true=0.034, printed=0.034), 5, 0.0031,
)  # fmt: skip
CABLE_OF_LOGS = CableOfLogs(CABLE_FOUND)

PLACES = np.array([-0.13, -0.09, -0.02, 0.04, 0.11])


def along(unit: str, off: float) -> Along:
    planted = some(5)
    wrong = off * np.array([0.3, -1.0, 0.2, 0.5, -0.4])
    return Along(planted * (1.0 + wrong), np.full(5, 0.45 * off) * planted, planted, unit)


UNITS = {"Fc": "N", "Fs": "N", "v0": "m/s", "sigma2": "N s/m"}
TRACK = TrackResult(
    PLACES,
    {w: {n: along(u, 0.01 * (i + 2) + 0.03 * (w > 0)) for i, (n, u) in enumerate(UNITS.items())}
     for w in (1.0, -1.0)},
    {w: {n: along(u, 0.001 * (i + 2) + 0.003 * (w < 0)) for i, (n, u) in enumerate(UNITS.items())}
     for w in (1.0, -1.0)},
)  # fmt: skip

DYNAMIC = DynamicResult(
    places=PLACES[:2],
    closed=Informed(0.0123, 0.0457, {"sigma0": 3.1, "sigma1": 7.7}, {"sigma0": 0.7, "sigma1": 0.1}),
    opened=Informed(0.211, 0.0459, {"sigma0": 0.013, "sigma1": 0.029}, {"sigma0": 1.1}),
    simplex={
        "sigma0": recovered("N/m", 0.07, -0.03, true=260.0),
        "sigma1": recovered("N s/m", 0.5, 0.9, true=0.6),
    },
    fitted={
        "sigma0": recovered("N/m", 0.002, -0.001, true=260.0),
        "sigma1": recovered("N s/m", 0.004, 0.007, true=0.6),
    },
    seconds=(3.7, 0.19),
    first_period=np.array([[5.1e-4, 1.3e-8], [4.7e-4, 1.7e-8]]),
    afterwards=np.array([[3.1e-5, 2.3e-9], [3.7e-5, 1.9e-9]]),
    trace=Trace(np.linspace(0.0, 6.0, 11), some(11), some(11), some(11)),
)

WHITE = whiteness_of(0.004)
COLOURED = replace(
    WHITE, correlations=[replace(c, value=c.value + 0.4) for c in whiteness_of().correlations]
)
RESIDUALS = ResidualResult(
    first="lugre",
    planted="gms",
    verdict=next(iter(Verdict)),
    named=("gms",),
    ranking=[Candidate(f"effect_{i}", 100.0 / (i + 1), 1.13 + i) for i in range(9)],
    before=COLOURED,
    after=WHITE,
    error_before=0.0431,
    error_after=0.00219,
    floor=0.00207,
    delay=1.3e-4,
    values={"Fc": recovered("N", 0.004, true=0.31), "v0": recovered("m/s", -0.02, true=0.012)},
)


def drift(level: float, slope: tuple[float, float]) -> Drift:
    return Drift(
        np.array([1.0, 4.0, 9.0]) + level, level + some(3) / 50, some(3) / 100,
        level + some(3) / 50, "N", slope,
    )  # fmt: skip


FUTURE = FutureResult(
    elements=[Elements(1, 0.0, 7.3), Elements(4, 913.0, 1.07), Elements(6, 871.0, 1.11)],
    planted=4,
    beside=[
        Beside("lugre", 0, 0.0413, 0.0437), Beside("empirical_map", 31, 0.0279, 0.0291),
        Beside("learned_residual", 27, 0.0253, 0.0267), Beside("gms", 3, 0.00213, 0.00227),
    ],
    floor=0.00211,
    slow=Slow(
        np.array([1e-4, 3e-4, 1e-3]), np.array([0.41, 0.43, 0.47]), np.array([0.23, 0.39, 0.45]),
        np.array([0.4105, 0.4299, 0.4713]),
    ),
    aging=Aging(
        drift(0.3, (0.0021, 0.0002)), drift(0.5, (0.0003, 0.0004)),
        {"wear.rate": recovered("1/m", 0.03, true=0.002),
         "thermal_drift.share": recovered("1", -0.04, true=0.25)},
        1.17, {"wear.rate": 0.00013},
    ),
)  # fmt: skip


def differences(*ratios: float) -> AxisAgreement:
    return AxisAgreement(
        [
            Difference(f"p{i}", 2.0 + i, 2.0 + i + ratio * (0.1 + 0.01 * i), 0.1 + 0.01 * i, unit,
                       3.1)
            for i, (ratio, unit) in enumerate(zip(ratios, ("kg", "N", "N s/m"), strict=False))
        ],
        (), (), (), (1.02, 1.07), "N", 0.0139, (Cause("payload_mass", 0.93),),
    )  # fmt: skip


TWIN = TwinResult(
    alike=Agreement({"x": differences(0.7, -1.9, 2.3)}),
    changed=Agreement({"x": differences(11.0, -1.3, -4.7)}),
    added=0.153,
    errors={"position": 2.3e-5, "velocity": 4.1e-3, "acceleration": 0.117, "force": 0.053},
)
CHAPTERS = {
    "models": MODELS, "simulation": SIMULATION, "cable": CABLE, "track": TRACK,
    "dynamic": DYNAMIC, "residuals": RESIDUALS, "future": FUTURE, "twin": TWIN,
}  # fmt: skip
