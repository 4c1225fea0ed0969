import numpy as np
import pytest
from made_up_batch import table

from ccmodel.rig.ingest import ingest_batch
from ccmodel.rig.log import read_log
from ccmodel.rig.outliers import _distances, _few, _many

TIME = np.linspace(0.0, 4.0, 2000)
NOISE = np.random.default_rng(3).normal(size=TIME.size)
# What rigs do, from sample to sample.
CHANNELS = {
    "noise": NOISE,
    "sine with noise": np.sin(TIME) + 0.01 * NOISE,
    "smooth sine": np.sin(5 * TIME),
    "step": np.where(TIME > 2.0, 1.0, 0.0) + 0.01 * NOISE,
    "a motion that began before": np.exp(-600 * TIME) + 0.01 * NOISE,
    "step without noise": np.where(TIME > 2.0, 1.0, 0.0),
    "one corner": np.abs(TIME - 2.0),
    "loops with square corners": np.sign(np.sin(6 * TIME)) + 0.01 * NOISE,
    "a load that snaps and rings": np.exp(-40 * np.clip(TIME - 2, 0, None)) * np.cos(400 * (TIME - 2)) * (TIME > 2),
    "coarse converter": np.round(3 * np.sin(TIME)),
    "dead but for one count": (np.arange(TIME.size) == 700).astype(float),
    "spikes of a switching drive": NOISE * 0.01 + np.where(np.arange(TIME.size) % 97 == 5, 1.0, 0.0),
    "heavy tails": np.random.default_rng(4).standard_t(2.0, TIME.size),
}


def outliers(values):
    return _few(*_distances(values))


def frequent_outliers(values):
    return _many(values, *_distances(values))


@pytest.mark.parametrize("name", CHANNELS)
def test_what_a_rig_does_is_no_outlier(name):
    assert outliers(CHANNELS[name]).size == 0


@pytest.mark.parametrize("value", [30.0, -30.0, 1000.0, 1e200])
@pytest.mark.parametrize("at", [[0], [1], [777], [TIME.size - 1], [500, 501], [20, 900, 1500]])
def test_impossible_readings_are_found(value, at):
    values = 9 * np.sin(3 * TIME) + 0.05 * NOISE
    values[at] = value
    is_seen = abs(value) > 30.0 or at not in ([0], [TIME.size - 1])
    assert outliers(values).tolist() == (at if is_seen else [])


@pytest.mark.parametrize("at", [0, TIME.size - 1])
def test_a_first_or_last_reading_may_be_impossible(at):
    values = 2.3 * np.sin(3 * TIME) + 0.05 * NOISE
    values[at] = 30.0
    assert outliers(values).tolist() == [at]


SHORT = np.sin(np.linspace(0.0, 12.0, 400)) + 0.005 * NOISE[:400]


@pytest.mark.parametrize("is_reversed", [False, True])
@pytest.mark.parametrize("rows", [2, 3, 5, 8])
@pytest.mark.parametrize("slope", [0.2, 0.4])
def test_a_motion_that_is_steep_at_an_end_is_no_outlier(rows, slope, is_reversed):
    values = SHORT.copy()
    values[-rows:] = values[-rows - 1] + slope * np.arange(1, rows + 1)
    values = values[::-1] if is_reversed else values
    assert outliers(values).size == 0
    assert frequent_outliers(values).size == 0


@pytest.mark.parametrize("rows", [2, 3, 5])
def test_a_motion_that_reverses_at_an_end_is_no_outlier(rows):
    """The current of a drive falls within a few samples after a reversal, and stays there."""
    values = SHORT.copy()
    values[-rows:] = values[-rows - 1] - 0.9
    assert outliers(values).size == 0


@pytest.mark.parametrize("place", range(1, 6))
@pytest.mark.parametrize("is_reversed", [False, True])
def test_a_spike_in_a_motion_that_is_steep_at_an_end_is_found(place, is_reversed):
    values = SHORT.copy()
    values[-6:] = values[-7] + 0.2 * np.arange(1, 7)
    values[-1 - place] += 2.0
    values = values[::-1] if is_reversed else values
    assert outliers(values).tolist() == [place if is_reversed else values.size - 1 - place]


def test_readings_that_are_too_many_to_be_dropped_are_named():
    values = 2.3 * np.sin(3 * TIME) + 0.01 * NOISE
    at = np.arange(7, TIME.size, 80)
    values[at] = 1000.0
    assert outliers(values).size == 0
    assert frequent_outliers(values).tolist() == at.tolist()
    others = (name for name in CHANNELS if name != "spikes of a switching drive")
    assert all(frequent_outliers(CHANNELS[name]).size == 0 for name in others)


@pytest.mark.parametrize("column", ["drive_encoder_counts", "load_encoder_counts"])
def test_a_single_wrong_reading_of_an_encoder_is_dropped_and_lost_counts_are_not(bench, column):
    counts = bench.tables["one"][column]
    off = counts + int(0.2 * np.ptp(counts))
    single, lost = counts.where(counts.index != 230, off), counts.where(counts.index < 230, off)
    bench.tables["one"] = bench.tables["one"].assign(**{column: single})
    (finding,) = ingest_batch(bench.write().folder).findings
    assert (finding.column, finding.row, finding.severity) == (column, 232, "warning")
    bench.tables["one"] = bench.tables["one"].assign(**{column: lost})
    findings = ingest_batch(bench.write().folder).findings
    assert findings and not any("far from those near it" in f.text for f in findings)


def test_a_log_with_many_of_them_has_a_warning(bench):
    log = table()
    log.loc[::60, "drive_current_A"] = 1000.0
    bench.write()
    log.to_csv(bench.log(), index=False)
    _, warnings = read_log(bench.log())
    assert [w.column for w in warnings] == ["drive_current_A"]
    assert "are far from all near them, up to 1000: is the sensor faulty? They are used" in warnings[0].text


@pytest.mark.parametrize(("column", "value", "said"), [("time_s", 7.0, "time must increase")])
def test_times_and_angles_have_checks_of_their_own(bench, column, value, said):
    log = table()
    log.loc[200, column] = value
    bench.write()
    log.to_csv(bench.log(), index=False)
    (finding,) = (f for f in ingest_batch(bench.folder).findings if f.severity == "refused")
    assert finding.column == column
    assert said in finding.text


def test_an_impossible_reading_may_lie_within_the_range():
    """A channel at 9 cannot read 0 for a sample."""
    values = 9 * np.sin(3 * TIME) + 0.05 * NOISE
    at = int(np.argmax(values))
    values[at] = 0.0
    assert outliers(values).tolist() == [at]


@pytest.mark.parametrize("column", ["drive_current_A", "load_current_A", "drive_load_cell_V", "load_load_cell_V"])
@pytest.mark.parametrize(
    ("factor", "why"), [(4, "far from those near it"), (1000, "far from those near it"), (1e200, "is no reading")]
)
def test_a_log_with_an_impossible_reading_is_read_without_its_row(bench, column, factor, why):
    healthy = table()
    damaged = healthy.copy()
    damaged.loc[250, column] = factor * np.abs(healthy[column]).max()
    bench.write()
    damaged.to_csv(bench.log(), index=False)
    ingested = ingest_batch(bench.folder)
    (finding,) = ingested.findings
    assert (finding.row, finding.column, finding.severity) == (252, column, "warning")
    assert why in finding.text and finding.text.endswith("row dropped")
    healthy.drop(index=250).to_csv(bench.log(), index=False)
    without = ingest_batch(bench.folder).recordings[0]
    for channel, values in ingested.recordings[0].channels.items():
        assert np.array_equal(values, without.channels[channel]), channel
