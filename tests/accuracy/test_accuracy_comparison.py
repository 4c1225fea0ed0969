"""The comparison with an accepted accuracy: what is a loss, what is covered, what cannot be compared."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t

from ccmodel.accuracy.baseline import make_baseline, read_baseline, write_baseline
from ccmodel.accuracy.comparison import GAINED, KEPT, LOST, UNKNOWN, Limits, compare
from ccmodel.accuracy.measure import BatchAccuracy, ChannelAccuracy, SetAccuracy, _error_by_channel
from ccmodel.typed import InputError

LIMITS = Limits(coverage=0.99, reproducibility=0.01)
REPEATED = ("c1-a", "c1-b", "c2-a", "c2-b")


def batch(
    errors, names=REPEATED, digest="same", verdict=None, fit_sd=0.0, rig="rig", window=(6.0, 8.0, 1000.0), biases=None
):
    """A batch with one parameter set and one channel of these errors, without bias unless it is given."""
    channel = ChannelAccuracy(biases=biases or [0.0] * len(errors), errors=list(errors), fit_sd=fit_sd)
    return BatchAccuracy(
        rig=rig,
        origin="virtual-rig",
        digest=digest,
        verdict=verdict,
        recordings={name: list(window) for name in names[: len(errors)]},
        sets={"fitted": SetAccuracy(fitted_to=[], channels={"tau_in_Nm": channel})},
    )


def outcome(accepted, now):
    (change,) = compare({"b": accepted}, {"b": now}, LIMITS).changes
    return change.outcome


def test_error_contains_bias_and_scatter():
    channel = ChannelAccuracy(biases=[3.0, -1.0], errors=[5.0, 7.0])
    assert channel.bias == pytest.approx(1.0)
    assert channel.error == pytest.approx(np.sqrt(37))
    assert channel.scatter == pytest.approx(6.0)


def test_on_the_same_recordings_one_percent_decides():
    before = batch([5.0, 5.2, 3.0, 3.1])
    assert outcome(before, batch([5.04, 5.24, 3.02, 3.12])) == KEPT
    assert outcome(before, batch([5.1, 5.3, 3.06, 3.16])) == LOST
    assert outcome(before, batch([4.9, 5.1, 2.94, 3.04])) == GAINED


def test_the_uncertainty_of_a_fit_counts_where_its_recordings_were_made_again():
    errors = [5.0, 5.01, 5.0, 5.01]
    before, now = batch(errors, fit_sd=0.05), [1.2 * e for e in errors]
    assert outcome(before, batch(now, digest="other", fit_sd=0.05)) == KEPT
    assert outcome(batch(errors), batch(now, digest="other")) == LOST
    assert outcome(before, batch(now, fit_sd=0.05)) == LOST, "on the same recordings the fit is the same"


def test_recorded_again_the_scatter_of_repeats_decides():
    before = batch([5.0, 5.5, 5.0, 5.5])
    # Two differences of ln 1.1 between repeats, two degrees of freedom; the weights of the errors are nearly equal.
    sd = np.log(1.1) / np.sqrt(2)
    square = np.array([5.0, 5.5, 5.0, 5.5]) ** 2
    reach = t.isf(0.01, 2) * sd * np.sqrt(2 * ((square / square.sum()) ** 2).sum()) + np.log(1.01)
    for share, expected in ((0.99, KEPT), (1.01, LOST)):
        factor = np.exp(share * reach)
        assert outcome(before, batch([factor * e for e in (5.0, 5.5, 5.0, 5.5)], digest="other")) == expected


def upper(error, quantile, variance):
    """Upper end of the interval of an error that is recorded again."""
    return error * np.exp(quantile * np.sqrt(variance) + np.log(1.01))


def test_the_accepted_and_the_present_recordings_have_weights_and_fits_of_their_own():
    before = batch([5.0, 5.5, 5.0, 5.5])
    (change,) = compare({"b": before}, {"b": batch([6.0, 6.0], digest="other", fit_sd=0.05)}, LIMITS).changes
    # Squares of 25 and 30.25 twice each, and two equal ones.
    weights = 2 * (25.0**2 + 30.25**2) / 110.5**2 + 2 * 0.5**2
    variance = np.log(1.1) ** 2 / 2 * weights + 0.05**2
    assert change.high == pytest.approx(upper(np.sqrt(27.625), t.isf(0.01, 2), variance))


def test_the_scatter_of_repeats_is_that_of_all_batches_of_the_rig_unless_the_batch_has_more():
    """One difference between repeats in each batch: of ln 1.02 and ln 1.3 on one rig, and of ln 3 on another."""
    names = ("c-a", "c-b")

    def run(digest):
        factors = {"quiet": 1.02, "loud": 1.3, "elsewhere": 3.0}
        rigs = {"elsewhere": "other rig"}
        return {b: batch([1.0, f], names, digest, rig=rigs.get(b, "rig")) for b, f in factors.items()}

    high = {change.batch: change.high for change in compare(run("x"), run("y"), LIMITS).changes}
    quantile, pooled = t.isf(0.01 / 3, 2), (np.log(1.02) ** 2 + np.log(1.3) ** 2) / 4
    for name, factor, square in (("quiet", 1.02, pooled), ("loud", 1.3, np.log(1.3) ** 2 / 2)):
        weights = 2 * (1 + factor**4) / (1 + factor**2) ** 2
        assert high[name] == pytest.approx(upper(np.sqrt((1 + factor**2) / 2), quantile, square * weights)), name


def test_on_the_same_batch_the_recordings_that_both_have_are_compared():
    before = batch([5.0, 7.0, 1.0, 20.0])
    now = batch([7.0, 5.0, 1.0], names=("c1-b", "c1-a", "c2-a"))
    (change,) = compare({"b": before}, {"b": now}, LIMITS).changes
    assert (change.accepted, change.now, change.outcome) == (pytest.approx(5.0), pytest.approx(5.0), KEPT)


def test_the_largest_loss_stands_first():
    before = {b: batch([5.0] * 4) for b in "abc"}
    found = compare(before, {b: batch([e] * 4) for b, e in (("a", 6.0), ("b", 9.0), ("c", 7.0))}, LIMITS)
    assert [change.batch for change in found.of(LOST)] == ["b", "c", "a"]
    assert [line[:7] for line in found.losses] == ["batch b", "batch c", "batch a"]


def test_other_noise_is_covered_as_stated():
    """Errors drawn anew a thousand times raise about one false alarm in a hundred runs of ten channels' batches."""
    random, alarms, runs = np.random.default_rng(3), 0, 400
    names = tuple(f"c{k}-{letter}" for k in range(6) for letter in "ab")

    def drawn(digest):
        return {f"b{k}": batch(np.exp(random.normal(0, 0.1, 12)), names, digest, rig=f"rig {k}") for k in range(10)}

    for _ in range(runs):
        alarms += bool(compare(drawn("before"), drawn("after"), Limits(coverage=0.9, reproducibility=0.0)).losses)
    assert 0.03 * runs < alarms < 0.14 * runs


