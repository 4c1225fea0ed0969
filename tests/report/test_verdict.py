"""Verdicts in words: numbers, units, directions and places are those of the diagnosis."""

import re

import pytest
from made_pages import BACKLASH, SCALE, diagnosis

from ccmodel import mechanisms
from ccmodel.report.verdict import (
    claim,
    headline,
    nearest_sentence,
    possible_places,
    quantity,
    rounded,
    sentence,
    with_symbols,
)


def gain(value, low, high, place="load-sensor"):
    parameters = [{"name": "gain", "value": value, "low": low, "high": high, "unit": "1"}]
    return {"name": "torque-scale", "place": place, "parameters": parameters}


def test_a_claim_has_number_unit_interval_direction_and_place():
    assert claim(SCALE) == "the load's torque sensor reads 14.8 % high (14.7 to 14.9 %)"
    low = gain(-0.052, -0.055, -0.049, "drive-sensor")
    assert claim(low) == "the drive's torque sensor reads 5.2 % low (4.9 to 5.5 %)"


def test_an_interval_across_zero_keeps_its_signs():
    assert claim(gain(0.01, -0.02, 0.04)).endswith("reads 1 % high (-2 to 4 %)")
    assert claim(gain(-0.01, -0.04, 0.02)).endswith("reads 1 % low (-2 to 4 %)")


def test_a_parameter_that_may_be_neutral_is_said_where_it_is_not():
    def bearing(share, low, high):
        torque = {"name": "friction_torque", "value": 4e-3, "low": 3.9e-3, "high": 4.1e-3, "unit": "N*m"}
        of_pull = {"name": "share", "value": share, "low": low, "high": high, "unit": "1"}
        return claim({"name": "pulley-friction", "place": "load-pulley", "parameters": [torque, of_pull]})

    constant = "the load pulley's bearing has a friction torque of 4.0 mN m (3.9 to 4.1 mN m)"
    assert bearing(0.01, 0.0, 0.03) == constant
    assert bearing(0.8, 0.7, 0.9) == (
        "the load pulley's bearing has a friction torque of 4.0 mN m at a pull of 10 N, 80 % of it in proportion to the"
        " pull (3.9 to 4.1 mN m; 70 to 90 %)"
    )


@pytest.mark.parametrize("name", mechanisms.names())
def test_every_mechanism_has_a_sentence_on_its_own_strengths(name):
    mechanism = mechanisms.get(name)
    fields = set(re.findall(r"\{(\w+)(?::%)?\}", mechanism.sentence)) - {"side"}
    assert {p.name for p in mechanism.strengths} <= fields <= {p.name for p in mechanism.parameters}
    assert ("|" in mechanism.sentence) <= mechanism.strengths[0].signed
    assert set(re.findall(r"\[(\w+):", mechanism.sentence)) <= {p.name for p in mechanism.shapes}
    for place in mechanism.places:
        parameters = [
            {
                "name": p.name,
                "value": value,
                "low": 0.9 * value,
                "high": 1.1 * value,
                "unit": p.unit.replace(" ", "*"),
            }
            # Off the neutral value, so that every clause is said.
            for p, value in ((p, p.at(0.6)) for p in mechanism.parameters)
        ]
        said = claim({"name": name, "place": place, "parameters": parameters})
        assert not set("{}[]|") & set(said)
        assert " ," not in said
        assert "  " not in said
        assert ("{side}" in mechanism.sentence) <= (place.split("-")[0] in said)


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ((0.0301, 0.0292, 0.0309, "rad"), ("30.1 mrad", "29.2 to 30.9 mrad")),
        ((3.04e-3, 2.9e-3, 3.2e-3, "N*m"), ("3.0 mN m", "2.9 to 3.2 mN m")),
        ((2.7e-5, 2.4e-5, 3.0e-5, "m"), ("27 µm", "24 to 30 µm")),
        ((0.87, 0.83, 0.92, "rad"), ("0.87 rad", "0.83 to 0.92 rad")),
        ((1.23e-5, 1.1e-5, 1.3e-5, "kg*m^2"), ("1.2·10⁻⁵ kg m²", "1.1 to 1.3·10⁻⁵ kg m²")),
        ((1.0, 1.0, 1.0, "1"), ("1.00", "1.00 to 1.00")),
        ((0.0, 0.0, 0.0, "N"), ("0.00 N", "0.00 to 0.00 N")),
        ((30.0, 29.9999, 30.0001, "s"), ("30.00 s", "30.00 to 30.00 s")),
        ((2e-6, -3e-3, 3e-3, "N*m"), ("0 mN m", "-3 to 3 mN m")),
        ((3.0, 2.0, 4.0, "1/(rad)"), ("3 1/(rad)", "2 to 4 1/(rad)")),
        ((-0.04, -0.05, -0.03, "log10(m/s)"), ("-0.04 log10(m/s)", "-0.05 to -0.03 log10(m/s)")),
        ((1e-9, -0.5, 0.5, "1"), ("0.0", "-0.5 to 0.5")),
        # Intervals of positive quantities are often longer above.
        ((0.04, 0.011, 0.31, "rad/s"), ("0.04 rad/s", "0.01 to 0.3 rad/s")),
        ((4e-4, 6e-5, 2.1e-3, "m/s"), ("0.4 mm/s", "0.06 to 2 mm/s")),
        ((0.26, 0.03, 0.75, "1"), ("0.3", "0.03 to 0.8")),
        ((-0.26, -0.75, -0.03, "1"), ("-0.3", "-0.8 to -0.03")),
    ],
)
def test_a_quantity_has_the_digits_that_its_interval_leaves(given, shown):
    assert quantity(*given) == shown


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ((9.84e-5, "N*m"), "98 µN m"),
        ((0.0123, "%"), "1.2 %"),
        ((99.7, "N"), "100 N"),
        ((9.07e-4, "rad"), "0.91 mrad"),
        ((0.0, "N"), "0 N"),
    ],
)
def test_a_rounded_value_has_two_digits(given, shown):
    assert rounded(*given) == shown


