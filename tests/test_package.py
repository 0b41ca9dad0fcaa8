"""What travels inside the package, and what the architecture forbids."""

import ast
import importlib
import json
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from twin.effects import load_catalogue
from twin.examples import EXAMPLES
from twin.model.file import load_model

ROOT = Path(__file__).parent.parent
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def importing(package: str, *others: str) -> list[Path]:
    """Files of a package that import one of the others."""
    line = re.compile(rf"^\s*(from|import) ({'|'.join(others)})\b", re.M)
    files = (ROOT / package).rglob("*.py")
    return [path for path in files if line.search(path.read_text(encoding="utf-8"))]


def test_packages_import_only_downwards():
    assert importing("twin", "identify", "studies", "benchmarks", "tests") == []
    assert importing("identify", "studies", "benchmarks", "tests") == []
    assert importing("identify", "twin") != []


def test_every_public_name_is_there():
    """Of each package that says what it offers."""
    offering = [p for top in ("twin", "identify") for p in (ROOT / top).rglob("__init__.py")
                if "__all__ = " in p.read_text(encoding="utf-8")]  # fmt: skip
    assert len(offering) > 3
    for path in offering:
        package = importlib.import_module(".".join(path.parent.relative_to(ROOT).parts))
        assert not [name for name in package.__all__ if not hasattr(package, name)], path


def test_studies_stay_outside_and_use_public_names_alone():
    """The packages know nothing of them, and travel without them."""
    assert SETTINGS["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"] == [
        "twin", "identify"
    ]  # fmt: skip
    for path in (ROOT / "studies").rglob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        names = [a.name for n in nodes if isinstance(n, ast.ImportFrom) for a in n.names]
        names += [n.attr for n in nodes if isinstance(n, ast.Attribute)]
        assert not [n for n in names if n.startswith("_") and not n.endswith("__")], path


def test_stage_model_and_mjcf_agree_on_the_masses():
    import mujoco

    model = load_model("proton_xy", load_catalogue())
    stage = mujoco.MjModel.from_xml_string(model.mjcf)
    carriage, beam = stage.body("carriage").mass[0], stage.body("beam").mass[0]
    assert model.axes["y"].mass == carriage
    assert model.axes["x"].mass == beam + carriage


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """A folder with the wheel and its source."""
    folder = tmp_path_factory.mktemp("built")
    words = [sys.executable, "-m", "hatchling", "build", "-d", str(folder)]
    subprocess.run(words, cwd=ROOT, check=True, capture_output=True)
    return folder


def test_the_wheel_holds_the_packages_with_their_models_and_examples_and_nothing_else(built):
    names = zipfile.ZipFile(next(built.glob("*.whl"))).namelist()
    assert {name.split("/")[0].split("-")[0] for name in names} == {
        "twin",
        "identify",
        "proton_twin",
    }
    beside = {"models": "twin/models", "examples": "twin/example_files"}
    for folder in ("twin", "identify", *beside):
        for path in (ROOT / folder).rglob("*.*"):
            if "__pycache__" not in path.parts:
                inside = path.relative_to(ROOT / folder).as_posix()
                assert f"{beside.get(folder, folder)}/{inside}" in names
    assert {"twin/py.typed", "identify/py.typed"} <= set(names)


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no checkout, but a copy of the files")
def test_the_source_is_what_git_keeps(built):
    with tarfile.open(next(built.glob("*.tar.gz"))) as source:
        names = {name.partition("/")[2] for name in source.getnames()}
    kept = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    missing = set(kept.stdout.splitlines()) - names
    assert not {name for name in missing if (ROOT / name).exists()}
    assert names - set(kept.stdout.splitlines()) <= {"PKG-INFO"} | untracked()


def untracked() -> set[str]:
    words = ["git", "ls-files", "--others", "--exclude-standard"]
    found = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    return set(found.stdout.splitlines())


def asked(requirements: Iterable) -> set[tuple[str, SpecifierSet]]:
    """Names and versions that are asked for; a group in a group is none."""
    found = [Requirement(text) for text in requirements if isinstance(text, str)]
    return {(canonicalize_name(one.name), one.specifier) for one in found}


def test_the_lock_file_is_of_these_dependencies_and_of_the_public_index():
    text = (ROOT / "uv.lock").read_text(encoding="utf-8")
    assert set(re.findall(r"\w+://([^/\"]+)", text)) == {"pypi.org", "files.pythonhosted.org"}
    part = next(p for p in text.split("[[package]]") if p.startswith('\nname = "proton-twin"\n'))
    own = tomllib.loads(part.replace("[package.", "["))
    assert own["version"] == SETTINGS["project"]["version"], "`uv lock` brings it up to date"
    known = chain(own["metadata"]["requires-dist"], *own["metadata"]["requires-dev"].values())
    locked = {(entry["name"], SpecifierSet(entry.get("specifier", ""))) for entry in known}
    extras, groups = SETTINGS["project"]["optional-dependencies"], SETTINGS["dependency-groups"]
    lists = SETTINGS["project"]["dependencies"], *extras.values(), *groups.values()
    assert asked(chain(*lists)) == locked


def test_actions_are_pinned_and_every_job_says_what_it_may_do():
    for path in (ROOT / ".github" / "workflows").glob("*.yml"):
        text = path.read_text(encoding="utf-8")
        for used in re.findall(r"uses: (.*)", text):
            assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40} # v[\d.]+", used), used
        assert "\npermissions:\n" in text


def test_the_versions_of_python_that_are_named_are_tested():
    named = re.findall(r"Python :: (3\.\d+)", " ".join(SETTINGS["project"]["classifiers"]))
    text = (ROOT / ".github" / "workflows" / "tests.yml").read_text(encoding="utf-8")
    assert f"python: {json.dumps(named)}\n" in text
    assert SETTINGS["project"]["requires-python"] == f">={named[0]}"


@pytest.mark.slow  # a minute: everything is installed from the index
def test_what_is_published_runs_in_an_empty_environment_and_lists_what_it_brings(tmp_path):
    for name in ("twin", "identify", "models", "examples"):
        shutil.copytree(ROOT / name, tmp_path / name)
    for name in ("pyproject.toml", "Makefile", "README.md", "LICENSE", ".gitignore"):
        shutil.copy(ROOT / name, tmp_path)
    words = ["make", "dist", f"PYTHON={sys.executable}"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    twin, empty = tmp_path / "build" / "installed" / "bin" / "twin", tmp_path / "empty"
    empty.mkdir()
    subprocess.run([twin, "example", "recording"], cwd=empty, check=True)
    for command in EXAMPLES["recording"].commands:
        words = [twin, *command.split()[1:]]
        subprocess.run(words, cwd=empty / "recording", check=True, capture_output=True)
    text = (tmp_path / "build" / "proton-twin.cdx.json").read_text(encoding="utf-8")
    bill = json.loads(text)
    assert bill["metadata"]["component"]["name"] == "proton-twin"
    # By these the release attests it; the serial number is lost where the output is reproducible.
    assert {"bomFormat", "serialNumber", "specVersion"} <= set(bill)
    listed = {canonicalize_name(component["name"]) for component in bill["components"]}
    assert {name for name, _ in asked(SETTINGS["project"]["dependencies"])} <= listed
    assert str(tmp_path) not in text
