"""Native functions: their cache on disk, laws as C functions, calls of one by its address.

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
from numba import types
from numba.core import cgutils
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys
from numba.extending import intrinsic, register_jitable

from twin.effect import Effect, Law, own_functions
from twin.errors import InputError


class _Cache(FunctionCache):
    """A function's cache, keyed by all that is compiled into the function."""

    def load_overload(self, sig, target_context):
        # Of what numba prepares for its compiler (0.4 s), machine code needs only its runtime.
        rtsys.initialize(target_context)
        try:
            return self._load_overload(sig, target_context)
        except ImportError:  # kept by a version whose modules had other names: compile anew
            return None

    def _index_key(self, sig, codegen):
        return (*super()._index_key(sig, codegen), digest(self._py_func))


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
    types_of = signature.args, signature.return_type
    out: Any = CFunc(function, types_of, {}, {"error_model": "numpy"})
    out._cache = _Cache(function)
    out.compile()
    return out


_let_be_called = cache(register_jitable)  # once each


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


DOUBLES = types.CPointer(types.float64)
LAW_SIGNATURE = types.void(DOUBLES, DOUBLES, DOUBLES)

# Columns of the entry table, one row an effect.
ADDRESS, KIND, P_AT, S_AT = range(4)


def law_address(effect: Effect) -> int:
    """Address of the effect's compiled law; compiles at the first use on this machine.

    Raises InputError where the law cannot be compiled.
    """
    try:
        return _compile(effect.law).address
    except numba.core.errors.NumbaError as error:
        reason = next((line for line in str(error).splitlines()[1:] if line.strip()), "")
        raise InputError(
            f"effect '{effect.name}': its law cannot be compiled: {reason.strip()}; use only "
            "numbers, math functions and the arrays p, s, io"
        ) from error


def address_of(law: Law) -> int:
    """Address of a function with the signature of a law; compiles as ``law_address`` does."""
    return int(_compile(law).address)


@cache  # the native code must live as long as its address
def _compile(law: Law) -> Any:
    return callback(law, LAW_SIGNATURE)


@intrinsic
def call_at(typingctx, address, arguments):
    """Call the function at ``address``, which returns nothing, with a tuple of addresses.

    An int may be among them: up to four arguments are each in a register, whatever their width.
    """

    def codegen(context, builder, signature, args):
        pointer = context.get_value_type(types.voidptr)
        given = cgutils.unpack_tuple(builder, args[1])
        fnty = cgutils.ir.FunctionType(context.get_value_type(types.void), [pointer] * len(given))
        fn = builder.inttoptr(args[0], fnty.as_pointer())
        builder.call(fn, [builder.inttoptr(a, pointer) for a in given])
        return context.get_dummy_value()

    return types.void(types.int64, arguments), codegen


@intrinsic
def doubles_at(typingctx, address):
    """Pointer to doubles at an address."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], context.get_value_type(DOUBLES))

    return DOUBLES(types.int64), codegen


@intrinsic
def borrow(typingctx, arrays):
    """Arrays, alone or in a tuple, without their reference counts; their owner must keep them.

    In a loop over samples, counting the references to every row costs as much as the laws.
    """

    def codegen(context, builder, signature, args):
        return _lend(context, builder, signature.return_type, args[0])

    return arrays(arrays), codegen


def _lend(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.BaseTuple):
        items = zip(kind, cgutils.unpack_tuple(builder, value), strict=True)  # pyrefly: ignore[bad-argument-type]
        return context.make_tuple(builder, kind, [_lend(context, builder, *i) for i in items])
    lent = context.make_array(kind)(context, builder, value=value)
    lent.meminfo = cgutils.get_null_value(lent.meminfo.type)
    lent.parent = cgutils.get_null_value(lent.parent.type)
    return lent._getvalue()
