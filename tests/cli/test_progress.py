"""Progress: shares of the work, the time that is left, and where it is shown."""

import io

import pytest
from example_folder import noisy_batch
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from ccmodel.progress import Stopwatch, clock, each_of, log_lines, shown, within
from ccmodel.rig.ingest import ingest_batch


class Clock:
    """A clock that is set by hand."""

    def __init__(self):
        self.time = 100.0

    def __call__(self):
        return self.time


def test_the_rest_is_taken_to_be_as_fast_as_the_work_so_far():
    now = Clock()
    watch = Stopwatch(now)
    assert watch.remaining_s is None
    now.time += 30
    watch.stage(0.25)
    assert watch.remaining_s == pytest.approx(90)
    now.time += 20
    assert watch.elapsed_s == pytest.approx(50)
    assert watch.remaining_s == pytest.approx(70), "it counts down between two stages"
    now.time += 80
    assert watch.remaining_s is None, "a stage has outlasted the estimate"
    watch.stage(1.0)
    assert watch.remaining_s == 0


@given(st.lists(st.none() | st.floats(0, 3)))
def test_the_share_never_falls_and_never_exceeds_one(shares):
    watch, seen = Stopwatch(Clock()), []
    for share in shares:
        watch.stage(share)
        seen.append(watch.done)
    assert seen == sorted(seen)
    assert all(0 <= done <= 1 for done in seen)


def test_lines_of_a_log():
    now, log = Clock(), io.StringIO()
    progress = log_lines(log, now)
    progress("started", 0.0)
    now.time += 65
    progress("half", 0.5)
    now.time += 5
    progress("no share")
    assert log.getvalue().splitlines() == [
        "0:00, -:-- left: started",
        "1:05, 1:05 left: half",
        "1:10, 1:00 left: no share",
    ]
    assert clock(3725) == "1:02:05"


def test_items_and_parts_have_their_shares():
    seen = []
    progress = within(lambda text, done: seen.append((text, done)), 0.5, 1.0)
    assert list(each_of(["a", "b"], progress, lambda one: f"item {one}")) == ["a", "b"]
    assert seen == [("item a", 0.5), ("item b", 0.75)]


def test_a_terminal_shows_a_bar_and_a_pipe_nothing():
    for is_terminal in (True, False):
        stream = io.StringIO()
        with shown(Console(file=stream, force_terminal=is_terminal, width=100)) as progress:
            progress("screening 32 mechanisms", 0.4)
        assert ("screening 32 mechanisms" in stream.getvalue()) == is_terminal
        assert ("40 %" in stream.getvalue()) == is_terminal
        assert ("left" in stream.getvalue()) == is_terminal


def test_a_diagnosis_reports_shares_that_only_grow(tmp_path):
    import ccmodel

    seen = []
    folder = noisy_batch(tmp_path / "loops", pretensions=(7.0, 5.0))
    # One candidate is fitted whatever the screening says, so that the stage of the fits is reached.
    ccmodel.diagnose(
        folder,
        tmp_path / "out",
        candidates="pulley-friction at drive-pulley",
        progress=lambda text, done=None: seen.append((text, done)),
    )
    shares = [done for _, done in seen if done is not None]
    assert shares == sorted(shares)
    assert shares[0] == 0.0 and shares[-1] <= 1.0
    assert any("fitting pulley-friction" in text for text, _ in seen)
    assert {text.split()[0] for text, _ in seen} >= {"reading", "calibrating", "writing"}


def test_reading_reports_each_log(tmp_path):
    seen = []
    ingest_batch(noisy_batch(tmp_path / "loops"), lambda text, done=None: seen.append(text))
    assert [text.split()[0] for text in seen] == ["reading"] * 3 + ["checking"] * 3 + ["comparing"]
