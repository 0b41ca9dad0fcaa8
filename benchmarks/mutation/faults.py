"""Small faults: a line drawn at random, and one operator of cosmic-ray applied to it.

Two operators are added that it lacks: arguments swapped, and a term dropped.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import MutationVisitor
from cosmic_ray.operators.operator import Example, Operator
from cosmic_ray.plugins import get_operator

PACKAGES = ("twin", "identify")
LEAST = 5  # faults in a folder: of fewer, a share says nothing of three in five
# A comparison is inverted; moving its boundary (< to <=) hardly ever matters between doubles.
KINDS = (
    *(f"ReplaceBinaryOperator_{k}" for k in (
        "Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "Pow_Mul", "FloorDiv_Div", "Mod_Add",
        "BitAnd_BitOr", "BitOr_BitAnd",
    )),
    *(f"ReplaceComparisonOperator_{k}" for k in (
        "Lt_GtE", "LtE_Gt", "Gt_LtE", "GtE_Lt", "Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is",
    )),
    "ReplaceUnaryOperator_USub_UAdd", "ReplaceUnaryOperator_Delete_Not", "AddNot",
    "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd",
    "ReplaceBreakWithContinue", "NumberReplacer", "ZeroIterationForLoop",
)  # fmt: skip
# Faults that change nothing, whatever the code around them, so that no test can notice them:
# arguments of a symmetric function swapped (of the second kind the first two alone),
SYMMETRIC = {"min", "max"}
SYMMETRIC_IN_TWO = {
    "minimum", "maximum", "hypot", "convolve", "array_equal", "union1d", "intersect1d",
    "logical_and", "logical_or", "multiply", "gcd",
}  # fmt: skip
# whether zip looks at the lengths of sequences that are of one length, and what type checkers alone
# read: annotations, which are never evaluated, type variables.
GUARDS = ("strict=",)


class SwapArguments(Operator):
    """f(a, b) -> f(b, a), for each neighbouring pair of positional arguments."""

    def mutation_positions(self, node):
        pairs = self._pairs(node)  # all at once: the node changes while its mutant is made
        return [(node.children[i].start_pos, node.children[i + 2].end_pos) for i in pairs]

    def mutate(self, node, index):
        i = self._pairs(node)[index]
        first, second = node.children[i].get_code(False), node.children[i + 2].get_code(False)
        swapped = f"{second}, {first}"
        module = get_ast(f"f({swapped})")
        fresh = next(n for n in ast_nodes(module) if n.type == "arglist").children
        prefix = node.children[i].get_first_leaf().prefix
        fresh[0].get_first_leaf().prefix = prefix
        node.children[i : i + 3] = fresh
        return node

    @staticmethod
    def _pairs(node) -> list[int]:
        """Where two positional arguments that differ stand side by side."""
        if node.type != "arglist" or getattr(node.parent, "type", "") == "classdef":
            return []
        function = node.get_previous_leaf().get_previous_leaf().value
        if function in SYMMETRIC:
            return []
        found = []
        for i in range(2 * (function in SYMMETRIC_IN_TWO), len(node.children) - 2, 2):
            one, other = node.children[i], node.children[i + 2]
            plain = all(c.type != "argument" for c in (one, other))
            if plain and one.get_code(False) != other.get_code(False):
                found.append(i)
        return found

    @classmethod
    def examples(cls):
        return (Example("f(a, b)", "f(b, a)"),)


class DropTerm(Operator):
    """a + b -> a, for each term of a sum after its first."""

    def mutation_positions(self, node):
        return [
            (node.children[i].start_pos, node.children[i + 1].end_pos) for i in self._terms(node)
        ]

    def mutate(self, node, index):
        i = self._terms(node)[index]
        del node.children[i : i + 2]
        return node

    @staticmethod
    def _terms(node) -> list[int]:
        if node.type != "arith_expr":
            return []
        return list(range(1, len(node.children), 2))

    @classmethod
    def examples(cls):
        return (Example("x = a + b", "x = a"),)


@cache
def operators() -> dict[str, Operator]:
    """Every kind of fault by name."""
    known: dict[str, Operator] = {k: get_operator(f"core/{k}")() for k in KINDS}
    return {**known, "SwapArguments": SwapArguments(), "DropTerm": DropTerm()}


@dataclass(frozen=True)
class Fault:
    """One altered line: path from the project's root, line number, kind, which of that kind."""

    path: str
    line: int
    kind: str
    occurrence: int

    @property
    def folder(self) -> str:
        """The folder that it is counted to."""
        return str(Path(self.path).parent)

    def applied(self, source: str) -> str:
        """The source with the fault in it."""
        altered = MutationVisitor.mutate_code(source, operators()[self.kind], self.occurrence)
        return source if altered is None else altered

    def shown(self, source: str) -> str:
        """The lines before and after, e.g. "a + b  ->  a - b"."""
        before, after = source.splitlines(), self.applied(source).splitlines()
        changed = [i for i, (a, b) in enumerate(zip(before, after, strict=False)) if a != b]
        if not changed:
            return f"{before[self.line - 1].strip()}  ->  (a line less)"
        i = changed[0]
        return f"{before[i].strip()}  ->  {after[i].strip()}"


