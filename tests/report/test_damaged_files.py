"""Files of the program that were damaged or edited by hand: the command that reads them answers, or says what is wrong.

No command ends in a traceback, and each problem is one line that names a file.
"""

import contextlib
import copy
import io
import json
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_pages import BACKLASH, diagnosis

from builders import write_batch
from ccmodel import cli
from ccmodel.accuracy.history import rows_of
from ccmodel.accuracy.measure import BatchAccuracy
from ccmodel.config import expand_studies, load_config
from ccmodel.model.files import model_as_dict
from ccmodel.model.general.run import Active
from ccmodel.model.parameters import Parameters
from ccmodel.studies.table_one.settings import TableOne
from ccmodel.typed import InputError, load_yaml_model
from fuzzing import examples

ROOT = Path(__file__).parents[2]
ODD = [None, 3, -1e400, "", [], {}, "x", True, [[]], {"a": 1}, "\ud800", 10**400]
odd = st.sampled_from(ODD).map(copy.deepcopy)
BASELINE = json.loads((ROOT / "config/accuracy-baseline.json").read_text())
NAME = min(BASELINE["batches"])
LONGEST_S = 10


def places(data, above=()):
    """Paths of all values."""
    yield above
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield from places(value, (*above, key))


@st.composite
def damaged(draw, good):
    """JSON, or other text, with a byte that is another, or cut; of JSON, up to two values may be odd or missing."""
    data = copy.deepcopy(good)
    for _ in range(0 if isinstance(good, str) else draw(st.integers(0, 2))):
        *above, key = draw(st.sampled_from([place for place in places(data) if place] or [("",)]))
        inner = data
        for one in above:
            inner = inner[one]
        if inner in ([], {}) or not isinstance(inner, dict | list):
            data = draw(odd)
        elif draw(st.booleans()):
            del inner[key]
        else:
            inner[key] = draw(odd)
    content = bytearray((good if isinstance(good, str) else json.dumps(data)).encode())
    if draw(st.integers(0, 4)) == 0:
        content[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    if draw(st.integers(0, 9)) == 0:
        del content[draw(st.integers(0, len(content))) :]
    return bytes(content)


def command(*words):
    """A command as a shell runs it: what reads a file, given its folder."""

    def run(folder):
        names = [file.name for file in folder.iterdir()]
        arguments = [word.format(folder=folder) for word in words]
        out, err = io.StringIO(), io.StringIO()
        before = sys.argv
        sys.argv = ["ccmodel", *arguments]
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as ended:
                cli.main()
        finally:
            sys.argv = before
        assert ended.value.code in (0, 1, 2), err.getvalue()
        assert "Traceback" not in err.getvalue()
        if ended.value.code == 2:
            lines = json.loads(out.getvalue())["error"] if "--json" in words else err.getvalue().splitlines()
            assert lines
            assert all(any(name in line for name in (folder.name, *names)) for line in lines), lines
        return ended.value.code

    return run


def reading(read):
    """A function that reads a file, which no command does without Snakemake or minutes of work."""

    def run(folder):
        try:
            read(folder)
        except InputError as error:
            assert folder.name in str(error)
            return 2
        return 0

    return run


def model():
    gap = Active("backlash", "load-pulley", {"half_gap": 0.02})
    return model_as_dict(Parameters(9000.0, 1.2, 0.15, 0.006, 0.006, 0.05, mechanisms=(gap,)), {})


def of_batch():
    return BatchAccuracy.model_validate_json(json.dumps(BASELINE["batches"][NAME]))


def measured(folder):
    stated = {"coverage": 0.95, "reproducibility": 0.01, "history": "history.csv"}
    return {
        "settings": stated | {"file": str(folder / "baseline.json")},
        "measured": {NAME: of_batch().model_dump(mode="json")},
    }


def history():
    return rows_of({NAME: of_batch()}, "abc1234", "2026-01-01T00:00:00+00:00", "1").to_csv(index=False)


def yaml_of(name):
    return yaml.safe_load((ROOT / name).read_text())


def configured(folder):
    expand_studies(load_config(folder / "config.yaml"), sorted(p.name for p in (ROOT / "data/raw").iterdir()))


# Damaged file, its content while it is good, and what reads it.
MODEL = ("--model", "{folder}/model.json", "--out", "{folder}/out", "--quiet")
CASES = {
    "verdict": ("diagnosis.json", diagnosis("b", "explained", mechanisms=[BACKLASH]), command("report", "{folder}")),
    "verdict as JSON": ("diagnosis.json", diagnosis("b", "agrees"), command("report", "{folder}", "--json")),
    "left out": (
        "left-out.json",
        {"left_out": ["a: is empty"], "inconsistent": ["b: c"], "warnings": ["d"]},
        command("report", "{folder}"),
    ),
    "measured": ("tables/baseline.json", measured, command("accuracy", "check", "{folder}")),
    "baseline": ("baseline.json", BASELINE, command("accuracy", "check", "{folder}")),
    "history": ("history.csv", history(), command("accuracy", "history", "--history", "{folder}/history.csv")),
    "model of predict": ("model.json", model(), command("predict", "{folder}/tiny", *MODEL)),
    "model of estimate": ("model.json", model(), command("estimate", "{folder}/tiny", *MODEL)),
    "model of simulate": (
        "model.json",
        model(),
        command("simulate", "{folder}/motion.csv", *MODEL[:3], "{folder}/out.csv", "--batch", "{folder}/tiny"),
    ),
    "map": (
        "map.yaml",
        yaml_of("docs/tutorial/map.yaml"),
        command("import", "{folder}/run1.csv", "--map", "{folder}/map.yaml", "--out", "{folder}/made", "--quiet"),
    ),
    "configuration": ("config.yaml", yaml_of("config/config.yaml"), reading(configured)),
    "table one": (
        "table-one.yaml",
        yaml_of("config/table-one.yaml"),
        reading(lambda folder: load_yaml_model(folder / "table-one.yaml", TableOne)),
    ),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """All other files that the commands read."""
    folder = tmp_path_factory.mktemp("damaged")
    (folder / "tables").mkdir()
    (folder / "tables/baseline.json").write_text(json.dumps(measured(folder)))
    (folder / "baseline.json").write_text(json.dumps(BASELINE))
    time_s = np.arange(0, 1, 0.01)
    pd.DataFrame({"time_s": time_s, "theta_in_rad": 0.3 * np.sin(6 * time_s)}).to_csv(folder / "motion.csv")
    rows = (ROOT / "docs/tutorial/logs/run1.csv").read_text().splitlines(keepends=True)
    (folder / "run1.csv").write_text("".join(rows[:500]))
    write_batch(folder / "tiny", pretensions=(3.5,))
    return folder


# A process of its own reads a log, which takes a second.
@pytest.mark.parametrize("case", CASES)
@settings(max_examples=examples(12), suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(data=st.data())
def test_a_damaged_file_is_a_line(case, folder, data):
    name, good, read = CASES[case]
    good = good(folder) if callable(good) else good
    file = folder / name
    file.write_text(good if isinstance(good, str) else json.dumps(good))
    try:
        assert read(folder) in (0, 1)
        file.write_bytes(data.draw(damaged(good)))
        started = time.process_time()
        read(folder)
        assert time.process_time() - started < LONGEST_S
    finally:
        file.write_text(good if isinstance(good, str) else json.dumps(good))
