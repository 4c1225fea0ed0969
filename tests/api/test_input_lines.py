"""Inputs that cannot be used are refused in a line that says what is wrong."""

import gzip
import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import ccmodel as cc
from builders import write_batch

MOTION = pd.DataFrame({"time_s": [0.0, 0.1, 0.2], "theta_in_rad": [0.0, 0.1, 0.2]})


def spoilt(**columns):
    return MOTION.assign(**columns)


@pytest.mark.parametrize(
    "motion, line",
    [
        (MOTION.drop(columns="theta_in_rad"), "motion: no column theta_in_rad; the columns are time_s"),
        (MOTION.rename(columns={"time_s": "t"}), "motion: no column time_s; the columns are t, theta_in_rad"),
        (spoilt(time_s=[0.0, 0.2, 0.1]), "motion: row 2: time_s does not increase: 0.1 after 0.2"),
        (spoilt(theta_in_rad=[0.0, np.nan, 0.1]), "motion: row 1: theta_in_rad is empty"),
        (spoilt(theta_in_rad=["a", "b", "c"]), "motion: row 0: theta_in_rad is no finite number: 'a'"),
        (MOTION[:0], "motion: no samples"),
        (xr.Dataset({"angle": ("time_s", [0.0, 1.0])}, {"time_s": [0.0, 1.0]}), "motion: no column theta_in_rad"),
        ([0.0, 1.0], "motion: a DataFrame, a Dataset, a Recording or a CSV file; got list"),
    ],
)
def test_a_motion_that_cannot_be_simulated_is_refused_by_name(fitted, motion, line):
    with pytest.raises(cc.InputError, match=line):
        cc.simulate(fitted.model, motion)


@pytest.mark.parametrize(
    "text, line",
    [
        (
            "time_s;theta_in_rad\n0;0\n1;1\n",
            "its columns are separated by ';'; use commas, and decimal points in numbers",
        ),
        (
            "time_s;theta_in_rad\n0;0\n0,1;0,25\n",
            "its columns are separated by ';'; use commas, and decimal points in numbers",
        ),
        (
            "time_s\ttheta_in_rad\n0\t0\n",
            "its columns are separated by tabs; use commas, and decimal points in numbers",
        ),
        ("time_s,theta_in_rad\n0,0\n1,\n2,1\n", "row 3: theta_in_rad is empty"),
        ("time_s,theta_in_rad\n0,0\n\n2,1\n", "row 3: time_s is empty"),
        ("time_s,theta_in_rad\n0,0\n1,inf\n", "row 3: theta_in_rad is no finite number: 'inf'"),
        ("time_s,theta_in_rad\n0,0\n1,one\n", "row 3: theta_in_rad is no finite number: 'one'"),
        ("time_s,theta_in_rad\n0,0\n0,1\n", "row 3: time_s does not increase: 0 after 0"),
        ("time_s,theta_in_rad\n", "no samples"),
        ("", "is empty; a motion is a CSV with the columns time_s and theta_in_rad"),
        (
            "time_s,theta_in_rad,x\n0,0.5,0.1,9\n1,0.6,0.2,9\n",
            "a motion is a CSV with the columns time_s and theta_in_rad; its rows have more cells than its header",
        ),
        ("t,angle\n0,0\n", "no column time_s and no theta_in_rad; the columns are t, angle"),
    ],
)
def test_a_file_of_a_motion_is_refused_with_its_row(fitted, tmp_path, text, line):
    file = tmp_path / "motion.csv"
    file.write_text(text)
    with pytest.raises(cc.InputError) as refused:
        cc.simulate(fitted, file)
    assert str(refused.value) == f"{file}: {line}"


def test_blank_lines_at_the_end_of_a_motion_do_not_matter(fitted, tmp_path):
    file = tmp_path / "motion.csv"
    file.write_text(MOTION.to_csv(index=False) + "\n\n")
    assert cc.simulate(fitted, file).time_s.size == len(MOTION)


@pytest.mark.parametrize("given, line", [(None, "got None"), ("first", "got a Recording alone"), (3, "got int")])
def test_what_is_no_batch_is_named(batch, given, line):
    given = batch.recordings[0] if given == "first" else given
    with pytest.raises(cc.InputError, match=f"batch: a Batch or its folder; {line}"):
        cc.fit(given)


def test_swapped_arguments_are_recognised(fitted, batch):
    with pytest.raises(cc.InputError, match="model: a Model, .* comes first; got Batch"):
        cc.predict(batch, fitted.model)
    with pytest.raises(cc.InputError, match="model: .* comes first; got DataFrame"):
        cc.simulate(MOTION, fitted.model)
    with pytest.raises(cc.InputError, match="batch: a Batch or its folder; got Model"):
        cc.predict(fitted.model, fitted.model)


@pytest.mark.parametrize("pretension_N", ["x", -1.0, float("nan"), float("inf")])
def test_a_pretension_that_is_none_is_refused(fitted, pretension_N):
    with pytest.raises(cc.InputError, match="pretension_N: a tension that is not negative, N; got"):
        cc.simulate(fitted, MOTION, pretension_N=pretension_N)


def test_a_step_that_leaves_few_samples_is_refused(batch):
    for work in (cc.fit, cc.diagnose):
        with pytest.raises(cc.InputError, match="step_s: 100 s leaves 1 of the 625 samples of t-7N; 20 are needed"):
            work(batch, step_s=100.0)


def test_a_channel_that_is_not_there_is_named(batch):
    with pytest.raises(cc.InputError, match="known/t-7N: no channel 'tau_in'; did you mean 'tau_in_Nm'"):
        batch["t-7N"]["tau_in"]
    with pytest.raises(cc.InputError, match="no channel 'x'; there is theta_in_rad, "):
        batch["t-7N"]["x"]


