"""Which diagnoses of a case are right, and which size they estimate."""

import pytest

from proof.real.cases import cases_of
from proof.real.page import _summary
from proof.real.plan import read_real_plan
from proof.real.score import classification, estimated_size, is_right, is_size_recovered, outcome_of, truth_of

MODEL = {
    "mechanisms": [
        {"name": "pulley-friction", "place": "drive-pulley", "values": {"friction_torque": 0.03}},
        {"name": "presliding", "place": "conduit", "values": {"z0": 1e-4}},
    ],
}
PULLEY = "pulley-friction at drive-pulley"
OFF = ("pulley-friction",)


def judged(verdict="agrees", mechanisms=(), alternatives=(), place=None, **case):
    """Outcome of the case whose fields are `case`, with a given diagnosis."""
    wanted = {"fault": None, "removed": None, "without": ()} | case
    plan = read_real_plan()
    found = next(c for c in cases_of(plan, MODEL) if all(getattr(c, k) == v for k, v in wanted.items()))
    diagnosis = {
        "verdict": verdict,
        "place": place,
        "mechanisms": [claim(m) for m in mechanisms],
        "alternatives": [claim(a, 0.4) for a in alternatives],
        "nearest": None,
        "mean_square": {"calibrated": 1.0, "extended": 1.0},
    }
    result = {
        "diagnosis": diagnosis,
        "failure": None,
        "tampering": [],
        "case": found.name,
        "key": found.digest,
        "sources": "0123456789abcdef",
        "changed": {},
        "took_s": 1.0,
    }
    return outcome_of(found, truth_of(found, plan, MODEL), result)


def claim(label, confidence=0.9, **values):
    name, _, place = label.partition(" at ")
    parameters = [{"name": n, "value": v} for n, v in values.items()]
    return {"name": name, "place": place, "confidence": confidence, "parameters": parameters}


def with_values(o, label, **values):
    """The outcome with one identified mechanism that has values."""
    o.diagnosis["mechanisms"] = [claim(label, **values)]
    return o


@pytest.mark.parametrize(("place", "right"), [("drive-pulley", True), ("load", False)])
def test_a_law_stands_for_a_mechanism_off_the_list_where_it_acts(place, right):
    o = judged("learned", place="conduit", removed=PULLEY, without=OFF)
    o.diagnosis["laws"] = [{"place": place, "slot": "bearing-torque", "arguments": ["angle"], "confidence": 0.9}]
    assert classification(o) == ("learned, right place" if right else "learned, other place")
    assert is_right(o) == right


@pytest.mark.parametrize(
    ("place", "confidence", "case", "wrong"),
    [
        ("drive-pulley", 0.95, {}, 1),
        ("drive-pulley", 0.7, {}, 0),
        ("drive-pulley", 0.95, {"fault": "cogging"}, 0),
        ("conduit", 0.95, {"fault": "cogging"}, 1),
        ("drive-sensor", 0.95, {"fault": "gain-of-load-torque"}, 0),  # of the equivalent gain
    ],
)
def test_a_law_of_another_place_is_wrong_with_confidence(place, confidence, case, wrong):
    """As in the simulated validation; in a control every place is wrong."""
    o = judged("learned", place=place, **case)
    o.diagnosis["laws"] = [{"place": place, "slot": "drag", "arguments": ["theta_in"], "confidence": confidence}]
    assert o.confidently_wrong == [f"law of drag at {place}"] * wrong
    assert not (o.confidently_wrong and is_right(o))


GAIN, DRIFT = {"fault": "gain-of-drive-torque"}, {"fault": "drift-of-drive-torque"}


@pytest.mark.parametrize(
    ("o", "expected", "right", "wrong"),
    [
        (judged(), "true negative", True, 0),
        (judged("explained", ["backlash at load-pulley"]), "misidentified", False, 1),
        (judged("explained", ["torque-scale at drive-sensor"], **GAIN), "identified", True, 0),
        (judged("explained", ["torque-scale at load-sensor"], **GAIN), "identified at another place", False, 1),
        (judged("explained", ["presliding at conduit"], **GAIN), "misidentified", False, 1),
        (judged(**GAIN), "false negative", False, 0),
        (
            judged("undecided", [], ["relaxation at cable", "torque-scale at drive-sensor"], **GAIN),
            "undecided, includes it",
            True,
            0,
        ),
        (judged("undecided", [], ["relaxation at cable"], **GAIN), "undecided, excludes it", False, 0),
        (judged("unexplained", place="conduit", **GAIN), "unexplained, other place", False, 0),
        (
            judged("explained", ["torque-scale at drive-sensor"], fault="gain-of-load-torque"),
            "identified an equivalent",
            True,
            0,
        ),
        (judged("inputs-inconsistent", place="drive-sensor", **DRIFT), "inputs called inconsistent", False, 0),
        (judged("unexplained", place="drive-sensor", **DRIFT), "unexplained, right place", True, 0),
        (judged("unexplained", place="conduit", **DRIFT), "unexplained, other place", True, 0),
        (judged("undecided", [], ["relaxation at cable"], **DRIFT), "undecided, excludes it", True, 0),
        (judged("explained", ["relaxation at cable"], **DRIFT), "misidentified", False, 1),
        (judged(**DRIFT), "false negative", False, 0),
        (
            judged("unexplained", place="drive-pulley", removed=PULLEY, without=OFF),
            "unexplained, right place",
            True,
            0,
        ),
        (judged("unexplained", place="load", removed=PULLEY, without=OFF), "unexplained, other place", False, 0),
        (
            judged("undecided", [], ["constant-drag at conduit"], "drive-pulley", removed=PULLEY, without=OFF),
            "undecided, excludes it",
            True,
            0,
        ),
    ],
)
def test_classification(o, expected, right, wrong):
    assert classification(o) == expected
    assert is_right(o) is right
    assert len(o.confidently_wrong) == wrong


def test_a_removed_mechanism_must_be_identified_with_its_value():
    for value, right in ((0.03, True), (0.025, True), (0.02, False)):
        o = with_values(judged("explained", removed=PULLEY), PULLEY, friction_torque=value)
        assert classification(o) == "identified"
        assert estimated_size(o) == value
        assert is_right(o) is right


def test_a_size_that_is_not_recovered_counts_among_the_identifications():
    outcomes = [with_values(judged("explained", removed=PULLEY), PULLEY, friction_torque=v) for v in (0.03, 0.09)]
    assert "- Identifications with a size within 25 %: 1 of 2.\n" in _summary(outcomes)


def test_the_size_of_a_drag_is_its_difference_from_the_baseline():
    o = with_values(judged("explained", fault="drag"), PULLEY, friction_torque=0.042)
    assert estimated_size(o) == pytest.approx(0.012)
    assert is_size_recovered(o) is (abs(0.012 / o.case.size - 1) <= 0.25)


def test_an_equivalent_gain_is_the_inverse():
    o = judged("explained", fault="gain-of-load-torque")
    with_values(o, "torque-scale at drive-sensor", gain=1 / (1 + o.case.size) - 1)
    assert estimated_size(o) == pytest.approx(o.case.size)
