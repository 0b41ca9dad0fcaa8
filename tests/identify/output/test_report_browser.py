"""The report in a real browser: nothing goes wrong or out, and its controls do what they say."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, browser
from report_cases import Case

from identify import workflow
from identify.output.blocks import Chart, Drawn, LineStyle
from identify.output.report.page import Section
from identify.output.report.page import page as whole_page
from twin.effects import Catalogue, load_catalogue
from twin.model.machine import Fitted
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator


@pytest.fixture(scope="module")
def shown(case: Case, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Browser, Path]]:
    folder = tmp_path_factory.mktemp("browser")
    case.write(folder / "report.html")
    with browser(folder) as running:
        yield running, folder / "report.html"


@pytest.fixture
def page(shown: tuple[Browser, Path]) -> Iterator[Browser]:
    """The page as it is when it has been loaded; at the end nothing has gone wrong or out."""
    running, path = shown
    running.open(path)
    yield running
    assert running.errors == []
    assert running.requests == [path.resolve().as_uri()]


def test_the_answer_comes_first_fits_the_window_and_its_command_is_copied(page: Browser) -> None:
    box = page.run("""const b = document.querySelector(".answer").getBoundingClientRect();
      const p = document.getElementById("coordinate").getBoundingClientRect();
      return [b.bottom, p.bottom, document.documentElement.scrollWidth];""")
    assert box[0] < 800
    assert box[1] < 800
    assert box[2] <= 1280
    assert page.run("return document.querySelectorAll('.plot canvas').length") >= 9
    copied = page.run("""document.querySelector("[data-copy]").click();
      await frame(); await frame(); return document.querySelector("[data-copy]").textContent;""")
    assert copied == "Copied"


@pytest.mark.slow
def test_all_plots_follow_a_zoom_in_time(page: Browser) -> None:
    zoomed = page.run("""
      const all = span("forces"), note = text("coordinate-note");
      document.querySelector("[data-zoom=in]").click(); await frame();
      const near = [span("forces"), span("left"), span("motion")], inside = text("coordinate-note");
      document.getElementById("time").dispatchEvent(
        new KeyboardEvent("keydown", {key: "ArrowRight", bubbles: true})); await frame();
      const later = span("left");
      document.querySelector("[data-zoom=all]").click(); await frame();
      return {all, near, later, again: span("forces"), note, inside, end: text("coordinate-note"),
        units: document.getElementById("motion").shown.axes.map(a => a.label)};
    """)
    low, high = zoomed["all"]
    width = high - low
    for span in zoomed["near"]:
        assert span == pytest.approx([low + width / 4, high - width / 4])
    assert zoomed["later"] == pytest.approx([low + width / 2, high])
    assert zoomed["again"] == pytest.approx(zoomed["all"])
    assert zoomed["note"] == zoomed["end"] != zoomed["inside"]
    assert "s in view, of run 1 (training) to run 2 (selection)" in zoomed["inside"]
    assert zoomed["units"] == ["Time (s), log after log", "Position (mm)"]


@pytest.mark.slow
def test_a_drag_zooms_and_a_log_can_be_chosen(page: Browser) -> None:
    before, box = page.run("""const b = document.querySelector("#left .u-over")
      .getBoundingClientRect(); scrollTo(0, b.top - 100);
      const c = document.querySelector("#left .u-over").getBoundingClientRect();
      return [span("left"), [c.left, c.top, c.width, c.height]];""")
    left, top, width, height = box
    at = [("mouseMoved", 0.25), ("mousePressed", 0.25), ("mouseMoved", 0.5), ("mouseReleased", 0.5)]
    for kind, part in at:
        page.call(
            "Input.dispatchMouseEvent", type=kind, x=left + part * width, y=top + height / 2,
            button="left", clickCount=1,
        )  # fmt: skip
    dragged = page.run('await frame(); return [span("forces"), span("left")]')
    length = before[1] - before[0]
    for span in dragged:
        expected = [before[0] + length / 4, before[0] + length / 2]
        assert span == pytest.approx(expected, abs=0.02 * length)
    chosen = page.run('await choose("log", "1"); return [span("left"), text("coordinate-note")]')
    assert chosen[0] == pytest.approx([6.0, before[1]], abs=0.1)
    assert "run 2 (selection)" in chosen[1]


@pytest.mark.slow
def test_any_signal_is_shown_over_any_coordinate(page: Browser) -> None:
    seen = page.run("""
      const u = () => document.getElementById("coordinate").shown, out = [];
      const state = () => [u().axes[0].label, u().axes[1].label, u().series.length,
        Math.max(...u().data[1].map(Math.abs)), u().scales.y.max];
      out.push(state());
      await choose("against", "velocity"); out.push(state());
      await choose("against", "time"); out.push(state());
      await choose("against", "command"); out.push(state());
      await choose("show", "effect cogging"); await choose("against", "cogging_phase");
      out.push(state());
      document.getElementById("apart").click(); await frame(); out.push(state());
      return out;
    """)
    labels = [s[:2] for s in seen]
    assert labels[0][0].startswith("Cogging phase (")
    assert labels[0][1].startswith("Unexplained force (")
    assert labels[1][0].startswith("Speed (mm/s")
    assert labels[2][0] == "Time, log after log (s)"
    assert labels[3][0].startswith("Command (")
    assert [s[2] for s in seen] == [3, 3, 3, 3, 2, 3]  # the coordinate, and a mean for each
    assert seen[4][3] == pytest.approx(100.0, rel=0.05)  # mN of cogging, over one period
    # The largest residual is inside the picture.
    worst = page.run("""await choose("show", "residual"); await choose("against", "position");
      const u = document.getElementById("left").shown, y = document.getElementById("coordinate");
      return [Math.max(...u.data[1].filter(v => v !== null)), y.shown.scales.y.max];""")
    assert worst[0] < worst[1]


def test_effects_can_be_shown_and_hidden(page: Browser) -> None:
    seen = page.run("""
      const boxes = [...document.querySelectorAll("#toggles input")];
      const u = document.getElementById("forces").shown;
      const names = boxes.map(b => b.parentElement.textContent);
      const before = boxes.map((b, i) => [b.checked, u.series[i + 1].show]);
      boxes.forEach(b => b.click()); await frame();
      return {names, before, after: boxes.map((b, i) => [b.checked, u.series[i + 1].show])};
    """)
    assert seen["names"][3:] == ["coulomb viscous", "constant force", "cogging"]
    assert [checked for checked, _ in seen["before"]] == [True, True, True, False, False, False]
    assert all(checked == drawn for checked, drawn in (*seen["before"], *seen["after"]))
    assert [a for a, _ in seen["after"]] == [not b for b, _ in seen["before"]]


def test_the_map_tells_the_error_of_a_cell(page: Browser) -> None:
    said = page.run("""const o = document.querySelector("#map-plot .u-over");
      const b = o.getBoundingClientRect(), u = document.getElementById("map-plot").shown, out = [];
      for (let i = 1; i < 40; i++) for (let j = 1; j < 20; j++) {
        u.setCursor({left: b.width * i / 40, top: b.height * j / 20});
        const t = text("map-value"); if (t.includes("RMS")) out.push(t); }
      await choose("map-of", "after");
      return [out, text("map-note")];""")
    assert len(said[0]) > 50
    pattern = r"Cogging phase [−\d.]+ mm, speed [−\d.]+ mm/s: [\d.]+ mN RMS, \d+ test functions"
    assert all(re.fullmatch(pattern, one) for one in said[0])
    assert said[1].startswith("RMS of all logs: from the noise floor")


def test_a_band_has_one_entry_and_small_values_a_scale(shown: tuple[Browser, Path]) -> None:
    """Beside each band its name stood twice, and below 0.001 the scale said 0."""
    running, file = shown
    along, size = np.array([1.0, 10.0, 100.0]), np.array([1e-5, 1e-4, 1e-3])
    edges = [Drawn("band", factor * size, LineStyle.BAND) for factor in (0.5, 2.0)]
    chart = Chart(("f (Hz)", along), "F (N)", [*edges, Drawn("F", size)], log_x=True, log_y=True)
    text = whole_page("bands", (), [Section("one", "One", [chart])], (), ())
    (file.parent / "bands.html").write_text(text, encoding="utf-8")
    running.open(file.parent / "bands.html")
    told = running.run("""const place = document.querySelector("[data-chart]"), u = place.shown;
      const rows = [...place.querySelectorAll(".u-series")].filter(row => row.offsetParent);
      return [rows.map(row => row.querySelector(".u-label").textContent),
        u.axes[1].values(u, [1e-5, null]), u.series[1].value(u, 5e-5, 1, 1)];""")
    assert told == [["f (Hz)", "band", "F"], ["0.00001", ""], "0.00005 to 0.0002"]
    assert running.errors == []


def test_a_narrow_page_fits_its_texts_have_contrast_and_its_controls_names(
    page: Browser, shown: tuple[Browser, Path]
) -> None:
    """WCAG AA: 4.5 to 1 for text, on the background that is behind it."""
    page.open(shown[1], 400, 800)
    wide = page.run("""const plots = [...document.querySelectorAll(".plot .uplot")];
      return [document.documentElement.scrollWidth,
        ...plots.map(e => e.getBoundingClientRect().right)]""")
    assert all(one <= 400 for one in wide)
    found = page.run("""
      const light = c => { const [r, g, b] = c.match(/[\\d.]+/g).slice(0, 3).map(v => v / 255)
        .map(v => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
      const own = e => getComputedStyle(e).backgroundColor;
      const behind = e => !e ? "rgb(255, 255, 255)"
        : own(e).endsWith(", 0)") ? behind(e.parentElement) : own(e);
      const read = e => [...e.childNodes].some(n => n.nodeType === 3 && n.data.trim());
      const low = [];
      for (const e of document.querySelectorAll("body *")) {
        if (!read(e) || !e.offsetParent) continue;
        const [a, b] = [light(getComputedStyle(e).color), light(behind(e))].sort((p, q) => q - p);
        if ((a + 0.05) / (b + 0.05) < 4.5) low.push(`${e.tagName}: ${e.textContent}`); }
      const unnamed = [...document.querySelectorAll("select, input, button")]
        .filter(e => !(e.closest("label")?.textContent || e.ariaLabel || e.textContent).trim());
      return [low, unnamed.map(e => e.outerHTML)];
    """)
    assert found == [[], []]


@pytest.mark.slow
def test_five_logs_of_a_million_and_a_half_samples(case: Case, tmp_path: Path) -> None:
    """At most 3 MB and, on a machine that does nothing else, a second to the first paint."""
    catalogue = load_catalogue()
    axis = case.model.axes["x"]
    hidden = Fitted.at_start(catalogue["cogging"], {"p": 0.025, "a1": 0.1})
    truth = case.model.with_axis("x", axis.with_effect(hidden))
    logs = {
        f"run {seed}": simulate(
            truth, "tracking", seed=seed, duration=150.0, simulator=ReducedSimulator
        )
        for seed in range(5)
    }
    assert sum(len(log) for log in logs.values()) >= 1_500_000
    test = {"run 4": logs.pop("run 4")}
    held = {"run 3": logs.pop("run 3")}
    few = Catalogue([catalogue["cogging"]])
    found = workflow.diagnose(case.model, logs, held, test, catalogue=few)
    path = tmp_path / "long.html"
    case.write(path, result=found, additions=())
    with browser(tmp_path) as running:
        paints = []
        for _ in range(5):
            running.open(path)
            paints.append(running.paint())
        assert running.errors == []
    assert path.stat().st_size < 3_000_000
    assert min(paints) < 1.0


@pytest.mark.slow
def test_a_spike_is_beyond_the_range_on_which_the_charts_open(
    shown: tuple[Browser, Path], tmp_path: Path
) -> None:
    """One test function that is far off all others hides none of them, and is told."""
    running, path = shown
    text = path.read_text(encoding="utf-8")
    found = re.search(r'(<script[^>]*id="signals"[^>]*>)(.*?)(</script>)', text, re.S)
    assert found is not None

    def written(name: str, spike: bool) -> Path:
        signals = json.loads(found[2])
        for signal in signals[0]["signals"]:
            if signal["name"] in signals[0]["residuals"]:
                values = np.frombuffer(base64.b64decode(signal["data"]), "<i2").copy()
                there = values != -32768
                values[there] //= 8  # smaller, so that there is room for a spike
                values[np.flatnonzero(there)[100]] = 32000 if spike else 0
                signal["data"] = base64.b64encode(values.tobytes()).decode()
        (tmp_path / name).write_text(text.replace(found[2], json.dumps(signals)), encoding="utf-8")
        return tmp_path / name

    script = """const y = id => document.getElementById(id).shown.scales.y.max;
      return [y("coordinate"), y("left"), text("coordinate-note")];"""
    running.open(written("usual.html", False))
    usual = running.run(script)
    running.open(written("spiked.html", True))
    opened = running.run(script)
    assert opened[:2] == pytest.approx(usual[:2], rel=2.0)  # three times what is usual
    assert re.search(r"\d+ dots are beyond, from .* to ", opened[2])
    assert "beyond" not in usual[2]


def drag(page: Browser, place: str, first: tuple[float, float], last: tuple[float, float]) -> None:
    """Drag in a plot from one part of its width and height to another."""
    left, top, width, height = page.run(f"""const b = document.querySelector("#{place} .u-over");
      scrollTo(0, scrollY + b.getBoundingClientRect().top - 100);
      const c = b.getBoundingClientRect(); return [c.left, c.top, c.width, c.height];""")
    moves = [("Moved", first), ("Pressed", first), ("Moved", last), ("Released", last)]
    for kind, (right, down) in moves:
        page.call(
            "Input.dispatchMouseEvent", type=f"mouse{kind}", button="left", clickCount=1,
            x=left + right * width, y=top + down * height,
        )  # fmt: skip
    page.run("await frame()")


MARKS = """const pink = id => {
  const c = [...document.querySelectorAll(`#${id} canvas`)].at(-1);  // the sheet of marks
  const own = new OffscreenCanvas(c.width, c.height).getContext("2d", {willReadFrequently: true});
  own.drawImage(c, 0, 0);
  const p = own.getImageData(0, 0, c.width, c.height).data;
  let n = 0;
  for (let i = 0; i < p.length; i += 4)
    if (p[i] > 190 && p[i + 1] < 0.85 * p[i] && p[i + 2] > p[i + 1]) n++;
  return n;
};
return {seen: ["forces", "left", "motion", "coordinate", "map-plot"].map(pink),
  note: text("mark-note"), zoom: span("left"),
  cleared: document.getElementById("mark-none").disabled};"""


def test_what_is_marked_in_one_plot_is_marked_in_all_and_told(page: Browser) -> None:
    clear = page.run(MARKS)
    lie = """const [a, b] = document.querySelectorAll("#coordinate canvas");
      return [a, b].map(c => c.getBoundingClientRect()).map(r => [r.x, r.y, r.width]);"""
    below, sheet = page.run(lie)
    assert sheet == below
    assert clear["note"] == ""
    assert clear["cleared"]
    page.run('document.getElementById("mark").click()')
    for place, first, last in (
        ("coordinate", (0.4, 0.05), (0.6, 0.95)), ("left", (0.2, 0.5), (0.3, 0.5)),
        ("map-plot", (0.4, 0.05), (0.7, 0.9)),
    ):  # fmt: skip
        drag(page, place, first, last)
        marked = page.run(MARKS)
        assert marked["zoom"] == clear["zoom"]
        assert all(n > m for n, m in zip(marked["seen"], clear["seen"], strict=True)), place
        said = re.fullmatch(
            r"Marked in all plots: \d+ test functions, ([\d.]+) % of all, with ([\d.]+) % of the "
            r"squared .*, from [\d.]+ s of .* to [\d.]+ s of .*\.", marked["note"],
        )  # fmt: skip
        assert said, marked["note"]
        assert 0.0 < float(said[1]) < 60.0
    page.run('document.getElementById("mark-largest").click()')
    said = re.search(r"([\d.]+) % of all, with ([\d.]+) %", page.run('return text("mark-note")'))
    assert float(said[1]) == pytest.approx(5.0, abs=0.3)
    assert float(said[2]) > 15.0
    page.run('document.getElementById("mark-none").click()')
    assert page.run(MARKS) == clear
    page.run('document.getElementById("mark").click()')
    drag(page, "left", (0.2, 0.5), (0.3, 0.5))
    assert page.run('return span("left")') != pytest.approx(clear["zoom"])
