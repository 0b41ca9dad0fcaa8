"""C of this package, compiled as strictly as it promises, and called from the tests."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from twin.signals import Array

COMPILERS = tuple(filter(None, map(shutil.which, ("gcc", "clang"))))
STRICT = ("-Wall", "-Wextra", "-Werror", "-std=c99")
UNDEFINED = "-fsanitize=undefined"  # says on standard error what is undefined, as it happens
needs_compiler = pytest.mark.skipif(not COMPILERS, reason="neither gcc nor clang is installed")
DOUBLES = ctypes.POINTER(ctypes.c_double)


def library(folder: Path, files: Mapping[str, str | bytes], *options: str) -> ctypes.CDLL:
    """The files as one shared library, without a warning of any compiler."""
    for name, content in files.items():
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    sources = [name for name in files if name.endswith(".c")]
    first, *others = COMPILERS
    commands = [
        [first, *STRICT, *options, "-shared", "-fPIC", *sources, "-o", "made.so", "-lm"],
        *([other, *STRICT, "-fsyntax-only", *sources] for other in others),
    ]
    for command in commands:
        subprocess.run(command, cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "made.so"))


def given(*arrays: Array) -> list:
    """Arrays of doubles as C takes them."""
    for array in arrays:
        assert array.dtype == np.float64
        assert array.flags.c_contiguous
    return [array.ctypes.data_as(DOUBLES) for array in arrays]
