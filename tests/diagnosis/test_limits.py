"""When a diagnosis fits no further candidate: the limits on model runs and on time."""

import time
from functools import partial

import pytest

import ccmodel as cc
from benchmarks.same_bytes import rubbing
from builders import recording, spoil, write_batch
from ccmodel.deadline import UNLIMITED, Deadline, OutOfTimeError
from ccmodel.effort import count_run, model_runs
from ccmodel.inference import pool
from ccmodel.model.run import simulate_recording
from ccmodel.typed import InputError
from made_observations import PARAMETERS


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    return spoil(
        write_batch(tmp_path_factory.mktemp("raw") / "rubbing", pretensions=(7.0, 6.0)),
        partial(rubbing, current_A=0.17),
    )


def test_a_deadline_ends_after_its_runs_or_its_time():
    assert not UNLIMITED.has_passed
    by_runs = Deadline.after(1e6, 1)
    count_run()
    by_runs.check()
    count_run()
    assert by_runs.has_passed and not by_runs.is_late
    with pytest.raises(OutOfTimeError):
        by_runs.check()
    by_time = Deadline(time.monotonic() - 1.0)
    assert by_time.has_passed and by_time.is_late


def test_every_run_of_the_model_is_counted():
    before = model_runs()
    simulate_recording(recording(pretension_N=7.0), PARAMETERS)
    assert model_runs() - before == 1


@pytest.mark.parametrize("threads", [1, 2])
def test_all_work_is_done_also_where_one_part_fails(threads):
    done = []

    def work(i, item):
        if item in (1, 2):
            raise ValueError(f"item {item}")
        done.append(item)
        return item

    pool.set_threads(threads)
    try:
        with pytest.raises(ValueError, match="item 1"):
            pool.each(range(5), work)
        assert sorted(done) == [0, 3, 4]
        assert pool.each([3, 4], work) == [3, 4]
    finally:
        pool.set_threads(None)


def test_the_limit_on_runs_gives_the_same_verdict_on_any_number_of_cores(batch):
    reports = []
    for threads in (1, 2):
        pool.set_threads(threads)
        try:
            reports.append(cc.diagnose(batch, run_limit=300, time_limit_s=1e6).report)
        finally:
            pool.set_threads(None)
    assert reports[0] == reports[1]
    (why,) = (one["why"] for one in reports[0]["not_judged"] if one["what"] == "further candidates")
    assert why == "the limit of 300 model runs was reached before all of them were fitted"


def test_the_limit_of_time_is_named_where_it_comes_first(batch):
    report = cc.diagnose(batch, time_limit_s=0.2).report
    (why,) = (one["why"] for one in report["not_judged"] if one["what"] == "further candidates")
    assert why == "the time limit of 0.2 s was reached before all of them were fitted"


@pytest.mark.parametrize("limits", [{"run_limit": 0}, {"time_limit_s": -1.0}])
def test_a_limit_is_positive(batch, limits):
    with pytest.raises(InputError, match=next(iter(limits))):
        cc.diagnose(batch, **limits)
