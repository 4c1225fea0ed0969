"""Which tests a mutant meets, and which mutants are drawn."""

from pathlib import Path

from cosmic_ray import work_item
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import MutationSpec, WorkerOutcome, WorkItem, WorkResult

from benchmarks.mutants import files_for, report, sample

ROOT = Path(__file__).parents[1]


def item(line, operator, job):
    at = {"start_pos": (line, 0), "end_pos": (line, 5), "definition_name": None, "operator_args": {}}
    spec = MutationSpec(module_path="src/ccmodel/rig/a.py", operator_name=operator, occurrence=0, **at)
    return WorkItem(job_id=job, mutations=(spec,))


def test_the_tests_that_import_a_module_come_first():
    direct, folder = files_for(Path("src/ccmodel/rig/outliers.py"), ROOT)
    assert "tests/rig/test_outliers.py" in direct
    assert folder == ["tests/rig"]


def test_one_mutant_is_drawn_of_a_place_and_none_of_a_union_of_types():
    items = tuple(item(line, f"core/Add_{n}", f"{line}-{n}") for line in range(5) for n in range(9))
    items += (item(7, "core/ReplaceBinaryOperator_BitOr_Add", "union"),)
    drawn = [one.job_id for one in sample(items, 100, seed=1)]
    assert sorted(job.partition("-")[0] for job in drawn) == list("01234")
    assert len(sample(items, 3, seed=1)) == 3
    assert sample(items[::-1], 100, seed=1) == sample(items, 100, seed=1)


def test_a_mutant_that_does_not_compile_does_not_count(tmp_path, capsys):
    outputs = {"died": "E   assert 1 == 2", "no-python": "E   SyntaxError: invalid syntax", "lived": "5 passed"}
    with use_db(tmp_path / "session.sqlite", WorkDB.Mode.create) as session:
        session.add_work_items(item(line, "core/Add", job) for line, job in enumerate(outputs))
        for job, output in outputs.items():
            outcome = work_item.TestOutcome("survived" if job == "lived" else "killed")
            session.set_result(job, WorkResult(WorkerOutcome.NORMAL, output, outcome, f"diff of {job}"))
    report(tmp_path)
    assert "all          1 of 2 died" in capsys.readouterr().out
    assert (tmp_path / "survivors.txt").read_text() == "diff of lived"
