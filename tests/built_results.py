"""One small result of every kind, all of whose numbers are different."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from built_fits import PLAIN, axis_of, built, built_dataset, built_fit, fitted, step

from identify.dataset.dataset import Role
from identify.estimation.confounded import MovedParameter, ParameterShift, Refit
from identify.estimation.errors import Errors
from identify.estimation.fit import Outcome
from identify.estimation.intervals import Estimate, NotExcited
from identify.estimation.open_loop import Beginning
from identify.estimation.residual_dependence import Dependence, Repeat
from identify.estimation.simulated_motion import MotionFit
from identify.experiment_design.discrimination import SimulatedExperiment
from identify.experiment_design.missing_excitation import Gap
from identify.experiment_design.plan import Plan
from identify.mechanism.bodies import WrongBody
from identify.output.printing import to_text  # noqa: F401 - results print themselves
from identify.results.grown import Addition
from identify.results.results import (
    AxisSummary,
    Comparison,
    Diagnosis,
    Feedforward,
    FitResult,
    SimulationFit,
    with_all_found,
)
from identify.selection.acceptance import Score, Taken
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import Finding
from identify.validation.agreement import AxisAgreement, Cause, Difference
from identify.validation.comparison import AxisComparison
from identify.validation.misfit_maps import MisfitMap, Region
from identify.validation.tracking import AxisTracking, TrackingError
from identify.validation.whiteness import Correlation, Feedback, ResidualTests
from twin.experiments.kinds import Passes, Tracking
from twin.feedforward import followed
from twin.model.machine import HistoryStep, MachineModel
from twin.model.parameters import free_parameters, read, write

DATASET = replace(built_dataset("run 1", "run 2", held=("held 1",)), channel_delay=0.000217)
RNG = np.random.default_rng(9)


def estimates(offset: float) -> tuple[Estimate, ...]:
    """Free with an interval, free without one, and held."""
    o = offset
    return (
        Estimate("mass", 5.31 + o, "kg", 5.23 + o, 5.47 + o, True),
        Estimate("cogging.p", 0.0241 + o, "m", None, None, True, NotExcited()),
        Estimate("coulomb_viscous.Fs", 0.337 + o, "N", None, None, False),
    )


def refit_of(offset: float) -> Refit:
    first = ParameterShift(
        "mass", 15.1 + offset, 15.7 + offset, "kg", 0.572 + offset, ("payload_mass",)
    )
    second = ParameterShift("cogging.a1", 0.113 + offset, 0.127 + offset, "N", 0.219 + offset)
    return Refit(0.913 + offset, 0.127 + 2 * offset, (first, second))


def candidate(name: str, o: float, *, bic: float = 510.0, t: float = 9.1, **values: float):
    fit = built_fit(1.19 + o, 1.03 + o, axis_of().with_effect(fitted(name, **values)))
    return built(name, bic + 100 * o, t + o, 7.13 + o, 2.17 + o, fit=fit)


BEST = candidate("cogging", 0.0, p=0.0261, a1=0.127, b1=0.0353)
RIVAL = candidate("quadratic_drag", 0.21, bic=402.0)
WEAK = candidate("constant_force", 0.33, bic=33.0, t=1.0, F0=0.0717)
LATER = candidate("lugre", 0.44, bic=205.0)

CHOSEN = Passes("x", 0.0831, 0.0127, 7)
TRIALS = (
    SimulatedExperiment(
        CHOSEN, 8.3, 0.0412, 0.0113, 57.3, DATASET.training[0], np.array([0.3, 0.1])
    ),
    SimulatedExperiment(
        Tracking(9.7), 9.9, 0.0287, 0.0107, 31.9, DATASET.training[1], np.array([0.2, 0.1])
    ),
)


def plan_of(*between: str, **changes: object) -> Plan:
    plan = Plan(
        axis="x", between=between, ranking=TRIALS, gap=Gap("speed", "m/s", 0.0137, 0.0591, 0.0117),
        favoured_by_the_logs=None, excited_by={between[0]: "slow passes"}, supposed=False,
    )  # fmt: skip
    return replace(plan, **changes)


def errors(before: float, after: float, on: Role = Role.SELECTION) -> tuple[Errors, Errors]:
    """Test errors, and those on the logs that chose."""
    chosen = Errors(before, after, Role.SELECTION)
    return replace(chosen, on=on), chosen


def score_of(part: float, t: float, control: float) -> Score:
    return Score(Taken(t, part, part), Taken(t + 1.3, part + 0.01, part), control)


FOUND = (
    Finding("cogging", ("quadratic_drag",), 0.871, *errors(7.17, 2.19), "N",
            {"p": 0.0261, "a1": 0.127}, score_of(0.813, 7.7, 0.137),
            parameter_units={"p": "m", "a1": "N"},
            equation="F = a1 sin(2 pi x/p)"),
    Finding("lugre", (), 0.119, *errors(3.23, 2.19), "N", {"Fc": 0.31}, score_of(0.417, 4.3, 0.071),
            parameter_units={"Fc": "N"}),
)  # fmt: skip
BASE, FINAL = built_fit(8.37, 2.11, PLAIN), built_fit(3.19, 2.03, BEST.fit.axis)


def diagnosis_of(
    verdict: Verdict = Verdict.MISSING_EFFECTS,
    findings: tuple[Finding, ...] | None = None,
    on: Role = Role.SELECTION,
    **changes: object,
) -> AxisDiagnosis:
    """A diagnosis that names cogging and lugre; of another verdict nothing. on: logs told of."""
    named = verdict is Verdict.MISSING_EFFECTS
    told = findings if findings is not None else FOUND if named else ()
    steps = (step(BEST, RIVAL), step(LATER, dropped=("wear",))) if named else ()
    found = AxisDiagnosis(
        DATASET, BASE, (BEST, RIVAL, WEAK), steps, FINAL if told else BASE, verdict, told
    )
    found = replace(found, **changes)
    tested, chosen = errors(7.81, 2.39 if told else 7.81, on)
    found.__dict__.update(tested=tested, chosen=chosen)
    return found


def summary_of(found: AxisDiagnosis) -> AxisSummary:
    """The summary of a built diagnosis."""
    before = estimates(0.5)[::2]
    after = before if found.final is found.base else estimates(0.0)
    floors = {Role.TRAINING: 2.03, Role.SELECTION: 2.17} if found.dataset.selection else {}
    floors = {Role.TRAINING: 2.03, **floors}
    return AxisSummary(before, after, (), found.tested, found.chosen, floors)


STRUCTURE = Dependence(
    0.631, "other_axis_position", 0.0273, "m", {"time": 0.117, "position": 0.231}
)
LEFT_OVER = Region("speed", "m/s", 0.0137, 0.0291, 4.71, 2.32, 0.417, "N", 0.13)
REPEAT = Repeat(0.00253, {"run 1": 1.07, "run 2": 0.93}, {"run 1": 0.31, "run 2": 2.13})


def map_of(coordinate: str, unit: str, offset: float) -> MisfitMap:
    edges = np.array([0.01, 0.03, 0.06, 0.1]) + offset
    return MisfitMap(
        coordinate, unit, 0.5 * (edges[1:] + edges[:-1]) + 0.001, edges[:-1], edges[1:],
        np.array([0.11, -0.12, 0.13]) + offset, np.array([0.71, 0.52, 0.33]) + offset,
        np.array([0.61, 0.27, 0.12]) + offset, np.array([0.21, 0.34, 0.0]) + offset / 10,
        np.array([0.041, 0.052, 0.063]) + offset,
    )  # fmt: skip


def correlation(signal: str, o: float) -> Correlation:
    lag = 0.02 * np.arange(-2, 3)
    value = np.array([0.05, -0.31, 0.9, 0.07, 0.02]) + o
    tested = np.array([False, False, False, True, True])
    return Correlation(signal, lag, value, tested, 0.061 + o, 0.113 + o)


SIGNALS = ("residual", "command", "speed")


def whiteness_of(o: float = 0.0) -> ResidualTests:
    edges = np.linspace(-0.5, 0.5, 6) + o
    density = np.array([0.1, 0.9, 2.3, 1.1, 0.6]) + o
    made = tuple(correlation(n, o + i / 1e3) for i, n in enumerate(SIGNALS))
    return ResidualTests(Feedback.OPEN, 387, 0.0737 + o, edges, density, 0.883 - o, made)


def comparison_of(axis: str = "x", o: float = 0.0) -> AxisComparison:
    residual = np.concatenate([RNG.standard_normal(len(w)) for w in DATASET.training])
    position = np.linspace(-0.031, 0.047, len(residual))
    place = 0.0123 + o, 0.0257 + o
    return AxisComparison(
        axis=axis,
        force_error={"run 1": 0.0517 + o, "run 2": 0.0731 + o},
        floor=0.0113 + o,
        position_error={"run 1": 3.17e-6 + o, "run 2": 4.29e-6 + o},
        position_drift_of_noise={"run 1": 2.13e-7 + o, "run 2": 2.57e-7 + o},
        residual=residual * (0.0647 + o) / np.sqrt(np.mean(residual**2)),
        logs=DATASET.training,
        coordinates={
            "position": position, "velocity": 3.0 * position[::-1],
            "roller_spikes_phase": np.mod(position, 0.034),
        },
        maps=[map_of("position", "m", o), map_of("velocity", "m/s", o + 0.011)],
        worst=[
            Region("position", "m", *place, 0.121 + o, 14.3 + o, 0.37 + o, visited=0.07),
            Region("direction", "1", -1.5, 0.0, 0.087 + o, 7.7 + o, 0.53 + o, "N", 0.31),
        ],
        tests=whiteness_of(o),
        kept=np.ones(len(residual), dtype=bool),
    )  # fmt: skip


MODEL = MachineModel("the stage", {"x": PLAIN, "y": replace(PLAIN, mass=7.9)})


def compared() -> Comparison:
    return Comparison(MODEL, {"x": comparison_of(), "y": comparison_of("y", 0.0019)})


def diagnosed(x: AxisDiagnosis | None = None) -> Diagnosis:
    """x as given, and y where nothing is missing."""
    other, quiet = replace(DATASET, axis="y", channel_delay=0.0), built_fit(1.07, 0.97)
    y = diagnosis_of(
        Verdict.NOTHING_MISSING, dataset=other, base=quiet, final=quiet,
        ranking=(replace(WEAK, axis="y"),),
    )  # fmt: skip
    axes = {"y": y, "x": x or diagnosis_of()}
    summaries = {axis: summary_of(d) for axis, d in axes.items()}
    summaries["y"] = replace(summaries["y"], floors={Role.TRAINING: 0.97, Role.SELECTION: 0.99})
    return Diagnosis(
        MODEL, axes, compared(), summaries,
        {"x": plan_of("cogging", "quadratic_drag")}, {"x": refit_of(0.0), "y": refit_of(0.01)},
        left_over={"x": LEFT_OVER} if x and x.unexplained else {},
        model=MODEL if x and x.final is not FINAL else with_all_found(MODEL, axes, summaries),
        free_runs={"x": {"run 1": 4.1e-7, "run 2": 3.9e-7}},
    )  # fmt: skip


def wrong_body() -> WrongBody:
    """A heavier fore arm, whose mass and half of whose inertia the joints do not tell."""
    change = np.array([0.0, 0.12, 0.0, -0.01, 0.0, 0.024, 0.02, 0.0, 0.0, 0.0])
    band = np.array([np.nan, 2e-3, 1e-3, 3e-3, np.nan, 1e-3, 2e-3, *3 * [np.nan]])
    inertial = np.array([2.0, 0.3, 0.0, 0.0, 0.02, 0.08, 0.08, 0.0, 0.0, 0.0])
    errors = {"x": errors_of(0.56, 0.0022), "y": errors_of(3.16, 0.02)}
    return WrongBody(
        "fore", "y", ("upper",), ("x", "y"), inertial, change, band, score_of(0.98, 14.0, 0.3),
        errors,
    )  # fmt: skip


def errors_of(before: float, after: float) -> Errors:
    """On the selection logs, N."""
    return errors(before, after)[0]


def fit_result() -> FitResult:
    x = built_fit(0.0513, 0.0127, outcome=Outcome.AT_BOUND)
    y = built_fit(0.0317, 0.0131)
    datasets = {"x": DATASET, "y": replace(DATASET, axis="y", channel_delay=0.0)}
    result = FitResult(
        MODEL, datasets, {"x": x, "y": y}, {"x": estimates(0.0), "y": estimates(0.02)},
        {"x": 0.0611, "y": None}, {"x": None, "y": 0.0733}, MODEL,
        {"x": refit_of(0.0), "y": Refit(0.0319, 0.0317, ())},
    )  # fmt: skip
    return result


def simulation_fit(outcome=Outcome.CONVERGED, held=(6.1e-3, 4.3e-3)) -> SimulationFit:
    where = free_parameters(PLAIN)
    now = write(PLAIN, where, read(PLAIN, where) * 1.07)
    beginnings = [Beginning(3, 0.011, -0.21, np.zeros(1)), Beginning(5, 0.013, 0.23, np.zeros(1))]
    logs = built_dataset("one", "two").training
    fit = MotionFit(now, PLAIN, logs, beginnings, outcome, (7.1e-3, 5.3e-3, 9.7e-3))
    fit.__dict__["errors"] = (np.array([3e-3, -4e-3]),)
    fit.__dict__["error_begun"] = 8.5e-3
    return SimulationFit(None, SimpleNamespace(not_fitted=["z"]), {"x": fit}, {"x": held})  # type: ignore[arg-type]


def differences(*ratios: float) -> AxisAgreement:
    """Parameters p0, p1, ... that differ by so many joint standard errors."""
    shown = {
        f"p{i}": Difference(2.0 + i, 2.0 + i + ratio * (0.1 + 0.01 * i), 0.1 + 0.01 * i, unit, 3.1)
        for i, (ratio, unit) in enumerate(zip(ratios, ("kg", "N", "N s/m"), strict=False))
    }
    cause = Cause("payload_mass", 0.93)
    return AxisAgreement(shown, (), (), (), (1.02, 1.07), "N", 0.0139, (cause,))


SAME = differences(0.7, -1.9, 2.3)
OTHER = replace(
    differences(11.0, -1.3, -4.7), only_in_a=("wear",), only_in_b=("gms", "cogging"),
    not_compared=("p7",), error_over_noise_floor=(7.3, 1.9),
    causes=(Cause("payload_mass", 0.61, ("constant_force",)), Cause("wear", 0.23)),
)  # fmt: skip


STEPS = (
    HistoryStep("add", "cogging", "x", 7.31, 4.57, 7.83, 4.91, notes=("mass moved",)),
    HistoryStep(
        "add", "lugre", "x", 4.53, 2.29, 4.97, 2.71, test_error_before=5.03, test_error_after=2.83
    ),
    HistoryStep("replace", "wear", "y", 3.41, 3.13, None, None),
)


MOVED = MovedParameter("mass", 5.31, 5.47, "kg", False)


def addition(kept: bool = True) -> Addition:
    return Addition(
        MODEL,
        STEPS[0],
        BEST if kept else WEAK,
        kept,
        (3.71e-6, 1.93e-6),
        1.97e-6,
        (MOVED,),
        position_error_on="run 1",
        notes=("mass moved", "the errors told flatter it"),
    )


def feedforward() -> Feedforward:
    """Of a model whose static friction no feedforward holds."""
    every = (TrackingError(o * 1e-6, 3.1 * o * 1e-6) for o in (9.7, 4.3, 1.9))
    found = AxisTracking(
        "m", *every, {"cogging": 2.3e-6, "lugre": 7.1e-7}, followed(MODEL.axes["x"]).lost
    )
    return Feedforward(MODEL, MODEL, ("run 1", "run 2"), {"x": found})
