"""The typed configuration: what is refused, how, and that its schema file is up to date."""

import json
from pathlib import Path

import pytest

from ccmodel.config import Config, batches_in, expand_studies, load_config
from ccmodel.studies.diagnosis.settings import Diagnosing
from ccmodel.typed import InputError

ROOT = Path(__file__).parents[1]


@pytest.fixture
def edited(tmp_path):
    """The committed configuration with one piece of text replaced."""

    def edit(old, new):
        text = (ROOT / "config/config.yaml").read_text()
        assert old in text
        file = tmp_path / "config.yaml"
        file.write_text(text.replace(old, new, 1))
        return file

    return edit


@pytest.mark.parametrize("name", ["config.yaml", "real.yaml"])
def test_committed_configurations_are_valid(name):
    assert load_config(ROOT / "config" / name).studies


def test_committed_schema_is_that_of_the_typed_config():
    assert json.loads((ROOT / "config/schema.json").read_text()) == Config.model_json_schema()


def test_an_unknown_key_is_refused_with_the_nearest_name(edited):
    file = edited("variable: bend", "varable: bend")
    line = next(n for n, text in enumerate(file.read_text().splitlines(), start=1) if "varable" in text)
    told = f"line {line}: unknown key 'varable' in studies.loops; did you mean 'variable'"
    with pytest.raises(InputError, match=told):
        load_config(file)


def test_an_unknown_parameter_cannot_be_free(edited):
    with pytest.raises(InputError, match="stifness"):
        load_config(edited("stiffness_N_per_m:", "stifness_N_per_m:"))


def test_bounds_the_wrong_way_round_are_refused(edited):
    with pytest.raises(InputError, match=r"friction_coefficient: bounds must be lowest then highest"):
        load_config(edited("[0.01, 0.6]", "[0.6, 0.01]"))


def test_the_simulated_example_is_as_strict(edited):
    with pytest.raises(InputError, match="unknown key 'pretension' in phases; did you mean 'pretension_N'"):
        load_config(edited("pretension_N: 10.0", "pretension: 10.0"))
    with pytest.raises(InputError, match="multiple of 4"):
        load_config(edited("samples_per_cycle: 4000", "samples_per_cycle: 4001"))


def test_a_study_with_unknown_parameters_is_refused(edited):
    with pytest.raises(InputError, match="asks for parameters 'guessed'; there are estimated, fitted"):
        load_config(edited("parameters: estimated", "parameters: guessed"))


def test_a_study_of_a_batch_that_is_not_there_is_refused(edited):
    config = load_config(edited("batches: [loops]", "batches: [lops]"))
    with pytest.raises(InputError, match="studies.loops: there is no batch 'lops'"):
        expand_studies(config, ["half-loop", "loops", "pretension", "radius"])


@pytest.mark.parametrize("key", ["fits", "studies"])
def test_the_name_of_a_fit_or_study_can_be_that_of_a_file(key):
    values = {"fits": TWO_RIGS["fits"]["fitted"], "studies": {"batches": ["a"]}}
    with pytest.raises(ValueError, match=rf"{key}.a/b: becomes the name of a file"):
        two_rigs(**{key: {"a/b": values[key]}})


def test_two_studies_make_no_file_of_one_name():
    each = two_rigs(studies={"s": {"batches": "each"}, "s-a": {"batches": ["a"]}})
    with pytest.raises(InputError, match="studies.s-a: 's-a' is the name of another study"):
        expand_studies(each, BATCHES)
    history = two_rigs(
        studies={"accuracy-history": {"batches": ["a"]}}, baseline={"file": "a.json", "history": "a.csv"}
    )
    with pytest.raises(InputError, match="both make the figure accuracy-history"):
        expand_studies(history, BATCHES)


def test_a_folder_with_a_decomposed_letter_is_a_batch(tmp_path):
    (tmp_path / "pru\u0308f").mkdir()
    assert len(batches_in(tmp_path)[0]) == 1


def test_a_study_of_what_no_diagnosis_finds_is_refused():
    study = {"s": {"batches": ["b"], "parameters": "extended"}}
    with pytest.raises(ValueError, match=r"asks for parameters .extended.; there are estimated \["):
        Config.model_validate({"studies": study})
    config = Config.model_validate({"diagnose": ["a"], "studies": study})
    with pytest.raises(InputError, match=r"studies.s: there are no 'extended' parameters of b: not diagnosed"):
        expand_studies(config, ["a", "b"])


