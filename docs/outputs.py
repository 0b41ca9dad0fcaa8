"""Run the commands that README and pages print, and put what they answer below them.

    python docs/outputs.py                  README.md
    python docs/outputs.py --data DIR       the pages about measurements of others, too; DIR holds
                                            emps/ and laas/ as their authors publish them

A block ``sh`` or ``python`` is run, in the order of the page, in one empty folder that has the
folder ``examples``; the block ``text`` that follows it is its answer. Where that ends in a line
"...", as many lines are shown as before. Blocks ``console`` are not run. Progress is no part of it.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = ("README.md",)
WITH_DATA = {"emps": "docs/start/emps.md", "laas": "docs/start/laas.md"}  # by folder of the data
BLOCK = re.compile(r"^```(sh|python|text)\n(.*?)^```$", flags=re.S | re.M)
REST = "..."


def answered(text: str, folder: Path) -> str:
    """A page with the answers of its commands, run in a folder."""
    shutil.copytree(ROOT / "examples", folder / "examples")
    parts, end, answer = [], 0, ""
    for block in BLOCK.finditer(text):
        kind, content = block.groups()
        if kind == "text":
            content = _as_long(answer, content)
        else:
            answer = run(kind, content, folder)
        parts += [text[end : block.start()], f"```{kind}\n{content}```"]
        end = block.end()
    return "".join([*parts, text[end:]])


def run(kind: str, content: str, folder: Path) -> str:
    """What the commands of a block print."""
    start = ["sh", "-ec"] if kind == "sh" else [sys.executable, "-c"]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        [*start, content], cwd=folder, env={**os.environ, "PATH": path}, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    if done.returncode not in (0, 1):  # 1 is a negative result
        raise SystemExit(f"{content}{done.stderr}")
    return done.stdout


def _as_long(answer: str, shown: str) -> str:
    lines = shown.splitlines()
    if lines and lines[-1] == REST:
        answer = "".join(f"{line}\n" for line in [*answer.splitlines()[: len(lines) - 1], REST])
    return answer


def pages(data: Path | None) -> Iterator[tuple[Path, Path | None]]:
    """Each page, and the folder whose files its commands read."""
    yield from ((ROOT / name, None) for name in PAGES)
    if data is not None:
        yield from ((ROOT / page, data / name) for name, page in WITH_DATA.items())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, help="measurements of others")
    for page, files in pages(parser.parse_args().data):
        with tempfile.TemporaryDirectory() as folder:
            for file in files.rglob("*") if files else ():
                if file.is_file():
                    (Path(folder) / file.name).symlink_to(file.resolve())
            page.write_text(answered(page.read_text(encoding="utf-8"), Path(folder)), "utf-8")


if __name__ == "__main__":
    main()
