import json

import pytest
import yaml
from made_up_batch import description

from ccmodel.recording import read_recordings, write_recordings
from ccmodel.rig.batch import Batch, load_batch
from ccmodel.rig.ingest import ingest_batch
from ccmodel.typed import InputError

PIECES = [{"length_m": 0.4, "bend_rad": 0.0}, {"length_m": 0.8, "bend_rad": 3.1416}]


def shared(bench, **defaults):
    """The bench with these defaults, which its recordings do not state."""
    bench.described["defaults"] = defaults
    for entry in bench.described["recordings"]:
        for key in defaults:
            entry.pop(key, None)
    return bench


def problems(bench):
    with pytest.raises(InputError) as raised:
        load_batch(bench.write().folder)
    return [(problem.line, problem.text) for problem in raised.value.problems]


def test_recordings_have_the_defaults_that_they_do_not_state(bench):
    plain = ingest_batch(bench.write().folder)
    shared(bench, pretension_N=3.5, conduit=PIECES)
    for entry in bench.described["recordings"]:
        assert set(entry) == {"id", "file"}
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    assert [r.pretension_N for r in ingested.recordings] == [3.5, 3.5]
    assert [r.path.bend_rad for r in ingested.recordings] == [r.path.bend_rad for r in plain.recordings]
    assert ingested.batch.recordings == plain.batch.recordings


def test_an_own_key_replaces_the_whole_default(bench):
    shared(bench, excitation={"wave": "sine", "frequency_Hz": 0.5}, settled_s=0.2, note="warm")
    bench.described["recordings"][1] |= {"excitation": {"wave": "chirp"}, "settled_s": 0.0}
    one, two = load_batch(bench.write().folder).recordings
    assert (one.excitation, one.settled_s, one.note) == ({"wave": "sine", "frequency_Hz": 0.5}, 0.2, "warm")
    assert (two.excitation, two.settled_s, two.note) == ({"wave": "chirp"}, 0.0, "warm")


def test_a_summary_of_a_batch_reads_back(bench):
    shared(bench, pretension_N=3.5, conduit=PIECES)
    bench.described["rig"]["nominal"] = ["cable.length_m"]
    batch = load_batch(bench.write().folder)
    summary = json.loads(json.dumps(batch.model_dump(mode="json")))
    assert Batch.model_validate(summary, strict=False) == batch


def test_a_faulty_default_is_one_problem(bench):
    shared(bench, pretension_N=-1.0)
    ((line, text),) = problems(bench)
    assert text == "defaults.pretension_N: must be above 0.0, found -1.0"
    assert "pretension_N: -1.0" in (bench.folder / "batch.yaml").read_text().splitlines()[line - 1]


@pytest.mark.parametrize(
    ("defaults", "text"),
    [
        ({"pretensoin_N": 3.5}, "unknown key 'pretensoin_N' in defaults; did you mean 'pretension_N'?"),
        ({"conduit": [{"length_m": 1.0, "bent_rad": 1.0}]}, "unknown key 'bent_rad' in defaults.conduit[0]; did you"),
        ({"conduit": []}, "defaults.conduit: needs at least 1 entries, has 0"),
        ({"id": "one"}, "unknown key 'id' in defaults; known keys are pretension_N, conduit, excitation"),
        (3, "defaults: must hold keys and values, found 3"),
    ],
)
def test_problems_of_defaults(bench, defaults, text):
    lost = {"pretensoin_N": "pretension_N", "conduit": "conduit"}
    bench.described["defaults"] = defaults
    for entry in bench.described["recordings"]:
        for key in defaults if isinstance(defaults, dict) else ():
            entry.pop(lost.get(key), None)
    ((_, found),) = problems(bench)
    assert text in found


def test_without_a_default_each_recording_states_its_own(bench):
    for entry in bench.described["recordings"]:
        del entry["pretension_N"]
    assert [text for _, text in problems(bench)] == [
        "key 'pretension_N' is missing in recordings[0]",
        "key 'pretension_N' is missing in recordings[1]",
    ]


