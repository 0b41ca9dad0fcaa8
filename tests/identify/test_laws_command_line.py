"""The command line alone: every option reaches its call by name, exit codes, JSON by itself."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import pytest
from stubbed_cli import stub, stubbed

import identify.demo
import identify.experiment_design.signature
import identify.output.report
import identify.output.signature
import identify.selftest
import twin.checks
import twin.checks.long
import twin.experiments.file
import twin.experiments.named
import twin.experiments.setpoint_csv
import twin.importers
import twin.logs
import twin.model.file
from identify import workflow
from identify.cli.shared import sentences
from identify.output import as_json, diagnosis_json, machine_json, machine_text
from identify.output import selftest as selftest_output
from identify.output import text as as_text
from identify.selftest.case import Case
from identify.selftest.tally import Rate
from twin.checks import CheckReport, Fault, Finding, Severity
from twin.model.units import LINEAR


@pytest.fixture
def cli(monkeypatch, capsys, tmp_path):
    """Runs `twin` with all input stubbed: exit code, standard output and standard error."""
    return stubbed(monkeypatch, capsys, tmp_path)


def printed(monkeypatch, name: str) -> None:
    """Both forms of a result are a mark of the form and the result."""
    monkeypatch.setattr(as_text, f"{name}_text", lambda r: f"text of {name}", raising=False)
    told = diagnosis_json if name == "diagnose" else as_json
    monkeypatch.setattr(
        told, f"{name}_json", lambda r, *findings: {"json of": name, "bad": float("nan")}
    )


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


COMMON = ("--test-function", "0.07", "--effects", "e1.py", "--effects", "e2.py")
HELD = ("--holdout", "h1.mcap", "--holdout", "h2.mcap")
TESTED = ("--test", "t.mcap")
LOGS = {"a.mcap": "log a.mcap", "b.mcap": "log b.mcap"}
HOLDOUT = {"h1.mcap": "log h1.mcap", "h2.mcap": "log h2.mcap"}
TEST = {"t.mcap": "log t.mcap"}
NAME = "m.toml ['e1.py', 'e2.py']"


@pytest.mark.parametrize("name", ["fit", "compare", "diagnose"])
def test_the_loop_is_called_with_what_was_given(monkeypatch, cli, name):
    printed(monkeypatch, name)
    model = SimpleNamespace(history=("a step",))
    result = SimpleNamespace(model=model, comparison="the comparison")
    call = stub(monkeypatch, workflow, name, result)
    save = stub(monkeypatch, twin.model.file, "save_model")
    write = stub(monkeypatch, identify.output.report, "write_report")
    held = (*HELD, *TESTED) if name != "compare" else ()
    out = ("-o", "out.html")
    code, text, warned = cli(name, "m.toml", "a.mcap", "b.mcap", *held, *COMMON, *out)
    assert (code, text.strip()) == (0, f"text of {name}")
    assert warned.splitlines() == ["twin: warned of a.mcap", "twin: warned of b.mcap"]
    given, named = call.only
    assert given[0].name == NAME
    assert given[1:] == ((LOGS,) if name == "compare" else (LOGS, HOLDOUT, TEST))
    assert named.pop("test_function") == 0.07
    catalogue = named.pop("catalogue", None)
    assert (catalogue or {}).get("all") == (None if name == "compare" else ["e1.py", "e2.py"])
    assert named == {}
    if name == "fit":
        assert save.only == ((model, Path("out.html")), {})
    else:
        (path,), told = write.only
        assert path == Path("out.html")
        diagnosis = result if name == "diagnose" else None
        comparison = result if name == "compare" else "the comparison"
        assert (told["diagnosis"], told["comparison"]) == (diagnosis, comparison)
        assert told["history"] == (("a step",) if name == "diagnose" else ())
        assert told["title"].startswith(NAME)
    code, text, _ = cli(name, "m.toml", "a.mcap", "--json")
    told = {"json of": name, "bad": None, "left_out": []}
    assert (code, json.loads(text, parse_constant=refuse)) == (0, told)
    assert text.count("\n") == 1
    assert len(save.calls) + len(write.calls) == 1
    given, named = call.calls[-1]
    assert named["test_function"] is None
    assert given[1:] == (({"a.mcap": "log a.mcap"},) if name == "compare" else (
        {"a.mcap": "log a.mcap"}, {}, {},
    ))  # fmt: skip


@pytest.mark.parametrize(("kept", "code"), [(True, 0), (False, 1)])
def test_add(monkeypatch, cli, kept, code):
    printed(monkeypatch, "add")
    result = SimpleNamespace(model="the new model", kept=kept)
    call = stub(monkeypatch, workflow, "add", result)
    save = stub(monkeypatch, twin.model.file, "save_model")
    command = ("add", "wear", "m.toml", "a.mcap", "b.mcap", "-o", "n.toml", "--axis", "y")
    found, text, _ = cli(*command, *HELD, *TESTED, *COMMON)
    assert (found, text.strip()) == (code, "text of add")
    given, named = call.only
    assert (given[0], given[1].name, *given[2:]) == ("W", NAME, LOGS, HOLDOUT, TEST)
    assert named == {"axis": "y", "test_function": 0.07}
    assert save.only == (("the new model", Path("n.toml")), {})
    found, text, _ = cli(*command, "--json")
    assert (found, json.loads(text)) == (code, {"json of": "add", "bad": None, "left_out": []})


@pytest.mark.parametrize(("decides", "code"), [(True, 0), (False, 1)])
def test_plan(monkeypatch, cli, decides, code):
    printed(monkeypatch, "plan")
    chosen = SimpleNamespace(experiment="the experiment", units=LINEAR)
    call = stub(monkeypatch, workflow, "plan", SimpleNamespace(decides=decides, chosen=chosen))
    save = stub(monkeypatch, twin.experiments.file, "save_experiment")
    table = stub(monkeypatch, twin.experiments.setpoint_csv, "write_setpoints")
    monkeypatch.setattr(as_text, "plan_text", lambda r: "one\ntwo\nthree\nfour")
    command = ("plan", "m.toml", "a.mcap", "b.mcap", "--between", "wear", "other.toml", "--axis",
               "y", "--duration", "7.5", "-o", "next.toml")  # fmt: skip
    found, text, warned = cli(*command, *HELD, *COMMON)
    assert found == code
    given, named = call.only
    assert (given[0].name, *given[1:]) == (NAME, LOGS, HOLDOUT)
    first, second = named.pop("between")
    assert (first, second.name) == ("W", "other.toml")
    assert named.pop("catalogue")["all"] == ["e1.py", "e2.py"]
    assert named == {"axis": "y", "duration": 7.5, "test_function": 0.07}
    saved = ("the experiment", Path("next.toml"), "one", "two", "three")
    assert save.calls == ([(saved, {"units": LINEAR})] if decides else [])
    assert ("twin simulate next.toml" in text) is decides
    assert [given[0][-1] for given in table.calls] == [Path("next.setpoints.csv")] * decides
    assert len(warned.splitlines()) == 2
    found, text, _ = cli(*command[:2], "--json")
    assert (found, json.loads(text)) == (
        code, {
            "json of": "plan", "bad": None, "file": "experiment.toml" if decides else None,
            "setpoints": "experiment.setpoints.csv" if decides else None,
        },
    )  # fmt: skip
    assert call.calls[-1][1] | {"catalogue": 0} == {
        "between": [], "catalogue": 0, "axis": None, "duration": 20.0, "test_function": None,
    }  # fmt: skip
    assert cli("plan", "m.toml", "-o", "next.mcap")[0] == 2


def test_simulate(monkeypatch, cli):
    class Reach:
        take = staticmethod(lambda part: f"{part} seen")
        warnings = staticmethod(lambda: ("axis x went",))

    call = stub(monkeypatch, twin.experiments.named, "simulate_parts", ["one", "two"])
    record = stub(monkeypatch, twin.logs, "record_log", 35_000)
    monkeypatch.setattr(twin.experiments.named, "Reach", lambda stage: Reach)
    monkeypatch.setattr(twin.experiments.file, "load_experiment", lambda path: f"file {path}")
    command = ("simulate", "moves", "--model", "m.toml", "-o", "r.mcap", "--seed", "5",
               "--duration", "3.5", "--axis", "y", *COMMON[2:])  # fmt: skip
    code, text, warned = cli(*command)
    assert (code, text.strip(), warned.strip()) == (
        0, "r.mcap: 35000 samples at 10000 Hz", "twin: axis x went",
    )  # fmt: skip
    given, named = call.only
    assert (given[0].name, given[1]) == (NAME, "moves")
    assert named == {"seed": 5, "duration": 3.5, "axis": "y"}
    parts, path = record.only[0]
    assert (list(parts), path) == (["one seen", "two seen"], Path("r.mcap"))
    code, text, _ = cli("simulate", "e.toml", "--json")
    assert json.loads(text) == {
        "log": "log.mcap",
        "samples": 35_000,
        "sample_rate": 1e4,
        "unit": "Hz",
    }
    assert call.calls[-1][0][1] == "file e.toml"
    assert call.calls[-1][1] == {"seed": 0, "duration": None, "axis": None}


def test_import_and_recover(monkeypatch, cli):
    class Recording(list):
        sample_rate = 125.0
        metadata: ClassVar[dict[str, str]] = {"resampled": "steps of 1 ms"}
        axes: ClassVar[dict[str, str]] = {}

    log = Recording([0] * 9)
    load = stub(monkeypatch, twin.importers, "load_mapping", "the map")
    read = stub(monkeypatch, twin.importers, "import_log", log)
    write = stub(monkeypatch, twin.logs, "write_log")
    code, text, _ = cli("import", "d.csv", "--map", "m.toml", "-o", "r.mcap", "--json")
    assert (code, json.loads(text)) == (
        0, {"log": "r.mcap", "samples": 9, "sample_rate": 125.0, "unit": "Hz"},
    )  # fmt: skip
    assert (load.only[0], read.only[0]) == ((Path("m.toml"),), ([Path("d.csv")], "the map"))
    assert write.calls.pop()[0] == (log, Path("r.mcap"))
    found = SimpleNamespace(kept=41, lost=("end",), unproved=("all",))
    files = {Path("g.mcap"): "41 samples", Path("g.part1.mcap"): "2 samples"}
    mend = stub(monkeypatch, twin.logs, "recover_file", (found, files))
    code, text, _ = cli("recover", "bad.mcap", "-o", "g.mcap", "--json")
    assert json.loads(text) == {
        "log": "g.mcap", "kept": 41, "lost": ["end"], "not_proved": ["all"],
        "others": ["g.part1.mcap"],
    }  # fmt: skip
    assert mend.only == ((Path("bad.mcap"), Path("g.mcap")), {"unproved": False})


@pytest.mark.parametrize(("severity", "code"), [(Severity.ERROR, 1), (Severity.WARNING, 0)])
def test_check(monkeypatch, cli, severity, code):
    finding = Finding(severity, Fault.LAG, "y", "what", "where", "remedy")
    reports = {Path("a.mcap"): CheckReport((finding,)), Path("b.mcap"): CheckReport(())}
    monkeypatch.setattr(twin.checks.long, "check_file", reports.__getitem__)
    found, text, _ = cli("check", "a.mcap", "b.mcap", "--json")
    assert (found, json.loads(text)["ok"]) == (code, code == 0)
    assert list(json.loads(text)["logs"]) == ["a.mcap", "b.mcap"]
    assert sentences("n", reports[Path("a.mcap")]) == [
        f"n: {severity.value}: axis y, where: what; remedy"
    ]


def test_effects(monkeypatch, cli):
    monkeypatch.setattr(machine_text, "effects_text", lambda effects: f"all {len(effects)}")
    monkeypatch.setattr(machine_text, "effect_text", lambda effect: f"one {effect}")
    monkeypatch.setattr(machine_json, "effect_json", lambda effect: {"is": effect})
    draw = stub(monkeypatch, identify.output.signature, "draw")
    own = identify.experiment_design.signature
    monkeypatch.setattr(own, "signature", lambda effect, known: ("motion", f"force of {effect}"))
    assert cli("effects") == (0, "all 2\n", "")
    code, out, err = cli("effects", "--plot", "w.svg")
    assert (code, out, err) == (2, "", "twin: --plot w.svg: draws one effect; give its NAME\n")
    assert json.loads(cli("effects", "--json")[1]) == {"effects": [{"is": []}, {"is": "W"}]}
    assert cli("effects", "wear", "--plot", "w.svg") == (0, "one W\n", "")
    assert draw.only[0] == ("W", "motion", "force of W", Path("w.svg"))
    assert json.loads(cli("effects", "wear", "--json")[1]) == {"is": "W"}


@pytest.mark.parametrize(("named", "code"), [(True, 0), (False, 1)])
def test_demo(monkeypatch, cli, named, code):
    monkeypatch.setattr(diagnosis_json, "diagnose_json", lambda d: {"d": d})
    monkeypatch.setattr(as_json, "add_json", lambda a: {"a": a})
    hidden = SimpleNamespace(effect=SimpleNamespace(name="wear"))
    result = SimpleNamespace(
        hidden=hidden, named=named, report=Path("r.html"), diagnosis="D", addition="A"
    )
    run = stub(monkeypatch, identify.demo, "demo", result)
    found, text, _ = cli("demo", "-o", "f", "--seed", "9", "--model", "m.toml", "--json")
    assert (found, json.loads(text)) == (
        code, {"hidden": "wear", "named": named, "report": "r.html", "diagnosis": {"d": "D"},
               "addition": {"a": "A"}},
    )  # fmt: skip
    stage, catalogue, folder, seed, tell, _ = run.calls[0][0]
    assert (stage.name, catalogue["all"], folder, seed) == ("m.toml []", [], Path("f"), 9)
    found, text, _ = cli("demo")
    assert found == code
    assert ("the diagnosis is right" in text) is named
    assert run.calls[1][0][0].name == "proton_xy []"
    assert run.calls[1][0][2:4] == (Path("demo"), 2)
    tell("progress")  # of the run with --json: nothing but the object on standard output


def test_selftest(monkeypatch, cli):
    cases = stub(monkeypatch, identify.selftest.Design, "cases", ["a case"])
    run = stub(monkeypatch, identify.selftest, "run_all", ["an outcome"])
    draw, reliable = (
        stub(monkeypatch, identify.selftest, name) for name in ("draw", "draw_reliability")
    )
    rate = Rate("mass", 1, 2)
    monkeypatch.setattr(selftest_output, "rates", lambda results: [rate])
    monkeypatch.setattr(selftest_output, "coverage_by_parameter", lambda results: {"mass": rate})
    monkeypatch.setattr(selftest_output, "by_stratum", lambda results: {"bumps": [rate]})
    for name in ("reliability", "failures"):
        monkeypatch.setattr(selftest_output, name, lambda results: [])
    monkeypatch.setattr(
        selftest_output, "selftest_json", lambda results, seed: {"n": len(results), "seed": seed}
    )
    code, text, _ = cli(
        "selftest", "--seed", "4", "--only", "wear", "--only", "gms", "-o", "p.svg",
        "--reliability", "r.svg",
    )  # fmt: skip
    half = "mass: 1 of 2 (50 %, 95 % interval 1 to 99 %)"
    assert (code, text.splitlines()) == (
        0, ["seed 4, 1 machines", half, f"  interval of {half}", f"  bumps, {half}"],
    )  # fmt: skip
    assert cases.calls.pop()[0] == (4, ["wear", "gms"])
    assert run.calls.pop()[0] == (["a case"],)
    assert draw.only[0] == (["an outcome"], Path("p.svg"))
    assert reliable.only[0] == (["an outcome"], Path("r.svg"))
    code, text, _ = cli("selftest", "--json")
    assert (code, json.loads(text)) == (0, {"n": 1, "seed": 1})
    assert cases.only[0] == (1, None)
    picked = []
    for name in ("QUICK", "FULL"):
        design = SimpleNamespace(cases=lambda seed, names, n=name: picked.append((n, seed)))
        monkeypatch.setattr(identify.selftest, name, design)
    cli("selftest")
    cli("selftest", "--full")
    assert picked == [("QUICK", 1), ("FULL", identify.selftest.release_seed())]
    run.calls.clear()
    cli("selftest", "--case", "wear@5/bumps/17")
    assert run.only[0] == ([Case(("wear",), 5.0, 17, "bumps")],)
