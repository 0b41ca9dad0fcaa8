"""The public EMPS task: command in, position out, the whole pulses record without a restart.

A. Janot, M. Gautier, M. Brunot, *Data Set and Reference Models of EMPS*, 2019. Fitted on the first
record, judged on the one with pulses. With four parameters the least error on the first record is
found from every start; with six, places with errors within 1 % of each other on it have 5 to 8 mm
on the pulses. Fitted to the pulses record itself the diagnosed model simulates it far better, so
the friction of the two records differs: that limits the task. The last two figures say what the
published one is of: MuJoCo's friction fits the first record worse than Coulomb's (3.18 instead of
2.87 mm) and simulates the second better.
"""

from __future__ import annotations

from pathlib import Path
from time import process_time

import identify
from benchmarks.emps_frictions import error, exact, least, least_of_all, mujoco
from benchmarks.figures import Figure, Target
from twin.effects import Catalogue, load_catalogue
from twin.importers import import_log, load_mapping
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import Fitted, MachineModel

TITLE = "EMPS: position simulated from the command over the whole pulses record"
ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data" / "emps"
TEST_FUNCTION = 0.2  # s
PUBLISHED = Target(high=6.63)  # mm, mujoco.sysid with four parameters; pNARX: 5.17 mm


def measure() -> list[Figure]:
    """RMS position errors of the four-parameter model and of the diagnosed one, mm."""
    if not DATA.is_dir():
        return [Figure("EMPS", None, note=f"the measurements are not in {DATA.name}")]
    catalogue = load_catalogue()
    mapping = load_mapping(ROOT / "examples" / "import_emps.toml")
    run, pulses = (
        import_log(DATA / f"{name}.mat", mapping) for name in ("DATA_EMPS", "DATA_EMPS_PULSES")
    )
    four = load_model(ROOT / "examples" / "emps.toml", catalogue)
    six = _diagnosed(four, catalogue)
    itself = identify.fit_simulation(
        identify.fit(six, {"pulses": pulses}, test_function=TEST_FUNCTION)
    )
    return [
        *_judged("four parameters", four, run, pulses),
        *_judged("with asymmetric friction, as diagnosed", six, run, pulses),
        Figure("the latter fitted to the pulses record itself", 1e3 * itself.axes["x"].error, "mm"),
        *_frictions(run, pulses),
    ]


def _frictions(run: Log, pulses: Log) -> list[Figure]:
    """The same four parameters by two simulators that are not the product's."""
    first, second = ((log.axes["x"].position, log.axes["x"].force) for log in (run, pulses))
    stops = least_of_all(exact, *first)
    yields, soft = mujoco(), least(mujoco(), stops, *first)
    return [
        Figure(
            f"four parameters: {name}", 1e3 * error(simulated, values, *second), "mm",
            note=f"{1e3 * error(simulated, values, *first):.2f} mm on the first record",
        )
        for name, simulated, values in (
            ("Coulomb friction with exact stops, least of all", exact, stops),
            ("MuJoCo's frictionloss, which yields at standstill", yields, soft),
        )
    ]  # fmt: skip


def _diagnosed(model: MachineModel, catalogue: Catalogue) -> MachineModel:
    """The model with what `twin diagnose` names (tests/identify/selection/test_emps_product.py)."""
    axis = model.axes["x"].with_effect(Fitted.at_start(catalogue["asymmetric_friction"]))
    return model.with_axis("x", axis)


def _judged(name: str, model: MachineModel, run: Log, pulses: Log) -> list[Figure]:
    force = identify.fit(model, {"run": run}, {"pulses": pulses}, test_function=TEST_FUNCTION)
    begun = process_time()
    found = identify.fit_simulation(force)
    seconds = process_time() - begun
    held = found.holdout_error["x"]
    assert held is not None
    before, after = held
    note = f"{1e3 * found.axes['x'].error:.2f} mm on the record it was fitted on, {seconds:.1f} s"
    return [
        Figure(f"{name}: force fit", 1e3 * before, "mm"),
        Figure(f"{name}: fit of simulated motion", 1e3 * after, "mm", PUBLISHED, note),
    ]
