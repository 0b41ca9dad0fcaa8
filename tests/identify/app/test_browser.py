"""`twin app` walked in a real browser, as an engineer does who has never seen it."""

import os
import signal
from pathlib import Path

import mujoco
import numpy as np
import pytest
from app_runs import browsed, served
from arms import ARM, arm_log
from check_drive import drive
from cli_runs import twin

from identify.project.folder import Folder
from twin.logs import read_log, write_log


def recorded(path: Path, rate: float, seed: int, seconds: int = 6) -> Path:
    """A mass of 5 kg with Coulomb friction and a spring of 40 N/m, at 1 kHz."""
    noise, t = np.random.default_rng(seed), np.arange(1000 * seconds) / 1000.0
    x = 0.05 * np.sin(rate * t) + 0.02 * np.sin(2.6 * rate * t)
    a = -(rate**2) * (0.05 * np.sin(rate * t) + 0.1352 * np.sin(2.6 * rate * t))
    force = 5.0 * a + 2.1 * np.sign(np.gradient(x)) + 40.0 * x + noise.normal(0.0, 0.05, len(t))
    columns = np.column_stack([t, 1e3 * x + noise.normal(0.0, 1e-4, len(t)), force])
    np.savetxt(path, columns, "%.9g", ",", header="time_s,pos_mm,force_N", comments="")
    return path


@pytest.mark.slow  # a browser and a server: 9 s
def test_the_first_screen_by_keyboard_and_a_file_that_is_none(tmp_path):
    """Hostile names are texts, and what is wrong is one sentence."""
    hostile = "<img src=x onerror=alert(1)>.csv"
    broken = tmp_path / hostile
    broken.write_text("this is\nno recording\n")
    folder = tmp_path / "machine"
    folder.mkdir()
    with served(folder) as address, browsed() as context:
        page = context.new_page()
        page.goto(address)
        assert "token" not in page.url
        page.set_input_files("#files", str(broken))
        page.wait_for_selector(".card.warn")
        assert hostile in page.inner_text("main")
        assert page.query_selector("main img") is None
        page.focus("nav a >> nth=1")
        page.keyboard.press("Enter")
        page.wait_for_selector("text=There is no recording yet")
        assert page.title().startswith("Model")
        for field in page.query_selector_all("button, select, input"):
            assert field.evaluate("e => e.ariaLabel || e.labels?.length || e.textContent.trim()")


def imported(context, address: str, files: list[str]):
    """The page with these recordings taken in."""
    page = context.new_page()
    page.goto(address)
    page.set_input_files("#files", files)
    page.click("#import-all")
    page.wait_for_selector("text=force explained to")
    return page


def propose(page) -> None:
    """Propose a first model."""
    page.click("nav >> text=Model")
    page.click("#new")
    page.wait_for_selector("text=Fit its values")


@pytest.mark.slow  # a diagnosis, twice
def test_the_walk_from_three_files_to_the_added_effect(tmp_path):
    files = [str(recorded(tmp_path / f"run{k}.csv", 5.0 + k, k)) for k in range(3)]
    folder = tmp_path / "machine"
    folder.mkdir()
    with served(folder) as address, browsed() as context:
        page = imported(context, address, files)
        other = context.new_page()  # a second tab, which only looks
        other.goto(address)
        propose(page)
        page.click("nav >> text=Diagnose")
        page.click("#do-diagnose")
        page.wait_for_selector("#stop")
        page.reload()
        page.wait_for_selector("#stop, #do-add---found")
        page.click("#do-add---found")
        page.wait_for_selector(".ledger li:nth-child(2)")
        other.wait_for_selector(".ledger li:nth-child(2)")
        page.click("nav >> text=Model")  # switched off, and on again
        page.click("[role=switch][aria-label^='spring of axis'][aria-checked=true]")
        page.wait_for_selector(".ledger li:nth-child(3) >> text=without spring")
        page.click("[role=switch][aria-label^='spring of axis'][aria-checked=false]")
        page.wait_for_selector("[role=switch][aria-label^='spring of axis'][aria-checked=true]")
        page.wait_for_selector(".ledger li:nth-child(3)", state="detached")  # as it was
        page.click("nav >> text=Take along")
        page.click("#do-export---to-c")
        page.wait_for_selector("text=exports/1-c/")
    project = Folder(folder).read()
    assert "spring" in project.models[-1].change
    logs = [r.file for r in project.recordings]
    answer = next(a.file for a in project.answers if "diagnose" in a.command)
    words = ["add", answer, "models/1.toml", logs[0], "--holdout", logs[1], "--test", logs[2]]
    done = twin(*words, "--found", "-o", "models/outside.toml", folder=folder)
    assert done.returncode == 0
    own, outside = ((folder / f"models/{n}.toml").read_text() for n in ("2", "outside"))
    assert own == outside  # to the last digit


