"""Jobs that threads share."""

import os
import threading
import time

import pytest

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
