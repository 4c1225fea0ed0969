"""Two runs at once, and a run after a kill: the second says which process goes on, and no lock outlives its process."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

RUN = Path(__file__).parents[2] / "workflow/run.py"
# A run into results/NAME that waits for a file.
SNAKEFILE = """
rule all:
    input: f"{config['results']}/index.html"

rule page:
    output: "{results}/index.html"
    shell: "touch {wildcards.results}-began; while [ ! -e go ]; do sleep 0.1; done; touch {output}"
"""


@pytest.fixture
def start(tmp_path):
    """Start a run into a folder of results, in a process group of its own."""
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    started = []

    def run(results: str) -> subprocess.Popen:
        snakemake = [sys.executable, "-m", "snakemake", "--cores", "1", "--rerun-incomplete"]
        command = [sys.executable, str(RUN), results, *snakemake, "--config", f"results={results}"]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        started.append(subprocess.Popen(command, cwd=tmp_path, start_new_session=True, **pipes))
        return started[-1]

    yield run
    for process in started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)


def until_it_works(folder: Path, results: str) -> None:
    for _ in range(600):
        if (folder / f"{results}-began").exists():
            return
        time.sleep(0.1)
    raise AssertionError("the run did not begin")


def ended(process: subprocess.Popen) -> tuple[int, str]:
    said, _ = process.communicate(timeout=100)
    return process.returncode, said


def test_a_command_that_is_killed_alone_leaves_no_lock(tmp_path):
    (tmp_path / ".snakemake/locks").mkdir(parents=True)
    (tmp_path / "killed.py").write_text("import os; os.kill(os.getpid(), 9)")
    (tmp_path / "lock.py").write_text("import os; print(os.path.exists('.snakemake/locks/0'))")
    run = [sys.executable, str(RUN), "results", sys.executable]
    (tmp_path / ".snakemake/locks/0").touch()
    assert subprocess.run([*run, "lock.py"], cwd=tmp_path, capture_output=True, text=True).stdout == "True\n"
    assert subprocess.run([*run, "killed.py"], cwd=tmp_path).returncode != 0
    assert subprocess.run([*run, "lock.py"], cwd=tmp_path, capture_output=True, text=True).stdout == "False\n"


def test_a_second_run_says_which_process_goes_on_and_other_results_do_not_wait(start, tmp_path):
    first = start("one")
    until_it_works(tmp_path, "one")
    code, said = ended(start("one"))
    assert code == 1
    assert "has been working on these results since" in said
    holder = int(said.partition("process ")[2].partition(" ")[0])
    assert os.getpgid(holder) == first.pid and holder != first.pid
    other = start("two")
    until_it_works(tmp_path, "two")
    (tmp_path / "go").touch()
    for process in (other, first):
        code, said = ended(process)
        assert code == 0, said
    assert (tmp_path / "one/index.html").exists() and (tmp_path / "two/index.html").exists()


def test_a_run_after_a_kill_needs_no_unlocking(start, tmp_path):
    killed = start("one")
    until_it_works(tmp_path, "one")
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    assert list((tmp_path / ".snakemake/locks").iterdir()), "Snakemake's own lock stayed"
    (tmp_path / "go").touch()
    code, said = ended(start("one"))
    for _ in range(20):
        # The kernel ends the group's other processes, and their lock, a moment after its leader.
        if "has been working on these results since" not in said:
            break
        time.sleep(0.5)
        code, said = ended(start("one"))
    assert code == 0, said
    assert (tmp_path / "one/index.html").exists()


def test_a_lock_that_no_run_of_ours_has_left_is_kept(start, tmp_path):
    """Somebody may have started Snakemake itself."""
    locks = tmp_path / ".snakemake/locks"
    locks.mkdir(parents=True)
    (locks / "0.output.lock").write_text("one/index.html\n")
    (tmp_path / "go").touch()
    code, said = ended(start("one"))
    assert code == 1
    assert "--unlock" in said


def test_only_snakemake_was_left_alone_and_it_still_holds_the_results(start, tmp_path):
    first = start("one")
    until_it_works(tmp_path, "one")
    os.kill(first.pid, signal.SIGKILL)
    first.wait()
    code, said = ended(start("one"))
    assert code == 1 and "has been working on these results" in said
    os.killpg(first.pid, signal.SIGKILL)