@pytest.mark.slow  # a comparison and a replay
def test_what_is_marked_in_the_comparison_is_marked_in_the_replay(tmp_path):
    files = [str(recorded(tmp_path / f"run{k}.csv", 5.0 + k, k)) for k in range(3)]
    folder = tmp_path / "machine"
    folder.mkdir()
    with served(folder) as address, browsed() as context:
        page = imported(context, address, files)
        propose(page)
        page.click("nav >> text=Compare")
        page.click("#do-compare")
        page.click("#compare-view")
        page.wait_for_selector("iframe[title^=Comparison] >> visible=true")
        page.wait_for_selector("iframe[title*='in 3D'] >> visible=true")
        both = {f.name or f.url: f for f in page.frames[1:]}
        compared = next(f for url, f in both.items() if "compare" in url)
        replay = next(f for url, f in both.items() if "compare" not in url)
        replay.wait_for_selector("#chart")
        compared.click("#mark-largest")
        replay.wait_for_function("state.chosen.length > 0")
        spans, seconds = replay.evaluate("[state.chosen, duration]")
        assert all(-0.1 <= first <= last <= seconds + 0.1 for first, last in spans)
        assert 0.03 * seconds < sum(last - first for first, last in spans) < 0.1 * seconds
        compared.click("#mark-none")
        replay.wait_for_function("state.chosen.length === 0")


def running(page, command: str) -> int:
    """The process of a command, as soon as it runs."""
    asked = "fetch('/api/state').then(a => a.json()).then(s => s.jobs[0])"
    while True:
        job = page.evaluate(asked)
        if job["words"][0] == command and job["state"] == "running" and job["process"]:
            return job["process"]
        assert job["words"][0] != command or job["ended"] is None


@pytest.mark.slow  # two servers' worth of commands
def test_a_killed_worker_and_an_edit_from_outside_are_told_in_the_page(tmp_path):
    folder = tmp_path / "machine"
    folder.mkdir()
    files = [str(recorded(tmp_path / f"run{k}.csv", 5.0 + k, k, 60)) for k in range(2)]
    with served(folder) as address, browsed() as context:
        page = context.new_page()
        page.goto(address)
        page.set_input_files("#files", files)
        page.click("#import-all")
        page.wait_for_selector("#check:enabled")
        page.wait_for_selector("td >> text=run1.csv")
        assert twin("new", folder=folder).returncode == 0  # the command line beside it
        page.wait_for_selector("text=models/1.toml")
        page.click("nav >> text=Diagnose")
        page.click("#do-diagnose")
        os.kill(running(page, "diagnose"), signal.SIGKILL)
        page.wait_for_selector("text=was killed; nothing of it is half written")
        assert not list(folder.rglob("*.twin-part"))
        page.click("#do-diagnose")
        page.click("#stop")
        page.wait_for_selector("text=was stopped; the project is as it was")
        page.click("#undo")
        page.wait_for_selector("text=No model yet")
    assert Folder(folder).read().models == []


def loaded(model: mujoco.MjModel) -> None:
    """0.5 kg more on the forearm, 0.3 m out."""
    fore = model.body("fore").id
    model.body_mass[fore], model.body_ipos[fore, 0] = 2.5, (2.0 * 0.15 + 0.5 * 0.3) / 2.5


