"""Files are written whole: whatever ends the writing, what is there belongs together, and the next run completes it."""

import contextlib
import os
import resource
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from ccmodel.outputs import new_file, new_files, new_folder
from ccmodel.typed import InputError

VERDICT = "verdict.json"
NAMES = (VERDICT, "model.json", "page.html")
# What changes the disk, as the audit hook has it.
STEPS = {"open", "os.rename", "os.remove", "os.mkdir", "os.rmdir"}
LONG = "x" * 10_000


def write_files(folder, run):
    with new_files(folder, last=VERDICT, without=["nearest.json"]) as fresh:
        for name in NAMES:
            (fresh / name).write_text(run)


def write_file(path, run):
    with new_file(path) as fresh:
        fresh.write_text(run)


def write_folder(path, run):
    with new_folder(path) as fresh:
        fresh.mkdir()
        for name in NAMES:
            (fresh / name).write_text(run)


def content(folder):
    """All files below a folder, hidden ones included."""
    return {f.relative_to(folder).as_posix(): f.read_text() for f in sorted(folder.rglob("*")) if f.is_file()}


def in_child(work, *args):
    """Whether a process of its own comes to the end of its work."""
    child = os.fork()
    if not child:
        try:
            work(*args)
            os._exit(0)
        finally:
            os._exit(1)
    return os.waitpid(child, 0)[1] == 0


def killed_at(step, work, *args):
    """Do the work, in a process that is gone at its nth step that changes the disk."""
    left = [step]

    def hook(event, _):
        left[0] -= event in STEPS
        if left[0] < 0:
            os._exit(9)

    sys.addaudithook(hook)
    work(*args)


def every_kill(work, place, begin, folder, again=None):
    """What is there after a kill at each step of the work, and then after another run; first step to last.

    The other run is an undisturbed one, unless one is given.
    """
    states, done, step = [], False, 0
    while not done:
        begin()
        done = in_child(killed_at, step, work, place, "new")
        after_kill = content(folder)
        assert in_child(again or work, place, "new")
        states.append((after_kill, content(folder)))
        step += 1
    assert step > 4
    return states


def visible(files):
    return {name: text for name, text in files.items() if not name.startswith(".unfinished")}


def begin_with(folder):
    """A folder with the files of an earlier run, one of which the new one does not write, and another's file."""
    write_files(folder, "old")
    (folder / "nearest.json").write_text("old")
    (folder / "notes.txt").write_text("mine")


def test_files_of_a_killed_command_are_never_from_two_runs(tmp_path):
    states = every_kill(write_files, tmp_path, lambda: begin_with(tmp_path), tmp_path)
    found = [visible(after_kill) for after_kill, _ in states]
    for files in found:
        assert files.pop("notes.txt") == "mine"
        if VERDICT in files:
            of_run = {VERDICT: files[VERDICT]}.popitem()[1]
            assert files == dict.fromkeys((*NAMES, *(["nearest.json"] if of_run == "old" else [])), of_run)
        assert len(set(files.values())) <= 1
    # Kills before, between and after the renamings were tried.
    assert {files.get(VERDICT) for files in found} == {"old", None, "new"}
    assert all(after == dict.fromkeys(NAMES, "new") | {"notes.txt": "mine"} for _, after in states)


def fail(folder, _):
    with pytest.raises(ZeroDivisionError), new_files(folder, last=VERDICT):
        raise ZeroDivisionError


def test_files_of_a_killed_command_are_lost_at_no_step(tmp_path):
    states = every_kill(write_files, tmp_path, lambda: begin_with(tmp_path), tmp_path, again=fail)
    notes = {"notes.txt": "mine"}
    old = dict.fromkeys((*NAMES, "nearest.json"), "old") | notes
    new = dict.fromkeys(NAMES, "new") | notes
    found = [after for _, after in states]
    assert all(after in (old, new) for after in found)
    # A kill before the earlier files were put aside, and one after.
    assert old in found[:-1] and new in found[:-1]


