"""A step of the pipeline that fails while it writes leaves the file that was there, and nothing beside it."""

import os
import resource

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from builders import recording
from ccmodel.errors import COLUMNS
from ccmodel.figures import save_figure
from ccmodel.recording import write_recordings
from ccmodel.report import tables
from ccmodel.report.page import writing

# Bytes that a file may have while the disk is "full".
ROOM = 2000


def figure():
    drawn = Figure()
    drawn.add_subplot().plot(np.random.default_rng(0).standard_normal(500))
    return drawn


def write_parquet(file, monkeypatch):
    random = np.random.default_rng(0)
    monkeypatch.setattr(tables, "write_table", lambda *_: None)
    monkeypatch.setattr(tables, "read_pairs", lambda *_: [])
    monkeypatch.setattr(tables, "error_table", lambda *_: pd.DataFrame({"rmse": random.standard_normal(1000)}))
    monkeypatch.setattr(tables.provenance, "of_inputs", lambda _: {})
    tables.tabulate_errors([("estimated", file, file)], file.with_suffix(".csv"), file)


def write_page(file, monkeypatch):
    monkeypatch.setattr(writing, "with_figures", lambda *_: "x" * 2 * ROOM)
    writing.write_page(file, writing.Content([], pd.DataFrame(columns=list(COLUMNS))))


WRITERS = {
    "recordings.nc": lambda file, _: write_recordings(file, [recording(theta_out_rad=np.cos)], {}),
    "figure.png": lambda file, _: save_figure(figure(), file),
    "figure.svg": lambda file, _: save_figure(figure(), file),
    "errors.parquet": write_parquet,
    "index.html": write_page,
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_that_cannot_be_completed_leaves_the_earlier_one(name, tmp_path, monkeypatch):
    file = tmp_path / name
    WRITERS[name](file, monkeypatch)
    whole = file.read_bytes()
    assert len(whole) > ROOM
    child = os.fork()
    if not child:
        resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, ROOM))
        try:
            WRITERS[name](file, monkeypatch)
        except BaseException:
            os._exit(3)
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 3
    assert file.read_bytes() == whole
    assert [one.name for one in tmp_path.iterdir()] == [name]