def test_a_fit_of_other_recordings_makes_a_batch_one_that_was_recorded_again():
    def run(digest):
        fitted = batch([5.0] * 4)
        fitted.sets["fitted"].fitted_to.append("half-loop")
        return {"b": fitted, "half-loop": batch([4.0, 4.4], ("c-a", "c-b"), digest)}

    assert all(c.same_recordings for c in compare(run("x"), run("x"), LIMITS).changes)
    assert not any(c.same_recordings for c in compare(run("x"), run("y"), LIMITS).changes)
    for one, other in ((True, False), (False, True)):
        before, now = run("x"), run("y")
        for of, is_fitted in ((before, one), (now, other)):
            if not is_fitted:
                of["b"].sets["fitted"].fitted_to.clear()
        same = {c.batch: c.same_recordings for c in compare(before, now, LIMITS).changes}
        assert same == {"b": False, "half-loop": False}, "a fit of either run is enough"


def test_without_repeats_the_scatter_of_all_recordings_takes_their_place():
    names = tuple(f"trial-0{k}" for k in range(8))
    errors = [5.0, 6.0, 4.0, 5.5, 4.5, 5.0, 6.5, 4.2]
    before = batch(errors, names)
    assert outcome(before, batch([1.1 * e for e in errors], names, "other")) == KEPT
    assert outcome(before, batch([3.0 * e for e in errors], names, "other")) == LOST


