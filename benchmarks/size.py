"""How large the code is, and how it hangs together: `python -m benchmarks size [REVISION]`.

Prints each figure at a revision of git and now. Counted are the packages twin and identify, and
their tests; what lies beside them apart.
"""

from __future__ import annotations

import argparse
import ast
import io
import subprocess
import tarfile
import tokenize
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from benchmarks.figures import Figure, Target, shown
from twin.errors import InputError

TITLE = "Size of the code"
ROOT = Path(__file__).parent.parent
BEFORE = "3ff05d6"  # version 0.4.5, at its largest
IO_SLOTS = "twin/effect.py"
PACKAGES, BESIDE = ("twin", "identify"), ("benchmarks", "studies")
PATCHING = {"setattr", "delattr", "setitem", "delitem", "syspath_prepend"}  # of monkeypatch
NO_CODE = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
           tokenize.ENCODING, tokenize.ENDMARKER}  # fmt: skip
MOCKS = {"Mock", "MagicMock", "AsyncMock", "patch"}


@dataclass(frozen=True)
class Code:
    """Source files of one state of the project: path from its root -> text."""

    files: Mapping[str, str]

    def below(self, *folders: str) -> Code:
        """Those in some folders."""
        return Code({p: t for p, t in self.files.items() if p.split("/")[0] in folders})

    @cached_property
    def trees(self) -> dict[str, ast.Module]:
        """Each file parsed."""
        return {path: ast.parse(text) for path, text in self.files.items()}

    def nodes(self) -> Iterator[ast.AST]:
        """Everything in all files."""
        for tree in self.trees.values():
            yield from ast.walk(tree)

    @property
    def lines(self) -> list[int]:
        """Lines of each file."""
        return [len(text.splitlines()) for text in self.files.values()]

    @property
    def code_lines(self) -> int:
        """Lines that hold code: neither blank, nor a comment, nor of a docstring."""
        return sum(map(len, map(_lines_of_code, self.files.values())))

    @property
    def constants(self) -> list[tuple[int, bool]]:
        """Numbers at the top of a module: names bound at once, and whether a comment is beside.

        Less the slots of a law's ``io``, which are an enumeration.
        """
        found = []
        for path, tree in self.trees.items():
            lines = self.files[path].splitlines()
            for node in tree.body if path != IO_SLOTS else ():
                if isinstance(node, ast.Assign | ast.AnnAssign) and _is_number(node.value):
                    own = lines[max(node.lineno - 2, 0) : node.end_lineno]
                    said = own[0].startswith("#") or any("  # " in line for line in own[1:])
                    found.append((_names(node), said))
        return found

    @property
    def patches(self) -> int:
        """Calls that put something else in place of a piece of the product."""
        return sum(isinstance(node, ast.Call) and _patches(node.func) for node in self.nodes())

    @property
    def private_share(self) -> float:
        """Functions and methods whose name begins with an underscore, of all."""
        names = [n.name for n in self.nodes() if isinstance(n, ast.FunctionDef)]
        return sum(n.startswith("_") and not n.endswith("__") for n in names) / len(names)

    @property
    def circles(self) -> int:
        """Groups of modules that import each other, in functions and for types alone too."""
        modules = [_module(path) for path in self.files]
        place = {name: i for i, name in enumerate(modules)}
        arrows = [
            (i, place[other])
            for i, (name, tree) in enumerate(zip(modules, self.trees.values(), strict=True))
            for other in _imports(tree, place)
            if other != name and "." in other  # a package's own front door apart
        ]
        start, end = np.array(arrows).T
        size = (len(modules), len(modules))
        graph = coo_array((np.ones(len(arrows)), (start, end)), shape=size)
        _, group = connected_components(graph, connection="strong")
        return int(np.sum(np.bincount(group) > 1))


def _lines_of_code(text: str) -> set[int]:
    """Numbers of the lines of a file that hold code.

    A text that stands as a statement is a docstring, of an attribute too.
    """
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    code = {n for t in tokens if t.type not in NO_CODE for n in range(t.start[0], t.end[0] + 1)}
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                code -= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return code


def _names(node: ast.Assign | ast.AnnAssign) -> int:
    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
    return len(target.elts) if isinstance(target, ast.Tuple) else 1