def test_a_mechanism_that_a_model_does_not_have_is_named(fitted):
    with pytest.raises(cc.InputError, match="no mechanism 'kink'; there is none"):
        fitted.model.without("kink")


def test_an_old_model_file_needs_the_batch(fitted, batch, tmp_path):
    content = fitted.model.as_dict()
    del content["rig"]
    file = tmp_path / "old.json"
    file.write_text(json.dumps(content))
    with pytest.raises(cc.InputError, match="state a batch too"):
        cc.simulate(file, MOTION)
    by_batch = cc.simulate(file, MOTION, batch=batch)
    assert np.array_equal(by_batch["T1_N"], cc.simulate(fitted.model, MOTION)["T1_N"])


def test_what_is_not_there_is_named(fitted, batch, tmp_path):
    with pytest.raises(cc.InputError, match="did you mean 't-7N'"):
        batch["t-7"]
    with pytest.raises(cc.InputError, match="recording: the model knows t-7N, t-6N, t-5N; got x"):
        cc.simulate(fitted.model, MOTION, recording="x")
    with pytest.raises(cc.InputError, match="there is no such folder"):
        cc.load(tmp_path / "nothing")
    with pytest.raises(cc.InputError, match="there is no such file"):
        cc.read_model(tmp_path / "nothing.json")


@pytest.mark.parametrize(
    "options, line",
    [
        ({"free": ["stifness"]}, "stifness cannot be fitted to these recordings; stiffness_N_per_m, friction"),
        ({"free": []}, "nothing to fit"),
        ({"tolerance": 2.0}, "tolerance: Input should be less than 0.5"),
        ({"tolerance": {"torque": 0.1}}, "tolerance: "),
        ({"step_s": -1.0}, "step_s: Input should be greater than 0"),
        ({"cycles": 0}, "cycles: Input should be greater than or equal to 1"),
    ],
)
def test_options_of_a_fit_that_cannot_be_used_are_named(batch, options, line):
    with pytest.raises(cc.InputError, match=line):
        cc.fit(batch, **options)


@pytest.mark.parametrize(
    "options, line",
    [
        ({"without": ["rust"]}, "without: .*rust"),
        (
            {"candidates": ["kink at nowhere"]},
            "candidates: 'kink at nowhere' is at none of its places; state 'kink at conduit'",
        ),
        ({"candidates": "kink"}, "candidates: 'kink' is at none of its places; state 'kink at conduit'"),
        ({"candidates": "rust at conduit"}, "candidates: there is no mechanism 'rust at conduit'"),
        ({"freeze": True}, "freeze: there is no baseline to freeze"),
    ],
)
def test_options_of_a_diagnosis_that_cannot_be_used_are_named(batch, options, line):
    with pytest.raises(cc.InputError, match=line):
        cc.diagnose(batch, **options)


def test_a_folder_that_cannot_be_written_is_refused_before_the_work(batch, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(cc.InputError, match="cannot be made: .* is a file"):
        cc.diagnose(batch, tmp_path / "file" / "out")


def test_a_refused_diagnosis_leaves_no_folder(batch, tmp_path):
    with pytest.raises(cc.InputError, match="freeze"):
        cc.diagnose(batch, tmp_path / "out", freeze=True)
    with pytest.raises(cc.InputError, match="there is no such file"):
        cc.diagnose(batch, tmp_path / "out", baseline=tmp_path / "nothing.json")
    assert not (tmp_path / "out").exists()


def test_a_file_is_written_into_folders_that_are_made(fitted, tmp_path):
    fitted.save(tmp_path / "a" / "b" / "fit.json")
    fitted.model.save(tmp_path / "c" / "model.json")
    assert cc.read_model(tmp_path / "a/b/fit.json").parameters == cc.read_model(tmp_path / "c/model.json").parameters


def test_a_place_that_cannot_be_written_is_an_input_error(fitted, found, tmp_path):
    (tmp_path / "file").write_text("")
    for one in (fitted, fitted.model, found, cc.predict(fitted.model, fitted.batch)):
        with pytest.raises(cc.InputError, match="file.*: cannot be written"):
            one.save(tmp_path / "file" / "out")


@pytest.fixture(scope="module")
def contradictory(tmp_path_factory):
    """A batch of which one recording's load torque reads the same throughout."""
    folder = write_batch(tmp_path_factory.mktemp("raw") / "dead", pretensions=(7.0, 6.0))
    file = folder / "t-6N.csv.gz"
    table = pd.read_csv(file).assign(load_current_A=1.0)
    with gzip.open(file, "wt") as f:
        table.to_csv(f, index=False)
    return cc.load(folder)


def test_inputs_that_contradict_one_another_are_not_fitted(contradictory):
    assert contradictory.contradicts
    assert "inconsistent: " in repr(contradictory)
    with pytest.raises(cc.InputError, match="load_current_A.*\n.*trust_inputs=True"):
        cc.fit(contradictory)
    assert cc.fit(contradictory, trust_inputs=True).succeeded


def test_inputs_that_contradict_one_another_have_a_verdict_of_their_own(contradictory, tmp_path):
    found = cc.diagnose(contradictory, tmp_path / "out")
    assert found.verdict == "inputs-inconsistent"
    assert found.confidence == pytest.approx(1.0, abs=0.1)
    assert found.model is found.calibrated is found.nearest is None
    assert found.to_frame().empty
    assert "contradict" in found._repr_html_()
    with pytest.raises(cc.InputError, match="no model was fitted"):
        found.plot()
    with pytest.raises(cc.InputError, match="no model was fitted.*; verdict: inputs-inconsistent"):
        cc.simulate(found, MOTION)
    with pytest.raises(cc.InputError, match="holds no model"):
        cc.read_model(tmp_path / "out" / "model.json")
