"""The types of what a law names, for C: inferred as numba does, from those of its arguments.

A number is a double, a whole number or a truth value; p, s and io are the arrays.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import textwrap
from collections.abc import Callable, Iterator
from functools import reduce
from types import FunctionType
from typing import Any

Type = Any  # one of the texts below, None for nothing, or a tuple of them
REAL, WHOLE, TRUTH = "double", "long long", "int"
P, S, IO = "p", "s", "io"  # the arrays, each known by its use
WIDTH = (TRUTH, WHOLE, REAL)  # the wider type holds the narrower
Returns = Callable[[Any, tuple[Type, ...]], Type]  # of a function that is called with such types

SAME_NAME = {
    getattr(math, name): name
    for name in (
        "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "ceil", "copysign", "cos",
        "cosh", "erf", "erfc", "exp", "expm1", "fabs", "floor", "fmod", "hypot", "log", "log10",
        "log1p", "log2", "pow", "sin", "sinh", "sqrt", "tan", "tanh", "trunc",
    )
}  # fmt: skip


class CannotTranslate(Exception):
    """A law uses what has no counterpart in C here; the text says what."""


class Typed:
    """One Python function for given types of its arguments: the types of all that it names."""

    def __init__(self, returns: Returns, function: Any, types: tuple[Type, ...]) -> None:
        self.returned_by = returns
        self.tree = _parsed(function)
        arguments = [a.arg for a in self.tree.args.args]
        if len(arguments) != len(types):
            raise CannotTranslate(f"{function.__name__} is called with {len(types)} arguments")
        self.arguments = dict(zip(arguments, types, strict=True))
        self.types: dict[str, Type] = dict(self.arguments)
        self.result: Type = None
        closed_over = inspect.getclosurevars(function).nonlocals
        self.known = {**function.__globals__, **closed_over}
        names = [n for n in ast.walk(self.tree) if isinstance(n, ast.Name)]
        self.read = {n.id for n in names if isinstance(n.ctx, ast.Load)}
        body = self.tree.body
        self.body = body[1:] if ast.get_docstring(self.tree) else body
        self._infer()

    def _infer(self) -> None:
        """Types of all variables and of the result: until a pass changes none."""
        while True:
            before = dict(self.types), self.result
            for node in ast.walk(self.tree):
                if isinstance(node, ast.For):
                    self._widen(node.target, WHOLE)
            for node in _in_order(self.body):
                match node:
                    case ast.Assign(targets=[target]):
                        self._widen(target, self.type_of(node.value))
                    case ast.AugAssign(target=ast.Name()):
                        self._widen(node.target, self.type_of(of_augmented(node)))
                    case ast.Return(value=ast.expr() as value):
                        self.result = _wider(self.result, self.type_of(value))
            if before == (self.types, self.result):
                return

    def _widen(self, target: ast.expr, found: Type) -> None:
        match target:
            case ast.Name(id=name):
                self.types[name] = _wider(self.types.get(name), found)
            case ast.Tuple(elts=parts):
                if not isinstance(found, tuple) or len(found) != len(parts):
                    raise CannotTranslate("several values are taken from what is not as many")
                for part, own in zip(parts, found, strict=True):
                    self._widen(part, own)

    def type_of(self, node: ast.expr) -> Type:
        """Type of an expression."""
        match node:
            case ast.Constant(value=bool()) | ast.Compare():
                return TRUTH
            case ast.Constant(value=int()):
                return WHOLE
            case ast.Constant(value=float()) | ast.Subscript():
                return REAL
            case ast.Name(id=name) if name in self.types:
                return self.types[name]
            case ast.Name() | ast.Attribute():
                return self.type_of(ast.Constant(self._constant(node)))
            case ast.Tuple(elts=parts):
                return tuple(map(self.type_of, parts))
            case ast.UnaryOp(op=ast.Not()):
                return TRUTH
            case ast.UnaryOp(operand=operand):
                return _wider(WHOLE, self.type_of(operand))
            case ast.BinOp(left=left, right=right):
                both = _wider(_wider(WHOLE, self.type_of(left)), self.type_of(right))
                return REAL if isinstance(node.op, ast.Div | ast.Pow) else both
            case ast.BoolOp(values=values):
                if {self.type_of(v) for v in values} != {TRUTH}:
                    raise CannotTranslate("`and` or `or` of numbers; compare them with something")
                return TRUTH
            case ast.IfExp(body=one, orelse=other):
                return _wider(self.type_of(one), self.type_of(other))
            case ast.Call():
                return self._type_of_call(node)
        raise CannotTranslate(f"`{ast.unparse(node)}` has no counterpart in C here")

    def _type_of_call(self, node: ast.Call) -> Type:
        called, types = self._called(node)
        if called is int:
            return WHOLE
        if called in (abs, min, max):
            return reduce(_wider, types, WHOLE)
        if isinstance(called, FunctionType):
            return self.returned_by(called, types)
        return REAL

    def _called(self, node: ast.Call) -> tuple[Any, tuple[Type, ...]]:
        """What is called, and with which types."""
        if node.keywords:
            raise CannotTranslate(f"`{ast.unparse(node)}`: give arguments by their place")
        called = self._value(node.func)
        fine = called in (abs, min, max, int, float) or called in SAME_NAME
        if not (fine or isinstance(called, FunctionType)):
            raise CannotTranslate(f"`{ast.unparse(node.func)}` has no counterpart in C here")
        return called, tuple(map(self.type_of, node.args))

    def _value(self, node: ast.expr) -> Any:
        """What a name of the module, or an attribute of such a one, stands for."""
        match node:
            case ast.Name(id=name) if name in self.known:
                return self.known[name]
            case ast.Name(id=name) if hasattr(builtins, name):
                return getattr(builtins, name)
            case ast.Attribute(value=owner, attr=name):
                return getattr(self._value(owner), name, None)
        raise CannotTranslate(f"`{ast.unparse(node)}` is read before it has a value")

    def _constant(self, node: ast.expr) -> float:
        value = self._value(node)
        if isinstance(value, bool | int | float):
            return value
        raise CannotTranslate(f"`{ast.unparse(node)}` is no number")


def _parsed(function: Any) -> ast.FunctionDef:
    """The function's own source as a tree; raises CannotTranslate."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    except (OSError, TypeError, SyntaxError) as error:
        raise CannotTranslate("its source cannot be read") from error
    if not isinstance(tree, ast.FunctionDef):
        raise CannotTranslate(f"{getattr(function, '__name__', function)} is no plain function")
    return tree


def _wider(one: Type, other: Type) -> Type:
    """The type that holds both; raises CannotTranslate where there is none."""
    if one == other or other is None:
        return one
    if one is None:
        return other
    if isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
        return tuple(_wider(a, b) for a, b in zip(one, other, strict=True))
    if one in WIDTH and other in WIDTH:
        return max(one, other, key=WIDTH.index)
    raise CannotTranslate("a variable holds now a number, now something else")


def _in_order(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Statements as they are written, with those inside of others."""
    for node in body:
        yield node
        for inner in ("body", "orelse"):
            yield from _in_order(getattr(node, inner, []))


def of_augmented(node: ast.AugAssign) -> ast.BinOp:
    """``a op b`` of ``a op= b``."""
    read = ast.parse(ast.unparse(node.target), mode="eval").body
    return ast.BinOp(read, node.op, node.value)
