"""The FMU is a whole one, and what it gives step by step is the feedforward of the model."""

import ctypes
import io
import re
import zipfile
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from c_compiler import UNDEFINED, given, library, needs_compiler
from effect_runs import CATALOGUE

from twin.export import compare_export, find_exporter
from twin.export.formats.fmu import WRAPPER
from twin.feedforward import feedforward
from twin.model.file import load_model
from twin.model.machine import MachineModel

STAGE = load_model("proton_xy", CATALOGUE)
# Of FMI 2.0: those of every FMU, and those of co-simulation.
FUNCTIONS = """GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment
EnterInitializationMode ExitInitializationMode Terminate Reset GetReal GetInteger GetBoolean
GetString SetReal SetInteger SetBoolean SetString GetFMUstate SetFMUstate FreeFMUstate
SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate GetDirectionalDerivative
SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus
GetIntegerStatus GetBooleanStatus GetStringStatus"""
N = 400


@pytest.fixture(scope="module")
def archive() -> zipfile.ZipFile:
    content = find_exporter("fmu").export(STAGE, {}).files["proton_motion_stage.fmu"]
    assert isinstance(content, bytes)
    return zipfile.ZipFile(io.BytesIO(content))


@pytest.fixture(scope="module")
def code(archive, tmp_path_factory) -> ctypes.CDLL:
    """Its sources, compiled as strictly as the C export is."""
    files = {
        name.removeprefix("sources/"): archive.read(name)
        for name in archive.namelist()
        if name.startswith("sources/")
    }
    made = library(tmp_path_factory.mktemp("fmu"), files, UNDEFINED)
    made.fmi2Instantiate.restype = ctypes.c_void_p
    return made


def described(archive: zipfile.ZipFile) -> ElementTree.Element:
    return ElementTree.fromstring(archive.read("modelDescription.xml"))


def motion() -> np.ndarray:
    """Position, velocity and acceleration (3, N) of x; y rests."""
    t = STAGE.period * np.arange(N)
    return np.stack([0.05 * np.sin(9.0 * t), 0.45 * np.cos(9.0 * t), -4.05 * np.sin(9.0 * t)])


def wanted() -> np.ndarray:
    own = motion()
    return feedforward(STAGE.axes["x"], own, np.zeros_like(own), STAGE.period)


def test_its_variables_have_their_units_and_references(archive) -> None:
    root = described(archive)
    assert root.attrib["fmiVersion"] == "2.0"
    variables = root.findall("ModelVariables/ScalarVariable")
    names = [v.attrib["name"] for v in variables]
    assert names[:3] == ["x_position", "x_velocity", "x_acceleration"]
    assert names[6:] == ["x_force", "x_current", "y_force", "y_current"]
    assert [v.attrib["valueReference"] for v in variables] == [str(i) for i in range(10)]
    units = [v.find("Real").attrib["unit"] for v in variables]
    assert units[:3] + units[6:8] == ["m", "m/s", "m/s^2", "N", "A"]
    assert {u.attrib["name"] for u in root.findall("UnitDefinitions/Unit")} == set(units)
    assert [u.attrib["index"] for u in root.findall("ModelStructure/Outputs/Unknown")] == [
        "7", "8", "9", "10",
    ]  # fmt: skip


def test_it_has_every_function_that_the_standard_lists() -> None:
    made = {n for n in re.findall(r"fmi2(\w+)", WRAPPER.read_text()) if n != "Status"}
    assert made == set(FUNCTIONS.split())


def steps(code: ctypes.CDLL, made: int, first: int, last: int) -> np.ndarray:
    """Force and current of x (2, n) after each step."""
    c, out = ctypes.c_void_p(made), np.zeros((2, N))
    inputs, outputs = (ctypes.c_uint * 3)(0, 1, 2), (ctypes.c_uint * 2)(6, 7)
    values, now = motion().T.copy(), np.zeros(2)
    for k in range(first, last):
        assert code.fmi2SetReal(c, inputs, ctypes.c_size_t(3), *given(values[k])) == 0
        time, step = ctypes.c_double(k * STAGE.period), ctypes.c_double(STAGE.period)
        assert code.fmi2DoStep(c, time, step, 1) == 0
        assert code.fmi2GetReal(c, outputs, ctypes.c_size_t(2), *given(now)) == 0
        out[:, k] = now
    return out[:, first:last]