def faults_on(path: str, source: str, line: int) -> list[Fault]:
    """Every fault that can be put into one line, but for those that change nothing."""
    if line in _idle_lines(source):
        return []
    found, text = [], source.splitlines()[line - 1]
    nodes = list(ast_nodes(get_ast(source)))
    for kind, operator in operators().items():
        places = [place for node in nodes for place, _ in operator.mutation_positions(node)]
        found += [
            Fault(path, line, kind, occurrence)
            for occurrence, place in enumerate(places)
            if place[0] == line
            and not text[: place[1]].endswith(GUARDS)
            and not any(begin <= place < end for begin, end in _annotations(source))
        ]
    return [f for f in found if _compiles(f.applied(source), source)]


def _compiles(altered: str, source: str) -> bool:
    try:
        compile(altered, "altered", "exec")
    except SyntaxError:
        return False
    return altered != source


@cache
def _idle_lines(source: str) -> frozenset[int]:
    """Lines that no result depends on: annotations, imports, decorators and texts."""
    idle: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        whole: list[ast.AST] = []
        match node:
            case ast.Import() | ast.ImportFrom() | ast.AnnAssign(value=None):
                whole = [node]
            case (
                ast.Expr(value=ast.Constant()) | ast.Call(func=ast.Name(id="TypeVar" | "ParamSpec"))
            ):
                whole = [node]
            case ast.FunctionDef() | ast.ClassDef():
                whole = list(node.decorator_list)
        for part in whole:
            idle.update(range(part.lineno, part.end_lineno + 1))  # type: ignore[attr-defined]
        if isinstance(node, ast.FunctionDef):
            idle.update(range(node.lineno, node.body[0].lineno))
    return frozenset(idle)


@cache
def _annotations(source: str) -> tuple[tuple[tuple[int, int], tuple[int, int]], ...]:
    """Begin and end (line, column) of the annotation of every variable."""
    nodes = [n.annotation for n in ast.walk(ast.parse(source)) if isinstance(n, ast.AnnAssign)]
    return tuple(
        ((n.lineno, n.col_offset), (n.end_lineno or 0, n.end_col_offset or 0)) for n in nodes
    )


def is_native(source: str, line: int) -> bool:
    """Whether a line is in a law, a compiled function, or what one compiles to."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef) and node.lineno <= line <= (node.end_lineno or 0):
            law = [a.arg for a in node.args.args] == ["p", "s", "io"]
            made = " ".join(ast.dump(d) for d in node.decorator_list)
            if law or any(word in made for word in ("compiled", "jit", "intrinsic")):
                return True
    return False


def is_at_import(source: str, line: int) -> bool:
    """Whether a line is in no function, and so runs once, for whichever test is the first."""
    functions = (ast.FunctionDef, ast.AsyncFunctionDef)
    return not any(
        isinstance(node, functions) and node.body[0].lineno <= line <= (node.end_lineno or 0)
        for node in ast.walk(ast.parse(source))
    )


def draw(root: Path, count: int, seed: int, least: int = LEAST) -> list[Fault]:
    """Faults in lines drawn at random: ``least`` of each folder, the rest by its lines.

    Where ``count`` is too few for that, as many of each folder as there are for all.
    """
    rng = np.random.default_rng(seed)
    paths = [p for package in PACKAGES for p in sorted((root / package).rglob("*.py"))]
    sources = {str(p.relative_to(root)): p.read_text() for p in paths}
    folders: dict[str, list[tuple[str, int]]] = {}
    for path, source in sources.items():
        lines = [(path, i + 1) for i, text in enumerate(source.splitlines()) if text.strip()]
        folders.setdefault(str(Path(path).parent), []).extend(lines)
    parts = shares({f: len(v) for f, v in folders.items()}, count, least)
    return [fault for f, n in parts.items() for fault in _drawn(folders[f], sources, n, rng)]


def _drawn(
    lines: Sequence[tuple[str, int]], sources: dict[str, str], wanted: int, rng: np.random.Generator
) -> Iterator[Fault]:
    for i in rng.permutation(len(lines)):
        if wanted == 0:
            return
        path, line = lines[i]
        if choice := faults_on(path, sources[path], line):
            yield choice[int(rng.integers(len(choice)))]
            wanted -= 1


def shares(sizes: dict[str, int], count: int, least: int) -> dict[str, int]:
    """How many of each folder: ``least``, and what is left goes where its part is missed most."""
    total = sum(sizes.values())
    each = min(least, count // len(sizes))
    out = {f: min(each, n) for f, n in sizes.items()}
    while sum(out.values()) < min(count, total):
        room = [f for f in sizes if out[f] < sizes[f]]
        neediest = max(room, key=lambda f: count * sizes[f] / total - out[f])
        out[neediest] += 1
    return out