@pytest.mark.slow  # a mechanism diagnosed, twice
def test_a_mechanism_is_taken_in_with_its_file_and_its_body_is_corrected(tmp_path):
    (tmp_path / "arm.xml").write_text(ARM)
    files = [tmp_path / "arm.xml"]
    for seed in (1, 2, 3):
        files.append(tmp_path / f"run{seed}.mcap")
        write_log(arm_log(seed, change=loaded, duration=8.0), files[-1])
    folder = tmp_path / "machine"
    folder.mkdir()
    with served(folder) as address, browsed() as context:
        page = context.new_page()
        page.goto(address)
        page.set_input_files("#files", [str(file) for file in files])
        page.click("#take")
        page.wait_for_selector("td >> text=run3.mcap")
        page.click("nav >> text=Model")
        page.select_option("#mjcf", "arm.xml")
        page.click("#new")
        page.wait_for_selector("text=Fit its values")
        assert "elbow" in page.inner_text("main")
        page.click("nav >> text=Diagnose")
        page.click("#do-diagnose")
        page.wait_for_selector("text=Body fore: another inertia than in the file")
        page.click("#do-add---found")
        page.wait_for_selector(".ledger li:nth-child(2)")
    model = Folder(folder).read().models[-1]
    assert model.change == ["body fore"]
    assert all(e.after < 0.1 * e.before for e in model.errors)
    mass = mujoco.MjModel.from_xml_path(str(folder / "models/2.xml")).body("fore").mass[0]
    assert mass == pytest.approx(2.5, rel=0.01)


@pytest.mark.slow  # a browser and a server
def test_a_fault_is_marked_on_the_course_of_a_recording_and_cut_off_there(tmp_path):
    """The position goes on elsewhere after 5 s, so the longer part is kept."""

    def stepped(columns):
        columns["position"][5000:] += 0.02

    folder = tmp_path / "machine"
    folder.mkdir()
    write_log(drive(seconds=8.0, change=stepped), tmp_path / "run.mcap")
    with served(folder) as address, browsed() as context:
        page = context.new_page()
        page.goto(address)
        page.set_input_files("#files", str(tmp_path / "run.mcap"))
        page.click("#take")
        page.wait_for_selector("svg.course >> nth=1")
        assert page.query_selector(".mark") is None
        page.click("#check")
        mark = page.wait_for_selector("svg.course .mark")
        assert 62.0 < float(mark.get_attribute("x")) < 66.0  # 5 of 8 s of a plot that is 104 wide
        page.click("td >> text=error")
        if place := os.environ.get("SHOT"):
            page.screenshot(path=place)
        page.click("text=Cut here")
        page.wait_for_selector(".mark", state="detached")
    kept = read_log(folder / Folder(folder).read().recordings[0].file)
    assert 4.9 < len(kept) * kept.period < 5.1


@pytest.mark.slow  # a browser and a server
def test_a_recording_is_dragged_to_another_role(tmp_path):
    folder = tmp_path / "machine"
    folder.mkdir()
    for name in ("a.mcap", "b.mcap", "c.mcap"):
        write_log(drive(seconds=3.0), tmp_path / name)
    with served(folder) as address, browsed() as context:
        page = context.new_page()
        page.goto(address)
        page.set_input_files("#files", [str(tmp_path / f"{n}.mcap") for n in "abc"])
        page.click("#take")
        page.wait_for_selector("#drop-test >> text=c.mcap")
        page.drag_and_drop("#drop-test >> text=c.mcap", "#drop-training")
        page.wait_for_selector("#drop-training >> text=c.mcap")
        if place := os.environ.get("SHOT"):
            page.wait_for_selector("svg.course >> nth=5")
            page.screenshot(path=place)
        page.click("#undo")
        page.wait_for_selector("#drop-test >> text=c.mcap")
    assert [r.role for r in Folder(folder).read().recordings] == ["training", "selection", "test"]
