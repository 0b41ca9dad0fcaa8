"""The house keeps its order: who may import whom, and what only an effect's own file may know."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import identify
import twin
from twin.effects import load_catalogue

IDENTIFY, TWIN = (Path(package.__file__).parent for package in (identify, twin))
# In the order in which data pass them: a room imports only from those before it.
ROOMS = (
    "rules", "printed", "dataset", "estimation", "analysis", "frequency", "selection", "mechanism",
    "validation", "experiment_design", "results", "project", "output", "workflow", "adding",
    "fleet", "view", "testing", "demo", "app", "cli", "start",
)  # fmt: skip
TWIN_ROOMS = (
    "errors", "files", "entries", "numbers", "signals", "record", "telling", "threads", "parallel",
    "isolated", "installed", "engine", "excitation", "curve", "knee", "effect", "law_parts", "core",
    "effects", "mujoco", "model", "logs", "checks", "importers", "laws", "feedforward",
    "experiments", "simulation", "export", "schemas", "examples",
)  # fmt: skip
LOG_ROOMS = {"logs", "importers", "checks"}
# Where it is decided what is told.
DECIDING = ROOMS[ROOMS.index("dataset") : ROOMS.index("results")]
PLAIN_NUMBERS = {0.5, 12.0, 100.0, 1000.0}
MOST_FLOORS = 11  # the table of rules is the lowest: what is decided in a dataset is in it too
# Functions that tell what a model or a result holds, without its logs.
READING = {"followed", "nonparametric_labels"}
ONE_OF_EACH = re.compile(r"np\.gradient|savgol|0\.6745|np\.diff\([^)]*\) / ")
OPTION = re.compile(r"(?<!-)--[a-z]")
UNIT_SELECTORS = re.compile(r"""\bunit\s*(==|!=|in|not in)\s*[(\[{]?["'](?!1["'])""")


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def modules(package: Path) -> dict[str, Path]:
    """Every module of a package by its dotted name."""
    names = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def imports(path: Path, known: dict[str, Path]) -> Iterator[str]:
    """Modules of the package that a file imports, inside its functions and for types alone too."""
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield from [n for n in (name, node.module) if n in known][:1]
        elif isinstance(node, ast.Import):
            yield from (a.name for a in node.names if a.name in known)


def room(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def arrows_of(package: Path) -> dict[str, set[str]]:
    """A package's modules -> those that they import, its own front door apart."""
    known, door = modules(package), package.name
    return {n: set(imports(p, known)) - {door} for n, p in known.items() if n != door}


@pytest.fixture(scope="module")
def arrows() -> dict[str, set[str]]:
    return arrows_of(IDENTIFY)


@pytest.mark.parametrize(
    ("package", "rooms"), [(IDENTIFY, ROOMS), (TWIN, TWIN_ROOMS)], ids=("identify", "twin")
)
def test_a_room_imports_only_from_those_before_it(package: Path, rooms: tuple[str, ...]) -> None:
    arrows = arrows_of(package)
    assert {room(n) for n in arrows} == set(rooms)
    for name, used in arrows.items():
        later = [u for u in used if rooms.index(room(u)) > rooms.index(room(name))]
        assert not later, f"{name} imports {', '.join(later)}"


def test_output_computes_nothing(arrows) -> None:
    """It has from the rooms that compute their classes alone, and what reads off a model."""
    computing = {*ROOMS[: ROOMS.index("results")]} - {"printed"}
    for name, path in modules(IDENTIFY).items():
        if room(name) != "output":
            continue
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ImportFrom) and room(node.module or "") in computing:
                used = {a.name for a in node.names if a.name[0].islower()} - READING
                assert not used, f"{name} has {used}"


def test_what_writes_blocks_knows_no_result(arrows) -> None:
    writers = {"identify.output.text", "identify.output.blocks", "identify.output.numbers"}
    writers |= {n for n in arrows if n.startswith("identify.output.report")}
    assert not {(n, other) for n in writers for other in arrows[n] - writers - {"identify.output"}}


def test_no_module_of_the_machine_imports_identify() -> None:
    for name, path in modules(TWIN).items():
        assert "identify" not in {
            (n.module or "").split(".")[0]
            for n in ast.walk(parsed(path))
            if isinstance(n, ast.ImportFrom)
        }, name


def test_logs_know_neither_importers_nor_checks_nor_these_each_other() -> None:
    known = modules(TWIN)
    for name, path in known.items():
        if room(name) in LOG_ROOMS:
            others = LOG_ROOMS - {"logs", room(name)}
            assert not [u for u in imports(path, known) if room(u) in others], name


@pytest.mark.parametrize("package", [IDENTIFY, TWIN], ids=lambda p: p.name)
def test_imports_have_no_circle(package: Path) -> None:
    known = modules(package)
    used = {n: set(imports(p, known)) - {n, package.name} for n, p in known.items()}
    done: set[str] = set()

    def visit(name: str, path: tuple[str, ...]) -> None:
        assert name not in path, " -> ".join((*path, name))
        if name not in done:
            for other in used[name]:
                visit(other, (*path, name))
            done.add(name)

    for name in used:
        visit(name, ())


def test_the_house_has_few_floors(arrows) -> None:
    """A room's floor is one above the highest of the rooms that it imports from."""
    below: dict[str, set[str]] = {r: set() for r in ROOMS}
    for name, used in arrows.items():
        below[room(name)] |= {room(u) for u in used}
    floors: dict[str, int] = {}
    for r in ROOMS:
        floors[r] = 1 + max((floors[b] for b in below[r] if b != r), default=0)
    assert max(floors.values()) <= MOST_FLOORS, floors


def test_each_room_says_what_it_is_for() -> None:
    for package in (IDENTIFY, TWIN):
        for path in package.rglob("__init__.py"):
            if path.parent != package:
                assert ast.get_docstring(parsed(path)), f"{path} says nothing"


def test_the_name_of_a_class_has_one_meaning() -> None:
    known: dict[str, list[str]] = {}
    for module, path in (modules(IDENTIFY) | modules(TWIN)).items():
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                known.setdefault(node.name, []).append(module)
    assert not {name: where for name, where in known.items() if len(where) > 1}


def test_only_effects_know_a_pitch_a_unit_or_another_number_of_the_stage() -> None:
    for path in [*IDENTIFY.rglob("*.py"), *TWIN.rglob("*.py")]:
        if path.parent == TWIN / "effects" and path.name != "__init__.py":
            continue
        text = path.read_text()
        assert "0.034" not in text, f"{path} knows the rollers' pitch"
        assert not UNIT_SELECTORS.search(text), f"{path} selects by a unit"


def test_signals_are_differentiated_and_smoothed_in_one_file() -> None:
    for path in [*IDENTIFY.rglob("*.py"), *TWIN.rglob("*.py")]:
        own = ONE_OF_EACH.search(path.read_text())
        assert not own or path == TWIN / "signals.py", f"{path}: {own} is in twin/signals.py"


def test_nothing_below_a_fleet_knows_of_it(arrows) -> None:
    """One log and one machine need neither a store nor an engine."""
    using = {name for name, used in arrows.items() if any(room(u) == "fleet" for u in used)}
    assert {room(name) for name in using} <= {"fleet", "cli"}


def test_sentences_about_results_are_made_in_output_alone() -> None:
    for name, path in modules(IDENTIFY).items():
        if room(name) == "output":
            continue
        nodes = list(ast.walk(parsed(path)))
        functions = [n.name for n in nodes if isinstance(n, ast.FunctionDef)]
        assert not [f for f in functions if "in_words" in f], f"{path} makes sentences"
        enums = [n for n in nodes if isinstance(n, ast.ClassDef) and "Enum" in ast.dump(n)]
        texts = [str(c.value) for e in enums for s in e.body if isinstance(s, ast.Assign)
                 for c in ast.walk(s) if isinstance(c, ast.Constant)]  # fmt: skip
        assert all(len(t.split()) < 4 for t in texts), f"{path} has an Enum of sentences"


@pytest.mark.parametrize("effect", load_catalogue())
def test_no_other_file_of_the_product_names_an_effect(effect: str) -> None:
    """Adding or removing one file is all it takes."""
    naming = {path for path, words in words_of_the_product().items() if effect in words}
    assert naming <= {TWIN / "effects" / f"{effect}.py"}


def test_an_error_names_no_option_of_the_command_line() -> None:
    """It is read by users of Python, too, whose arguments are called otherwise."""
    rooms = {*ROOMS[: ROOMS.index("output")], "workflow", "adding", *TWIN_ROOMS} - {"examples"}
    for name, path in (modules(IDENTIFY) | modules(TWIN)).items():
        if room(name) in rooms:
            told = {n.value for n in ast.walk(parsed(path)) if isinstance(n, ast.Expr)}
            texts = [n for n in ast.walk(parsed(path)) if isinstance(n, ast.Constant)]
            said = [str(n.value) for n in texts if n not in told]
            assert not [s for s in said if OPTION.search(s)], path


@cache
def words_of_the_product() -> dict[Path, set[object]]:
    """Constants and imported names of every file of the product."""
    return {path: set(words(path)) for path in [*IDENTIFY.rglob("*.py"), *TWIN.rglob("*.py")]}


def words(path: Path) -> Iterator[object]:
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Constant):
            yield node.value
        elif isinstance(node, ast.alias | ast.ImportFrom):
            named = node.name if isinstance(node, ast.alias) else node.module or ""
            yield named.split(".")[-1]


def unexplained_numbers(path: Path) -> Iterator[str]:
    """Numbers of a module that decide something, where no comment in or above the statement is.

    Small integers, a half and what converts units decide nothing; defaults are in the docstring.
    """
    lines = path.read_text(encoding="utf-8").splitlines()

    def asked(node: ast.AST, first: int, last: int) -> Iterator[str]:
        if isinstance(node, ast.stmt):
            body = getattr(node, "body", None)
            heads = [node.lineno, *(d.lineno for d in getattr(node, "decorator_list", ()))]
            first, last = min(heads), body[0].lineno - 1 if body else node.end_lineno or 0
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            value, said = abs(node.value), any("#" in line for line in lines[first - 2 : last])
            small = float(value).is_integer() and value <= 10
            if not (small or value in PLAIN_NUMBERS or said):
                yield f"{path.name}:{node.lineno}: {node.value}"
        for inner in ast.iter_child_nodes(node):
            if not isinstance(inner, ast.arguments):
                yield from asked(inner, first, last)

    yield from asked(parsed(path), 1, 1)


@pytest.mark.parametrize("deciding", DECIDING)
def test_a_number_that_decides_has_its_reason_beside_it(deciding: str) -> None:
    paths = (p for n, p in modules(IDENTIFY).items() if room(n) == deciding)
    assert not [found for path in paths for found in unexplained_numbers(path)]


def test_a_number_without_a_reason_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "deciding.py"
    path.write_text("def odd(x):\n    if x > 0.66:\n        return 2 * x\n    return x  # 0.7\n")
    assert [*unexplained_numbers(path)] == ["deciding.py:2: 0.66"]