def instance(code: ctypes.CDLL, archive: zipfile.ZipFile) -> int:
    guid = described(archive).attrib["guid"].encode()
    made = code.fmi2Instantiate(b"one", 1, guid, b"", None, 0, 0)
    none = ctypes.c_double(0.0)
    assert made
    assert code.fmi2SetupExperiment(ctypes.c_void_p(made), 0, none, none, 0, none) == 0
    return made


@needs_compiler
def test_each_step_gives_the_feedforward(code, archive, capfd) -> None:
    made = instance(code, archive)
    force, current = steps(code, made, 0, N)
    assert np.abs(force - wanted()).max() <= 1e-9 * np.abs(wanted()).max()
    np.testing.assert_allclose(current, force / 53.4, rtol=1e-12)
    assert code.fmi2Instantiate(b"one", 1, b"another", b"", None, 0, 0) is None
    assert code.fmi2SetReal(ctypes.c_void_p(made), (ctypes.c_uint * 1)(6), ctypes.c_size_t(1),
                            *given(np.zeros(1))) == 3  # fmt: skip
    code.fmi2FreeInstance(ctypes.c_void_p(made))
    assert "runtime error" not in capfd.readouterr().err


@needs_compiler
def test_a_state_that_was_kept_goes_on_as_before(code, archive) -> None:
    made, state = instance(code, archive), ctypes.c_void_p()
    c = ctypes.c_void_p(made)
    steps(code, made, 0, N // 2)
    assert code.fmi2GetFMUstate(c, ctypes.byref(state)) == 0
    first = steps(code, made, N // 2, N)
    assert code.fmi2SetFMUstate(c, state) == 0
    np.testing.assert_array_equal(steps(code, made, N // 2, N), first)
    assert code.fmi2FreeFMUstate(c, ctypes.byref(state)) == 0
    assert code.fmi2Reset(c) == 0
    np.testing.assert_allclose(steps(code, made, 0, 5)[0], wanted()[:5], rtol=1e-12)
    code.fmi2FreeInstance(c)


@needs_compiler
def test_fmpy_opens_and_runs_it(archive, tmp_path) -> None:
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (group test)")
    from fmpy.validation import validate_fmu

    file = tmp_path / "stage.fmu"
    file.write_bytes(archive.fp.getbuffer())
    assert validate_fmu(str(file)) == []
    names = ["x_position", "x_velocity", "x_acceleration"]
    rows = np.zeros(N, [("time", float), *((n, float) for n in names)])
    rows["time"] = STAGE.period * np.arange(N)
    for name, column in zip(names, motion(), strict=True):
        rows[name] = column
    done = fmpy.simulate_fmu(
        str(file), input=rows, output=["x_force"], stop_time=STAGE.period * (N - 1),
        step_size=STAGE.period, output_interval=STAGE.period,
    )  # fmt: skip
    assert np.abs(done["x_force"][1:] - wanted()[: N - 1]).max() <= 1e-9 * np.abs(wanted()).max()


@needs_compiler
@pytest.mark.parametrize("name", ["model", "fmi2", "int", "Modell 1 ü"])
def test_no_name_of_a_model_is_in_the_way_of_c_or_of_the_format(name):
    x = STAGE.axes["x"]
    made = find_exporter("fmu").export(MachineModel(name, {"int": x}, STAGE.sample_rate), {})
    assert not [r for r in made.lost if r.part == "binary"]


@pytest.mark.parametrize(
    ("compiler", "why"),
    [
        (None, "no C compiler was found"),
        ("echo 'model.c:3: broken' >&2; echo later >&2; exit 1", "failed: model.c:3: broken"),
        ("exit 1", "failed: nothing said"),
    ],
)
def test_without_a_library_it_is_said_why(tmp_path, monkeypatch, compiler, why) -> None:
    if compiler:
        (tmp_path / "cc").write_text(f"#!/bin/sh\n{compiler}\n")
        (tmp_path / "cc").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    made = find_exporter("fmu").export(STAGE, {})
    bare = [remark for remark in made.lost if remark.part == "binary"]
    assert [remark.axis for remark in bare] == list(STAGE.axes)
    assert all(why in remark.text for remark in bare)


def test_it_is_that_of_the_model_or_of_one_before(tmp_path) -> None:
    made = find_exporter("fmu").export(STAGE, {})
    path = tmp_path / "proton_motion_stage.fmu"
    path.write_bytes(made.files[path.name])
    assert compare_export(STAGE, path, {}).agrees
    heavier = STAGE.with_axis("x", replace(STAGE.axes["x"], mass=1.1 * STAGE.axes["x"].mass))
    (outdated,) = compare_export(heavier, path, {}).outdated
    assert (outdated.file, outdated.line) == (str(path), None)