BATCHES = ["a", "b", "c", "alone"]
TWO_RIGS = {
    "rigs": {"one": ["a", "b"], "two": ["c"]},
    "fits": {
        "fitted": {"batches": ["a"], "free": {"friction_coefficient": {"bounds": [0.01, 1]}}},
        "apart": {"batches": "each", "free": {"friction_coefficient": {"bounds": [0.01, 1]}}},
    },
    "diagnose": ["c"],
}


def two_rigs(**changes):
    return Config.model_validate(TWO_RIGS | changes, strict=False)


def test_a_fit_is_used_for_the_batches_of_its_rig_only():
    config = two_rigs()
    of_diagnosis = ["calibrated", "extended", "nearest"]
    assert {batch: config.sets_of(batch) for batch in BATCHES} == {
        "a": ["estimated", "fitted", "apart"],
        "b": ["estimated", "fitted", "apart"],
        "c": ["estimated", "apart", *of_diagnosis],
        "alone": ["estimated", "apart"],
    }
    assert two_rigs(rigs={}).sets_of("alone") == ["estimated", "fitted", "apart"]
    assert config.parameter_sets == ["estimated", "fitted", "apart", *of_diagnosis]


def test_a_study_takes_the_first_fit_of_the_rig_or_else_the_calibrated_model():
    fits = {"fitted": TWO_RIGS["fits"]["fitted"]}
    config = two_rigs(fits=fits, studies={"all": {"batches": BATCHES}}, accuracy={})
    taken = [("", "fitted", "a"), ("", "fitted", "b"), ("", "calibrated", "c"), ("", "estimated", "alone")]
    assert config.studies["all"].needs(config, config.studies, BATCHES) == taken
    assert config.accuracy.needs(config, config.studies, BATCHES) == taken
    of_rig = two_rigs(accuracy={"parameters": "fitted"})
    assert of_rig.accuracy.needs(of_rig, {}, BATCHES) == taken[:2], "batches without the set are left out"


@pytest.mark.parametrize(
    "changes, text",
    [
        ({"rigs": {"one": ["a", "b"], "two": ["b"]}}, "rigs: batch 'b' is listed twice"),
        ({"rigs": {"one": ["a", "d"]}}, "rigs.one: there is no batch 'd' in data/raw; there are a, b, c, alone"),
        ({"diagnosing_by_batch": {"b": {"cycles": 2}}}, "diagnosing_by_batch: 'b' is not diagnosed"),
        ({"diagnose": ["d"], "diagnosing_by_batch": {"d": {}}}, "diagnose: there is no batch 'd'"),
        ({"diagnose": "each", "diagnosing_by_batch": {"d": {}}}, "diagnosing_by_batch: there is no batch 'd'"),
        ({"diagnose_rigs": ["three"]}, "diagnose_rigs: there is no rig 'three'"),
        ({"diagnose_rigs": ["two"]}, "diagnose_rigs: rig 'two' has one batch; name that batch in 'diagnose'"),
        ({"rigs": {"a b": ["a", "b"]}, "diagnose_rigs": "each"}, "rigs.a b: cannot be a folder of results"),
        ({"rigs": {"c": ["a", "b"]}, "diagnose_rigs": "each"}, "rigs.c: is the name of a batch too"),
        ({"diagnosing_by_batch": {"one": {"cycles": 2}}}, "diagnosing_by_batch: 'one' is not diagnosed"),
        ({"fits": {"f": TWO_RIGS["fits"]["fitted"] | {"batches": ["a", "c"]}}}, "fits.f: a, c are not of one rig"),
        (
            {"studies": {"s": {"batches": ["a", "c"], "parameters": "fitted"}}},
            "studies.s: there are no 'fitted' parameters of c: of another rig",
        ),
        *(
            ({"fits": {name: TWO_RIGS["fits"]["fitted"]}}, f"fits.{name}: '{name}' names .*call the fit something else")
            for name in ("estimated", "calibrated", "extended", "nearest")
        ),
    ],
)
def test_rigs_and_names_that_do_not_fit_are_refused(changes, text):
    with pytest.raises((ValueError, InputError), match=text):
        expand_studies(two_rigs(**changes), BATCHES)


