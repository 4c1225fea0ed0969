"""What is right to say of a case, and which size it is that was found."""

import pytest

from proof.real.cases import cases_of
from proof.real.plan import read_real_plan
from proof.real.score import found_size, is_right, is_size_found, made_of, outcome_of, truth_of

MODEL = {
    "mechanisms": [
        {"name": "pulley-friction", "place": "drive-pulley", "values": {"friction_torque": 0.03}},
        {"name": "presliding", "place": "conduit", "values": {"z0": 1e-4}},
    ],
}
PULLEY = "pulley-friction at drive-pulley"
OFF = ("pulley-friction",)


def judged(verdict="agrees", mechanisms=(), alternatives=(), place=None, **case):
    """What is made of a case: of the kind, or with that left out, that `case` says."""
    wanted = {"kind": None, "left_out": None, "without": ()} | case
    plan = read_real_plan()
    found = next(c for c in cases_of(plan, MODEL) if all(getattr(c, k) == v for k, v in wanted.items()))
    said = {
        "verdict": verdict,
        "place": place,
        "mechanisms": [claim(m) for m in mechanisms],
        "alternatives": [claim(a, 0.4) for a in alternatives],
        "nearest": None,
        "left": {"calibrated": 1.0, "extended": 1.0},
    }
    result = {
        "said": said,
        "why": None,
        "tampering": [],
        "case": found.name,
        "key": found.digest,
        "changed": {},
        "took_s": 1.0,
    }
    return outcome_of(found, truth_of(found, plan, MODEL), result)


def claim(acting, confidence=0.9, **values):
    name, _, place = acting.partition(" at ")
    parameters = [{"name": n, "value": v} for n, v in values.items()]
    return {"name": name, "place": place, "confidence": confidence, "parameters": parameters}


def with_values(o, acting, **values):
    """The same with a first name that has values."""
    o.said["mechanisms"] = [claim(acting, **values)]
    return o


GAIN, DRIFT = {"kind": "gain-of-drive-torque"}, {"kind": "drift-of-drive-torque"}


@pytest.mark.parametrize(
    ("o", "made", "right", "wrong"),
    [
        (judged(), "let be", True, 0),
        (judged("explained", ["backlash at load-pulley"]), "another name", False, 1),
        (judged("explained", ["torque-scale at drive-sensor"], **GAIN), "named", True, 0),
        (judged("explained", ["torque-scale at load-sensor"], **GAIN), "named elsewhere", False, 1),
        (judged("explained", ["presliding at conduit"], **GAIN), "another name", False, 1),
        (judged(**GAIN), "not noticed", False, 0),
        (
            judged("undecided", [], ["relaxation at cable", "torque-scale at drive-sensor"], **GAIN),
            "undecided with it",
            True,
            0,
        ),
        (judged("undecided", [], ["relaxation at cable"], **GAIN), "undecided without it", False, 0),
        (judged("unexplained", place="conduit", **GAIN), "unexplained, elsewhere", False, 0),
        (
            judged("explained", ["torque-scale at drive-sensor"], kind="gain-of-load-torque"),
            "named as its equal",
            True,
            0,
        ),
        (judged("unexplained", place="drive-sensor", **DRIFT), "unexplained, in place", True, 0),
        (judged("unexplained", place="conduit", **DRIFT), "unexplained, elsewhere", True, 0),
        (judged("undecided", [], ["relaxation at cable"], **DRIFT), "undecided without it", True, 0),
        (judged("explained", ["relaxation at cable"], **DRIFT), "another name", False, 1),
        (judged(**DRIFT), "not noticed", False, 0),
        (
            judged("unexplained", place="drive-pulley", left_out=PULLEY, without=OFF),
            "unexplained, in place",
            True,
            0,
        ),
        (judged("unexplained", place="load", left_out=PULLEY, without=OFF), "unexplained, elsewhere", False, 0),
        (
            judged("undecided", [], ["constant-drag at conduit"], "drive-pulley", left_out=PULLEY, without=OFF),
            "undecided without it",
            True,
            0,
        ),
    ],
)
def test_what_is_right(o, made, right, wrong):
    assert made_of(o) == made
    assert is_right(o) is right
    assert len(o.wrong_names) == wrong


def test_what_was_taken_out_is_to_be_named_with_its_value():
    for value, right in ((0.03, True), (0.025, True), (0.02, False)):
        o = with_values(judged("explained", left_out=PULLEY), PULLEY, friction_torque=value)
        assert made_of(o) == "named"
        assert found_size(o) == value
        assert is_right(o) is right


def test_of_drag_the_size_is_what_was_added():
    o = with_values(judged("explained", kind="drag"), PULLEY, friction_torque=0.042)
    assert found_size(o) == pytest.approx(0.012)
    assert is_size_found(o) is (abs(0.012 / o.case.size - 1) <= 0.25)


def test_a_gain_at_the_other_end_is_the_inverse():
    o = judged("explained", kind="gain-of-load-torque")
    with_values(o, "torque-scale at drive-sensor", gain=1 / (1 + o.case.size) - 1)
    assert found_size(o) == pytest.approx(o.case.size)
