"""The typed configuration: what is refused, how, and that its schema file is up to date."""

import json
from pathlib import Path

import pytest

from ccmodel.config import Config, batches_in, expand_studies, load_config
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


def test_a_study_of_what_no_diagnosis_finds_is_refused():
    study = {"s": {"batches": ["b"], "parameters": "extended"}}
    with pytest.raises(ValueError, match=r"asks for parameters .extended.; there are estimated \["):
        Config.model_validate({"studies": study})
    config = Config.model_validate({"diagnose": ["a"], "studies": study})
    with pytest.raises(InputError, match="studies.s: 'extended' parameters of b, which no one diagnoses"):
        expand_studies(config, ["a", "b"])


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
    assert "my batch: a batch's name is" in unusable[1]


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
    file.write_text(text.replace("tolerance:", "allowance:").replace("forced_candidates:", "suspects:"))
    with pytest.warns(FutureWarning, match="'suspects' is now called 'forced_candidates'"):
        assert load_config(file) == load_config(ROOT / "config" / "real.yaml")
