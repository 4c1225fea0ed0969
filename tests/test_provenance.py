"""A step reruns if a source file that it uses changes, and only then."""

import os

from ccmodel.provenance import files_in, folder_digest, source_digest, sources_of


def names(module):
    return {file.name for file in sources_of(module)}


def test_a_step_consists_of_what_it_imports():
    simulate = names("ccmodel.steps.simulate")
    steps = {"simulate.py", "files.py", "pair.py", "geometry.py", "reconstruction.py", "recording.py", "batch.py"}
    assert steps <= simulate
    assert not {"figures.py", "errors.py", "signs.py", "page.html.j2"} & simulate


def test_templates_belong_to_the_step_that_fills_them():
    assert "page.html.j2" in names("ccmodel.report.page")


def test_ingest_does_not_depend_on_the_model():
    assert "paper.py" not in names("ccmodel.steps.ingest")


def test_a_step_that_uses_a_registry_depends_on_all_its_modules():
    assert {"time_skew.py", "load_cell.py", "kink.py"} <= names("ccmodel.studies.diagnosis.run")
    assert "csv.py" in names("ccmodel.rig.readers")
    assert "csv.py" in names("ccmodel.steps.ingest")


def test_a_kernel_depends_on_the_modules_that_it_imports_only():
    march = {file.name for file in sources_of("ccmodel.model.general.march", discovered=False)}
    assert "presliding.py" in march
    assert not {"time_skew.py", "load_cell.py"} & march


def test_steps_differ_in_their_digests():
    assert source_digest("ccmodel.steps.ingest") != source_digest("ccmodel.steps.simulate")


def test_hidden_files_are_none_of_a_batch(tmp_path):
    (tmp_path / ".ipynb_checkpoints").mkdir()
    for name in (".DS_Store", ".ipynb_checkpoints/a.csv", "a.csv"):
        (tmp_path / name).write_text("x")
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs/b.csv").write_text("x")
    assert [f.name for f in files_in(tmp_path)] == ["a.csv", "b.csv"]


def test_a_folders_digest_is_of_names_and_contents_and_not_of_dates(tmp_path):
    log = tmp_path / "a.csv"
    log.write_text("1")
    first = folder_digest(tmp_path)
    os.utime(log, (0, 0))
    assert folder_digest(tmp_path) == first
    log.write_text("2")
    os.utime(log, (0, 0))
    assert folder_digest(tmp_path) != first
    log.write_text("1")
    log.rename(tmp_path / "b.csv")
    assert folder_digest(tmp_path) != first


def test_files_behind_a_link_are_those_of_the_batch(tmp_path):
    """Logs may lie in a data store; a link back to the batch itself ends."""
    batch, store = tmp_path / "batch", tmp_path / "store"
    batch.mkdir()
    store.mkdir()
    (store / "a.csv").write_text("x")
    (batch / "logs").symlink_to(store)
    (store / "back").symlink_to(batch)
    assert [f.relative_to(batch).as_posix() for f in files_in(batch)] == ["logs/a.csv"]


def test_what_a_module_reads_from_a_table_is_one_of_its_sources():
    assert "units.txt" in {file.name for file in sources_of("ccmodel.steps.ingest")}
