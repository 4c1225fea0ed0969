"""Model files: a model comes back as it was written, and keys keep the names that the format gave them."""

import json
from dataclasses import fields

import pytest

from ccmodel.model.files import model_as_dict, read_model_file
from ccmodel.model.general.run import Active
from ccmodel.model.parameters import Parameters
from ccmodel.typed import InputError

FORMAT_KEYS = {"drive_place": 0.3, "load_place": -0.5, "profile_bow_A": 0.1, "profile_bow_B": -0.2}
MODEL = Parameters(
    9000.0,
    1.2,
    0.15,
    0.006,
    0.006,
    drive_encoder_offset=0.3,
    load_gap_position=-0.5,
    tension_curvature_A=0.1,
    tension_curvature_B=-0.2,
    mechanisms=(Active("backlash", "load-pulley", {"half_gap": 0.02}),),
)


def write(path, model=MODEL, **changed):
    content = model_as_dict(model, {})
    path.write_text(json.dumps(content | {"parameters": content["parameters"] | changed}))
    return path


def test_a_model_comes_back_as_it_was_written(tmp_path):
    assert read_model_file(write(tmp_path / "model.json")).parameters == MODEL


def test_keys_of_the_format_stay(tmp_path):
    """Files of before have these keys, and programs of others read them."""
    written = json.loads(write(tmp_path / "model.json").read_text())["parameters"]
    assert {key: written[key] for key in FORMAT_KEYS} == FORMAT_KEYS
    names = {f.name for f in fields(Parameters)} - {"mechanisms", "refinement", "session_start_s", "session_end_s"}
    assert len(written) == len(names)


def test_an_unknown_key_is_refused_by_name(tmp_path):
    with pytest.raises(InputError, match="stifness"):
        read_model_file(write(tmp_path / "model.json", stifness=1.0))


def test_a_required_value_is_not_null(tmp_path):
    with pytest.raises(InputError, match=r"parameters\.stiffness_N_per_m: null; a number is needed"):
        read_model_file(write(tmp_path / "model.json", stiffness_N_per_m=None))
    assert read_model_file(write(tmp_path / "model.json", pretension_N=None)).parameters == MODEL


@pytest.mark.parametrize("name", ["load_radius_m", "drive_radius_m"])
@pytest.mark.parametrize("value", [1e300, 1e-300, float("inf")])
def test_a_value_that_overflows_is_named(tmp_path, name, value):
    with pytest.raises(InputError, match=f"parameters.{name}"):
        read_model_file(write(tmp_path / "model.json", **{name: value}))


@pytest.mark.parametrize("name", ["stiffness_N_per_m", "reference_length_m"])
def test_a_cable_without_stiffness_or_length_is_named(tmp_path, name):
    for value in (-5.0, 0.0):
        with pytest.raises(InputError, match=rf"model\.json: parameters\.{name}: {value:g} is no value of a rig"):
            read_model_file(write(tmp_path / "model.json", **{name: value}))


def test_a_value_may_be_as_small_as_a_fit_leaves_it(tmp_path):
    read = read_model_file(write(tmp_path / "model.json", tau_in_zero_Nm=-1e-18, pretension_N=0.0)).parameters
    assert (read.tau_in_zero_Nm, read.pretension_N) == (-1e-18, 0.0)


def test_a_file_that_is_far_too_large_is_not_read(tmp_path):
    with open(tmp_path / "model.json", "wb") as file:
        file.truncate(1_500_000_000)
    with pytest.raises(InputError, match="larger than 50 MB"):
        read_model_file(tmp_path / "model.json")


def test_a_value_that_is_missing_is_named(tmp_path):
    content = json.loads(write(tmp_path / "model.json").read_text())
    del content["parameters"]["friction_coefficient"]
    (tmp_path / "model.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="parameters: no friction_coefficient; a model needs it"):
        read_model_file(tmp_path / "model.json")
