"""Several batches of one rig taken together: what must be alike, and how their recordings are told apart."""

from copy import deepcopy

import pytest
import yaml

from builders import write_batch
from ccmodel.rig.ingest import ingest_batch
from ccmodel.rig.joint import together
from ccmodel.typed import InputError


@pytest.fixture
def batches(tmp_path):
    """Two batches of one rig, with one recording id in both; the second one's batch.yaml may be changed."""

    def write(change=lambda stated: None):
        found = []
        for name, pretensions in (("monday", (7.0, 5.0)), ("tuesday", (7.0,))):
            folder = write_batch(tmp_path / name, pretensions)
            if name == "tuesday":
                stated = yaml.safe_load((folder / "batch.yaml").read_text())
                change(stated)
                (folder / "batch.yaml").write_text(yaml.safe_dump(stated))
            found.append((f"{name}/batch.yaml", ingest_batch(folder)))
        return found

    return write


def changed(key, value):
    """A change of one key below `rig`, as ``load.pulley_radius_m``; None removes it."""

    def change(stated):
        *above, last = key.split(".")
        part = stated["rig"]
        for name in above:
            part = part[name]
        if value is None:
            del part[last]
        else:
            part[last] = value

    return change


def test_recordings_of_several_batches_have_ids_of_their_own(batches):
    two = batches()
    found = together(two)
    assert [r.id for r in found.recordings] == ["monday/t-7N", "monday/t-5N", "tuesday/t-7N"]
    assert [r.session for r in found.recordings] == ["monday", "monday", "tuesday"]
    assert {r.batch for r in found.recordings} == {found.stated.batch} == {"monday + tuesday"}
    assert found.parts == ("monday", "tuesday")
    assert together(two, "bench").recordings[0].batch == "bench"


def test_a_batch_by_itself_is_as_it_was(batches):
    one = batches()[0]
    assert together([one]) is one[1]
    assert {r.session for r in one[1].recordings} == {""}


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("load.pulley_radius_m", 0.008, "rig.load.pulley_radius_m is 0.008, but 0.006 in monday/batch.yaml"),
        ("drive.torque_constant_Nm_per_A", 0.03, "rig.drive.torque_constant_Nm_per_A is 0.03, but 0.0234 in monday"),
        ("load.encoder_counts_per_rev", 1000, "rig.load.encoder_counts_per_rev is 1000.0, but 2000.0 in monday"),
        ("cable.length_m", 1.5, "rig.cable.length_m is 1.5, but 1.2 in monday"),
        ("load.spring_stiffness_Nm_per_rad", None, "spring_stiffness_Nm_per_rad is absent, but 0.05 in monday"),
    ],
)
def test_different_rigs_are_refused_by_file_and_key(batches, key, value, line):
    with pytest.raises(InputError, match=f"^tuesday/batch.yaml: .*{line}.*mend the wrong one"):
        together(batches(changed(key, value)))


def test_measured_and_simulated_recordings_are_not_of_one_rig(batches):
    with pytest.raises(InputError, match="tuesday/batch.yaml: origin is rig, but virtual-rig in monday"):
        together(batches(lambda stated: stated.update(origin="rig")))


def test_every_difference_has_a_line(batches):
    def two(stated):
        changed("cable.length_m", 1.5)(stated)
        changed("load.pulley_radius_m", 0.008)(stated)

    with pytest.raises(InputError) as refused:
        together(batches(two))
    assert len(str(refused.value).splitlines()) == 2


def test_calibrations_of_sensors_may_differ(batches):
    found = together(batches(changed("drive.load_cell", {"sensitivity_V_per_N": 0.2, "zero_V": 0.0})))
    first, _, second = found.recordings
    assert second["F_drive_N"].mean() == pytest.approx((first["F_drive_N"].mean() + 2.5) / 2, rel=0.01)
    assert not [f for f in found.findings if f.batch == "monday + tuesday"]


def test_estimates_may_differ_and_the_first_are_used(batches):
    found = together(batches(changed("cable.friction_coefficient", 0.2)))
    assert found.stated.rig.cable.friction_coefficient == 0.147
    (finding,) = [f for f in found.findings if f.batch == "monday + tuesday"]
    assert "rig.cable.friction_coefficient: is 0.2, but 0.147 in monday/batch.yaml" in str(finding)


def test_a_batch_is_not_taken_twice(batches):
    one = batches()[0]
    with pytest.raises(InputError, match="two batches are called 'monday'"):
        together([one, deepcopy(one)])
