"""Each how-to guide is followed to the letter, in a fresh copy of what it needs."""

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pytest
from following import ROOT, Guide, first_missing

from ccmodel.rig.importing import import_files

pytestmark = pytest.mark.long

TUTORIAL = ROOT / "docs/tutorial"
# Of one bend and motion, with two pretensions: enough for a diagnosis.
RUNS = ("logs/run1", "logs/run3")
LATER = ("later/run5", "later/run6")
PAGES = sorted((ROOT / "docs/how-to").glob("*.md"))
PIPELINE = ("Snakefile", "workflow", "profiles", "config", "docs/tutorial")


def copy_of(names, folder: Path) -> Path:
    """Copies of files and folders of the repository."""
    for name in names:
        source, copy = ROOT / name, folder / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(source, copy, ignore=ignored) if source.is_dir() else shutil.copy2(source, copy)
    return folder


def import_batch(runs: Sequence[str], batch_file: str, out: Path) -> Path:
    """A batch of some of the tutorial's logs, under the name of the folder `out`."""
    import_files([TUTORIAL / f"{run}.csv" for run in runs], TUTORIAL / "map.yaml", out)
    text = re.sub("^batch: .*", f"batch: {out.name}", (TUTORIAL / batch_file).read_text("utf-8"), flags=re.MULTILINE)
    (out / "batch.yaml").write_text(only(runs, text))
    return out


def only(runs: Sequence[str], batch_yaml: str) -> str:
    """The text of a `batch.yaml` without recordings other than these."""
    kept = {Path(run).name for run in runs}
    entries = re.compile(r"^- \{id: (\w+),.*\n", re.MULTILINE)
    return entries.sub(lambda entry: entry[0] if entry[1] in kept else "", batch_yaml)


def followed(page: str, folder: Path, **options) -> Guide:
    guide = Guide(ROOT / f"docs/how-to/{page}.md", folder, **options)
    guide.follow()
    return guide


def test_import_logs(tmp_path):
    shutil.copytree(TUTORIAL / "logs", tmp_path / "measurements")
    copy_of(["docs/tutorial"], tmp_path)
    assert len(followed("import-logs", tmp_path).skipped) == 2


def test_add_a_batch(tmp_path):
    copy_of(PIPELINE, tmp_path)
    copied = tmp_path / "docs/tutorial/batch.yaml"
    copied.write_text(only(RUNS, copied.read_text("utf-8")))
    batch = import_batch(RUNS, "batch.yaml", tmp_path / "data/raw/my-batch")
    for other in ("batch.yaml", "map.yaml", "import.json"):
        (batch / other).unlink()
    assert len(followed("add-a-batch", tmp_path).skipped) == 2
    assert (tmp_path / "results/mine/index.html").exists()


def test_add_a_study(tmp_path):
    copy_of(PIPELINE, tmp_path)
    import_batch(RUNS, "batch.yaml", tmp_path / "data/mine/my-batch")
    assert followed("add-a-study", tmp_path).skipped == []


def test_add_a_reader(tmp_path):
    copy_of(["src", "pyproject.toml"], tmp_path)
    assert followed("add-a-reader", tmp_path, source=tmp_path / "src").skipped == []


def test_add_a_mechanism(tmp_path):
    copy_of(["src", "pyproject.toml", "docs/mechanisms.md", "docs/mechanisms"], tmp_path)
    guide = followed("add-a-mechanism", tmp_path, source=tmp_path / "src")
    assert len(guide.skipped) == 2
    assert "load cell" in (tmp_path / "docs/mechanisms/load-cell-nonlinearity.md").read_text(encoding="utf-8")


def test_the_lines_of_python_in_the_readme(tmp_path):
    import_batch(RUNS, "batch.yaml", tmp_path / "my-batch")
    guide = Guide(ROOT / "README.md", tmp_path)
    names = guide.follow()
    assert len(guide.skipped) == 3
    assert names["found"].verdict == "explained"
    assert len(names["run"].to_frame()) == len(names["motion"]) > 1000


def test_watch(tmp_path):
    import_batch(RUNS, "batch.yaml", tmp_path / "my-rig/raw/trusted")
    import_batch(LATER, "later.yaml", tmp_path / "my-rig/raw/monday")
    changed = import_batch(LATER, "later.yaml", tmp_path / "my-rig/raw/changed")
    for file in changed.glob("*.csv.gz"):
        log = pd.read_csv(file)
        log.assign(drive_current_A=1.1 * log["drive_current_A"]).to_csv(file, index=False)
    assert len(followed("watch", tmp_path).skipped) == 2


def test_estimate_the_load(tmp_path):
    import_batch(RUNS, "batch.yaml", tmp_path / "my-rig/raw/first")
    import_batch(LATER, "later.yaml", tmp_path / "my-rig/raw/later")
    guide = followed("estimate-the-load", tmp_path)
    assert guide.skipped == []
    estimated = pd.read_csv(tmp_path / "estimated/run5.csv")
    assert set(estimated["load_is_visible"]) == {0, 1}


def test_every_guide_is_followed_here():
    followed_here = set(re.findall(r'followed\("([\w-]+)"', Path(__file__).read_text(encoding="utf-8")))
    # One needs a cluster, the other has no commands.
    assert {page.stem for page in PAGES} - {"cluster", "record"} == followed_here


@pytest.mark.parametrize(
    ("expected", "missing"),
    [
        ("mean 1.02 N\n...\nsecond", None),
        ("mean 1.2 N", "mean 1.2 N"),
        ("mean 1.0 ...", None),
        ("second\nmean 1.0 N of 3", "mean 1.0 N of 3"),
        ("mean 1.0", "mean 1.0"),
    ],
)
def test_output_is_compared_line_by_line(expected, missing):
    assert first_missing(expected, "first\nmean   1.0 N of 3\nmean 1.0 N\nsecond\n") == missing
