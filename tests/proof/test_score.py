"""The score, on answers and diagnoses made up so that it can be said beforehand."""

from dataclasses import replace

import numpy as np
import pytest

from proof import score as scoring
from proof.figures import write_figures
from proof.page import _kept, page
from proof.score import Outcome


def answer(kind, *truth, protocol="rich"):
    effects = [
        {"name": n, "place": p, "severity": 2, "strength": 0.5, "size": size, "unit": "1", "values": values}
        for n, p, size, values in truth
    ]
    none = [{"name": "none", "place": None, "severity": 0}]
    return {"case": "case-1", "kind": kind, "protocol": protocol, "recorded": protocol, "truth": effects or none}


def said(verdict, *mechanisms, place=None, alternatives=()):
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
RIGHT = said("explained", ("torque-scale", "drive-sensor", 0.95, VALUE))
WRONG = said("explained", ("pulley-friction", "drive-pulley", 0.95, []))
AGREES = said("agrees")

CLEAN = Outcome(answer("clean"), AGREES, errors=errors(1.0))
ACCUSED = Outcome(answer("clean"), WRONG, errors=errors(1.0))
FOUND = Outcome(answer("single", GAIN), RIGHT, errors=errors(11.0, 2.0))
MISNAMED = Outcome(answer("single", GAIN), WRONG, errors=errors(11.0, 9.0))
UNSEEN = Outcome(answer("single", GAIN), AGREES, errors=errors(2.0, 2.0))
OVERLOOKED = Outcome(answer("single", GAIN), AGREES, errors=errors(11.0, 11.0))
ODD = ("unlisted-encoder-runout", "load-sensor", 0.02, {})
STRANGE = Outcome(answer("unlisted", ODD), said("unexplained", place="load-sensor"), errors=errors(9.0, 9.0))
STRANGE_NAMED = Outcome(answer("removed", ("unlisted-kink", "conduit", 0.5, {})), WRONG, errors=errors(9.0, 5.0))
OPEN = Outcome(
    answer("poor", GAIN, protocol="single"),
    said("undecided", alternatives=[("torque-scale", "drive-sensor", 0.5, []), ("kink", "conduit", 0.5, [])]),
)


def rate_of(what, *outcomes):
    (found,) = [r for r in scoring.rates(outcomes) if r["what"].startswith(what)]
    return found["k"], found["n"]


@pytest.mark.parametrize(
    ("what", "outcomes", "expected"),
    [
        ("clean: not accused", (CLEAN, ACCUSED, FOUND), (1, 2)),
        ("single, visible: noticed", (FOUND, MISNAMED, UNSEEN, OVERLOOKED), (2, 3)),
        ("single, visible: right place", (FOUND, MISNAMED), (1, 2)),
        ("single, rich, visible: named first", (FOUND, MISNAMED, UNSEEN), (1, 2)),
        ("single, rich, of any size", (FOUND, MISNAMED, UNSEEN), (1, 3)),
        ("not confidently wrong", (CLEAN, ACCUSED, FOUND, MISNAMED, STRANGE_NAMED), (2, 5)),
        ("outside the list: unexplained or", (STRANGE, STRANGE_NAMED), (1, 2)),
        ("poor protocol", (OPEN,), (1, 1)),
        ("undecided: the truth", (OPEN, FOUND), (1, 1)),
        ("90 % intervals", (FOUND, MISNAMED), (1, 1)),
        ("a verdict at all", (FOUND, Outcome(answer("clean"), None, "refused")), (1, 2)),
    ],
)
def test_rates(what, outcomes, expected):
    assert rate_of(what, *outcomes) == expected


def test_a_pair_needs_both_names():
    key = answer("pair", GAIN, ("kink", "conduit", 0.5, {}))
    both = said("explained", ("kink", "conduit", 0.9, []), ("torque-scale", "drive-sensor", 0.9, []))
    assert rate_of("pair: both", Outcome(key, both), Outcome(key, RIGHT)) == (1, 2)
    assert rate_of("pair: one", Outcome(key, both), Outcome(key, RIGHT), Outcome(key, WRONG)) == (2, 3)


def test_more_names_than_allowed_are_none():
    many = said("explained", *[(n, "conduit", 0.5, []) for n in ("torque-scale", "kink", "stribeck")])
    o = Outcome(answer("single", GAIN), many)
    assert o.first is None
    assert o.confidently_wrong