def test_rigs_of_several_batches_are_diagnosed_together_if_they_ask_for_it():
    assert two_rigs().diagnosed_rigs == {}
    assert two_rigs(diagnose_rigs="each").diagnosed_rigs == {"one": ["a", "b"]}
    config = two_rigs(diagnose_rigs=["one"], diagnosing={"cycles": 2}, diagnosing_by_batch={"one": {"step_s": 0.04}})
    assert config.diagnosing_of("one") == Diagnosing(cycles=2, step_s=0.04)
    assert expand_studies(config, BATCHES) == {}


def test_a_batch_has_the_settings_of_all_but_for_its_own():
    config = two_rigs(
        diagnose="each",
        diagnosing={"tolerance": 0.02, "cycles": 2},
        diagnosing_by_batch={"c": {"tolerance": {"tau_in_Nm": 0.1}, "step_s": 0.04}},
    )
    assert config.diagnosing_of("a") == config.diagnosing
    own = config.diagnosing_of("c")
    assert (own.tolerance, own.step_s, own.cycles) == ({"tau_in_Nm": 0.1}, 0.04, 2)


def test_a_study_cannot_have_the_name_of_a_judgement():
    with pytest.raises(ValueError, match=r"studies.accuracy: that is the name of another study"):
        Config.model_validate({"studies": {"accuracy": {"batches": ["b"]}}, "accuracy": {}})


def test_each_becomes_a_study_a_batch():
    config = Config.model_validate({"studies": {"load": {"batches": "each"}}})
    assert {n: s.batches for n, s in expand_studies(config, ["a", "b"]).items()} == {"load-a": ["a"], "load-b": ["b"]}


def test_every_visible_folder_is_a_batch_or_named_as_none(tmp_path):
    for name in ("b", "a", ".git", "my batch", "b{x}"):
        (tmp_path / name).mkdir()
    names, unusable = batches_in(tmp_path)
    assert names == ["a", "b"]
    assert len(unusable) == 2
    assert "my batch: a name is" in unusable[1]


def test_a_folder_without_batches_is_refused(tmp_path):
    with pytest.raises(InputError, match="no batch here"):
        batches_in(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("  bend: loops\n", "  bend: lops\n", "claims.bend: 'lops' is no study"),
        ("  bend: loops\n", "  bend: radius\n", "claims.bend: study 'radius' varies radius"),
        ("slack_below_N", "slack_bellow_N", "did you mean 'slack_below_N'"),
        ("coverage_factor: 2.0", "coverage_factor: 0", "coverage_factor: must be above 0"),
        ("  coverage: 0.9\n  coverage_factor", "  parameters: guess\n  coverage_factor", "parameters 'guess'"),
    ],
)
def test_claims_and_accuracy_that_cannot_be_judged_are_refused(edited, old, new, said):
    with pytest.raises(InputError, match=said):
        load_config(edited(old, new))


FIT = {"batches": ["b"], "free": {"stiffness_N_per_m": {"bounds": [1e3, 1e5]}}}


@pytest.mark.parametrize(
    "change, text",
    [
        (
            {"free": {"tau_in_zero_Nm": {"bounds": [-1, 1]}}, "per_recording": {"tau_in_zero_Nm": {"spread": 1}}},
            "either",
        ),
        ({"per_recording": {"friction_scale": {"spread": 0.01, "bounds": [2, 1]}}}, "lowest then highest"),
        ({"per_recording": {"friction_scale": {"spread": 0}}}, "greater than 0"),
        ({"profile": ["friction_coefficient"]}, "friction_coefficient is not free"),
    ],
)
def test_a_fit_that_makes_no_sense_is_refused(change, text):
    Config.model_validate({"fits": {"f": FIT}}, strict=False)
    with pytest.raises(ValueError, match=text):
        Config.model_validate({"fits": {"f": FIT | change}}, strict=False)


def test_former_names_of_keys_are_read_and_said(tmp_path):
    file = tmp_path / "config.yaml"
    text = (ROOT / "config" / "real.yaml").read_text()
    text = text.replace("  cycles: 1", "  forced_candidates: [[kink at conduit]]\n  cycles: 1")
    (tmp_path / "present.yaml").write_text(text)
    file.write_text(text.replace("tolerance:", "allowance:").replace("forced_candidates:", "suspects:"))
    with pytest.warns(FutureWarning, match="'suspects' is now called 'forced_candidates'"):
        assert load_config(file) == load_config(tmp_path / "present.yaml")