def test_files_that_have_been_replaced_never_come_back(tmp_path):
    """After a kill while the earlier files are removed, in whatever order the disk lists them."""
    write_files(tmp_path, "new")
    work = tmp_path / ".unfinished-files"
    write_files(work / "earlier", "old")
    (work / "complete").mkdir()
    fail(tmp_path, None)
    assert content(tmp_path) == dict.fromkeys(NAMES, "new")


def test_a_second_command_that_writes_into_a_folder_is_refused(tmp_path):
    """Otherwise its files and those of the first would mix."""
    with new_files(tmp_path / "out", last=VERDICT) as fresh:
        (fresh / VERDICT).write_text("first")
        with pytest.raises(InputError, match="out: another command is writing there"):
            write_files(tmp_path / "out", "second")
        assert not in_child(write_files, tmp_path / "out", "second")
        write_files(tmp_path / "other", "second")
    assert content(tmp_path / "out") == {VERDICT: "first"}
    write_files(tmp_path / "out", "third")
    assert content(tmp_path / "out") == dict.fromkeys(NAMES, "third")


def test_many_commands_that_write_into_a_folder_leave_the_files_of_one(tmp_path):
    def repeatedly(run):
        for _ in range(100):
            with contextlib.suppress(InputError):
                write_files(tmp_path, run)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(repeatedly, ["a", "b", "c", "d"]))
    found = content(tmp_path)
    assert found.keys() == set(NAMES) and len(set(found.values())) == 1


def test_a_file_of_a_killed_command_is_the_old_or_the_new_one(tmp_path):
    file = tmp_path / "model.json"
    states = every_kill(write_file, file, lambda: file.write_text("old"), tmp_path)
    assert {visible(after_kill)["model.json"] for after_kill, _ in states} == {"old", "new"}
    assert all(after == {"model.json": "new"} for _, after in states)


def test_a_folder_of_a_killed_command_is_lost_at_no_step(tmp_path):
    folder = tmp_path / "batch"
    states = every_kill(write_folder, folder, lambda: write_folder(folder, "old"), tmp_path)
    for after_kill, after in states:
        seen = {name: text for name, text in after_kill.items() if name.startswith("batch/")}
        kept = {name.rpartition("/")[2]: text for name, text in after_kill.items() if "/earlier-batch/" in name}
        assert set(seen.values()) in ({"old"}, {"new"}, set())
        assert seen or kept == dict.fromkeys(NAMES, "old")
        assert after == {f"batch/{name}": "new" for name in NAMES}


def test_an_earlier_folder_comes_back_if_the_next_run_fails(tmp_path):
    folder = tmp_path / "batch"
    write_folder(tmp_path / ".unfinished-batch" / "earlier-batch", "old")
    with pytest.raises(ZeroDivisionError), new_folder(folder):
        raise ZeroDivisionError
    assert content(tmp_path) == {f"batch/{name}": "old" for name in NAMES}


@pytest.mark.parametrize("work, place", [(write_files, "out"), (write_file, "out/model.json"), (write_folder, "out")])
def test_a_full_disk_leaves_what_was_there(work, place, tmp_path):
    work(tmp_path / place, "old")
    before = content(tmp_path)

    def on_a_full_disk():
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
        with pytest.raises(InputError, match=r"out\S*: cannot be written"):
            work(tmp_path / place, LONG)

    assert in_child(on_a_full_disk)
    assert content(tmp_path) == before


def test_a_link_stays_a_link(tmp_path):
    target, link = tmp_path / "model.json", tmp_path / "latest.json"
    link.symlink_to(target)
    write_file(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_an_error_of_reading_is_not_one_of_writing(tmp_path):
    source = tmp_path / "missing.txt"
    with pytest.raises(InputError, match=r"missing.txt: cannot be used \(No such file"), new_folder(tmp_path / "made"):
        source.read_text()
