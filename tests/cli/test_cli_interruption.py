"""Ctrl-C and SIGTERM: a line on what is left, no traceback, and nothing that goes on working."""

import signal
import subprocess
import sys

import pytest
from example_folder import noisy_batch

# A command whose work, on threads, does not end by itself within the test; it says when it has begun.
THREADS = """
import time
from ccmodel.inference.pool import each, set_threads
import ccmodel

def work(batch, out, **others):
    set_threads(2)
    {before}
    print("working", flush=True)
    each(range(10_000), lambda i, item: time.sleep(0.05))

ccmodel.diagnose = work
from ccmodel.cli import main
main()
"""
PROCESSES = """
import time
from ccmodel.inference.pool import processes
from ccmodel.studies.table_one import study

def work(*others):
    with processes(2) as pool:
        # Both workers are up when each has taken one of these.
        list(pool.map(time.sleep, [0.5] * 4))
        started = [pool.submit(time.sleep, 1000) for _ in range(8)]
        print("working", flush=True)
        started[0].result()

study.table_one = work
from ccmodel.cli import main
main()
"""


@pytest.fixture
def batch(tmp_path):
    return noisy_batch(tmp_path / "loops", pretensions=(7.0,))


def interrupted(code, how, *words):
    """Exit code, standard output and standard error of a command that gets a signal in the middle of its work."""
    command = [sys.executable, "-c", code, *map(str, words)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=_heed_interruptions
    )
    try:
        assert process.stdout.readline() == "working\n"
        process.send_signal(how)
        # Its pipes close only when its workers have ended as well.
        out, err = process.communicate(timeout=100)
    finally:
        process.kill()
    return process.returncode, out, err


def _heed_interruptions():
    """Tests in the background of a shell inherit that Ctrl-C is ignored, and so would the command."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.parametrize("how, code", [(signal.SIGINT, 130), pytest.param(signal.SIGTERM, 143, marks=pytest.mark.long)])
def test_a_diagnosis_says_that_nothing_was_written(how, code, batch, tmp_path):
    out = tmp_path / "out"
    found = interrupted(THREADS.format(before=""), how, "diagnose", batch, "--out", out)
    assert found == (code, "", f"interrupted: nothing was written to {out}; the same command starts again\n")
    assert not out.exists()


def test_what_was_written_is_named(batch, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "earlier.json").write_text("{}")
    code = THREADS.format(before='time.sleep(0.1); (out / "diagnosis.json").write_text("{}")')
    returned, _, err = interrupted(code, signal.SIGINT, "diagnose", batch, "--out", out)
    assert returned == 130
    assert err.count("\n") == 1
    assert f"written so far: {out / 'diagnosis.json'};" in err


@pytest.mark.long
def test_interruption_as_json(batch, tmp_path):
    found = interrupted(
        THREADS.format(before=""), signal.SIGINT, "diagnose", batch, "--out", tmp_path / "out", "--json"
    )
    assert found[0] == 130
    assert found[1].startswith('{\n "error": [\n  "interrupted: nothing was written')
    assert found[2] == ""


def test_processes_end_with_the_command(tmp_path):
    (tmp_path / "settings.yaml").touch()
    words = "table-one", tmp_path / "settings.yaml", "--out", tmp_path / "out", "--figure", tmp_path / "figure.png"
    code, _, err = interrupted(PROCESSES, signal.SIGINT, *words)
    assert code == 130
    assert err.count("\n") == 1
    assert "Traceback" not in err
