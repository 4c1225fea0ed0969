"""Work side by side: its order, its failures, work within work, and after a fork."""

import threading

import pytest

from ccmodel.inference import pool


@pytest.fixture(params=[1, 3])
def threads(request):
    pool.set_threads(request.param)
    yield request.param
    pool.set_threads(None)


@pytest.mark.parametrize("threads", [3], indirect=True)
def test_items_are_worked_on_at_the_same_time(threads):
    everyone = threading.Barrier(threads, timeout=30)
    assert sorted(pool.each(range(threads), lambda i, _: everyone.wait())) == [0, 1, 2]


def test_results_come_in_the_order_of_the_items(threads):
    assert pool.each("abcde", lambda i, item: (i, item)) == list(enumerate("abcde"))


def test_the_first_items_failure_is_raised_after_all_others_were_worked_on(threads):
    done = []

    def work(i, item):
        done.append(item)
        if item >= 2:
            raise ValueError(f"item {item}")

    with pytest.raises(ValueError, match="item 2"):
        pool.each(range(5), work)
    assert sorted(done) == [0, 1, 2, 3, 4]


def test_work_may_call_for_work_itself(threads):
    """Were the inner work handed to the same threads, all of them would wait for it."""
    found = pool.each(range(7), lambda i, _: sum(pool.each(range(i), lambda k, _: k)))
    assert found == [sum(range(i)) for i in range(7)]


def _squares(items):
    return pool.each(items, lambda i, item: item * item)


@pytest.mark.parametrize("threads", [3], indirect=True)
def test_a_process_that_was_forked_has_threads_of_its_own(threads):
    assert _squares(range(4)) == [0, 1, 4, 9]
    with pool.processes(1) as others:
        assert others.submit(_squares, range(4)).result(timeout=60) == [0, 1, 4, 9]