def test_a_refused_result_is_never_right():
    assert not scoring.is_right(Outcome(answer("clean"), None, "refused"))
    assert not scoring.is_right(Outcome(answer("single", GAIN), None, "refused"))


def test_wilson_interval():
    rate = scoring.rate("", 8, 10)
    assert (rate["low"], rate["high"]) == (pytest.approx(0.4902, abs=1e-4), pytest.approx(0.9433, abs=1e-4))


def test_the_gap_is_closed_in_the_channel_that_was_off_most():
    o = Outcome(
        answer("single", GAIN),
        RIGHT,
        errors={
            "a": {"before": 20.0, "after": 3.0, "floor": 2.0},
            "b": {"before": 4.0, "after": 4.0, "floor": 2.0},
        },
    )
    assert o.closed == pytest.approx(17 / 18)
    assert o.left == pytest.approx(2.0)
    assert FOUND.is_visible and not UNSEEN.is_visible


def test_calibration_error_of_known_claims():
    sure = [Outcome(answer("single", GAIN), said("explained", ("torque-scale", "x", 0.9, []))) for _ in range(9)]
    wrong = [Outcome(answer("single", GAIN), said("explained", ("kink", "x", 0.9, [])))]
    assert scoring.calibration_error(sure + wrong) == pytest.approx(0.0, abs=1e-12)
    assert scoring.calibration_error(sure + wrong * 9) == pytest.approx(0.4)


def test_curve_of_noticing_finds_where_half_are_noticed():
    random = np.random.default_rng(1)
    sizes = np.exp(random.uniform(np.log(1e-3), np.log(1e-1), 300))
    noticed = random.uniform(size=300) < 1 / (1 + (sizes / 1e-2) ** -3)
    found = scoring._half([{"size": s, "noticed": n} for s, n in zip(sizes, noticed, strict=True)])
    assert found["half_size"] == pytest.approx(1e-2, rel=0.2)
    assert found["slope"] == pytest.approx(3, rel=0.3)


def test_every_miss_is_on_the_page(tmp_path):
    outcomes = [CLEAN, ACCUSED, FOUND, MISNAMED, UNSEEN, OVERLOOKED, STRANGE, STRANGE_NAMED, OPEN]
    outcomes += [Outcome(answer("clean"), None, "refused: it imported virtualrig")]
    scored = scoring.score(outcomes)
    assert len(scored["misses"]) == 5
    assert scored["confusion"]["torque-scale"] == {
        "torque-scale": 1,
        "pulley-friction": 1,
        "agrees": 2,
        "undecided": 1,
    }
    figures = write_figures(scored, tmp_path / "figures")
    text = page(scored, figures, tmp_path / "figures", tmp_path / "proof.md", "make proof", "All of them.")
    assert text.count("case-1 (") == 5
    assert "imported virtualrig" in text
    assert "| clean: not accused | 1/3 |" in text
    assert all((tmp_path / "figures" / name).stat().st_size > 5000 for name in figures)
    assert len(figures) == 5


def test_what_more_cases_would_decide_is_open():
    few, many, none = (scoring.rate("", k, n, 0.9) for k, n in ((8, 8), (800, 800), (500, 800)))
    assert [_kept(r) for r in (few, many, none)] == ["yes, open", "yes", "**no**"]


def test_noticing_is_counted_by_how_visible_an_effect_is():
    low, high = scoring.noticing([FOUND, MISNAMED, UNSEEN, OVERLOOKED, CLEAN])
    assert (low["low"], low["noticed"]["k"], low["noticed"]["n"]) == (1.6, 0, 1)
    assert (high["noticed"]["k"], high["named"]["k"], high["named"]["n"]) == (2, 1, 3)


def test_a_rival_is_nearer_where_it_leaves_less():
    beaten, better = (replace(FOUND, rivals={"x": {"tau_in_Nm": left}}) for left in (3.0, 1.5))
    _, row, _ = scoring.rivalry([beaten, better])
    assert (row["rival"], row["nearer"]["k"], row["nearer"]["n"]) == ("x", 1, 2)


def test_a_crash_is_no_way_to_hide_a_visible_effect():
    crashed = Outcome(answer("single", GAIN), None, "exit code 1")
    assert rate_of("single, visible: noticed", FOUND, crashed) == (1, 2)
