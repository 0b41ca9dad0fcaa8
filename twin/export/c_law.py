"""Laws as C99: a law is arithmetic on three arrays of doubles, in Python and in C alike.

Each function is translated from its own source, statement by statement, with the functions that it
calls. So there is one law, written once; what C text says is compared with what the compiled law
says over the whole catalogue in the tests. As numba does, a function is made for the types that it
is called with.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from twin import effect as slots
from twin.effect import IO_SIZE, Law
from twin.export.c_types import (
    IO,
    REAL,
    SAME_NAME,
    WHOLE,
    CannotTranslate,
    P,
    S,
    Type,
    Typed,
    of_augmented,
)

DECLARED = {P: "const double *", S: "double *", IO: "double *"}
SLOTS = {
    name: value
    for name, value in vars(slots).items()
    if name.isupper() and type(value) is int and value < IO_SIZE
}
OPERATORS: dict[type, tuple[str, int]] = {
    ast.Add: ("+", 5), ast.Sub: ("-", 5), ast.Mult: ("*", 6), ast.Div: ("/", 6),
    ast.Eq: ("==", 3), ast.NotEq: ("!=", 3), ast.Lt: ("<", 4), ast.LtE: ("<=", 4),
    ast.Gt: (">", 4), ast.GtE: (">=", 4), ast.And: ("&&", 2), ast.Or: ("||", 1),
}  # fmt: skip
UNARY, CALL = 7, 8  # how tightly these bind, beside the numbers above
RESERVED = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum",
    "extern", "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict",
    "return", "short", "signed", "sizeof", "static", "struct", "switch", "typedef", "union",
    "unsigned", "void", "volatile", "while", "gamma", "j0", "j1", "jn", "y0", "y1", "yn",
} | set(SAME_NAME.values())  # fmt: skip

# What Python has and C has not; whole numbers divide downwards in Python.
HELPERS = {
    "smaller": "double smaller(double a, double b) { return b < a ? b : a; }",
    "larger": "double larger(double a, double b) { return b > a ? b : a; }",
    "smaller_whole": "long long smaller_whole(long long a, long long b) { return b < a ? b : a; }",
    "larger_whole": "long long larger_whole(long long a, long long b) { return b > a ? b : a; }",
    "modulo": """double modulo(double a, double b)
{
    const double rest = fmod(a, b);
    return rest != 0.0 && (rest < 0.0) != (b < 0.0) ? rest + b : rest;
}""",
    "modulo_whole": """long long modulo_whole(long long a, long long b)
{
    const long long rest = a % b;
    return rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest;
}""",
    "divided": """double divided(double a, double b)
{
    return floor((a - modulo(a, b)) / b + 0.5);
}""",
    "divided_whole": """long long divided_whole(long long a, long long b)
{
    return a / b - (a % b != 0 && (a < 0) != (b < 0));
}""",
}


@dataclass
class CLaws:
    """C functions for laws, each after those that it calls."""

    texts: dict[tuple[Any, ...], str] = field(default_factory=dict)
    """The text of each function made, by the function and the types it is called with."""
    names: dict[tuple[Any, ...], str] = field(default_factory=dict)
    helpers: set[str] = field(default_factory=set)
    returned: dict[tuple[Any, ...], Type] = field(default_factory=dict)

    def law(self, law: Law) -> str:
        """Name of the C function ``void name(p, s, io)`` of a law. Raises CannotTranslate."""
        return self.function(law, (P, S, IO))

    @property
    def text(self) -> str:
        """All functions made so far."""
        made = [f"static {HELPERS[name]}" for name in HELPERS if name in self.helpers]
        return "\n\n".join([*made, *self.texts.values()])

    def returns(self, function: Any, types: tuple[Type, ...]) -> Type:
        """Type of what a function returns that is called with these types."""
        key = function, types
        if key not in self.returned:
            self.returned[key] = None  # a function that calls itself gives nothing, and is refused
            self.returned[key] = Typed(self.returns, function, types).result
        return self.returned[key]

    def function(self, function: Any, types: tuple[Type, ...]) -> str:
        """Name of the C function for these types; its text is made at the first call."""
        key = function, types
        if key not in self.names:
            result = self.returns(function, types)
            name = f"{function.__module__.rpartition('.')[2]}_{function.__name__}"
            taken = sum(other.startswith(name) for other in self.names.values())
            name = f"{name}_{taken + 1}" if name in self.names.values() else name
            self.names[key] = name
            text = _Function(self, function, types).text(name)  # adds first what it calls
            if isinstance(result, tuple):
                members = " ".join(f"{t} r{i};" for i, t in enumerate(result))
                text = f"typedef struct {{ {members} }} {name}_result;\n\n{text}"
            self.texts[key] = text
        return self.names[key]


class _Function(Typed):
    """The same as C text."""

    def __init__(self, laws: CLaws, function: Any, types: tuple[Type, ...]) -> None:
        self.laws = laws
        self.undeclared: set[str] = set()  # names that wait for their first value
        super().__init__(laws.returns, function, types)

    def text(self, name: str) -> str:
        """The C function of that name."""
        result = f"{name}_result" if isinstance(self.result, tuple) else self.result or "void"
        given = ", ".join(
            f"{DECLARED.get(t, f'{t} ')}{_safe(n)}" for n, t in self.arguments.items()
        )
        loops = {n.target.id for n in ast.walk(self.tree)
                 if isinstance(n, ast.For) and isinstance(n.target, ast.Name)}  # fmt: skip
        self.undeclared = _declared_in_place(self.body) - {*self.arguments}
        own = [
            f"    {t} {_safe(n)} = {'0.0' if t == REAL else '0'};"
            for n, t in self.types.items()
            if n in self.read - {*self.arguments} - loops - self.undeclared
        ]
        unused = [f"    (void){_safe(n)};" for n in self.arguments if n not in self.read]
        said = (ast.get_docstring(self.tree) or "").split("\n\n")[0]
        said = said.replace("*/", "* /").replace("\n", "\n   ")
        head = f"/* {said} */\n" if said else ""
        self.name = name
        lines = [f"static {result} {name}({given})", "{", *own, *unused, *self._block(self.body)]
        return head + "\n".join([*lines, "}"])

    def _block(self, body: list[ast.stmt]) -> Iterator[str]:
        for node in body:
            yield from (f"    {line}" for line in self._statement(node))

    def _statement(self, node: ast.stmt) -> Iterator[str]:
        match node:
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=value):
                yield from self._unpacked(targets, value)
            case ast.Assign(targets=[target], value=value):
                yield from self._assigned(target, value)
            case ast.AugAssign(target=target, op=op, value=value) if type(op) in OPERATORS:
                sign = OPERATORS[type(op)][0]
                if isinstance(op, ast.Div) and self.type_of(target) != REAL:
                    raise CannotTranslate("a whole number is divided in place")
                yield f"{self._target(target)} {sign}= {self.expression(value)};"
            case ast.AugAssign(target=target):
                yield from self._assigned(target, of_augmented(node))
            case ast.If():
                yield from self._branches(node)
            case ast.For():
                yield from self._loop(node)
            case ast.While(test=test, orelse=[]):
                yield f"while ({self.expression(test)}) {{"
                yield from self._block(node.body)
                yield "}"
            case ast.Return(value=None):
                yield "return;"
            case ast.Return(value=ast.Tuple(elts=parts)):
                yield f"return ({self.name}_result){{{', '.join(map(self.expression, parts))}}};"
            case ast.Return(value=ast.expr() as value):
                yield f"return {self.expression(value)};"
            case ast.Break() | ast.Continue():
                yield f"{type(node).__name__.lower()};"
            case ast.Expr(value=ast.Call() as call):
                yield f"{self.expression(call)};"
            case ast.Pass():
                pass
            case _:
                raise CannotTranslate(f"`{ast.unparse(node)[:60]}` has no counterpart in C here")

    def _target(self, node: ast.expr) -> str:
        if isinstance(node, ast.Name | ast.Subscript):
            return _safe(node.id) if isinstance(node, ast.Name) else self.expression(node)
        raise CannotTranslate(f"`{ast.unparse(node)}` cannot be given a value in C here")

    def _assigned(self, target: ast.expr, value: ast.expr) -> Iterator[str]:
        wanted, first = REAL, ""
        if isinstance(target, ast.Name):
            if target.id not in self.read:
                return
            wanted = self.types[target.id]
            if target.id in self.undeclared:
                self.undeclared.remove(target.id)
                first = f"{wanted} "
        yield f"{first}{self._target(target)} = {self.expression(value, wanted)};"

    def _unpacked(self, targets: list[ast.expr], value: ast.expr) -> Iterator[str]:
        """Several values at once: all of them are there before the first is given a new one."""
        if isinstance(value, ast.Tuple):
            changed = {t.id for t in targets if isinstance(t, ast.Name)}
            used = {n.id for v in value.elts for n in ast.walk(v) if isinstance(n, ast.Name)}
            if not changed & used and all(isinstance(t, ast.Name) for t in targets):
                for target, own in zip(targets, value.elts, strict=True):
                    yield from self._assigned(target, own)
                return
            sources = [f"new{i}" for i in range(len(targets))]
            first = [
                f"    const {self.type_of(own)} {source} = {self.expression(own)};"
                for source, own in zip(sources, value.elts, strict=True)
            ]
        elif isinstance(value, ast.Call):
            called, types = self._called(value)
            sources = [f"got.r{i}" for i in range(len(targets))]
            name = self.laws.function(called, types)
            first = [f"    const {name}_result got = {self.expression(value)};"]
        else:
            raise CannotTranslate(f"`{ast.unparse(value)}` has no counterpart in C here")
        yield "{"
        yield from first
        for target, source in zip(targets, sources, strict=True):
            if not isinstance(target, ast.Name) or target.id in self.read:
                yield f"    {self._target(target)} = {source};"
        yield "}"

    def _branches(self, node: ast.If) -> Iterator[str]:
        yield f"if ({self.expression(node.test)}) {{"
        yield from self._block(node.body)
        rest = node.orelse
        while len(rest) == 1 and isinstance(rest[0], ast.If):
            yield f"}} else if ({self.expression(rest[0].test)}) {{"
            yield from self._block(rest[0].body)
            rest = rest[0].orelse
        if rest:
            yield "} else {"
            yield from self._block(rest)
        yield "}"

    def _loop(self, node: ast.For) -> Iterator[str]:
        match node:
            case ast.For(
                target=ast.Name(id=counter),
                iter=ast.Call(func=ast.Name(id="range"), args=[*first, last]),
                orelse=[],
            ) if len(first) < 2:
                begin = self.expression(first[0]) if first else "0"
            case _:
                raise CannotTranslate(f"`for ... in {ast.unparse(node.iter)}`: give a range")
        changed = {
            n.id for part in node.body for n in ast.walk(part)
            if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        }  # fmt: skip
        if changed & {counter, *(n.id for n in ast.walk(last) if isinstance(n, ast.Name))}:
            raise CannotTranslate(f"the loop over {counter} changes where it ends")
        own = _safe(counter)
        end = self.expression(last)
        yield f"for ({WHOLE} {own} = {begin}; {own} < {end}; {own}++) {{"
        yield from self._block(node.body)
        yield "}"

    def expression(self, node: ast.expr, wanted: Type = None) -> str:
        """An expression in C; wanted: the type of what it becomes, where that is known."""
        return self._bound(node, wanted)[0]

    def _bound(self, node: ast.expr, wanted: Type = None) -> tuple[str, int]:
        """The same, and how tightly it binds."""
        match node:
            case ast.Constant(value=int() | float() as value):
                return _literal(float(value) if wanted == REAL else value), CALL
            case ast.Name(id=name) if name in self.types:
                return _safe(name), CALL
            case ast.Name() | ast.Attribute():
                return self._bound(ast.Constant(self._constant(node)), wanted)
            case ast.Subscript(value=ast.Name(id=array), slice=index):
                return f"{_safe(array)}[{self._index(array, index)}]", CALL
            case ast.UnaryOp(op=ast.USub() | ast.UAdd() | ast.Not() as op, operand=operand):
                sign = {ast.USub: "-", ast.UAdd: "+", ast.Not: "!"}[type(op)]
                return f"{sign}{self._within(operand, UNARY + 1, wanted)}", UNARY
            case ast.BinOp():
                return self._binary(node, wanted)
            case ast.Compare(left=left, ops=ops, comparators=others):
                return self._compared([left, *others], ops)
            case ast.BoolOp(op=op, values=values):
                sign, level = OPERATORS[type(op)]
                # `a || (b && c)`: compilers ask for the parentheses
                return f" {sign} ".join(self._within(v, 3) for v in values), level
            case ast.IfExp(test=test, body=one, orelse=other):
                parts = self._within(test, 1), self._within(one, 1), self._within(other, 1)
                return "{} ? {} : {}".format(*parts), 0
            case ast.Call():
                return self._call(node)
        raise CannotTranslate(f"`{ast.unparse(node)}` has no counterpart in C here")

    def _within(self, node: ast.expr, level: int, wanted: Type = None) -> str:
        """An expression inside another, in parentheses where it binds less tightly."""
        text, own = self._bound(node, wanted)
        return text if own >= level else f"({text})"

    def _index(self, array: str, index: ast.expr) -> str:
        kind = self.types.get(array)
        if kind not in (P, S, IO):
            raise CannotTranslate(f"`{array}` is none of the arrays p, s and io")
        if kind == IO and isinstance(index, ast.Name) and index.id not in self.types:
            for slot, value in SLOTS.items():
                if value == self._constant(index):
                    return f"IO_{slot}"
        text = self.expression(index)
        return text if self.type_of(index) != REAL else f"({WHOLE})({text})"

    def _binary(self, node: ast.BinOp, wanted: Type) -> tuple[str, int]:
        whole = REAL not in (self.type_of(node.left), self.type_of(node.right))
        if isinstance(node.op, ast.Pow):
            args = (self.expression(n, REAL) for n in (node.left, node.right))
            return f"pow({', '.join(args)})", CALL
        if isinstance(node.op, ast.Mod | ast.FloorDiv):
            helper = "modulo" if isinstance(node.op, ast.Mod) else "divided"
            helper += "_whole" * whole
            args = (self.expression(n) for n in (node.left, node.right))
            return self._helped(helper, args), CALL
        if type(node.op) not in OPERATORS:
            raise CannotTranslate(f"`{ast.unparse(node)}` has no counterpart in C here")
        sign, level = OPERATORS[type(node.op)]
        kind = None if whole and wanted != REAL else REAL
        left = self._within(node.left, level, kind)
        if isinstance(node.op, ast.Div) and whole and not isinstance(node.left, ast.Constant):
            return f"(double){self._within(node.left, CALL)} / {self._within(node.right, 7)}", level
        if isinstance(node.op, ast.Div):
            kind = REAL
        return f"{left} {sign} {self._within(node.right, level + 1, kind)}", level

    def _compared(self, parts: list[ast.expr], ops: list[ast.cmpop]) -> tuple[str, int]:
        if not all(type(op) in OPERATORS for op in ops):
            raise CannotTranslate("a comparison that is none of numbers")
        pairs = []
        for one, op, other in zip(parts, ops, parts[1:], strict=False):
            sign, level = OPERATORS[type(op)]
            kind = REAL if REAL in (self.type_of(one), self.type_of(other)) else None
            both = (self._within(side, level + 1, kind) for side in (one, other))
            pairs.append(f" {sign} ".join(both))
        return " && ".join(pairs), 3 if len(pairs) == 1 else 2

    def _call(self, node: ast.Call) -> tuple[str, int]:
        called, types = self._called(node)
        if called in (int, float):
            kind = WHOLE if called is int else REAL
            return f"({kind}){self._within(node.args[0], CALL)}", UNARY
        whole = self._type_of_call(node) == WHOLE
        args = [self.expression(a, None if whole else REAL) for a in node.args]
        if called is abs:
            return (f"{args[0]} < 0 ? -({args[0]}) : {args[0]}", 0) if whole else (
                f"fabs({args[0]})", CALL)  # fmt: skip
        if called in (min, max):
            helper = ("smaller" if called is min else "larger") + "_whole" * whole
            text = args[0]
            for other in args[1:]:
                text = self._helped(helper, (text, other))
            return text, CALL
        if called in SAME_NAME:
            return f"{SAME_NAME[called]}({', '.join(args)})", CALL
        args = [self.expression(a, t) for a, t in zip(node.args, types, strict=True)]
        return f"{self.laws.function(called, types)}({', '.join(args)})", CALL

    def _helped(self, helper: str, args: Any) -> str:
        self.laws.helpers |= {helper, "modulo"} if helper == "divided" else {helper}
        return f"{helper}({', '.join(args)})"


def _declared_in_place(body: list[ast.stmt]) -> set[str]:
    """Names that an outermost statement gives their first value, and none reads before."""
    found: set[str] = set()
    seen: set[str] = set()
    for node in body:
        match node:
            case ast.Assign(targets=[ast.Name() as target], value=value):
                targets: list[ast.expr] = [target]
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple() as value):
                pass
            case _:
                targets, value = [], ast.Constant(0)
        if all(isinstance(t, ast.Name) for t in targets):
            own = {t.id for t in targets if isinstance(t, ast.Name)}
            found |= own - {n.id for n in ast.walk(value) if isinstance(n, ast.Name)} - seen
        seen |= {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
    return found


def _safe(name: str) -> str:
    """The name, or another where C has it already."""
    return f"{name}_" if name in RESERVED or name.startswith("new") else name


def _literal(value: Any) -> str:
    if isinstance(value, bool):
        return str(int(value))
    if not math.isfinite(value):
        raise CannotTranslate(f"{value} is no finite number")
    return repr(value) if value >= 0 else f"({value!r})"
