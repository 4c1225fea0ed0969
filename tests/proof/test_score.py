"""The score of synthetic answers and diagnoses, for which it is known."""

from dataclasses import replace

import numpy as np
import pytest

from proof import score as scoring
from proof.calibration import calibration_error, spiegelhalter
from proof.detection import detection_by_error, half_detected
from proof.figures import write_figures
from proof.intervals import rate
from proof.outcome import Outcome
from proof.page import Source, met_rate, page


def answer(kind, *truth, protocol="rich"):
    effects = [
        {"name": n, "place": p, "severity": 2, "strength": 0.5, "size": size, "unit": "1", "values": values}
        for n, p, size, values in truth
    ]
    none = [{"name": "none", "place": None, "severity": 0}]
    return {"case": "case-1", "kind": kind, "protocol": protocol, "recorded": protocol, "truth": effects or none}


def reported(verdict, *mechanisms, place=None, alternatives=()):
    def claims(of):
        return [{"name": n, "place": p, "confidence": c, "parameters": v} for n, p, c, v in of]

    return {
        "verdict": verdict,
        "place": place or (mechanisms[0][1] if mechanisms else None),
        "mechanisms": claims(mechanisms),
        "alternatives": claims(alternatives),
    }


def errors(before, after=1.0):
    return {"tau_in_Nm": {"before": before, "after": after, "floor": 1.0}}


GAIN = ("torque-scale", "drive-sensor", 0.05, {"gain": 0.05})
VALUE = [{"name": "gain", "value": 0.051, "low": 0.04, "high": 0.06, "unit": "1"}]
RIGHT = reported("explained", ("torque-scale", "drive-sensor", 0.95, VALUE))
WRONG = reported("explained", ("pulley-friction", "drive-pulley", 0.95, []))
AGREES = reported("agrees")
# The inputs of every case are right.
FALSE_ALARM = reported("inputs-inconsistent", place="drive-sensor")

CLEAN = Outcome(answer("clean"), AGREES, errors=errors(1.0))
FALSE_POSITIVE = Outcome(answer("clean"), WRONG, errors=errors(1.0))
IDENTIFIED = Outcome(answer("single", GAIN), RIGHT, errors=errors(11.0, 2.0))
MISIDENTIFIED = Outcome(answer("single", GAIN), WRONG, errors=errors(11.0, 9.0))
INVISIBLE = Outcome(answer("single", GAIN), AGREES, errors=errors(2.0, 2.0))
MISSED = Outcome(answer("single", GAIN), AGREES, errors=errors(11.0, 11.0))
CALLED_INCONSISTENT = Outcome(answer("single", GAIN), FALSE_ALARM)
RUNOUT = ("unlisted-encoder-runout", "load-sensor", 0.02, {})
OUTSIDER = Outcome(answer("unlisted", RUNOUT), reported("unexplained", place="load-sensor"), errors=errors(9.0, 9.0))
OUTSIDER_MISIDENTIFIED = Outcome(
    answer("removed", ("unlisted-kink", "conduit", 0.5, {})), WRONG, errors=errors(9.0, 5.0)
)
LEARNED, LEARNED_ELSEWHERE = (
    Outcome(answer("unlisted", RUNOUT), reported("learned", place=place), errors=errors(9.0, 1.0))
    for place in ("load-sensor", "conduit")
)
UNDECIDED = Outcome(
    answer("poor", GAIN, protocol="single"),
    reported("undecided", alternatives=[("torque-scale", "drive-sensor", 0.5, []), ("kink", "conduit", 0.5, [])]),
)


def test_spiegelhalters_z_is_standard_normal_for_calibrated_claims():
    random = np.random.default_rng(0)
    stated = random.uniform(0.3, 0.9, (400, 150))
    z = [spiegelhalter(list(zip(p, random.uniform(size=p.size) < p, strict=True))) for p in stated]
    assert np.mean(z) == pytest.approx(0, abs=0.15)
    assert np.std(z) == pytest.approx(1, abs=0.1)
    too_sure = [spiegelhalter(list(zip(p, random.uniform(size=p.size) < p - 0.2, strict=True))) for p in stated]
    assert abs(np.mean(too_sure)) > 2


