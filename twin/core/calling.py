"""Laws as native functions, and how compiled code calls one by its address."""

from __future__ import annotations

from functools import cache
from typing import Any

import numba
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from twin.core.compiled import callback
from twin.effect import Effect, Law
from twin.errors import InputError

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
def call_law(typingctx, address, p, s, io):
    """Call the law at ``address`` with three addresses of doubles."""

    def codegen(context, builder, signature, args):
        double_p = context.get_value_type(types.float64).as_pointer()
        void = context.get_value_type(types.void)
        fnty = cgutils.ir.FunctionType(void, [double_p] * 3)
        fn = builder.inttoptr(args[0], fnty.as_pointer())
        builder.call(fn, [builder.inttoptr(a, double_p) for a in args[1:]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64, types.int64), codegen


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
        items = zip(kind, cgutils.unpack_tuple(builder, value), strict=True)
        return context.make_tuple(builder, kind, [_lend(context, builder, *i) for i in items])
    lent = context.make_array(kind)(context, builder, value=value)
    lent.meminfo = cgutils.get_null_value(lent.meminfo.type)
    lent.parent = cgutils.get_null_value(lent.parent.type)
    return lent._getvalue()
