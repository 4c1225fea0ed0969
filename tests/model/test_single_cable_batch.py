"""A batch of a single cable from its logs to a fit, a diagnosis and a figure: the truth comes back."""

import pytest
import yaml

from ccmodel.config import Study
from ccmodel.diagnosis.run import diagnose
from ccmodel.inference.least_squares import solve
from ccmodel.inference.observations import Observations
from ccmodel.inference.problem import Free, Problem
from ccmodel.model.general import Active
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import simulate_recording
from ccmodel.recording import FAR_ENDS, read_recordings, write_recordings
from ccmodel.rig.ingest import ingest_batch
from ccmodel.studies.diagnosis.page import write_diagnosis
from ccmodel.studies.loops.study import transmission_figure
from single_cable_batches import FRICTION, SPRING, STIFFNESS, write_batch

PULLEY = Active("pulley-friction", "drive-pulley", {"friction_torque": 4e-3, "presliding": 2e-3})


def ingested(folder, far_end, active=()):
    found = ingest_batch(write_batch(folder, far_end, active))
    assert len(found.recordings) == 5
    return found.recordings, Parameters.estimated(found.batch.rig)


@pytest.mark.parametrize("far_end", FAR_ENDS)
def test_a_fit_finds_stiffness_friction_and_spring(tmp_path, far_end):
    recordings, estimates = ingested(tmp_path / far_end, far_end)
    assert {"T1_N", "T2_N"} < recordings[0].channels.keys()
    assert not {"T3_N", "T4_N"} & recordings[0].channels.keys()
    free = {"stiffness_N_per_m": (STIFFNESS, 1e3, 1e5), "friction_coefficient": (FRICTION, 0.01, 1.0)}
    if far_end == "spring":
        free["load_stiffness_Nm_per_rad"] = (SPRING, 1e-3, 10.0)
    observations = [Observations.of(r, estimates, step_s=0.008) for r in recordings]
    prescribed = {"fixed": "theta_out_rad", "measured-motion": "theta_out_rad", "measured-tension": "F_load_N"}
    assert all(prescribed.get(far_end) not in e.channels for e in observations)
    start = {name: Free(estimates.value_of(name), low, high) for name, (_, low, high) in free.items()}
    problem = Problem(observations, start)
    values = problem.values_of(solve(problem, problem.start).x, 0)
    for name, (truth, _, _) in free.items():
        assert values[name] == pytest.approx(truth, rel=0.01), name


@pytest.mark.parametrize("far_end", [pytest.param("spring", marks=pytest.mark.long), "fixed"])
def test_a_diagnosis_agrees_or_names_what_was_left_out(tmp_path, far_end):
    found = diagnose(*ingested(tmp_path / "plain", far_end))
    write_diagnosis(tmp_path / "page.html", found)
    page = (tmp_path / "page.html").read_text()
    assert ">cable</text>" in page
    assert ">cables</text>" not in page
    plain = found.report
    assert plain["verdict"] == "agrees"
    assert "spring_beside_load_Nm_per_rad" not in plain["fit"]["calibrated"]
    seeded = diagnose(*ingested(tmp_path / "seeded", far_end, [PULLEY])).report
    assert seeded["verdict"] == "explained"
    (named,) = seeded["mechanisms"]
    assert (named["name"], named["place"]) == ("pulley-friction", "drive-pulley")
    assert named["parameters"][0]["value"] == pytest.approx(4e-3, rel=0.05)


def test_a_rig_without_load_cells_or_sensors_at_the_far_end(tmp_path):
    """Drive torque alone: the initial tension is not observed, and the tension comes from the torque."""
    folder = write_batch(tmp_path / "bare", "fixed")
    stated = yaml.safe_load((folder / "batch.yaml").read_text())
    for key in ("encoder_counts_per_rev", "torque_constant_Nm_per_A", "load_cell"):
        del stated["rig"]["load"][key]
    del stated["rig"]["drive"]["load_cell"]
    (folder / "batch.yaml").write_text(yaml.safe_dump(stated))
    recordings = ingest_batch(folder).recordings
    assert recordings[0].derived_from["T1_N"] == "tau_in_Nm / 0.006 m"
    assert "T2_N" not in recordings[0]
    simulated = simulate_recording(recordings[0], Parameters.estimated(ingest_batch(folder).batch.rig))
    assert simulated["T1_N"] == pytest.approx(simulated["tau_in_Nm"] / 0.006)


def test_it_is_drawn_and_kept(tmp_path):
    recordings, estimates = ingested(tmp_path / "drawn", "spring")
    file = tmp_path / "recordings.nc"
    write_recordings(file, recordings, {})
    recording = read_recordings(file)[0]
    assert recording.far_end == "spring"
    study = Study(title="one cable", figure="transmission", batches=["drawn"], variable="pretension")
    figure = transmission_figure([(recording, simulate_recording(recording, estimates))], study, 0.02)
    titles = [ax.get_xlabel() for ax in figure.axes if ax.lines and "time" not in ax.get_xlabel()]
    assert len(titles) == 3
    assert not any("cable B" in title for title in titles)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"far_end": None}, "stated together"),
        ({"transmission": "pull-pull"}, "stated together"),
        ({"far_end": "fixed"}, "only there"),
        ({"far_end": "loose"}, "far_end"),
    ],
)
def test_what_does_not_go_together_is_refused(tmp_path, change, message):
    folder = write_batch(tmp_path / "wrong", "spring")
    stated = yaml.safe_load((folder / "batch.yaml").read_text())
    stated["rig"] |= change
    (folder / "batch.yaml").write_text(yaml.safe_dump(stated))
    found = ingest_batch(folder)
    assert found.batch is None
    assert message in " ".join(map(str, found.findings))