def test_a_pair_that_is_declared_complete_with_one_member_is_confidently_wrong():
    answered = answer("pair", GAIN, ("kink", "conduit", 0.5, {}))
    assert Outcome(answered, RIGHT).is_confidently_wrong
    doubtful = reported("explained", ("torque-scale", "drive-sensor", 0.7, VALUE))
    assert not Outcome(answered, doubtful).is_confidently_wrong
    both = reported("explained", ("torque-scale", "drive-sensor", 0.9, VALUE), ("kink", "conduit", 0.9, []))
    assert not Outcome(answered, both).is_confidently_wrong


def test_a_pair_is_accounted_for_if_one_is_named_and_the_law_of_the_other_is_learned():
    answered = answer("pair", GAIN, ("kink", "conduit", 0.5, {}))
    both = reported("explained", ("torque-scale", "drive-sensor", 0.9, VALUE), ("kink", "conduit", 0.9, []))
    assert Outcome(answered, both).are_all_accounted_for
    assert not Outcome(answered, RIGHT).are_all_accounted_for
    for place, is_its in (("conduit", True), ("load", False)):
        beside = RIGHT | {
            "verdict": "learned",
            "laws": [{"place": place, "slot": "sliding-friction", "confidence": 0.9}],
        }
        assert Outcome(answered, beside).are_all_accounted_for == is_its
        assert not Outcome(answered, beside).are_all_identified
        assert not Outcome(answered, beside | {"mechanisms": []}).are_all_accounted_for


@pytest.mark.parametrize(
    ("name", "confidence", "wrong"), [("kink", 0.9, True), ("kink", 0.7, False), ("torque-scale", 0.9, False)]
)
def test_an_alternative_that_is_stated_with_confidence_counts_like_a_mechanism(name, confidence, wrong):
    said = reported("undecided", alternatives=[(name, "drive-sensor", confidence, [])])
    assert Outcome(answer("single", GAIN), said).is_confidently_wrong == wrong


@pytest.mark.parametrize("place", ["drive-sensor", "load-sensor"])
def test_a_mechanism_is_right_at_its_place_alone(place):
    is_there = place == "drive-sensor"
    one = Outcome(answer("single", GAIN), reported("explained", ("torque-scale", place, 0.9, [])))
    assert (one.is_identified_first, one.is_confidently_wrong) == (is_there, not is_there)
    assert one.claims == [(0.9, is_there)]
    listed = Outcome(answer("single", GAIN), reported("undecided", alternatives=[("torque-scale", place, 0.5, [])]))
    assert listed.includes_truth == is_there
    assert rate_of("pair: one identified", Outcome(answer("pair", GAIN, GAIN), one.diagnosis)) == (int(is_there), 1)


@pytest.mark.parametrize("channel", ["tau_in_Nm", "F_drive_N"])
def test_a_sensor_map_is_right_for_its_channel_alone(channel):
    key = answer("unlisted", GAIN)
    key["truth"][0] |= {"name": "unlisted-torque-curvature", "slot": "sensor-map", "channel": "tau_in_Nm"}
    law = {"slot": "sensor-map", "place": "drive-sensor", "channel": channel, "arguments": ["reading"]}
    o = Outcome(key, reported("learned", place="drive-sensor") | {"laws": [law | {"confidence": 0.9}]})
    assert o.claims == [(0.9, channel == "tau_in_Nm")]


@pytest.mark.parametrize(
    ("kind", "slot", "confidence", "wrong"),
    [
        ("single", "torque-map", 0.9, False),
        ("single", "load", 0.9, True),
        ("single", "load", 0.7, False),
        ("clean", "torque-map", 0.9, True),
    ],
)
def test_a_law_that_is_stated_with_confidence_is_wrong_in_another_slot(kind, slot, confidence, wrong):
    key = answer(kind, *([GAIN] if kind == "single" else []))
    key["truth"][0]["slot"] = "torque-map" if kind == "single" else None
    law = {"slot": slot, "place": "drive-sensor", "arguments": ["torque"], "confidence": confidence}
    o = Outcome(key, reported("learned", place="drive-sensor") | {"laws": [law]})
    assert o.is_confidently_wrong == wrong
    assert o.claims == [(confidence, slot == "torque-map" and kind == "single")]


