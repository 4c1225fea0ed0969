"""What a rig has beside what was said of it."""

import json

import pytest
from made_pages import BACKLASH, SCALE, content, diagnosis

from ccmodel.report.page import write_page
from ccmodel.report.page.concealed import beside, read_concealed
from ccmodel.typed import InputError

EFFECTS = [
    {"name": "backlash", "place": "load-pulley", "text": "half gap 30 mrad", "source": "a <data sheet>"},
    {"name": "torque-scale", "place": "drive-sensor", "text": "gain 5 %", "source": ""},
    {"name": None, "place": None, "text": "inertia of the cable", "source": ""},
]

SIZE = "30.1 mrad (29.2 to 30.9 mrad)"
IDENTIFIED = f"identified: {SIZE}"
NOTHING = "no mechanism describes it"
# As diagnosis.json states an alternative: without its parameters.
ALTERNATIVE = {"name": "torque-scale", "place": "load-sensor", "confidence": 0.2}


@pytest.fixture
def concealed(tmp_path):
    def write(effects=EFFECTS, batches=("b",), **changed):
        file = tmp_path / "concealed.json"
        rigs = [{"batches": list(batches), "effects": effects}]
        file.write_text(json.dumps({"format": 1, "rigs": rigs} | changed))
        return read_concealed(file)

    return write


@pytest.mark.parametrize(
    ("said", "of_backlash", "of_scale"),
    [
        ({"verdict": "explained"}, IDENTIFIED, "not identified"),
        ({"verdict": "explained", "alternatives": [ALTERNATIVE]}, IDENTIFIED, "alternative, but at the load sensor"),
        ({"verdict": "unexplained"}, f"in the nearest model, not accepted: {SIZE}", "not identified"),
        ({"verdict": "agrees"}, "not identified", "not identified"),
        ({"verdict": "inputs-inconsistent"}, "–", "–"),
        ({"verdict": None}, "–", "–"),
    ],
)
def test_each_effect_has_what_was_said_of_it(concealed, said, of_backlash, of_scale):
    (table,) = beside(concealed(), [diagnosis("b", **said)])
    assert [e["said"][0] for e in table["effects"][:2]] == [of_backlash, of_scale]


def test_the_same_effect_at_two_places_is_named_at_each_by_itself(concealed):
    effects = [EFFECTS[1] | {"place": place} for place in ("drive-sensor", "load-sensor")]
    (table,) = beside(concealed(effects), [diagnosis("b", "explained", mechanisms=[SCALE])])
    assert [e["said"] for e in table["effects"]] == [["not identified"], ["identified: 0.148 (0.147 to 0.149)"]]


@pytest.mark.parametrize(
    ("effects", "distance", "said", "besides"),
    [
        ([(None, "drive-pulley"), (None, "load")], 9.0, ["learned: bearing-torque by drive-angle", NOTHING], "–"),
        ([(None, None)], 9.0, ["learned: bearing-torque by drive-angle"], "–"),
        ([(None, "load")], 9.0, [NOTHING], "bearing-torque by drive-angle"),
        # Within its uncertainty it is the law of a listed mechanism.
        ([("torque-scale", "drive-pulley")], 0.5, ["learned: bearing-torque by drive-angle"], "–"),
        ([(None, "drive-pulley")], 0.5, [NOTHING], "bearing-torque by drive-angle"),
    ],
)
def test_a_law_is_said_of_the_effect_that_it_is(concealed, effects, distance, said, besides):
    law = {"slot": "bearing-torque", "place": "drive-pulley", "arguments": ["drive-angle"]}
    law |= {"nearest_listed": {"name": "torque-scale", "distance": distance, "limit": 1.3}}
    rig = [{"name": name, "place": place, "text": "cogging"} for name, place in effects]
    (table,) = beside(concealed(rig), [diagnosis("b", "learned", mechanisms=[], laws=[law])])
    assert [e["said"][0] for e in table["effects"]] == said
    assert table["besides"] == [besides]


def test_the_law_of_a_mechanism_with_one_place_is_its_own_wherever_it_stands(concealed):
    """Friction by cable stands at the conduits; the mechanism of cables that differ at the cable."""
    law = {"slot": "sliding-friction", "place": "conduit", "arguments": ["cable"]}
    law |= {"nearest_listed": {"name": "cable-asymmetry", "distance": 0.0, "limit": None}}
    rig = [{"name": "cable-asymmetry", "place": "cable", "text": "a rough cable"}]
    (table,) = beside(concealed(rig), [diagnosis("b", "learned", mechanisms=[], laws=[law])])
    assert table["effects"][0]["said"] == ["learned: sliding-friction by cable"]
    assert table["besides"] == ["–"]


def test_what_was_identified_and_is_not_there_is_said(concealed):
    (table,) = beside(concealed(EFFECTS[1:]), [diagnosis("b", "explained", mechanisms=[BACKLASH, SCALE])])
    assert table["besides"] == ["backlash"]


def test_what_is_left_is_said_with_the_model_that_leaves_it(concealed):
    verdicts = {"b": "explained", "c": "unexplained", "d": "agrees", "f": "inputs-inconsistent"}
    said = [diagnosis(batch, verdict) for batch, verdict in verdicts.items()]
    (table,) = beside(concealed(batches=["b", "c", "d", "f", "e"]), said)
    assert table["falls"] == [
        "τ_out: 6.0 to 1.2 times the noise floor (model: extended)",
        "τ_out: 6.0 to 1.2 times the noise floor (model: nearest (not accepted))",
        "τ_out: 6.0 times the noise floor",
        "–",
        "–",
    ]
    assert table["verdicts"][-1] == "not diagnosed"


def test_the_page_shows_it_only_where_it_is_stated(concealed, tmp_path):
    for given, there in ((concealed(), True), (None, False)):
        write_page(tmp_path / "index.html", content(diagnosis("b", "agrees"), concealed=given))
        text = (tmp_path / "index.html").read_text()
        assert ("What was concealed, and what was said" in text) == there
        assert ("a &lt;data sheet&gt;" in text) == there


def test_a_file_of_another_format_is_one_line(concealed):
    with pytest.raises(InputError, match=r"concealed\.json, line 1: format: must be at most 1") as error:
        concealed(format=2)
    assert "\n" not in str(error.value)


def test_what_was_said_of_all_batches_together_is_a_column_of_its_own(concealed):
    said = [diagnosis("b", "undecided"), diagnosis("bench", "explained", batches=["b", "c"])]
    (table,) = beside(concealed(batches=("b", "c")), said)
    assert table["columns"] == ["b", "c", "bench (2 batches together)"]
    assert table["effects"][0]["said"][2] == IDENTIFIED
