"""The script that compares runs under other circumstances finds files that depend on them, and times do not count."""

import json

import pytest

from benchmarks import same_bytes
from benchmarks.compared_files import differing, files_in
from benchmarks.same_bytes import Variant

# What changes together in one run; without the German locale on the machine, the locale is the one with ASCII.
VARIED = ("2 threads of BLAS", "hash seed 1", "decimal comma", "time zone of St John's")
CODE = "import os; os.mkdir('results'); open('results/page', 'w').write({})"


@pytest.fixture
def other(tmp_path, monkeypatch):
    """Variants whose files are not those of the reference, for a program that writes an expression."""
    (tmp_path / "inputs").mkdir()

    def variants(expression: str) -> set[str]:
        monkeypatch.setattr(same_bytes, "line_of", lambda *_: ["-c", CODE.format(expression)])
        monkeypatch.setattr(same_bytes, "missing", lambda name: "" if name != "two cores" else "one core")
        found = same_bytes.rows([*same_bytes.VARIANTS], ["pipeline"], tmp_path / "inputs", tmp_path / expression[:4])
        return {row["variant"] for row in found if row["why"]}

    return variants


def test_what_depends_on_hashes_time_zone_locale_threads_or_folder_is_found(other):
    assert other("str(hash('a'))") == {"two cores", "hash seed 1", "hash seed random"}
    assert other("__import__('time').ctime(0)") >= {"time zone of Kolkata", "time zone of St John's"}
    assert other("os.environ['LC_ALL']") == {"two cores", "decimal comma"}
    assert other("'OMP:' + os.environ['OMP_NUM_THREADS']") == {"two cores", "2 threads of BLAS", "4 threads of BLAS"}
    assert other("(os.getcwd())") == {"two cores", "another folder"}


@pytest.mark.long
def test_an_undecided_diagnosis_has_the_same_bytes_under_other_circumstances(tmp_path, monkeypatch):
    every = [same_bytes.VARIANTS[name].environment for name in VARIED]
    other = Variant({key: value for one in every for key, value in one.items()}, folder="elsewhere")
    monkeypatch.setattr(same_bytes, "VARIANTS", {same_bytes.REFERENCE: Variant(), "other": other})
    monkeypatch.setattr(same_bytes, "missing", lambda _: "")
    same_bytes.prepare(tmp_path / "inputs")
    found = list(same_bytes.rows(["other"], ["undecided"], tmp_path / "inputs", tmp_path / "out"))
    assert [(row["variant"], row["why"]) for row in found] == [("reference", ""), ("other", "")]


def test_another_verdict_and_a_run_that_fails_are_named(tmp_path, monkeypatch):
    (tmp_path / "inputs").mkdir()
    code = "import os; os.mkdir('results'); open('results/diagnosis.json', 'w').write('{\"verdict\": \"learned\"}')"
    for line, said in ((code, "the verdict is learned"), ("raise SystemExit('no disk')", "the run failed: no disk\n")):
        monkeypatch.setattr(same_bytes, "line_of", lambda *_, line=line: ["-c", line])
        args = (["reference"], ["agrees"], tmp_path / "inputs", tmp_path / said)
        assert [row["why"] for row in same_bytes.rows(*args)] == [said]


def test_times_and_dates_do_not_count_and_all_else_does(tmp_path):
    for run, date in (("a", "2026-01-01T10:00:00+00:00"), ("b", "2026-01-02T11:30:00+00:00")):
        (tmp_path / run / "results/logs").mkdir(parents=True)
        (tmp_path / run / "results/logs/one.log").write_text(date)
        (tmp_path / run / "config").mkdir()
        (tmp_path / run / "config/history.csv").write_text(f"commit,date\nabc,{date}\n")
        (tmp_path / run / "config/baseline.json").write_text(json.dumps({"date": date, "commit": "abc"}))
    one, other = (files_in(tmp_path / run, ["results", "config"]) for run in ("a", "b"))
    assert len(one) == 2 and not differing(one, other)
    assert files_in(tmp_path / "a/results", ["."]) == {}
    (tmp_path / "b/config/history.csv").write_text("commit,date\nabd,2026-01-01T10:00:00+00:00\n")
    assert differing(one, files_in(tmp_path / "b", ["config"])) == ["config/history.csv"]