def test_channels_of_a_text_have_their_symbols():
    said = "tau_in and theta_out are off most; sum_of_tau_inner stays"
    assert with_symbols(said) == "τ_in and θ_out are off most; sum_of_tau_inner stays"


def test_the_places_of_an_undecided_verdict_are_those_of_its_whole_model():
    """Also where some of its mechanisms are certain."""
    likeliest = [BACKLASH, {"name": "kink", "place": "conduit"}]
    found = diagnosis("b", "undecided", mechanisms=[BACKLASH], likeliest=likeliest)
    assert possible_places(found) == ["load-pulley", "conduit"]


@pytest.mark.parametrize(
    ("further", "others", "said"),
    [
        ((), (), "if anything."),
        ((("kink", "conduit"),), (), "if anything: perhaps kink at the conduit."),
        ((), (("drift", "drive-sensor", 0.21),), "if anything: perhaps drift at the drive sensor (0.21)."),
        (
            (("kink", "conduit"), ("running-in", "conduit")),
            (("kink", "conduit", 0.55), ("drift", "drive-sensor", 0.21)),
            "perhaps kink at the conduit (0.55) and running-in at the conduit or drift at the drive sensor (0.21).",
        ),
    ],
)
def test_beside_what_is_certain_the_rest_of_the_likeliest_model_is_said(further, others, said):
    likeliest = [{"name": name, "place": place} for name, place in further]
    alternatives = [{"name": name, "place": place, "confidence": confidence} for name, place, confidence in others]
    found = diagnosis(
        "b", "undecided", mechanisms=[BACKLASH], likeliest=[BACKLASH, *likeliest], alternatives=alternatives
    )
    assert sentence(found).endswith(said)


def test_a_set_of_which_nothing_is_certain_is_said_with_what_else_is_possible():
    likeliest = [{"name": "kink", "place": "conduit"}, {"name": "backlash", "place": "load-pulley"}]
    alternatives = [{"name": "kink", "place": "conduit", "confidence": 0.71}]
    alternatives += [{"name": "drift", "place": "drive-sensor", "confidence": 0.05}]
    found = diagnosis("b", "undecided", mechanisms=[], likeliest=likeliest, alternatives=alternatives)
    assert sentence(found) == (
        "Something is missing, and these recordings do not tell what: best described by kink at the conduit (0.71) and"
        " backlash at the load pulley together; also possible: drift at the drive sensor (0.05)."
    )


def test_each_verdict_has_its_sentence():
    assert "confidence 0.97" in sentence(diagnosis("b", "explained"))
    assert "may be backlash at the load pulley (0.50)" in sentence(diagnosis("b", "undecided"))
    unexplained = "Something is missing, most likely at the load pulley, and no listed mechanism explains it."
    assert sentence(diagnosis("b", "unexplained")) == unexplained
    assert "no missing physics" in sentence(diagnosis("b", "agrees"))
    dead = "The inputs contradict one another. one.csv, tau_in_Nm: is 0 throughout. No model is given."
    assert sentence(diagnosis("b", "inputs-inconsistent")) == dead
    assert sentence(diagnosis("b", None)) == "Not diagnosed: no recording that can be used."


def test_against_a_model_given_a_verdict_is_a_change():
    assert sentence(diagnosis("b", "explained", is_held=True)).startswith("This has changed: the load follows")
    assert "no change" in sentence(diagnosis("b", "agrees", is_held=True))
    assert "Something has changed, most likely at the load pulley" in sentence(
        diagnosis("b", "unexplained", is_held=True)
    )


def test_all_possible_places_of_a_mismatch_are_said():
    location = {"place": "load", "places": ["load", "load-pulley"], "channels": [], "phases": [], "text": ""}
    assert "missing, most likely at the load or the load pulley, and" in sentence(
        diagnosis("b", "unexplained", location=location)
    )


LIMIT = {
    "what": "further candidates",
    "why": "the limit of 9,000 model runs was reached before all of them were fitted",
}
NO_PLACE = {"what": "the place of the mismatch", "why": "the limit was reached before"}


