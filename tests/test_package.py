"""What travels inside the package, and what the architecture forbids."""

import ast
import tomllib
from pathlib import Path

from twin.effects import load_catalogue
from twin.model.file import load_model, models_folder

ROOT = Path(__file__).parent.parent


def imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
    return found


def test_twin_never_imports_identify():
    for path in (ROOT / "twin").rglob("*.py"):
        assert not any(name.split(".")[0] == "identify" for name in imports(path)), path


def test_studies_stay_outside_and_use_public_names_alone():
    """The packages know nothing of them, and travel without them."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert settings["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"] == [
        "twin", "identify"
    ]  # fmt: skip
    for package in ("twin", "identify"):
        for path in (ROOT / package).rglob("*.py"):
            assert not any(name.split(".")[0] == "studies" for name in imports(path)), path
    for path in (ROOT / "studies").rglob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        names = [a.name for n in nodes if isinstance(n, ast.ImportFrom) for a in n.names]
        names += [n.attr for n in nodes if isinstance(n, ast.Attribute)]
        assert not [n for n in names if n.startswith("_") and not n.endswith("__")], path


def test_every_model_of_the_package_loads_from_its_name_alone():
    catalogue = load_catalogue()
    names = sorted(p.stem for p in models_folder().glob("*.toml"))
    assert "proton_xy" in names
    for name in names:
        assert load_model(name, catalogue).axes


def test_stage_model_and_mjcf_agree_on_the_masses():
    import mujoco

    model = load_model("proton_xy", load_catalogue())
    stage = mujoco.MjModel.from_xml_string(model.mjcf)
    carriage, beam = stage.body("carriage").mass[0], stage.body("beam").mass[0]
    assert model.axes["y"].mass == carriage
    assert model.axes["x"].mass == beam + carriage
