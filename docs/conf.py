"""The site: `make docs`. What it prints is generated: effects, commands and schemas by generate.py
before the pages are read, tutorials by running their cells."""

from __future__ import annotations

import os
import sys
from importlib.metadata import version as version_of
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # for cells
os.environ["PYTHONPATH"] = os.pathsep.join(
    filter(None, (str(HERE.parent), os.environ.get("PYTHONPATH")))
)
os.environ["TWIN_EXAMPLES"] = str(HERE.parent / "examples")

import generate  # noqa: E402
from myst_nb.core import render  # noqa: E402

project = "Proton twin"
author = "the maintainers"
release = version = version_of("proton-twin")

extensions = ["myst_nb", "sphinx.ext.autodoc"]
exclude_patterns = ["_build", "_generated"]
root_doc = "index"
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
suppress_warnings = ["myst.header"]  # included files begin below the page's own heading

nb_execution_mode = "auto"  # cells have no answers of their own: they are run
nb_execution_in_temp = True
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_merge_streams = True  # by streams_in_one
nb_output_stderr = "remove"  # progress

autodoc_typehints = "none"
autodoc_member_order = "bysource"
add_module_names = False

html_sidebars = {
    page: [] for page in ("theory", "validation", "changelog", "contributing", "architecture")
}
html_theme = "pydata_sphinx_theme"
html_title = "Proton twin"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "navbar_align": "left",
    "header_links_before_dropdown": 7,
    "show_toc_level": 2,
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "search_bar_text": "Search",
}
copyright = "the maintainers, Apache 2.0"


def setup(app):  # type: ignore[no-untyped-def]
    app.connect("builder-inited", lambda _: generate.everything())
    app.connect("doctree-read", shell_cells)


def streams_in_one(outputs):  # type: ignore[no-untyped-def]
    """What a cell prints, as it was printed: it comes in pieces that may end within a line."""
    merged = {}
    for output in outputs:
        if output["output_type"] != "stream":
            merged[len(merged)] = output
        elif (first := merged.get(output["name"])) is not None:
            first["text"] += output["text"]
        else:
            merged[output["name"]] = type(output)(output)  # the cell keeps its own
    return list(merged.values())


render.coalesce_streams = streams_in_one


def shell_cells(_, doctree):  # type: ignore[no-untyped-def]
    """Cells that the shell runs are shown without the word that says so."""
    from docutils import nodes

    for block in doctree.findall(nodes.literal_block):
        head, _, rest = block.astext().partition("\n")
        if head == "%%sh":
            rest = rest.replace(" || true", "")  # a negative result is an answer
            block.children = [nodes.Text(rest)]
            block.rawsource, block["language"] = rest, "console"
