"""The score of learned laws, for answers and diagnoses for which it is known."""

from dataclasses import replace

import numpy as np
import pytest

from proof.laws import absorbed, inside, is_confidently_wrong_law, is_slot_right, score_of_laws, share_inside
from proof.outcome import Outcome

X = np.linspace(0.5, 12.0, 9)


def answer(kind="unlisted", name="unlisted-yielding-liner", slot="sliding-friction", argument="tension", y=None):
    curve = [] if y is None else np.column_stack([np.linspace(0.1, 15, 60), y(np.linspace(0.1, 15, 60))]).tolist()
    truth = {"name": name, "place": "conduit", "slot": slot, "argument": argument, "curve": curve, "severity": 2}
    rig = {"Ke": 0.05}
    return {"case": "case-1", "kind": kind, "protocol": "rich", "recorded": "rich", "truth": [truth], "rig": rig}


def law(y, sd=0.02, **changed):
    stated = {
        "slot": "sliding-friction",
        "place": "conduit",
        "arguments": ["tension"],
        "indistinguishable": [],
        "confidence": 0.95,
        "curve": np.column_stack([X, y(X), y(X) - 1.645 * sd, y(X) + 1.645 * sd]).tolist(),
        "nearest_listed": {"name": "constant-drag", "distance": 3.0},
    }
    return stated | changed


def outcome(key, *laws, after=1.1):
    diagnosis = {"verdict": "learned", "place": "conduit", "mechanisms": [], "alternatives": [], "laws": list(laws)}
    return Outcome(key, diagnosis, errors={"tau_in_Nm": {"before": 9.0, "after": after, "floor": 1.0}})


def rising(x):
    return 1 + 0.3 / (1 + np.exp(-(x - 6.0)))


def of(what, *outcomes):
    return next(one for one in score_of_laws(outcomes) if what in one["what"])


def test_a_true_curve_is_inside_whatever_the_calibration_has_of_it():
    """Friction is a factor of a factor that is fitted."""
    right = outcome(answer(y=lambda x: 0.8 * rising(x)), law(rising))
    assert inside(right) == 1.0
    shifted = outcome(answer(y=rising), law(lambda x: rising(x) + 0.2 * np.sin(x)))
    assert inside(shifted) < 0.6
    assert inside(outcome(answer(y=rising, argument="time"), law(rising))) is None


@pytest.mark.parametrize(("argument", "expected"), [("drive-angle", 1.0), ("speed", 0.0)])
def test_only_a_law_of_an_angle_has_its_slope_from_the_calibration(argument, expected):
    key = answer(slot="bearing-torque", argument=argument, y=lambda x: 2e-3 * np.sin(x))
    learned = law(lambda x: 2e-3 * np.sin(x) + 0.01 * x - 0.3, sd=1e-5, slot="bearing-torque", arguments=[argument])
    assert inside(outcome(key, learned)) == pytest.approx(expected, abs=0.2)


@pytest.mark.parametrize("shift", [0.0, 0.08])
def test_a_loads_angle_has_its_zero_from_the_calibration(shift):
    """A spring with detents from another zero: its constant torque is a shift of the angle, and the rest is the law."""
    spring, angle = 0.05, np.linspace(-0.5, 0.5, 25)
    true_x = np.linspace(-0.6, 0.6, 129)

    def detents(a):
        return 2e-3 * (np.sin(12 * a + 1.2) - np.sin(1.2))

    seen = spring * shift + detents(angle + shift) - 0.01 * angle
    curve = np.column_stack([angle, seen, seen - 5e-5, seen + 5e-5])
    truth = {"slot": "load", "argument": "load-angle", "curve": list(zip(true_x, detents(true_x), strict=True))}
    assert share_inside(curve, truth, spring) == 1.0
    other = np.column_stack([angle, np.sin(9 * angle), seen - 5e-5, seen + 5e-5])
    assert share_inside(other, truth, spring) < 0.5


def test_a_radius_has_no_slope_from_the_calibration():
    """The calibration takes a pulley's radius as stated."""
    angle = np.linspace(-0.6, 0.6, 9)
    truth = answer(slot="pulley-radius", argument="drive-angle")["truth"][0]
    assert absorbed(1 + 0.05 * angle, angle, np.ones(9), truth) == pytest.approx(1 + 0.05 * angle)


def test_regressors_are_compared_where_they_were_fitted():
    learned = outcome(answer(y=rising), law(rising))
    nearer, further = (
        replace(
            learned, regressors={"a": {"tau_in_Nm": learned.errors["tau_in_Nm"]["floor"] * 9}, "b": {"tau_in_Nm": x}}
        )
        for x in (0.0, learned.errors["tau_in_Nm"]["floor"] * 5)
    )
    assert nearer.error_of_regressors == 0.0 and further.error_of_regressors == pytest.approx(5.0)
    row = of("no reference regressor", learned, nearer, further)
    assert (row["k"], row["n"]) == (1, 2)


def test_slots_and_arguments_are_counted():
    right = outcome(answer(y=rising), law(rising))
    untold = outcome(answer(y=rising, argument="speed"), law(rising, indistinguishable=["speed"]))
    elsewhere = outcome(answer(y=rising), law(rising, slot="cable-stretch"))
    assert [is_slot_right(o) for o in (right, untold, elsewhere)] == [True, True, False]
    assert of("argument right", right, untold, elsewhere)["k"] == 2
    assert of("slot or place", right, untold, elsewhere)["k"] == 2
    assert of("median", right)["value"] == pytest.approx((9.0 - 1.1) / 8.0)


def test_what_no_slot_holds_is_scored_on_its_place():
    key = answer("removed", "unlisted-presliding", slot="", argument="")
    assert is_slot_right(outcome(key, law(rising)))
    far = outcome(key, law(rising))
    assert not is_slot_right(replace(far, diagnosis=far.diagnosis | {"place": "load-sensor"}))


def test_a_removed_mechanism_is_recognised_in_the_nearest_law():
    key = answer("removed", "unlisted-constant-drag", slot="", argument="")
    assert of("nearest listed", outcome(key, law(rising)))["k"] == 1
    none = outcome(key, law(rising, nearest_listed=None))
    assert of("nearest listed", none)["k"] == 0
    assert of("nearest listed", outcome(answer(y=rising), law(rising)))["n"] == 0


def test_a_confident_law_of_a_wrong_slot_is_wrong_if_its_model_is():
    key = answer(y=rising)
    wrong = law(rising, slot="load", place="load")
    assert is_confidently_wrong_law(outcome(key, wrong, after=4.0))
    assert not is_confidently_wrong_law(outcome(key, wrong, after=1.5))
    assert not is_confidently_wrong_law(outcome(key, wrong | {"confidence": 0.6}, after=4.0))
    assert not is_confidently_wrong_law(outcome(key, law(rising), after=4.0))
