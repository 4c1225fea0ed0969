"""The workflow is found, deployed and submitted as Snakemake's conventions have it."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from builders import write_batch

ROOT = Path(__file__).parents[2]
SNAKEFILES = [*sorted((ROOT / "workflow/rules").glob("*.smk")), ROOT / "proof/Snakefile"]
# As `snakedeploy` writes it for a person who deploys the workflow from the catalog.
DEPLOYED = f"""
configfile: "config.yaml"

module ccmodel:
    snakefile: "{ROOT / "workflow/Snakefile"}"
    config: config

use rule * from ccmodel
"""


def planned(folder: Path, snakefile: Path) -> dict[str, int]:
    """Number of jobs of each rule that would run."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(snakefile), "--directory", str(folder)]
    command += ["--configfile", str(folder / "config.yaml"), "--workflow-profile", "none", "--cores", "2", "--dry-run"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    table = (run.stdout + run.stderr).partition("Job stats:")[2]
    return {name: int(count) for name, count in re.findall(r"^(\w[\w-]*) +(\d+)$", table, flags=re.MULTILINE)}


@pytest.mark.long
def test_the_workflow_plans_the_same_jobs_wherever_it_is_started_from(tmp_path):
    write_batch(tmp_path / "data/raw/tiny")
    (tmp_path / "config.yaml").write_text(yaml.safe_dump({"diagnose": "each"}))
    (tmp_path / "deployed.smk").write_text(DEPLOYED)
    top = planned(tmp_path, ROOT / "Snakefile")
    assert {"ingest", "diagnose", "simulate", "tabulate_errors", "write_report", "all"} <= top.keys()
    assert planned(tmp_path, ROOT / "workflow/Snakefile") == top
    assert planned(tmp_path, tmp_path / "deployed.smk") == top


def rules() -> list[pytest.param]:
    """Text of every rule that makes something, by its name."""
    found = []
    for file in SNAKEFILES:
        for text in re.split(r"^(?= *rule\b)", file.read_text(), flags=re.MULTILINE)[1:]:
            name = re.match(r" *rule (\w+):", text)
            if "output:" in text:
                found.append(pytest.param(text, id=name[1] if name else "study"))
    return found


@pytest.mark.parametrize("rule", rules())
def test_every_rule_states_what_it_needs(rule):
    assert "threads:" in rule
    assert re.search(r"mem_mb=\d", rule)
    assert re.search(r"runtime=\d", rule)
    assert "log:" in rule and "message:" in rule


def test_the_cluster_profile_groups_rules_that_exist_and_differs_from_the_default_in_how_only():
    default, slurm = (
        yaml.safe_load((ROOT / f"profiles/{name}/profile.yaml").read_text()) for name in ("default", "slurm")
    )
    groups = {name for file in SNAKEFILES for name in re.findall(r'group:\s+"(\w+)"', file.read_text())}
    assert {entry.partition("=")[0] for entry in slurm["group-components"]} <= groups
    # What decides whether a job runs again is the same with and without the cluster.
    for key in ("configfile", "keep-going", "rerun-incomplete", "rerun-triggers"):
        assert slurm[key] == default[key]


def test_the_catalog_finds_what_it_asks_for():
    usage = yaml.safe_load((ROOT / ".snakemake-workflow-catalog.yml").read_text())["usage"]
    assert usage.keys() == {"mandatory-flags", "software-stack-deployment", "report"}
    assert (ROOT / "workflow/Snakefile").exists() and (ROOT / "config/README.md").exists()


@pytest.mark.parametrize("cases", ["1; touch ran", "0", "$(touch ran)"])
def test_the_proofs_number_of_cases_is_no_command(cases, tmp_path):
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "proof/Snakefile"), "--dry-run"]
    command += ["--directory", str(tmp_path), "--workflow-profile", "none", "--cores", "1", "--config"]
    run = subprocess.run([*command, f"cases={cases}"], capture_output=True, text=True, check=False)
    assert run.returncode != 0
    assert "cases: a number of cases is expected" in run.stdout + run.stderr
    assert not list(tmp_path.rglob("ran"))
