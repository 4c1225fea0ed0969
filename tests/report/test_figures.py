"""Files of figures, and the line in their corner."""

import shutil
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from builders import recording
from ccmodel.figures import FORMATS, STYLE, legend_below, save_figure, stamp_figure, title_figure
from ccmodel.provenance import content_digest
from ccmodel.recording import write_recordings
from ccmodel.studies.loops.settings import Measuring, Study
from ccmodel.studies.run import Run, run_study

TORQUES = {"tau_in_Nm": lambda t: np.sin(2 * np.pi * t), "tau_out_Nm": lambda t: np.cos(2 * np.pi * t)}


def make(folder, provenance="here", scale=1.0):
    """The files of a study of one recording, as a run of the pipeline makes them."""
    folder.mkdir(parents=True)
    recorded = recording(**TORQUES)
    channels = {name: scale * values for name, values in recorded.channels.items()}
    simulated = replace(recorded, origin="model", channels=channels, derived_from=dict.fromkeys(channels, "model"))
    for name, run in (("recorded", recorded), ("simulated", simulated)):
        write_recordings(folder / f"{name}.nc", [run], {"made in": provenance})
    files = [folder / f"a.{ending}" for ending in FORMATS]
    study = Study(batches=["b"], title="a study")
    run = Run("", folder / "recorded.nc", folder / "simulated.nc")
    run_study("loops", study.model_dump_json(), Measuring().model_dump_json(), [run], [], [files])
    return files


def stamp_in(svg):
    (line,) = [line for line in svg.read_text().splitlines() if "inputs" in line and "sources" in line]
    return line.split("ccmodel ")[1].split("<")[0]


def test_equal_inputs_give_equal_files(tmp_path):
    first, second = make(tmp_path / "a"), make(tmp_path / "elsewhere" / "b", provenance="another folder")
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.suffix
        assert one.stat().st_size > 5_000
    assert {file.read_bytes()[:4] for file in first} == {b"\x89PNG", b"<?xm", b"%PDF"}


def test_no_file_holds_a_date(tmp_path):
    for file in make(tmp_path / "a"):
        assert b"CreationDate" not in file.read_bytes()
        assert b"dc:date" not in file.read_bytes()


def test_the_stamp_follows_the_content_of_the_inputs(tmp_path):
    same, other = make(tmp_path / "a"), make(tmp_path / "b", scale=1.001)
    stamps = [stamp_in(files[1]) for files in (same, other)]
    assert all(stamp.split(",")[2] == stamps[0].split(",")[2] for stamp in stamps), "the same sources"
    assert stamps[0] != stamps[1]


def test_a_copied_input_with_another_time_stamp_has_the_same_digest(tmp_path):
    make(tmp_path / "a")
    shutil.copytree(tmp_path / "a", tmp_path / "b", copy_function=shutil.copyfile)
    one, other = (Run("", tmp_path / f / "recorded.nc", tmp_path / f / "simulated.nc") for f in "ab")
    assert content_digest(one.content) == content_digest(other.content)


def test_a_digest_sees_every_part_of_a_recording():
    recorded = recording(**TORQUES)
    others = [
        replace(recorded, pretension_N=7.1),
        replace(recorded, origin="rig"),
        replace(recorded, time_s=recorded.time_s + 1),
        replace(recorded, excitation={"wave": "sine"}),
        replace(recorded, path=replace(recorded.path, piece_bend_rad=np.array([3.0]))),
    ]
    assert len({content_digest(r) for r in [recorded, *others]}) == 6
    # A cached property of the path is no content.
    before = content_digest(recorded)
    assert recorded.path.length_m and content_digest(recorded) == before


def test_what_has_no_plain_content_has_no_digest():
    with pytest.raises(TypeError, match="no digest of a object"):
        content_digest(object())


@pytest.mark.parametrize("title", ["short", "long " * 60, r"costs 5 $ \alpha_{ and 6 $"])
def test_title_legend_and_stamp_keep_clear_of_the_panels(title):
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 2, figsize=(9, 4))
        for ax in axes:
            for i in range(9):
                ax.plot([0, 1], [0, i], label=f"a line with a long label, number {i}")
            ax.set(xlabel="x (m)", ylabel="y (m)")
    legend_below(figure, axes)
    title_figure(figure, title, "recording (measured): a")
    stamp_figure(figure, "ccmodel 0.0.0, inputs 00000000, sources 00000000")
    figure.canvas.draw()
    outside = [*figure.legends, *figure.texts]
    boxes = [artist.get_window_extent() for artist in outside]
    for box in boxes:
        assert box.x0 >= 0 and box.x1 <= figure.bbox.width and box.y0 >= 0 and box.y1 <= figure.bbox.height
    boxes += [ax.get_tightbbox() for ax in axes]
    pairs = [(a, b) for i, a in enumerate(boxes) for b in boxes[:i]]
    assert not any(a.overlaps(b) for a, b in pairs)
    plt.close(figure)


def test_a_figure_without_a_stamp_is_saved_too(tmp_path):
    with plt.rc_context(STYLE):
        figure, _ = plt.subplots()
    save_figure(figure, tmp_path / "a.pdf", tmp_path / "a.png")
    assert {file.suffix for file in tmp_path.iterdir()} == {".pdf", ".png"}
    plt.close(figure)
