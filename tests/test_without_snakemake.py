"""The library and its command line work where Snakemake is not installed."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from builders import write_batch

BLOCKED = """
import sys

class NoSnakemake:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0].startswith("snakemake"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, NoSnakemake())
"""
MODULES = """
import importlib, pkgutil
import ccmodel
names = [m.name for m in pkgutil.walk_packages(ccmodel.__path__, "ccmodel.") if not m.name.endswith("__main__")]
for name in names:
    importlib.import_module(name)
print(len(names))
"""
COMMAND = """
from ccmodel.cli import main
main()
"""


def without_snakemake(code: str, *arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-c", BLOCKED + code, *arguments], capture_output=True, text=True, check=False
    )


def test_the_block_holds():
    assert "No module named 'snakemake'" in without_snakemake("import snakemake").stderr
    assert without_snakemake("import snakemake_executor_plugin_slurm").returncode == 1


def test_every_module_of_the_library_is_imported_without_snakemake():
    done = without_snakemake(MODULES)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 100


@pytest.mark.long
def test_a_batch_is_checked_and_diagnosed_without_snakemake(tmp_path: Path):
    write_batch(tmp_path / "tiny")
    checked = without_snakemake(COMMAND, "check", str(tmp_path / "tiny"))
    assert checked.returncode == 0, checked.stdout + checked.stderr
    out = tmp_path / "out"
    diagnosed = without_snakemake(COMMAND, "diagnose", str(tmp_path / "tiny"), "--out", str(out))
    assert diagnosed.returncode == 0, diagnosed.stdout + diagnosed.stderr
    assert json.loads((out / "diagnosis.json").read_text())["verdict"] == "agrees"
