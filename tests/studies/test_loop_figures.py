"""What figures say of themselves; the pictures are looked at by people."""

from dataclasses import replace
from itertools import pairwise
from typing import get_args

import jinja2
import matplotlib.pyplot as plt
import numpy as np
import pytest

from builders import recording
from ccmodel.channels import TABLE
from ccmodel.figures import stamp_figure
from ccmodel.model.run import PRESCRIBED
from ccmodel.studies.loops.settings import Figure, Measuring, Study
from ccmodel.studies.loops.study import _grid
from ccmodel.studies.loops.study import draw as draw_study

FIGURES = get_args(Figure)
LOOP = {"tau_in_Nm": lambda t: np.sin(2 * np.pi * t), "tau_out_Nm": lambda t: np.cos(2 * np.pi * t)}


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def pair(origin="virtual-rig", given="model", batch="b", frequency=1.0, **kw):
    recorded = replace(recording(**LOOP, **kw), batch=batch, excitation={"frequency_Hz": frequency})
    recorded = recorded.with_channels(recorded.channels, recorded.derived_from, origin)
    sources = dict.fromkeys(recorded.channels, "model") | {"theta_in_rad": PRESCRIBED, "tau_out_Nm": given}
    return recorded, recorded.with_channels(recorded.channels, sources, "model")


def texts(figure):
    found = [t.get_text() for ax in figure.axes for t in (ax.title, ax._left_title, ax.yaxis.label, *ax.texts)]
    legend = [t.get_text() for legend in figure.legends for t in legend.get_texts()]
    return [t for t in (*found, *legend, figure.get_suptitle()) if t]


def draw(pairs, figure="torque-loops", **kw):
    settings = {"variable": "pretension", "title": "a study"} | kw
    return draw_study(pairs, Study(batches=["b"], figure=figure, **settings), Measuring())


def drawn_loops(figure):
    """Panels of loops, without the strips of residuals."""
    return [ax for ax in figure.axes if "time" not in ax.get_xlabel() and "Δ" not in ax.get_ylabel()]


def strips(figure):
    return {ax.get_ylabel(): ax for ax in figure.axes if "Δ" in ax.get_ylabel()}


@pytest.mark.parametrize("figure", FIGURES)
def test_a_virtual_rigs_recordings_are_never_called_measured(figure):
    drawn = texts(draw([pair()], figure))
    assert any("virtual rig, simulated" in t for t in drawn)
    assert not any("measured" in t or "experiment" in t for t in drawn)


@pytest.mark.parametrize("figure", FIGURES)
@pytest.mark.parametrize("order", [1, -1])
def test_every_batch_is_called_what_it_is_whatever_else_is_drawn(figure, order):
    measured, simulated = pair("rig", batch="a"), pair("virtual-rig", batch="v", id="s")
    pairs = [measured, simulated][::order]
    drawn = draw(pairs, figure)
    title = drawn.get_suptitle()
    if figure == "transmission":
        # It shows the first recording alone.
        assert ("recording (measured): a" in title) == (order == 1)
        assert ("recording (virtual rig, simulated): v" in title) == (order == -1)
    else:
        assert "recording (measured): a; recording (virtual rig, simulated): v" in title
        for label in ("7 N, recording (measured)", "7 N, recording (virtual rig, simulated)"):
            assert any(label in t for t in texts(drawn))


@pytest.mark.parametrize("figure", FIGURES)
def test_the_recording_is_seen_where_the_model_agrees_with_it(figure):
    for ax in drawn_loops(draw([pair()], figure)):
        recorded, simulated = ax.lines
        assert recorded.get_xydata() == pytest.approx(simulated.get_xydata())
        assert recorded.get_linewidth() > 2 * simulated.get_linewidth()
        assert recorded.get_zorder() < simulated.get_zorder()
        assert recorded.get_color() != simulated.get_color() or recorded.get_alpha() < 0.5


def off_by(offset, channel="tau_in_Nm"):
    recorded, simulated = pair()
    channels = dict(simulated.channels) | {channel: simulated[channel] + offset}
    return recorded, simulated.with_channels(channels, simulated.derived_from, "model")


@pytest.mark.parametrize("figure", ["torque-loops", "torque-loops-apart"])
def test_residuals_are_model_minus_recording_in_the_axis_unit(figure):
    found = strips(draw([off_by(0.002)], figure))
    assert set(found) == {f"Δ {TABLE[c].tex} (mN·m)" for c in ("tau_in_Nm", "tau_out_Nm")}
    shown = {label: [line.get_ydata() for line in ax.lines[:2]] for label, ax in found.items()}
    for label, (samples, mean) in shown.items():
        wanted = 2.0 if "in" in label else 0.0
        assert samples == pytest.approx(np.full(samples.size, wanted), abs=1e-9)
        assert mean == pytest.approx(np.full(samples.size, wanted), abs=1e-9)
    # One cycle of a 1 Hz sine.
    assert next(iter(found.values())).lines[0].get_xdata()[[0, -1]] == pytest.approx([0, 1], abs=0.011)


def test_the_line_of_a_residual_is_its_moving_mean():
    """Over two samples, 2 % of a cycle of 101: of a residual that changes its sign with every sample, nothing."""
    samples, mean = strips(draw([off_by(0.002 * (-1.0) ** np.arange(301))]))[
        f"Δ {TABLE['tau_in_Nm'].tex} (mN·m)"
    ].lines[:2]
    assert np.abs(samples.get_ydata()) == pytest.approx(2.0)
    assert np.abs(mean.get_ydata()).max() < 1e-9


def test_a_channel_that_the_model_was_given_has_no_residual():
    assert set(strips(draw([pair(given=PRESCRIBED)]))) == {f"Δ {TABLE['tau_in_Nm'].tex} (mN·m)"}
    assert set(strips(draw([pair()], "drive-loops"))) == {f"Δ {TABLE['tau_in_Nm'].tex} (mN·m)"}


