"""The hosted CI runs what the Makefile has, and keys its cache by the pinned environment."""

import re
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
WORKFLOW = ROOT / ".github/workflows/ci.yml"


def test_it_runs_tests_and_the_gate_from_targets_of_the_makefile():
    (job,) = yaml.safe_load(WORKFLOW.read_text())["jobs"].values()
    run = [name for step in job["steps"] for name in re.findall(r"make ([\w-]+)", step.get("run", ""))]
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    assert run == ["test", "docs", "long-tests", "results"]
    assert set(run) <= targets


def test_its_cache_is_keyed_by_the_pinned_environment():
    (job,) = yaml.safe_load(WORKFLOW.read_text())["jobs"].values()
    (cache,) = [step["with"] for step in job["steps"] if step.get("uses", "").startswith("actions/cache@")]
    assert "requirements.lock" in cache["key"] and "pip.lock" in cache["key"]
    assert cache["path"] == ".venv"


def test_make_results_ends_with_the_gate():
    text = (ROOT / "Makefile").read_text()
    (results,) = re.findall(r"^results:.*\n((?:\t.*\n)+)", text, flags=re.MULTILINE)
    assert "ccmodel accuracy check results" in results
