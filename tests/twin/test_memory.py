"""Memory that was freed is everybody's: no thread keeps its own."""

import ctypes
import subprocess
import sys
from pathlib import Path

import pytest

THREADS = 4
# Heaps of the C library while threads that have taken and freed memory are still there.
HEAPS = f"""
import ctypes, sys, threading
from twin.threads import share_one_arena

if sys.argv[1] == "shared":
    share_one_arena()
libc = ctypes.CDLL(None)
libc.malloc.restype = libc.fopen.restype = ctypes.c_void_p
ready, asked = threading.Barrier({THREADS + 1}), threading.Event()

def work():
    libc.free(ctypes.c_void_p(libc.malloc(20_000)))
    ready.wait()
    asked.wait()

workers = [threading.Thread(target=work) for _ in range({THREADS})]
for worker in workers:
    worker.start()
ready.wait()
file = ctypes.c_void_p(libc.fopen(sys.argv[2].encode(), b"w"))
libc.malloc_info(0, file)
libc.fclose(file)
asked.set()
"""


def heaps(how: str, folder: Path) -> int:
    """Places that a program of several threads takes its memory from."""
    told = folder / how
    subprocess.run([sys.executable, "-c", HEAPS, how, str(told)], check=True)
    return told.read_text().count("<heap nr=")


@pytest.mark.skipif(
    not hasattr(ctypes.CDLL(None) if sys.platform == "linux" else None, "malloc_info"),
    reason="only glibc tells where its memory is",
)
def test_threads_take_their_memory_from_one_place(tmp_path: Path) -> None:
    assert heaps("shared", tmp_path) == 1
    assert heaps("apart", tmp_path) > 1
