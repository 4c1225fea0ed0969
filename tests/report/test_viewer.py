"""Data of the viewer: what is packed is what was recorded, and shading follows the motion."""

import json
import zlib
from base64 import b64decode

import numpy as np
import pytest
from made_pages import run

from builders import recording
from ccmodel.model.run import PRESCRIBED
from ccmodel.report.page.viewer import LEVELS, MOST_SAMPLES, entry, packed, phases


def unpacked(data: bytes) -> tuple[dict, dict]:
    """Header and series by set and channel; the same steps as in viewer.js."""
    length = int.from_bytes(data[:4], "little")
    header = json.loads(data[4 : 4 + length])
    offset, series = 4 + length, []
    for row in header["series"]:
        if "same_as" in row:
            series.append(series[row["same_as"]])
            continue
        low, high = np.frombuffer(data, np.uint8, 2 * header["count"], offset).reshape(2, -1).astype(np.int64)
        levels = np.cumsum(low + 256 * high) & 0xFFFF
        series.append(np.where(levels == LEVELS + 1, np.nan, row["low"] + levels * row["step"]))
        offset += 2 * header["count"]
    assert offset == len(data)
    return header, {(r["set"], r["channel"]): s for r, s in zip(header["series"], series, strict=True)}


def test_what_is_unpacked_is_what_was_recorded():
    recorded, models = run(duration=30.0)
    header, series = unpacked(packed(recorded, models))
    every = slice(None, None, 3)
    assert header["count"] == recorded.time_s[every].size <= MOST_SAMPLES
    for channel, values in recorded.channels.items():
        assert series["recording", channel] == pytest.approx(values[every], abs=np.ptp(values) / LEVELS)
        assert series["extended", channel] == pytest.approx(0.99 * values[every], abs=np.ptp(values) / LEVELS)
    assert series["", "time_s"] == pytest.approx(recorded.time_s[every], abs=30 / LEVELS)


def test_missing_values_and_constant_channels_survive():
    recorded = recording(3.0, tau_in_Nm=lambda t: np.where(t > 1, np.nan, t), tau_out_Nm=lambda t: 0 * t + 0.7)
    _, series = unpacked(packed(recorded, {}))
    assert np.isnan(series["recording", "tau_in_Nm"]).sum() == (recorded.time_s > 1).sum()
    assert (series["recording", "tau_out_Nm"] == 0.7).all()


def test_equal_series_are_stored_once():
    recorded, models = run()
    twice = models | {"again": models["extended"]}
    assert len(packed(recorded, twice)) < len(packed(recorded, models)) + 1000
    _, series = unpacked(packed(recorded, twice))
    assert (series["again", "tau_in_Nm"] == series["extended", "tau_in_Nm"]).all()


def test_an_input_of_the_model_is_not_shown_as_its_result():
    recorded, models = run()
    model = models["extended"]
    given = model.with_channels(model.channels, {**model.derived_from, "tau_out_Nm": PRESCRIBED}, "model")
    header, _ = unpacked(packed(recorded, {"extended": given}))
    shown = {row["channel"] for row in header["series"] if row["set"] == "extended"}
    assert "tau_out_Nm" not in shown
    assert "tau_in_Nm" in shown


def test_an_entry_says_its_origin_and_leaves_out_models_that_failed():
    recorded, models = run(origin="rig")
    made = entry(recorded, models | {"nearest": None})
    assert (made["origin"], made["measured"], made["sets"]) == (
        "recording (measured)",
        True,
        ["calibrated", "extended"],
    )
    assert unpacked(zlib.decompress(b64decode(made["data"])))[0]["count"] > 0


def test_phases_are_rest_lost_motion_motion_and_slack():
    """Rest to 1 s; the drive alone from 1 to 2 s; both from 2 to 4 s, cable B without tension from 3 s; then rest."""
    step = lambda t, a, b: np.clip(t, a, b) - a  # noqa: E731
    tension = {"T1_N": lambda t: 0 * t + 7.0, "T2_N": lambda t: 0 * t + 7.0}
    slack = {name: (lambda t: np.where(t > 3, 0.0, 5.0)) for name in ("T3_N", "T4_N")}
    model = recording(
        5.0, theta_in_rad=lambda t: step(t, 1, 4), theta_out_rad=lambda t: step(t, 2, 4), **tension, **slack
    )
    found = phases(model, model)
    assert [phase for *_, phase in found] == [0, 1, 2, 3, 0]
    assert [start for start, *_ in found] == pytest.approx([0, 1, 2, 3, 4], abs=0.03)
    assert phases(model, None) == []


def test_the_shading_is_that_of_the_last_model_that_is_accepted():
    recorded, models = run()
    header, _ = unpacked(packed(recorded, models))
    model = models["extended"]
    slack = model.with_channels({**model.channels, "T1_N": 0 * model.time_s}, model.derived_from, "model")
    with_nearest, _ = unpacked(packed(recorded, models | {"nearest": slack}))
    assert with_nearest["phases"] == header["phases"]
    assert (with_nearest["phases_of"], header["phases_of"]) == ("extended", "extended")
    assert unpacked(packed(recorded, {}))[0]["phases_of"] is None


def test_a_reversal_is_no_rest():
    moving = recording(3.0, theta_out_rad=lambda t: np.sin(2 * np.pi * t))
    assert 0 not in [phase for *_, phase in phases(moving, moving)]
