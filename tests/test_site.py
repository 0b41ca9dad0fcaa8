"""The site: its pages are reached, its maps can be read, it is built where Sphinx is installed."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

from twin.effects import load_catalogue
from twin.importers import load_mapping

DOCS = Path(__file__).parent.parent / "docs"
GENERATED = ("_build", "_generated", "effects")
PAGES = sorted(
    p for p in DOCS.rglob("*.md") if not {*GENERATED} & {*p.relative_to(DOCS).parts}
)  # fmt: skip
NEEDED = ("sphinx", "myst_nb", "pydata_sphinx_theme", "ipykernel")


def of(page: Path) -> str:
    return page.relative_to(DOCS).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=of)
def test_the_pages_it_links_exist(page):
    effects = {f"{name}.md" for name in load_catalogue()}  # their pages are generated
    for target in re.findall(r"\]\(([\w./-]+)(?:#[\w-]+)?\)", page.read_text(encoding="utf-8")):
        if "gallery/effects/" in target:
            assert Path(target).name in effects, target
        else:
            assert (page.parent / target).exists(), target


def test_each_page_is_in_a_table_of_contents():
    listed = {"index.md"}
    for page in PAGES:
        for tree in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text("utf-8"), flags=re.S):
            names = [line for line in tree.splitlines() if line and not line.startswith(":")]
            listed |= {of((page.parent / f"{name}.md").resolve()) for name in names}
    assert {of(page) for page in PAGES} == listed


@pytest.mark.parametrize("page", [p for p in PAGES if p.parent.name == "howto"], ids=of)
def test_the_maps_that_it_shows_can_be_read(page, tmp_path):
    shown = re.findall(r"^```toml\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    for text in shown:
        (tmp_path / "map.toml").write_text(text, encoding="utf-8")
        assert load_mapping(tmp_path / "map.toml").axes


@pytest.mark.slow
def test_it_is_built_without_a_warning(tmp_path):
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"{', '.join(missing)} not installed; `make docs` installs what is needed")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", str(DOCS), str(tmp_path)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    for page in ("index", "start/tutorial", "gallery/effects/cogging", "reference/commands"):
        assert (tmp_path / f"{page}.html").stat().st_size > 5_000
