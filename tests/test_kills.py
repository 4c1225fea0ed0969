"""The script that kills commands finds what a kill or a full disk does to a command that does not write whole files."""

import numpy as np
import pytest

from benchmarks import kills
from benchmarks.kills import Command, Reference, state_of_each, state_of_folder, state_of_set

TEXT = "x" * 9
WAIT = "import os, time; time.sleep(0.15); "
WHOLE = WAIT + f"f = open('new', 'w'); f.write('{TEXT}' * 20000); f.close(); os.replace('new', 'out')"
IN_PLACE = f"import time; f = open('out', 'w'); time.sleep(0.3); f.write('{TEXT}' * 20000)"
LOCKED = "import time; open('lock', 'x'); time.sleep(0.3); open('out', 'w').write('x')"
GROWING = "import time; open('seen', 'a').write('x'); time.sleep(0.3); open('out', 'w').write(open('seen').read())"
GREEDY = WAIT + "open('input', 'w'); open('out', 'w').write('x'); time.sleep(0.3)"


def prepare(folder, older):
    folder.mkdir(parents=True)
    (folder / "input").write_text("mine")
    if older:
        (folder / "out").write_text("earlier")


@pytest.fixture
def of(tmp_path):
    def reference(code: str) -> Reference:
        command = Command(1, ("-c", code), ("out",), prepare, state_of_each)
        return kills.reference(command, tmp_path / "command")

    return reference


def found(of: Reference) -> list[str]:
    """What a few kills find."""
    return [kills.kill(of, "older", np.random.default_rng(seed))["why"] for seed in range(3)]


def test_a_command_that_writes_whole_files_passes(of):
    assert not any(found(of(WHOLE)))


def test_half_a_file_a_lock_that_stays_another_end_and_a_lost_input_are_found(of, tmp_path):
    assert any("after the kill: out" in why for why in found(of(IN_PLACE)))
    (tmp_path / "command/reference.json").unlink()
    assert any("the next run failed" in why for why in found(of(LOCKED)))
    (tmp_path / "command/reference.json").unlink()
    assert any("the next run differs: out" in why for why in found(of(GROWING)))
    (tmp_path / "command/reference.json").unlink()
    assert all("inputs are lost: input" in why for why in found(of(GREEDY)))


def test_a_full_disk_takes_the_earlier_result_of_a_command_that_writes_in_place(of, tmp_path):
    assert "the earlier result is not there: out" in kills.on_disk(of(IN_PLACE), "full disk")["why"]
    (tmp_path / "command/reference.json").unlink()
    assert "the earlier result" not in kills.on_disk(of(WHOLE), "full disk")["why"]


def test_what_may_be_there_after_a_kill():
    old, new = {"out/diagnosis.json": b"1", "out/a": b"1"}, {"out/diagnosis.json": b"2", "out/a": b"2"}
    aside, complete = "out/.unfinished-files/earlier", "out/.unfinished-files/complete"
    verdict_aside = {"out/a": b"1", f"{aside}/diagnosis.json": b"1"}
    new_to_come = {f"{aside}/a": b"1", f"{aside}/diagnosis.json": b"1", f"{complete}/diagnosis.json": b"2"}
    found = [state_of_set(files, old, new) for files in (old, new, verdict_aside, new_to_come | {"out/a": b"2"})]
    assert found == ["before", "after", "between", "between"]
    assert state_of_set({"out/a": b"1"}, old, new) == "wrong"
    assert state_of_set(verdict_aside | {"out/a": b"2"}, old, new) == "wrong"
    assert state_of_set({"out/a": b"1", "out/diagnosis.json": b"2"}, old, new) == "wrong"
    assert state_of_set({"out/diagnosis.json": b"2"}, old, new) == "wrong"
    old, new = {"raw/first/a": b"1"}, {"raw/first/a": b"2"}
    assert state_of_folder({"raw/.unfinished-first/earlier-first/a": b"1"}, old, new) == "between"
    assert state_of_folder({"raw/.unfinished-first/first/a": b"2"}, old, new) == "wrong"
    mixed = {"raw/first/a": b"3", "raw/.unfinished-first/earlier-first/a": b"1"}
    assert state_of_folder(mixed, old, new) == "wrong"
    assert state_of_folder({"raw/.unfinished-first/first/a": b"2"} | old, old, new) == "before"
    assert state_of_each({"raw/first/a": b""}, old, new) == "wrong"