def test_a_transmission_has_a_strip_below_each_loop_in_its_unit():
    figure = draw([pair()], "transmission")
    assert len(drawn_loops(figure)) == 1
    ((label, strip),) = strips(figure).items()
    assert label == "Δ (mN·m)"
    assert len(strip.lines) == 5, "samples and moving mean of both torques, and zero"


def test_many_recordings_get_a_panel_each():
    pairs = [pair(id=f"r{i}", pretension_N=float(i + 1)) for i in range(10)]
    assert len(drawn_loops(draw(pairs[:6]))) == 1
    figure = draw(pairs)
    assert len(drawn_loops(figure)) == 10
    assert all(len(ax.lines) == 2 for ax in drawn_loops(figure))


def test_conditions_differ_without_colour():
    pairs = [pair(id=f"r{i}", pretension_N=float(i + 1)) for i in range(4)]
    (ax,) = drawn_loops(draw(pairs))
    models = [line for line in ax.lines if line.get_zorder() == 3]
    assert len({line.get_linestyle() for line in models}) == 4
    assert len({line.get_color() for line in models}) == 4


@pytest.mark.parametrize("figure", FIGURES)
def test_a_legend_covers_no_panel(figure):
    pairs = [pair(id=f"r{i}", pretension_N=float(i + 1)) for i in range(4)]
    drawn = draw(pairs, figure)
    stamp_figure(drawn, "a stamp")
    drawn.canvas.draw()
    (legend,) = (legend.get_window_extent() for legend in drawn.legends)
    (stamp,) = (t.get_window_extent() for t in drawn.texts if t.get_text() == "a stamp")
    assert not stamp.overlaps(legend)
    for ax in drawn.axes:
        assert not ax.get_tightbbox().overlaps(legend)
        assert not ax.get_tightbbox().overlaps(stamp)
    assert legend.x0 >= 0 and legend.x1 <= drawn.bbox.width


@pytest.mark.parametrize("figure", FIGURES)
def test_recordings_are_drawn_where_the_model_could_not_be_run(figure):
    recorded, _ = pair()
    drawn = draw([(recorded, None)], figure)
    assert any(ax.lines for ax in drawn.axes)
    assert any("not simulated" in t for t in texts(drawn))
    assert not any(line.get_xydata().size == 0 for ax in drawn.axes for line in ax.lines)


def test_a_prescribed_load_torque_is_said():
    given = pair(given=PRESCRIBED)
    assert "model, given the recorded load torque" in texts(draw([given]))
    assert "model, in part given the recorded load torque" in texts(draw([given, pair(id="s")]))


def test_rows_of_panels_share_the_colours_of_conditions():
    pairs = [pair(pretension_N=T, id=f"{T}-{n}", frequency=n) for n in (1, 2) for T in (3.5, 7.0)]
    upper, lower = drawn_loops(draw(pairs, rows="frequency"))
    assert [len(ax.lines) for ax in (upper, lower)] == [4, 4], "recording and model of the row's own two recordings"
    colours = [[line.get_color() for line in ax.lines] for ax in (upper, lower)]
    assert colours[0] == colours[1]
    assert len(set(colours[0])) == 2


@pytest.mark.parametrize("figure", FIGURES)
def test_without_a_recording_the_figure_says_so(figure):
    assert any("no usable recording" in t for t in texts(draw([], figure)))


def test_of_very_many_recordings_some_are_drawn_from_the_best_to_the_worst():
    def one(number):
        recorded, simulated = pair(id=f"{number:03d}")
        off = {"tau_out_Nm": simulated["tau_out_Nm"] + 0.001 * ((number * 37) % 200)}
        return recorded, simulated.with_channels(simulated.channels | off, simulated.derived_from, "model")

    drawn = draw([one(number) for number in range(200)], rows="recording", variable="recording")
    titles = [ax.get_title(loc="left") for ax in drawn.axes if ax.get_title(loc="left")]
    assert len(titles) == 48 and titles == sorted(titles)
    worst = next(n for n in range(200) if n * 37 % 200 == 199)
    assert {"b/000", f"b/{worst:03d}"} <= set(titles)
    assert "48 of 200 panels" in drawn.get_suptitle()
    (legend,) = drawn.legends
    assert len(legend.get_texts()) == 2, "the titles of the panels name the recordings"


def test_a_run_without_two_channels_of_one_end_has_a_figure_that_says_so():
    recorded, simulated = pair()
    few = {name: recorded[name] for name in ("theta_in_rad", "tau_in_Nm")}
    recorded = recorded.with_channels(few, recorded.derived_from, recorded.origin)
    drawn = draw([(recorded, simulated)], "transmission")
    assert any("no two channels of one end" in t for t in texts(drawn))


def test_residuals_stand_below_their_loop():
    _, cells = _grid(cells=4, strips=2, columns=2)
    for loop, strips in cells:
        heights = [ax.get_position() for ax in (loop, *strips)]
        assert all(above.y0 > below.y1 for above, below in pairwise(heights))
        assert all(one.x0 == heights[0].x0 for one in heights)


@pytest.mark.parametrize("batches, said", [(["first"], "batch first"), (["first", "later"], "batches first, later")])
def test_the_caption_of_a_study_counts_its_batches(batches, said):
    environment = jinja2.Environment(loader=jinja2.PackageLoader("ccmodel", "."))
    part = {"settings": {"title": "pretension", "batches": batches}, "name": "pretension", "parameters": "extended"}
    text = environment.get_template("studies/loops/part.html.j2").render(parts=[part])
    assert f"</strong>: {said}; model" in text and f"model, {said}" in text
