"""What figures say of themselves; the pictures are looked at by people."""

from typing import get_args

import matplotlib.pyplot as plt
import numpy as np
import pytest

from builders import recording
from ccmodel.model.run import PRESCRIBED
from ccmodel.studies.loops.settings import Figure, Study
from ccmodel.studies.loops.study import draw as draw_study

FIGURES = get_args(Figure)
LOOP = {"tau_in_Nm": lambda t: np.sin(2 * np.pi * t), "tau_out_Nm": lambda t: np.cos(2 * np.pi * t)}


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def pair(origin="virtual-rig", given="model", **kw):
    recorded = recording(**LOOP, **kw)
    recorded = recorded.with_channels(recorded.channels, recorded.derived_from, origin)
    sources = dict.fromkeys(recorded.channels, "model") | {"tau_out_Nm": given}
    return recorded, recorded.with_channels(recorded.channels, sources, "model")


def texts(figure):
    found = [t.get_text() for ax in figure.axes for t in (ax.title, ax._left_title, *ax.texts)]
    legend = [t.get_text() for legend in figure.legends for t in legend.get_texts()]
    return [t for t in (*found, *legend, figure.get_suptitle()) if t]


def draw(pairs, figure="torque-loops", **kw):
    return draw_study(pairs, Study(batches=["b"], figure=figure, variable="pretension", title="a study", **kw))


@pytest.mark.parametrize("figure", FIGURES)
def test_a_virtual_rigs_recordings_are_never_called_measured(figure):
    drawn = texts(draw([pair()], figure))
    assert any("virtual rig, simulated" in t for t in drawn)
    assert not any("measured" in t or "experiment" in t for t in drawn)


@pytest.mark.parametrize("figure", ["torque-loops", "torque-loops-apart", "drive-loops"])
@pytest.mark.parametrize("order", [1, -1])
def test_a_study_of_both_origins_says_both_and_which_is_which(figure, order):
    drawn = texts(draw([pair("rig"), pair("virtual-rig", id="s")][::order], figure))
    assert any("7 N, recording (measured)" in t for t in drawn)
    assert any("7 N, recording (virtual rig, simulated)" in t for t in drawn)


@pytest.mark.parametrize("figure", FIGURES)
def test_recordings_are_drawn_where_the_model_could_not_be_run(figure):
    recorded, _ = pair()
    drawn = draw([(recorded, None)], figure)
    assert any(ax.lines for ax in drawn.axes)
    if figure != "transmission":
        assert any("not simulated" in t for t in texts(drawn))


def test_a_prescribed_load_torque_is_said():
    assert "model, given the recorded load torque" in texts(draw([pair(given=PRESCRIBED)]))


def test_rows_of_panels_share_the_colours_of_conditions():
    a, b = pair(pretension_N=3.5, id="a"), pair(pretension_N=7.0, id="b")
    figure = draw([a, b], rows="recording")
    (upper,), (lower,) = ([line.get_color() for line in ax.lines] for ax in (figure.axes[0], figure.axes[2]))
    assert upper != lower


@pytest.mark.parametrize("figure", FIGURES)
def test_without_a_recording_the_figure_says_so(figure):
    assert any("no usable recording" in t for t in texts(draw([], figure)))
