"""Native functions whose cache on disk is keyed by everything that was compiled into them.

numba keys a function's cache by that function's own file. The functions that it calls and the
constants that it reads are compiled into it too; here they are part of the key, so that a change of
any of them compiles it again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from functools import cache
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numba
import numpy as np
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys
from numba.extending import register_jitable

from twin.effect import own_functions


class _Cache(FunctionCache):
    """A function's cache, keyed by all that is compiled into the function."""

    def load_overload(self, sig, target_context):
        # Of what numba prepares for its compiler (0.4 s), machine code needs only its runtime.
        rtsys.initialize(target_context)
        return self._load_overload(sig, target_context)

    def _index_key(self, sig, codegen):
        return (*super()._index_key(sig, codegen), digest(self._py_func))


class _Callback(CFunc):
    """A C callback with such a cache."""

    def enable_caching(self):
        self._cache = _Cache(self.__wrapped__)


def compiled(*, inline: bool = False, nogil: bool = False) -> Callable[[Any], Any]:
    """Decorator: compile a function at its first call, and keep the machine code on disk."""

    def wrap(function):
        chosen = "always" if inline else "never"
        out = numba.njit(inline=chosen, nogil=nogil, error_model="numpy")(function)
        out._cache = _Cache(function)
        return out

    return wrap


def callback(function: Any, signature: Any) -> Any:
    """The function compiled now as a C function, from disk where it was compiled before.

    It may call plain functions, also other laws, so that a file of laws needs no numba to be read.
    Raises numba.core.errors.NumbaError where it cannot be compiled.
    """
    for called in own_functions(function):
        _let_be_called(called)
    out = _Callback(function, (signature.args, signature.return_type), {}, {"error_model": "numpy"})
    out.enable_caching()
    out.compile()
    return out


@cache  # once each
def _let_be_called(function: FunctionType) -> None:
    register_jitable(function)


@cache
def digest(function: Any) -> str:
    """Hash of a function's code, of all that it calls and of the constants that these read."""
    found = hashlib.sha256()
    for part in _parts(function, set()):
        found.update(part.encode())
    return found.hexdigest()


def _parts(function: Any, seen: set[int]) -> Iterator[str]:
    """Texts that change whenever the compiled code would change."""
    if id(function) in seen:
        return
    seen.add(id(function))
    for code in _codes(function.__code__):
        yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames}"
        yield from (repr(c) for c in code.co_consts if not isinstance(c, CodeType))
        for name in code.co_names:
            value = function.__globals__.get(name)
            yield from _value_parts(name, value, seen)
            if isinstance(value, ModuleType):
                for attribute in sorted(set(code.co_names) & set(vars(value))):
                    yield from _value_parts(attribute, getattr(value, attribute), seen)
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield from _value_parts(name, cell.cell_contents, seen)


def _value_parts(name: str, value: Any, seen: set[int]) -> Iterator[str]:
    own = value.py_func if isinstance(value, Dispatcher) else getattr(value, "_defn", value)
    if isinstance(own, FunctionType):
        yield from _parts(own, seen)
    elif isinstance(value, np.ndarray):
        yield f"{name} {value.dtype} {value.tobytes().hex()}"
    elif isinstance(value, (bool, int, float, complex, str, bytes, tuple)):
        yield f"{name} {value!r}"
    else:
        yield f"{name} {type(value).__name__}"


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)
