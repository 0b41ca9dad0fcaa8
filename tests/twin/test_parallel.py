"""Jobs that threads share, work in a process of its own, and memory that no thread keeps."""

import ctypes
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from twin.errors import InputError
from twin.isolated import NoAnswer, isolated
from twin.parallel import cores, parallel, spread


def test_results_come_in_the_order_of_the_items_whichever_ends_first():
    def job(k):
        time.sleep(0.02 * (3 - k))
        return k * k

    with parallel(4):
        assert spread(job, range(4)) == [0, 1, 4, 9]
    assert spread(job, iter(range(4))) == [0, 1, 4, 9]
    assert spread(job, ()) == []


def test_jobs_go_side_by_side_within_parallel_and_one_after_another_outside():
    meeting = threading.Barrier(2)

    def meet(_):
        meeting.wait(timeout=10.0)

    with parallel(2):
        spread(meet, range(2))  # each waits for the other
    here = threading.get_ident()
    assert spread(lambda _: threading.get_ident(), range(3)) == [here] * 3


def test_the_outermost_decides_how_many_threads_there_are():
    def running(_):
        time.sleep(0.01)
        return threading.get_ident()

    with parallel(1), parallel(3):
        assert len({*spread(running, range(6))}) == 1


def test_no_job_is_begun_after_one_failed_while_an_earlier_goes_on():
    begun, failed = [], threading.Event()

    def job(k):
        begun.append(k)
        if k == 0:
            assert failed.wait(timeout=10.0)
            time.sleep(0.3)  # in which some hundred others would be begun
        if k == 1:
            failed.set()
            raise KeyError("the second")
        time.sleep(0.001)

    with parallel(2), pytest.raises(KeyError, match="the second"):
        spread(job, range(1000))
    assert len(begun) < 40
    with parallel(2):  # and a later call is not held up
        assert spread(abs, [-1, 2]) == [1, 2]


def test_of_jobs_that_fail_the_first_of_the_items_is_told():
    failed = threading.Event()

    def job(k):
        if k == 0:
            assert failed.wait(timeout=10.0)
            time.sleep(0.02)
            raise KeyError("the first")
        failed.set()
        raise KeyError("a later one")

    with parallel(2), pytest.raises(KeyError, match="the first"):
        spread(job, range(50))


def test_how_many_jobs_have_ended_is_told_one_at_a_time_and_counts_up():
    within, told = [], []

    def tell(*at):
        within.append(at)
        time.sleep(0.002)
        told.append((at, len(within)))
        within.pop()

    expected = [((k, 12), 1) for k in range(13)]
    with parallel(4):
        spread(lambda k: time.sleep(0.001 * (12 - k)), range(12), tell)
    assert told == expected
    told.clear()
    spread(abs, range(12), tell)
    assert told == expected


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no affinity on this system")
def test_as_many_cores_as_the_process_may_use():
    allowed = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert cores() == 1
    finally:
        os.sched_setaffinity(0, allowed)
    assert cores() == len(allowed)


# Work in an isolated process gives its answer, its refusal, or why there is none


def doubled(value):
    return 2 * value


def refused(value):
    raise InputError(f"{value} is refused")


def endless():
    while True:
        pass


def exits(code):
    os._exit(code)


def leaves():
    raise SystemExit(3)


def fails():
    raise KeyError("damaged\n  table")


def talks(value):
    os.write(1, b"loading\n")
    os.write(2, b"a warning\n")
    return value


def not_sent():
    return lambda: None


def hungry(size):
    return len(bytearray(size))


def test_isolated_work_gives_its_answer_its_refusal_or_none():
    assert isolated(doubled, 21, seconds=20.0) == 42
    with pytest.raises(InputError, match="7 is refused") as told:
        isolated(refused, 7, seconds=20.0)
    assert not isinstance(told.value, NoAnswer)
    with pytest.raises(NoAnswer, match=r"does not come to an end within 0.2 s"):
        isolated(endless, seconds=0.2)
    with pytest.raises(NoAnswer, match="ended the program"):
        isolated(exits, 0, seconds=20.0)
    assert isolated(hungry, 10**6, seconds=20.0, memory=10**8) == 10**6
    with pytest.raises(InputError, match="takes more memory"):
        isolated(hungry, 3 * 10**8, seconds=20.0, memory=10**8)


def test_what_isolated_work_prints_is_nobodys_concern(capfd):
    assert isolated(talks, 3, seconds=20.0) == 3
    assert capfd.readouterr() == ("", "")


def test_an_error_in_isolated_work_is_told_and_an_exit_as_an_exit():
    with pytest.raises(NoAnswer, match=r"^failed while it was loaded \(KeyError: .damaged.* table"):
        isolated(fails, seconds=20.0)
    with pytest.raises(NoAnswer, match=r"failed while it was loaded .*pickle"):
        isolated(not_sent, seconds=20.0)
    with pytest.raises(NoAnswer, match="ended the program while it was loaded; remove the exit"):
        isolated(leaves, seconds=20.0)


# Memory that was freed is everybody's: no thread keeps its own


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