def test_rates_of_the_mechanisms_law_and_of_another_stand_apart():
    other = answer("single", GAIN)
    other["truth"][0]["law"] = "another"
    visible = Outcome(other, RIGHT, errors=errors(11.0))
    assert rate_of("the mechanism's law", IDENTIFIED, visible) == (1, 1)
    assert rate_of("another law", IDENTIFIED, visible, Outcome(other, WRONG, errors=errors(11.0))) == (1, 2)


def rate_of(what, *outcomes):
    (found,) = [r for r in scoring.rates(outcomes) if r["what"].startswith(what)]
    return found["k"], found["n"]


@pytest.mark.parametrize(
    ("what", "outcomes", "expected"),
    [
        ("clean: true negative", (CLEAN, FALSE_POSITIVE, IDENTIFIED), (1, 2)),
        ("single, visible: detected", (IDENTIFIED, MISIDENTIFIED, INVISIBLE, MISSED), (2, 3)),
        ("single, visible: located", (IDENTIFIED, MISIDENTIFIED), (1, 2)),
        ("single, visible, rich protocol: identified first", (IDENTIFIED, MISIDENTIFIED, INVISIBLE), (1, 2)),
        ("single, any size, rich protocol", (IDENTIFIED, MISIDENTIFIED, INVISIBLE), (1, 3)),
        (
            "no confident misidentification",
            (CLEAN, FALSE_POSITIVE, IDENTIFIED, MISIDENTIFIED, OUTSIDER_MISIDENTIFIED),
            (2, 5),
        ),
        ("no candidate: unexplained, ", (OUTSIDER, OUTSIDER_MISIDENTIFIED, LEARNED, LEARNED_ELSEWHERE), (2, 4)),
        ("poor protocol", (UNDECIDED,), (1, 1)),
        ("undecided: a true effect", (UNDECIDED, IDENTIFIED), (1, 1)),
        ("coverage of the 90 %", (IDENTIFIED, MISIDENTIFIED), (1, 1)),
        ("right inputs are not called", (CLEAN, IDENTIFIED, CALLED_INCONSISTENT), (2, 3)),
        ("single, visible: detected", (IDENTIFIED, CALLED_INCONSISTENT), (1, 2)),
        ("single, visible: located", (IDENTIFIED, CALLED_INCONSISTENT), (1, 2)),
        ("no confident misidentification", (CALLED_INCONSISTENT,), (1, 1)),
        ("a verdict is returned", (IDENTIFIED, Outcome(answer("clean"), None, "refused")), (1, 2)),
    ],
)
def test_rates(what, outcomes, expected):
    assert rate_of(what, *outcomes) == expected


def test_a_pair_needs_both_mechanisms():
    key = answer("pair", GAIN, ("kink", "conduit", 0.5, {}))
    both = reported("explained", ("kink", "conduit", 0.9, []), ("torque-scale", "drive-sensor", 0.9, []))
    assert rate_of("pair: both", Outcome(key, both), Outcome(key, RIGHT)) == (1, 2)
    assert rate_of("pair: one", Outcome(key, both), Outcome(key, RIGHT), Outcome(key, WRONG)) == (2, 3)


def test_too_many_mechanisms_count_as_none():
    many = reported(
        "explained", *[(n, "conduit", 0.5, []) for n in ("torque-scale", "kink", "stribeck", "presliding", "backlash")]
    )
    o = Outcome(answer("single", GAIN), many)
    assert o.first_identified is None
    assert o.is_confidently_wrong


def test_a_law_that_was_learned_is_right_in_the_true_slot():
    assert scoring.is_right(LEARNED)
    assert not scoring.is_right(LEARNED_ELSEWHERE)


def test_a_refused_result_is_never_right():
    assert not scoring.is_right(Outcome(answer("clean"), None, "refused"))
    assert not scoring.is_right(Outcome(answer("single", GAIN), None, "refused"))


def test_wilson_interval():
    found = rate("", 8, 10)
    assert (found["low"], found["high"]) == (pytest.approx(0.4902, abs=1e-4), pytest.approx(0.9433, abs=1e-4))


def test_the_gap_is_that_of_the_worst_channel():
    o = Outcome(
        answer("single", GAIN),
        RIGHT,
        errors={
            "a": {"before": 20.0, "after": 3.0, "floor": 2.0},
            "b": {"before": 4.0, "after": 4.0, "floor": 2.0},
        },
    )
    assert o.gap_closed == pytest.approx(17 / 18)
    assert o.error_after == pytest.approx(2.0)
    assert IDENTIFIED.is_visible and not INVISIBLE.is_visible