def test_one_recording_made_again_cannot_be_judged_and_is_named():
    found = compare({"b": batch([5.0])}, {"b": batch([5.0], digest="other")}, LIMITS)
    assert found.changes[0].outcome == UNKNOWN
    assert "too few repeats" in found.not_compared[0]
    assert compare({"b": batch([5.0])}, {"b": batch([9.0])}, LIMITS).losses, "on the same recording it is judged"


def test_an_interval_of_more_than_ten_in_ln_error_is_none():
    """One pair of repeats has one degree of freedom, for which the quantile of 0.99 is 31.8."""
    for factor, expected in ((1.5, KEPT), (1.7, UNKNOWN)):
        errors = [1.0, factor]
        weights = 2 * (1 + factor**4) / (1 + factor**2) ** 2
        reach = 31.82 * np.log(factor) / np.sqrt(2) * np.sqrt(weights)
        assert (reach > 10) == (expected == UNKNOWN)
        assert outcome(batch(errors), batch(errors, digest="other")) == expected


def test_less_data_is_a_loss_and_is_named():
    before = batch([5.0] * 4)
    earlier = batch([5.0] * 4, window=(4.0, 6.0, 1000.0))
    assert "compared from 4 to 6 s, accepted from 6 to 8 s" in compare({"b": before}, {"b": earlier}, LIMITS).losses[0]
    assert not compare({"b": before}, {"b": batch([5.0] * 4, window=(6.01, 8.01, 1001.0))}, LIMITS).losses
    later = batch([5.0] * 4, window=(6.3, 8.0, 1000.0))
    assert "compared from 6.3 to 8 s, accepted from 6 to 8 s" in compare({"b": before}, {"b": later}, LIMITS).losses[0]
    sparse = batch([5.0] * 4, window=(6.0, 8.0, 850.0))
    assert "compared in 850 samples, accepted in 1000" in compare({"b": before}, {"b": sparse}, LIMITS).losses[0]
    fewer = compare({"b": before}, {"b": batch([5.0] * 3)}, LIMITS).losses
    assert fewer == ["batch b, recording c2-b: compared before, and not in this run"]
    gone = compare({"b": before, "c": before}, {"b": before}, LIMITS).losses
    assert gone == ["batch c: accepted with 4 recordings, and not compared in this run"]
    silent = batch([5.0] * 4)
    silent.sets["fitted"].channels["tau_in_Nm"].errors[1] = None
    assert "not compared any more in c1-b" in compare({"b": before}, {"b": silent}, LIMITS).losses[0]
    del silent.sets["fitted"]
    assert "fitted parameters are not compared" in compare({"b": before}, {"b": silent}, LIMITS).losses[0]


def test_a_batch_that_the_baseline_does_not_have_is_one_line():
    found = compare({"b": batch([5.0] * 4)}, {"b": batch([5.0] * 4), "new": batch([1.0] * 4)}, LIMITS)
    assert not found.losses
    (line,) = found.not_compared
    assert "batch new: the baseline does not have it" in line


def test_a_parameter_set_or_channel_that_the_baseline_does_not_have_is_named():
    now = batch([5.0] * 4)
    one = now.sets["fitted"]
    now.sets["extended"] = one
    now.sets["fitted"] = SetAccuracy(fitted_to=[], channels=one.channels | {"T1_N": one.channels["tau_in_Nm"]})
    lines = compare({"b": batch([5.0] * 4)}, {"b": now}, LIMITS).not_compared
    assert [line.partition(":")[0] for line in lines] == [
        "batch b, T1 with fitted parameters",
        "batch b, extended parameters",
    ]


