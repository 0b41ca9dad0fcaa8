"""The equation that an effect states, as a formula: what its law is compared with.

"F = -k d exp(-(d/w)^2),  d = x - place" is one: products without a sign, powers with ^, absolute
values between bars, names explained behind a comma or semicolon.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from types import CodeType

import numpy as np

from twin.signals import Array

_TOKEN = re.compile(r"\s*(\d+\.?\d*(?:[eE][+-]?\d+)?|[A-Za-z_]\w*|[-+*/^()|])")
_FUNCTIONS: Mapping[str, Callable] = {
    "exp": np.exp, "sin": np.sin, "cos": np.cos, "tan": np.tan, "tanh": np.tanh, "sqrt": np.sqrt,
    "log": np.log, "abs": np.abs, "sgn": np.sign, "sign": np.sign, "floor": np.floor,
}  # fmt: skip
SIGNALS = ("x", "v", "t")
_OPERATORS = {"^": "**"}


class NoFormula(ValueError):
    """The text is an explanation, and cannot be computed."""


def formula(equation: str, parameters: Collection[str]) -> Callable[[Mapping[str, Array]], Array]:
    """The function of x, v, t and the parameters that the equation states; raises NoFormula."""
    stated, *explained = re.split(r"[;,](?![^(]*\))", equation)
    parts = stated.split("=")
    if len(parts) != 2:
        raise NoFormula(stated)
    meant: dict[str, str] = {}
    for clause in explained:
        name, equals, text = clause.partition("=")
        if equals and name.strip().isidentifier():
            meant[name.strip()] = text
    known = {*parameters, *SIGNALS, "pi", *meant}
    code = {name: _python(text, known) for name, text in meant.items()}
    whole = _python(parts[1], known)

    def computed(values: Mapping[str, Array]) -> Array:
        names = {**_FUNCTIONS, "pi": np.pi, **values}
        for _ in code:  # each may need those that are explained after it
            for name, meaning in code.items():
                with suppress(NameError):
                    names[name] = _value(meaning, names)
        try:
            return np.asarray(_value(whole, names), dtype=float)
        except NameError as error:
            raise NoFormula(str(error)) from error

    return computed


def _value(code: CodeType, names: Mapping[str, object]) -> Array:
    """Of an expression that ``_python`` made of known names and operators alone."""
    return eval(code, {"__builtins__": {}}, dict(names))


def _python(text: str, known: Collection[str]) -> CodeType:
    """The text as a Python expression; raises NoFormula for a word that is no known name."""
    out: list[str] = []
    at, bars, ended = 0, 0, False  # ended: whether what stands before is a value
    text = text.strip()
    while at < len(text):
        found = _TOKEN.match(text, at)
        if found is None:
            raise NoFormula(text)
        token, at = found[1], found.end()
        called = token in _FUNCTIONS and text[at : at + 1] == "("
        if token[0].isalpha() and not called and token not in known:
            raise NoFormula(token)
        closes = token == "|" and bars > 0 and ended
        begins = token[0].isalnum() or token == "(" or (token == "|" and not closes)
        if begins and ended:
            out.append("*")
        bars += (token == "|") * (-1 if closes else 1)
        python = ")" if closes else "abs(" if token == "|" else _OPERATORS.get(token, token)
        out.append(python)
        ended = closes or token == ")" or (token[0].isalnum() and not called)
    try:
        return compile(" ".join(out), "equation", "eval")
    except SyntaxError as error:
        raise NoFormula(text) from error