def _is_number(value: ast.expr | None) -> bool:
    """Whether an expression is a number, a sum or product of numbers, or a tuple of them."""
    match value:
        case ast.Constant(value=int() | float() as number):
            return not isinstance(number, bool)
        case ast.UnaryOp(operand=operand):
            return _is_number(operand)
        case ast.BinOp(left=left, right=right):
            return _is_number(left) and _is_number(right)
        case ast.Tuple(elts=elements):
            return bool(elements) and all(map(_is_number, elements))
    return False


def _patches(function: ast.expr) -> bool:
    match function:
        case ast.Attribute(value=ast.Name(id="monkeypatch"), attr=name):
            return name in PATCHING
        case ast.Attribute(value=ast.Name(id="patch" | "mock")) | ast.Name(id="patch"):
            return True
        case ast.Name(id=name):
            return name in MOCKS
    return False


def _module(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _imports(tree: ast.Module, known: Mapping[str, int]) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                both = (f"{node.module}.{alias.name}", node.module)
                yield from [name for name in both if name in known][:1]
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)


def here() -> Code:
    """The project as it lies here."""
    folders = (*PACKAGES, *BESIDE, "tests")
    paths = [p for folder in folders for p in sorted((ROOT / folder).rglob("*.py"))]
    return Code({p.relative_to(ROOT).as_posix(): p.read_text(encoding="utf-8") for p in paths})


def at(revision: str) -> Code:
    """The project at a revision of git. Raises InputError where there is none of that name."""
    done = subprocess.run(
        ["git", "archive", "--format=tar", revision], cwd=ROOT, capture_output=True, check=False
    )
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise InputError(
            f"revision '{revision}': git does not know it here ({said[-1] if said else 'no git'}); "
            "`git log` lists those there are"
        )
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        return Code({
            member.name: archive.extractfile(member).read().decode()  # type: ignore[union-attr]
            for member in archive
            if member.isfile() and member.name.endswith(".py")
        })  # fmt: skip


COUNTED: tuple[tuple[str, Callable[[Code], float], Target | None], ...] = (
    ("lines of twin and identify", lambda c: sum(c.below(*PACKAGES).lines), Target(high=27_000)),
    ("code lines", lambda c: c.below(*PACKAGES).code_lines, None),
    ("their files", lambda c: len(c.below(*PACKAGES).files), Target(high=210)),
    ("median file, lines", lambda c: float(np.median(c.below(*PACKAGES).lines)), None),
    (
        "numeric module constants",
        lambda c: sum(names for names, _ in c.below(*PACKAGES).constants),
        Target(high=200),
    ),
    (
        "of these without a comment",
        lambda c: sum(names for names, said in c.below(*PACKAGES).constants if not said),
        None,
    ),
    ("import circles", lambda c: c.below(*PACKAGES).circles, Target(high=0)),
    ("private share of functions", lambda c: c.below(*PACKAGES).private_share, None),
    ("lines of tests", lambda c: sum(c.below("tests").lines), Target(high=22_000)),
    ("files of tests", lambda c: len(c.below("tests").files), None),
    ("monkeypatch and mock", lambda c: c.below("tests").patches, None),
    (
        "tests over twin and identify",
        lambda c: sum(c.below("tests").lines) / sum(c.below(*PACKAGES).lines),
        None,
    ),
    ("lines of benchmarks and studies", lambda c: sum(c.below(*BESIDE).lines), None),
)


def compared(revision: str) -> list[Figure]:
    """Each figure now, with what it was at a revision in its note."""
    before, now = at(revision), here()
    return [
        Figure(what, count(now), "1", target, f"{shown(count(before))} at {revision}")
        for what, count, target in COUNTED
    ]


def measure() -> list[Figure]:
    """The figures now beside those of version 0.4.5."""
    return compared(BEFORE)


def main(arguments: Sequence[str]) -> int:
    """Print the figures at a revision and now."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks size", description=__doc__)
    parser.add_argument("revision", nargs="?", default=BEFORE, help="of git, to compare with")
    for f in compared(parser.parse_args(arguments).revision):
        print(f"{f.what:32} {f.note:>20}  {shown(f.value):>7} now  {f.verdict:4} {f.target or ''}")
    return 0
