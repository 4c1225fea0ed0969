"""Files of the program that were damaged or edited by hand: what reads them answers, or says one line."""

import copy
import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_pages import BACKLASH, diagnosis

from ccmodel.accuracy.gate import check
from ccmodel.accuracy.measure import BatchAccuracy
from ccmodel.model.files import model_as_dict, read_model_file
from ccmodel.model.general.run import Active
from ccmodel.model.parameters import Parameters
from ccmodel.report.summary import summary_of
from ccmodel.typed import InputError
from fuzzing import examples

ODD = [None, 3, -1e400, "", [], {}, "x", True, [[]], {"a": 1}, "\ud800", 10**400]
odd = st.sampled_from(ODD).map(copy.deepcopy)
BASELINE = Path(__file__).parents[2] / "config/accuracy-baseline.json"


def places(data, above=()):
    """Paths of all values."""
    yield above
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield from places(value, (*above, key))


@st.composite
def damaged(draw, good):
    """JSON with up to two values that are odd or missing, and perhaps a byte that is another, or cut."""
    data = copy.deepcopy(good)
    for _ in range(draw(st.integers(0, 2))):
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
    content = bytearray(json.dumps(data).encode())
    if draw(st.integers(0, 4)) == 0:
        content[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    if draw(st.integers(0, 9)) == 0:
        del content[draw(st.integers(0, len(content))) :]
    return bytes(content)


def model():
    gap = Active("backlash", "load-pulley", {"half_gap": 0.02})
    return model_as_dict(Parameters(9000.0, 1.2, 0.15, 0.006, 0.006, mechanisms=(gap,)), {})


def measured():
    accepted = json.loads(BASELINE.read_text())["batches"]
    name = min(accepted)
    settings = {"coverage": 0.95, "reproducibility": 0.01, "file": str(BASELINE), "history": "history.csv"}
    batch = BatchAccuracy.model_validate_json(json.dumps(accepted[name]))
    return {"settings": settings, "measured": {name: batch.model_dump(mode="json")}}


def show(folder):
    found = summary_of(folder)
    return found.lines(), found.as_dict()


EXPLAINED = diagnosis("b", "explained", mechanisms=[BACKLASH])
LEFT_OUT = {"left_out": ["a: is empty"], "inconsistent": ["b: c"], "warnings": ["d"]}
READ = {
    "diagnosis.json": (EXPLAINED, lambda file: show(file.parent)),
    "left-out.json": (LEFT_OUT, lambda file: show(file.parent)),
    "tables/baseline.json": (measured(), lambda file: check(file.parents[1])),
    "model.json": (model(), read_model_file),
}


@pytest.mark.parametrize("name", READ)
@settings(max_examples=examples(150), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_file_is_one_line(name, tmp_path, data):
    good, read = READ[name]
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_text(json.dumps(good))
    read(file)
    file.write_bytes(data.draw(damaged(good)))
    try:
        read(file)
    except InputError as error:
        assert "\n" not in str(error)