def test_a_verdict_that_determines_less_is_a_loss_on_the_same_recordings_only():
    def run(before, after, digest="same"):
        now = batch([5.0] * 4, verdict=after, digest=digest)
        return compare({"b": batch([5.0] * 4, verdict=before)}, {"b": now}, LIMITS)

    found = run("explained: kink at conduit", "undecided")
    assert found.losses == ["batch b: verdict explained: kink at conduit -> undecided"]
    assert not run("unexplained", "explained: kink at conduit").losses
    assert run("unexplained", "explained: kink at conduit").verdicts
    assert not run("agrees", "unexplained", digest="other").losses
    least_first = [("not diagnosed", "inputs-inconsistent"), ("unexplained",), ("undecided",)]
    least_first.append(("learned: load torque", "explained: kink at conduit", "agrees"))
    every = [(name, rank) for rank, names in enumerate(least_first) for name in names]
    for before, high in every:
        for after, low in every:
            assert bool(run(before, after).losses) == (low < high), (before, after)


def test_a_written_baseline_is_read_again_and_states_its_intervals(tmp_path):
    file, batches = tmp_path / "baseline.json", {"b": batch([5.0, 5.5, 5.0, 5.5])}
    write_baseline(file, make_baseline(batches, LIMITS, "2026-01-01", "abc", "first"))
    read = read_baseline(file)
    assert not compare(read.batches, batches, LIMITS).losses
    value, low, high = read.batches["b"].sets["fitted"].channels["tau_in_Nm"].accepted["error"]
    assert low < value < high
    assert outcome(batches["b"], batch([0.99 * high] * 4, digest="other")) == KEPT
    assert sum("tau_in_Nm" in line for line in file.read_text().splitlines()) == 1, "a channel is one line"


def test_the_intervals_of_a_baseline_by_hand():
    """Pairs of repeats that differ by 0.2 in bias and by ln 1.1 in ln error: two degrees of freedom."""
    one = batch([5.0, 5.5, 5.0, 5.5], biases=[1.0, 1.2, -0.5, -0.3])
    made = make_baseline({"b": one}, LIMITS, "2026-01-01", "abc", "first")
    # The spread of a bias is sqrt(0.02); that of a difference of two means of four sqrt(2 / 4) of it, which is 0.1.
    # Quantiles of 0.995 and 0.99 are 9.9248 and 6.9646.
    reach = 6.9646 * np.log(1.1) / np.sqrt(2) * np.sqrt(4 * (25.0**2 + 30.25**2) / 110.5**2)
    error, scatter = np.sqrt(27.625), np.sqrt(27.625 - 0.35**2)
    expected = {
        "bias": [0.35, 0.35 - 0.99248, 0.35 + 0.99248],
        "scatter": [scatter, scatter * np.exp(-reach), scatter * np.exp(reach)],
        "error": [error, error * np.exp(-reach), error * np.exp(reach)],
    }
    accepted = made.batches["b"].sets["fitted"].channels["tau_in_Nm"].accepted
    assert accepted == {name: [float(f"{v:.3g}") for v in row] for name, row in expected.items()}


@pytest.mark.parametrize(
    "text, says",
    [
        (None, "there is no baseline"),
        ("{", "not a baseline"),
        ("[]", "format None, and this version reads 1"),
        ('{"format": 2}', "format 2, and this version reads 1"),
        ('{"format": 1}', "Field required"),
    ],
)
def test_a_baseline_that_cannot_be_read_is_one_line(tmp_path, text, says):
    file = tmp_path / "baseline.json"
    if text is not None:
        file.write_text(text)
    with pytest.raises(InputError) as error:
        read_baseline(file)
    message = str(error.value)
    assert says in message
    assert str(file) in message
    assert "ccmodel accuracy accept" in message
    assert "\n" not in message


def test_errors_of_recordings_are_added_in_squares_by_channel():
    table = pd.DataFrame({"channel": ["a", "b", "a"], "nrmse_percent": [3.0, 7.0, 4.0]})
    assert dict(_error_by_channel(table)) == pytest.approx({"a": 12.5**0.5, "b": 7.0})
