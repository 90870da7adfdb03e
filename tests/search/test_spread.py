"""Calls through any executor: what comes back when it is stopped, and when its workers die."""

import os
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import pytest

from nectosome.search.executors import spread as spreading
from nectosome.search.executors.spread import LostError, check_versions, spread, submit, versions
from nectosome.units import InputError


def doubled(x):
    return 2 * x


def end(code):
    os._exit(code)


def slow(x):
    time.sleep(0.05)
    return x


class Deaf(Executor):
    """A scheduler that is lost: its futures end as cancelled."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.cancel()
        future.set_running_or_notify_cancel()
        return future


def test_every_result_comes_once_with_its_key(monkeypatch):
    monkeypatch.setattr(spreading, "_AHEAD", 3)  # fewer than there are
    with ThreadPoolExecutor(2) as pool:
        found = dict(spread(pool, ((k, doubled, (k,)) for k in range(50)), lambda: True))
    assert found == {k: 2 * k for k in range(50)}


def test_after_a_stop_nothing_new_begins_and_what_is_under_way_comes_in():
    seen = []
    with ThreadPoolExecutor(1) as pool:
        for key, value in spread(pool, ((k, slow, (k,)) for k in range(50)), lambda: not seen):
            seen.append((key, value))
    assert seen[0] == (0, 0)
    assert len(seen) <= 2


def test_the_first_error_ends_it():
    with ThreadPoolExecutor(1) as pool, pytest.raises(ZeroDivisionError):
        list(spread(pool, ((k, divmod, (1, k)) for k in (1, 0, 1)), lambda: True))


def test_a_worker_that_dies_and_a_scheduler_that_is_gone_are_told():
    with ProcessPoolExecutor(1, get_context("spawn")) as pool, pytest.raises(LostError, match="a worker process died"):
        list(spread(pool, ((k, end, (1,)) for k in range(3)), lambda: True))
    with pytest.raises(LostError, match="connection to the scheduler was lost"):
        list(spread(Deaf(), [(0, doubled, (1,))], lambda: True))
    with ThreadPoolExecutor(1) as pool:
        pass
    with pytest.raises(LostError, match="executor ended"):
        submit(pool, doubled, 1)


def test_other_versions_are_refused_with_both():
    ours = versions()
    asked = ours | {"jax": "0.0.1"}
    with pytest.raises(InputError, match=f"has jax {ours['jax']}, and 0.0.1 is where it was asked from"):
        spreading._call(asked, doubled, (1,))
    assert spreading._call(ours, doubled, (1,)) == 2
    with pytest.raises(InputError, match=f"worker tcp://far:1 has jax none, and {ours['jax']} is here"):
        check_versions(ours | {"jax": None}, "tcp://far:1")
