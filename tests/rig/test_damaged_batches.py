"""Batches damaged at random: a check has a result, or findings of one line that name the file."""

import copy
import warnings
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_up_batch import description, table

from ccmodel.rig.ingest import ingest_batch
from ccmodel.rig.overview import overview_of
from fuzzing import examples

LOGS = {name: table(n=300, seed=seed).to_csv(index=False) for seed, name in enumerate(("one", "two"), start=1)}
ODD = [
    None, -1, 0, 1, 1e-300, 1e300, 10**400, float("nan"), float("inf"), "", "x", "1,5", "½", True, [], {}, [1, 2],
    {"a": 1}, "2026-01-01", "../one.csv", "\ud7ff", "e\u0301", "$\\alpha_{$", "<b>",
]  # fmt: skip
odd = st.sampled_from(ODD).map(copy.deepcopy)
NEW = ["settled_s", "note", "far_end", "zero", "excitation", "started_at"]
CELLS = [
    "",
    "nan",
    "inf",
    "-1e308",
    "1e999",
    "0x1F",
    "1,5",
    "abc",
    '"',
    "٣",
    "1e-320",
    " ",
    "--",
    "\t",
    "\x00",
    "9" * 400,
]


def places(data, above=()):
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield (*above, key)
        yield from places(value, (*above, key))


@st.composite
def descriptions(draw):
    """The text of a batch.yaml with up to three values that are odd, missing or another's."""
    data = copy.deepcopy(description())
    for _ in range(draw(st.integers(0, 3))):
        known = list(places(data))
        *above, key = draw(st.sampled_from(known))
        inner = data
        for one in above:
            inner = inner[one]
        how = draw(st.sampled_from(["odd", "missing", "scaled", "new"]))
        if how == "missing":
            del inner[key]
        elif how == "scaled" and isinstance(inner[key], float):
            inner[key] *= draw(st.sampled_from([-1.0, 1e-6, 1e-3, 0.25, 4.0, 57.3, 1e3, 1e6]))
        elif how == "new" and isinstance(inner, dict):
            inner[draw(st.sampled_from(NEW))] = draw(odd)
        else:
            inner[key] = draw(odd)
    return yaml.safe_dump(data, allow_unicode=True).encode("utf-8", "surrogatepass")


@st.composite
def logs(draw, log):
    """A log with up to four cells, lines, columns or bytes that are others, missing or twice."""
    rows = [line.split(",") for line in log.splitlines()]
    for _ in range(draw(st.integers(0, 4))):
        row, column = draw(st.integers(0, len(rows) - 1)), draw(st.integers(0, 6))
        how = draw(st.sampled_from(["cell", "cell", "row twice", "row gone", "rows swapped", "column", "spike"]))
        if how == "cell" and column < len(rows[row]):
            rows[row][column] = draw(st.sampled_from(CELLS))
        elif how == "row twice":
            rows.insert(row, rows[row])
        elif how == "row gone" and len(rows) > 2:
            del rows[row]
        elif how == "rows swapped":
            other = draw(st.integers(0, len(rows) - 1))
            rows[row], rows[other] = rows[other], rows[row]
        elif how == "column":
            value = draw(st.sampled_from(["0", "", "7", "1e6"]))
            rows[1:] = [[*cells[:column], value, *cells[column + 1 :]] for cells in rows[1:]]
        elif how == "spike" and column < len(rows[row]):
            rows[row][column] = draw(st.sampled_from(["1000", "-1000", "30", "1e200"]))
    content = bytearray("".join(f"{','.join(cells)}\n" for cells in rows).encode())
    for _ in range(draw(st.sampled_from([0, 0, 0, 1, 3]))):
        content[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    if draw(st.integers(0, 9)) == 0:
        del content[draw(st.integers(0, len(content))) :]
    return bytes(content)


def checked(folder: Path, description_: bytes, tables: dict[str, bytes]) -> None:
    """What `ccmodel check` does with a batch."""
    (folder / "batch.yaml").write_bytes(description_)
    for name, content in tables.items():
        (folder / f"{name}.csv").write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        found = ingest_batch(folder)
        for recording in found.recordings:
            overview_of(recording)
    for finding in found.findings:
        assert "\n" not in str(finding)
        assert Path(finding.file).parent == folder
        assert "unexpected error" not in finding.text
    used = {recording.id for recording in found.recordings}
    refused = {Path(finding.file).name for finding in found.findings if finding.severity == "refused"}
    if found.batch is not None:
        stated = {entry.id: entry.file for entry in found.batch.recordings}
        assert all(id_ in used or Path(file).name in refused for id_, file in stated.items()), "left out in silence"
    else:
        assert refused


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "bench").mkdir()
    return tmp_path / "bench"


@settings(max_examples=examples(80), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=descriptions())
def test_a_damaged_description(folder, text):
    checked(folder, text, {name: log.encode() for name, log in LOGS.items()})


@settings(max_examples=examples(80), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(one=logs(LOGS["one"]), two=logs(LOGS["two"]))
def test_damaged_logs(folder, one, two):
    checked(folder, yaml.safe_dump(description()).encode(), {"one": one, "two": two})
