"""Cards: their order, their origin, and what they must not leave unsaid."""

from made_pages import ERROR, SCALE, diagnosis, summary

from ccmodel.report.page.cards import cards, mechanisms_named, overview


def made(*verdicts, measured=()):
    diagnoses = [diagnosis(f"b-{verdict}", verdict) for verdict in verdicts]
    origins = {name: "rig" for name in measured}
    batches = [summary(d["batch"], origins.get(d["batch"], "virtual-rig")) for d in diagnoses]
    return cards(batches, diagnoses)


def larger(factor):
    return {c: e | {"before": factor * e["before"]} for c, e in ERROR.items()}


def test_measured_batches_come_first_and_then_the_largest_mismatch():
    small, large = (diagnosis(name, "explained") for name in ("small", "large"))
    large["fit"] = large["fit"] | {"error": larger(3.0)}
    real = diagnosis("real", "agrees")
    batches = [summary("silent"), summary("small"), summary("large"), summary("real", "rig")]
    assert [c["batch"] for c in cards(batches, [small, large, real])] == ["real", "large", "small", "silent"]


def test_a_simulated_batch_is_called_simulated_beside_a_measured_one():
    found = {c["batch"]: c["origin"] for c in made("explained", "agrees", measured=["b-agrees"])}
    assert found == {"b-explained": "simulated", "b-agrees": "measured"}


def test_a_refused_batch_has_a_card_that_says_so():
    refused = {"folder": "data/raw/broken", "batch": None, "recordings": [], "findings": []}
    (card,) = cards([refused], [diagnosis("broken", None)])
    assert (card["origin"], card["sentence"]) == (
        "no usable recording",
        "Not diagnosed: no recording that can be used.",
    )


def test_under_unexplained_the_errors_after_are_the_nearest_models():
    (card,) = made("unexplained")
    assert card["after_is"] == "nearest (not accepted)"
    assert [round(row["after"], 2) for row in card["rows"]] == [1.2, 1.0]


def test_a_diagnosis_of_before_this_page_has_no_errors_of_its_nearest_model():
    old = diagnosis("b", "unexplained")
    del old["nearest"]["error"]
    (card,) = cards([summary("b")], [old])
    assert card["after_is"] == ""
    assert card["rows"][0]["after"] is None


def test_agrees_with_an_error_above_the_noise_is_explained():
    (card,) = made("agrees")
    assert card["caution"].startswith("τ_out and θ_out: above the noise floor")
    quiet = diagnosis("b", "agrees")
    quiet["fit"]["error"] = {"tau_in": {"before": 1.1e-3, "after": 1.1e-3, "noise": 1e-3, "unit": "N*m"}}
    assert cards([summary("b")], [quiet])[0]["caution"] is None


def test_what_an_accepted_model_leaves_above_the_noise_is_said():
    assert made("explained")[0]["caution"] is None
    worse = diagnosis("b", "explained")
    worse["fit"]["error"] = ERROR | {"theta_out": ERROR["theta_out"] | {"after": 4e-3}}
    (card,) = cards([summary("b")], [worse])
    assert (
        card["caution"] == "Not all is accounted for: up to 4.0 times the noise floor is left, in the load angle θ_out."
    )


def test_the_overview_tells_measured_from_simulated_and_says_how_far_the_errors_fall():
    measured, simulated = overview(made("explained", "unexplained", "agrees", measured=["b-unexplained"]))
    assert measured.startswith("Measured, batch b-unexplained: unexplained. Largest")
    assert measured.endswith("6.0 → 1.2 (nearest model, not accepted).")
    assert simulated.startswith("Simulated, 2 batches: 1 explained and 1 agrees.")
    assert simulated.endswith("Largest held-out error over noise: 6.0 → 1.2 (extended model, b-explained).")
    assert overview(made("agrees")) == ["Simulated, batch b-agrees: agrees."]
    assert overview([]) == []
    assert overview(made(None)) == ["No batch has been diagnosed."]


def test_explained_with_more_than_noise_left_is_called_in_part():
    worse = diagnosis("b", "explained")
    worse["fit"]["error"] = ERROR | {"theta_out": ERROR["theta_out"] | {"after": 4e-3}}
    (card,) = cards([summary("b")], [worse])
    assert (card["verdict"], card["shown_verdict"]) == ("explained", "explained in part")
    assert "batch b: explained in part." in overview([card])[0]
    assert made("explained")[0]["shown_verdict"] == "explained"


def test_the_fall_is_that_of_the_largest_error_of_any_channel():
    worse = diagnosis("b", "explained")
    worse["fit"]["error"] = ERROR | {"theta_out": ERROR["theta_out"] | {"after": 4e-3}}
    (card,) = cards([summary("b")], [worse])
    assert "6.0 → 4.0" in overview([card])[0]
    assert card["largest"] == {"before": card["rows"][0]["before"], "after": 4.0}


def test_the_fall_of_several_batches_is_the_median():
    found = [diagnosis(f"b{k}", "explained") for k in range(3)]
    for d, before, after in zip(found, (6.0, 9.0, 60.0), (1.2, 1.5, 1.8), strict=True):
        d["fit"] = d["fit"] | {"error": {"tau_out": {"before": before, "after": after, "noise": 1.0, "unit": "N*m"}}}
    (line,) = overview(cards([summary(d["batch"]) for d in found], found))
    assert line.endswith("9.0 → 1.5 (extended model, median of 3).")


def test_the_overview_says_held_out_of_held_out_recordings_alone():
    (card,) = made("explained")
    assert "Largest held-out error over noise" in " ".join(overview([card | {"held_out": 3}]))
    assert "Largest error over noise" in " ".join(overview([card | {"held_out": 0}]))


def test_contradictory_inputs_stand_first_and_have_no_errors():
    first, second = made("explained", "inputs-inconsistent")
    assert (first["shown_verdict"], first["rows"], first["mechanisms"]) == ("inputs inconsistent", [], [])
    assert first["sentence"].endswith("one.csv, tau_in_Nm: is 0 throughout. No model is given.")
    assert second["verdict"] == "explained"
    (line,) = overview([first, second])
    assert line.startswith("Simulated, 2 batches: 1 explained and 1 inputs inconsistent.")


def test_every_mechanism_that_anything_names_is_listed():
    asked = [
        diagnosis("a", "explained", alternatives=[SCALE]),
        diagnosis("b", "unexplained"),
        diagnosis("c", None),
    ]
    assert mechanisms_named(asked) == ["backlash", "torque-scale"]


def test_batches_that_are_diagnosed_together_have_a_card_of_their_rig():
    batches = [summary("a"), summary("b"), summary("other")]
    found = [diagnosis("a", "undecided"), diagnosis("b", "undecided")]
    rig = diagnosis("bench", "explained", batches=["a", "b"])
    rig["fit"] = rig["fit"] | {"error": larger(3.0)}
    every = cards(batches, [*found, rig])
    assert [c["batch"] for c in every] == ["bench", "a", "b", "other"]
    assert (every[0]["recordings"], every[0]["together"]) == (2, ["a", "b"])
    said = overview(every)
    assert said[0].startswith("Simulated, 2 batches: 2 undecided.")
    assert said[1].startswith("Rig bench, its 2 batches together: explained")
    failed = {"batch": "bench", "batches": ["a", "b"], "verdict": None, "why": "they are not of one rig"}
    assert "they are not of one rig" in next(c for c in cards(batches, [failed]) if c["together"])["sentence"]
