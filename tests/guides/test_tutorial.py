"""The tutorial is followed to the letter, in a fresh copy of what it needs."""

import json
import re
import runpy
import shutil
from pathlib import Path

import pandas as pd
import pytest
from following import ROOT, Guide
from ruamel.yaml import YAML

from ccmodel.rig.importing import write_guess

pytestmark = pytest.mark.long

TUTORIAL = ROOT / "docs/tutorial"
PAGE = ROOT / "docs/tutorial.md"
RIG = YAML(typ="safe").load(TUTORIAL / "rig.yaml")["rig"]


def lines_of(file: Path) -> set[str]:
    """Lines of a YAML file without their comments."""
    return {re.sub(r"\s+#.*", "", line).strip() for line in file.read_text(encoding="utf-8").splitlines()}


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tutorial")
    for name in ("Snakefile", "workflow", "profiles", "config", "docs/tutorial"):
        source, copy = ROOT / name, folder / name
        shutil.copytree(source, copy) if source.is_dir() else shutil.copy2(source, copy)
    guide = Guide(PAGE, folder)
    guide.follow()
    return guide


def test_every_block_but_two_was_run_and_printed_what_the_page_shows(followed):
    assert len(followed.skipped) == 2


def test_it_ends_with_a_page_on_both_batches(followed):
    assert (followed.folder / "my-rig/results/index.html").stat().st_size > 100_000
    errors = pd.read_csv(followed.folder / "my-rig/results/tables/errors.csv")
    assert {"first", "later"} <= set(errors["batch"])


def test_the_diagnosis_names_the_seeded_fault_and_its_size(followed):
    found = json.loads((followed.folder / "my-rig/diagnosis/diagnosis.json").read_text())
    (mechanism,) = found["mechanisms"]
    torque = next(p for p in mechanism["parameters"] if p["name"] == "friction_torque")
    assert list(RIG["effects"]) == ["drive_pulley"]
    assert (mechanism["name"], mechanism["place"]) == ("pulley-friction", "drive-pulley")
    # The page says that the truth lies on the edge of the 90 % interval.
    assert torque["low"] < torque["value"] < torque["high"]
    assert torque["value"] == pytest.approx(RIG["effects"]["drive_pulley"]["friction"]["torque_Nm"], rel=5e-3)


def test_the_corrected_map_differs_from_the_guess_in_the_two_lines_that_the_page_shows(tmp_path):
    write_guess(sorted((TUTORIAL / "logs").glob("*.csv")), tmp_path / "first")
    corrected = lines_of(TUTORIAL / "map.yaml") - lines_of(tmp_path / "first/map.yaml")
    shown = {"tau_out_Nm: {signal: Joint torque, unit: mNm}", "F_load_N: {signal: Joint cable force, unit: N}"}
    assert corrected == shown


def test_lines_of_batch_yaml_on_the_page_are_those_of_the_file():
    fragments = [block for block in re.findall(r"```yaml\n(.*?)```", PAGE.read_text(), re.DOTALL) if "pulley" in block]
    (fragment,) = fragments
    shown = {re.sub(r"\s+#.*", "", line).strip() for line in fragment.splitlines()}
    assert shown <= lines_of(TUTORIAL / "batch.yaml")


def test_both_batches_are_of_one_rig_and_state_that_they_are_simulated():
    first, later = (YAML(typ="safe").load(TUTORIAL / name) for name in ("batch.yaml", "later.yaml"))
    assert first["rig"] == later["rig"]
    assert first["origin"] == later["origin"] == "virtual-rig"


def test_the_logs_are_those_that_the_virtual_rig_records(tmp_path):
    """Recorded again, the later batch is the same up to the last digit that a log has."""
    runpy.run_path(str(TUTORIAL / "make_logs.py"))["write_logs"](tmp_path, ["later"])
    for file in sorted((TUTORIAL / "later").glob("*.csv")):
        again, kept = (pd.read_csv(log, sep=";", decimal=",") for log in (tmp_path / "later" / file.name, file))
        pd.testing.assert_frame_equal(again, kept, rtol=0, atol=0.02)
