"""The frame of a pipeline job: its threads, and its log when it fails."""

import pytest

from ccmodel.inference import pool
from ccmodel.jobs import logged


@pytest.fixture(autouse=True)
def restored(monkeypatch):
    monkeypatch.setattr(pool, "_threads", None)


def test_a_job_has_the_threads_of_its_rule(tmp_path):
    with logged(tmp_path / "log", threads=3):
        assert pool.threads() == 3


def test_a_failure_ends_the_job_and_is_in_its_log(tmp_path):
    with pytest.raises(SystemExit), logged(tmp_path / "log"):
        raise ValueError("a reason")
    assert "ValueError: a reason" in (tmp_path / "log").read_text()