def test_nominal_values_are_named(bench):
    bench.described["rig"]["nominal"] = ["cable.stiffness_N_per_m", "drive.load_cell.zero_V", "load.pulley_radius_m"]
    nominal = load_batch(bench.write().folder).rig.nominal
    assert nominal == ("cable.stiffness_N_per_m", "drive.load_cell.zero_V", "load.pulley_radius_m")


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("cable.stifness_N_per_m", "there is no key 'cable.stifness_N_per_m' below rig; did you mean 'cable.stiffness"),
        ("rig.cable.length_m", "there is no key 'rig.cable.length_m' below rig; did you mean 'cable.length_m'?"),
        ("weather", "there is no key 'weather' below rig; it is a path as cable.stiffness_N_per_m"),
        ("drive.encoder_accuracy_rad", "nominal names 'drive.encoder_accuracy_rad', which is not stated"),
        ("drive.torque_sensor.Nm_per_count", "nominal names 'drive.torque_sensor.Nm_per_count', which is not stated"),
    ],
)
def test_nominal_values_exist(bench, key, text):
    bench.described["rig"]["nominal"] = [key]
    ((_, found),) = problems(bench)
    assert text in found


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("rig.drive.pulley_radius_m", "rig.drive.pulley_radius_m: fill in the radius of the drive pulley, m"),
        ("rig.load.pulley_radius_m", "rig.load.pulley_radius_m: fill in the radius of the load pulley, m"),
        ("rig.drive.encoder_counts_per_rev", "fill in the counts of the drive encoder per revolution of its pulley"),
        ("rig.load.torque_constant_Nm_per_A", "fill in the torque constant of the load motor at its pulley, N m/A"),
        ("rig.drive.load_cell.sensitivity_V_per_N", "fill in the sensitivity of this load cell, V/N"),
        ("rig.drive.load_cell.zero_V", "fill in the reading of this load cell without force, V"),
        ("rig.load.spring_stiffness_Nm_per_rad", "fill in the stiffness of the spring at the load, N m/rad, or remove"),
        ("rig.cable.stiffness_N_per_m", "fill in the stiffness of the cable, N/m"),
        ("rig.cable.length_m", "fill in the length of cable that has this stiffness, m"),
        ("rig.cable.friction_coefficient", "fill in the friction coefficient of the cable in its conduit"),
        ("rig.accuracy.encoder_rad", "fill in the accuracy of the angles, rad"),
        ("rig.accuracy.torque_Nm", "fill in the accuracy of the torques, N m"),
        ("rig.accuracy.load_cell_N", "fill in the accuracy of the load cells, N"),
        ("recordings.1.pretension_N", "recordings[1].pretension_N: fill in the tension to which each cable was set"),
        ("recordings.0.conduit", "recordings[0].conduit: fill in the pieces of the conduit from the drive end, as [{"),
        ("recordings.0.conduit.1.bend_rad", "recordings[0].conduit[1].bend_rad: fill in the bend of this piece"),
        ("defaults.pretension_N", "defaults.pretension_N: fill in the tension to which each cable was set"),
    ],
)
def test_an_empty_key_is_one_line_with_its_unit(bench, key, text):
    described = json.loads(json.dumps(description() | {"defaults": {}}))  # without anchors
    for entry in described["recordings"] if key.startswith("defaults") else ():
        del entry["pretension_N"]
    *parents, last = (int(part) if part.isdigit() else part for part in key.split("."))
    place = described
    for part in parents:
        place = place[part]
    place[last] = "EMPTY"
    bench.write()
    path = bench.folder / "batch.yaml"
    path.write_text(yaml.safe_dump(described, sort_keys=False).replace(" EMPTY", ""))
    with pytest.raises(InputError) as raised:
        load_batch(bench.folder)
    (problem,) = raised.value.problems
    assert text in problem.text
    assert path.read_text().splitlines()[problem.line - 1].endswith(f"{last}:")


def test_null_is_a_value_and_some_keys_may_be_empty(bench):
    bench.write()
    path = bench.folder / "batch.yaml"
    text = path.read_text().replace("  accuracy:\n", "  accuracy:\n").replace("rig:\n", "note:\nrig:\n")
    path.write_text(text.replace("    torque_constant", "    encoder_accuracy_rad: null\n    torque_constant"))
    batch = load_batch(bench.folder)
    assert batch.note is None and batch.rig.drive.encoder_accuracy_rad is None


def test_a_recording_states_when_it_started_and_when_its_cables_were_tensioned(bench):
    shared(bench, tensioned_at="2026-03-31T12:00:00Z")
    one, two = bench.described["recordings"]
    one["started_at"] = "2026-03-31T14:05:00+02:00"
    two |= {"started_at": "2026-03-31T12:10:00", "tensioned_at": "2026-03-31T12:08:30"}
    ingested = ingest_batch(bench.write().folder)
    waited = [r.started_at_s - r.tensioned_at_s for r in ingested.recordings]
    assert waited == [300.0, 90.0]
    assert ingested.recordings[1].started_at_s - ingested.recordings[0].started_at_s == 300.0
    summary = json.loads(json.dumps(ingested.batch.model_dump(mode="json")))
    assert Batch.model_validate(summary, strict=False) == ingested.batch
    file = bench.folder.parent / "recordings.nc"
    write_recordings(file, ingested.recordings, {})
    assert [(r.started_at_s, r.tensioned_at_s) for r in read_recordings(file)] == [
        (r.started_at_s, r.tensioned_at_s) for r in ingested.recordings
    ]


@pytest.mark.parametrize(
    ("stated", "text"),
    [
        ({"started_at": "2026-03-31T14:05:00", "tensioned_at": "2026-03-31T14:06:00"}, "tensioned_at is 60 s after"),
        ({"started_at": "soon"}, "started_at: must be a date with a time of day as"),
        ({"started_at": "2026-13-31T14:05:00"}, "started_at: must be a date with a time of day as"),
    ],
)
def test_times_that_cannot_be_are_refused(bench, stated, text):
    bench.described["recordings"][1] |= stated
    ((_, found),) = problems(bench)
    assert text in found