def test_calibration_error_of_known_claims():
    right = reported("explained", ("torque-scale", "drive-sensor", 0.9, []))
    sure = [Outcome(answer("single", GAIN), right) for _ in range(9)]
    wrong = [Outcome(answer("single", GAIN), reported("explained", ("kink", "x", 0.9, [])))]
    assert calibration_error(sure + wrong) == pytest.approx(0.0, abs=1e-12)
    assert calibration_error(sure + wrong * 9) == pytest.approx(0.4)


def test_the_logistic_curve_finds_the_size_at_which_half_are_detected():
    random = np.random.default_rng(1)
    sizes = np.exp(random.uniform(np.log(1e-3), np.log(1e-1), 300))
    detected = random.uniform(size=300) < 1 / (1 + (sizes / 1e-2) ** -3)
    found = half_detected([{"size": s, "detected": d} for s, d in zip(sizes, detected, strict=True)])
    assert found["half_size"] == pytest.approx(1e-2, rel=0.2)
    assert found["slope"] == pytest.approx(3, rel=0.3)


def test_every_miss_is_on_the_page(tmp_path):
    outcomes = [
        CLEAN,
        FALSE_POSITIVE,
        IDENTIFIED,
        MISIDENTIFIED,
        INVISIBLE,
        MISSED,
        OUTSIDER,
        OUTSIDER_MISIDENTIFIED,
        UNDECIDED,
        CALLED_INCONSISTENT,
    ]
    outcomes += [Outcome(answer("clean"), None, "refused: it imported virtualrig")]
    scored = scoring.score(outcomes)
    assert len(scored["misses"]) == 6
    assert scored["confusion"]["torque-scale"] == {
        "torque-scale": 1,
        "pulley-friction": 1,
        "agrees": 2,
        "undecided": 1,
        "inputs-inconsistent": 1,
    }
    figures = write_figures(scored, tmp_path / "figures")
    text = page(scored, figures, Source(tmp_path / "proof.md", tmp_path / "figures", "make proof", "All of them."))
    assert text.count("case-1 (") == 6
    assert "imported virtualrig" in text
    assert "| clean: true negative | 1/3 |" in text
    assert all((tmp_path / "figures" / name).stat().st_size > 5000 for name in figures)
    assert len(figures) == 5


def test_a_target_within_the_interval_is_open():
    few, many, none = (rate("", k, n, 0.9) for k, n in ((8, 8), (800, 800), (500, 800)))
    assert [met_rate(r) for r in (few, many, none)] == ["yes, open", "yes", "**no**"]


def test_detection_is_binned_by_the_error_before():
    low, high = detection_by_error([IDENTIFIED, MISIDENTIFIED, INVISIBLE, MISSED, CLEAN])
    assert (low["low"], low["detected"]["k"], low["detected"]["n"]) == (1.6, 0, 1)
    assert (high["detected"]["k"], high["identified"]["k"], high["identified"]["n"]) == (2, 1, 3)


def test_a_regressor_is_better_with_less_error():
    worse, better = (replace(IDENTIFIED, regressors={"x": {"tau_in_Nm": error}}) for error in (3.0, 1.5))
    _, row, _ = scoring.method_comparison([worse, better])
    assert (row["method"], row["better"]["k"], row["better"]["n"]) == ("x", 1, 2)


def test_a_crash_counts_as_not_detected():
    crashed = Outcome(answer("single", GAIN), None, "exit code 1")
    assert rate_of("single, visible: detected", IDENTIFIED, crashed) == (1, 2)


def test_times_of_clean_and_other_cases_stand_apart():
    timed = [replace(CLEAN, diagnosis_s=8.0), replace(IDENTIFIED, diagnosis_s=20.0), replace(MISSED, diagnosis_s=60.0)]
    found = {s["what"]: (s["n"], s["value"]) for s in scoring.statistics([*timed, OUTSIDER])}
    assert found["processor time of a diagnosis, clean, median (s)"] == (1, 8.0)
    assert found["processor time of a diagnosis, not clean, median (s)"] == (2, 40.0)
    assert found["processor time of a diagnosis, not clean, largest (s)"] == (2, 60.0)