def test_that_the_place_is_found_by_elimination_is_said():
    conduit = {"place": "conduit", "places": ["conduit"], "channels": [], "phases": [], "text": ""}
    said = sentence(diagnosis("b", "unexplained", location=conduit))
    assert (
        said
        == "Something is missing, most likely at the conduit (by elimination), and no listed mechanism explains it."
    )
    several = conduit | {"places": ["conduit", "load"]}
    assert "at the conduit or the load, and" in sentence(diagnosis("b", "unexplained", location=several))


@pytest.mark.parametrize(
    ("not_judged", "where"), [([LIMIT], ", most likely at the load pulley"), ([LIMIT, NO_PLACE], "")]
)
def test_after_a_limit_the_headline_does_not_speak_of_what_was_not_fitted(not_judged, where):
    assert sentence(diagnosis("b", "unexplained", not_judged=not_judged)) == (
        f"Something is missing{where}. The search ended at its limit before all candidates were fitted, and none of"
        " those fitted explains it."
    )


def test_a_place_that_was_not_looked_for_is_not_stated():
    found = diagnosis("b", "unexplained", not_judged=[NO_PLACE])
    assert possible_places(found) == []
    assert sentence(found) == "Something is missing and no listed mechanism explains it."
    found["location"]["place"] = "conduit"
    assert nearest_sentence(found).startswith("Nearest model, not accepted: ")
    assert possible_places(diagnosis("b", "explained", not_judged=[NO_PLACE])) == ["load-pulley"]


def test_two_mechanisms_are_both_said_with_their_confidence():
    said = sentence(diagnosis("b", "explained", mechanisms=[BACKLASH, SCALE]))
    assert said.index("dead zone") < said.index("confidence 0.97; and the load's torque sensor")
    assert said.endswith("confidence 0.99.")
    alike = sentence(diagnosis("b", "explained", mechanisms=[BACKLASH, SCALE | {"confidence": 0.97}]))
    assert alike.count("confidence") == 1
    assert alike.endswith("; confidence 0.97.")


def test_the_headline_says_how_far_the_error_fell():
    assert "of τ_out falls from 6.0 to 1.2 times the noise floor" in headline(diagnosis("b", "explained"))
    assert "falls" not in headline(diagnosis("b", "agrees"))


def headline_of(mean_square, **errors):
    """Headline of errors before and after, over a noise of 1."""
    small = diagnosis("b", "explained")
    small["fit"]["error"] = {c: {"before": b, "after": a, "noise": 1.0} for c, (b, a) in errors.items()}
    small["fit"]["mean_square"] = dict(zip(("calibrated", "extended"), mean_square, strict=True))
    return headline(small)


def test_the_headline_of_a_small_effect_does_not_promise_a_smaller_error():
    said = headline_of((1.11, 1.05), F_load=(3.88, 3.9), tau_in=(1.5, 1.5))
    assert "the held-out error of F_load is 3.9 times the noise floor before and 3.9 after" in said
    assert (
        "The mean square of the residuals, for which this scatter is noise, falls from 1.11 to 1.05 (1: noise)." in said
    )
    assert "is 1.2 times the noise floor before and 1.9 after" in headline_of((1.11, 1.05), F_load=(1.2, 1.9))
    nothing = headline_of((1.04, 1.04), F_load=(1.2, 1.2))
    assert "The held-out error of no channel falls; that of F_load is 1.2" in nothing
    assert "falls from" not in nothing


def test_where_the_worst_error_stays_the_headline_names_the_one_that_falls_most():
    said = headline_of((9.0, 2.0), F_load=(3.9, 3.9), tau_out=(1.2, 1.1), tau_in=(3.5, 1.0))
    assert said.endswith(
        "the held-out error of τ_in falls from 3.5 to 1.0 times the noise floor. That of F_load stays at 3.9 times the"
        " noise floor."
    )
    assert "of F_load falls from 3.9 to 3.5" in headline_of((9.0, 2.0), F_load=(3.9, 3.5), tau_in=(3.5, 1.0))


def test_the_headline_says_in_which_channels_the_error_does_not_fall():
    errors = {"tau_out": (9.0, 1.2), "tau_in": (3.0, 3.0), "F_load": (1.2, 1.9), "theta_out": (1.0, 1.4)}
    said = headline_of((9.0, 2.0), **errors)
    assert said.endswith(
        "of τ_out falls from 9.0 to 1.2 times the noise floor. That of F_load rises from 1.2 to 1.9 and that of τ_in"
        " stays at 3.0 times the noise floor."
    )
    assert "θ_out" not in said
    small = headline_of((1.11, 1.05), F_load=(3.88, 3.9), tau_in=(1.5, 2.5))
    assert "3.9 after. That of τ_in rises from 1.5 to 2.5 times the noise floor. The mean square" in small


def test_the_nearest_model_is_never_said_without_its_label():
    assert nearest_sentence(diagnosis("b", "unexplained")).startswith("Nearest model, not accepted: ")
    assert nearest_sentence(diagnosis("b", "explained")) is None
