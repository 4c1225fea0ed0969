"""Intervals of linear functions of a candidate's unknowns, on fits of straight lines."""

from types import SimpleNamespace

import numpy as np
import pytest

from ccmodel.diagnosis.linear_functions import half_widths_of
from ccmodel.inference.cross_validation import jackknife
from ccmodel.inference.effective_samples import IN_DIAGNOSIS

TRUE = np.array([1.0, 2.0])
# A line's values at its abscissas' middle, at an end and beyond it.
FUNCTIONS = np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 1.5]])


def line(random, lengths, scatter=0.0, shared=0.0):
    """A line fitted to recordings of a channel with as many samples as it counts for.

    Each may have its own slope, with the standard deviation `scatter`; `shared` is that of errors that all have alike.
    """
    missed = shared * random.standard_normal(IN_DIAGNOSIS)
    J = [np.stack([np.ones(IN_DIAGNOSIS), length * np.linspace(-1, 1, IN_DIAGNOSIS)], axis=1) for length in lengths]
    y = [
        j @ (TRUE + scatter * random.standard_normal() * np.array([0.0, 1.0]))
        + missed
        + random.standard_normal(IN_DIAGNOSIS)
        for j in J
    ]

    def fitted(some):
        return np.linalg.lstsq(np.vstack([J[i] for i in some]), np.concatenate([y[i] for i in some]), rcond=None)[0]

    every = range(len(lengths))
    left_out = every if len(lengths) > 1 else ()
    without = [fitted([i for i in every if i != out]) for out in left_out]
    named = [dict(zip("ab", one, strict=True)) for one in without]
    information = [j.T @ j / IN_DIAGNOSIS for j in J]
    return SimpleNamespace(
        values=dict(zip("ab", fitted(every), strict=True)),
        loo_values=named,
        information=information,
        total_information=sum(information),
        prior_precision=np.zeros(2),
        sizes=np.ones(2),
        jacobian=J,
        by_channel={"one": np.mean([(y[i] - J[i] @ one) ** 2 for i, one in enumerate(without or [fitted(every)])])},
        whitened=[SimpleNamespace(measured=one[None], observations=recording(one)) for one in y],
    )


def recording(samples):
    return SimpleNamespace(channels=["one"], measured=samples[None])


def share_inside(lengths, scatter, draws=600, shared=0.0):
    random = np.random.default_rng(11)
    found = [line(random, lengths, scatter, shared) for _ in range(draws)]
    off = [np.abs(FUNCTIONS @ (np.array(list(one.values.values())) - TRUE)) for one in found]
    return np.mean(np.array(off) < [half_widths_of(one, FUNCTIONS) for one in found], axis=0)


@pytest.mark.parametrize("lengths", [[1.0] * 6, [4.0, 1.0, 1.0, 1.0, 1.0, 1.0]])
def test_intervals_hold_the_truth_where_the_noise_is_as_stated(lengths):
    """More often than stated, since they are the wider of two."""
    assert (share_inside(lengths, scatter=0.0) > 0.9).all()


def test_intervals_hold_the_truth_where_recordings_differ_by_more_than_noise():
    assert (share_inside([1.0] * 6, scatter=1.0) > 0.88).all()


@pytest.mark.parametrize("lengths", [[1.0] * 6, [4.0, 1.0, 1.0, 1.0, 1.0, 1.0]])
def test_intervals_hold_the_truth_where_all_recordings_have_an_error_alike(lengths):
    """Without it they would hold it half as often: no recording differs from the others by it."""
    inside = share_inside(lengths, scatter=0.0, shared=3.0)
    assert ((inside > 0.85) & (inside < 0.99)).all()


def test_what_one_channel_misses_widens_what_this_channel_determines():
    """Two channels determine a number each; the fit of one of them is bad."""
    J = np.kron(np.eye(2), np.ones((IN_DIAGNOSIS, 1)))
    both = SimpleNamespace(channels=["one", "other"], measured=np.zeros((2, IN_DIAGNOSIS)))
    fitted = SimpleNamespace(
        values={"a": 0.0, "b": 0.0},
        information=[J.T @ J / both.measured.size],
        prior_precision=np.zeros(2),
        sizes=np.ones(2),
        jacobian=[J],
        by_channel={"one": 9.0, "other": 1.0},
        whitened=[SimpleNamespace(measured=both.measured, observations=both)],
    )
    wide, narrow = half_widths_of(fitted, np.eye(2))
    assert wide == pytest.approx(3 * narrow)


@pytest.mark.parametrize("precision", [0.0, 0.7])
def test_one_recording_has_the_interval_of_its_information_and_of_the_prior(precision):
    one = line(np.random.default_rng(1), [1.0])
    one.prior_precision = np.array([0.0, precision])
    one.by_channel = {"one": 1.0}
    inverse = np.linalg.inv(IN_DIAGNOSIS * (one.information[0] + np.diag([0.0, precision**2])))
    assert half_widths_of(one, FUNCTIONS) == pytest.approx(
        1.6449 * np.sqrt(np.einsum("ka,ab,kb->k", FUNCTIONS, inverse, FUNCTIONS)), rel=1e-3
    )


def test_the_jackknife_of_functions_that_are_the_unknowns_is_that_of_the_unknowns():
    one = line(np.random.default_rng(2), [1.0, 2.0, 3.0, 4.0])
    total = sum(one.information)
    moved = np.array([list(values.values()) for values in one.loo_values]) - list(one.values.values())
    given = moved, one.information, np.linalg.inv(total), [np.linalg.inv(total - H) for H in one.information]
    covariance, degrees = jackknife(*given)
    swapped, degrees_swapped = jackknife(*given, functions=np.array([[0.0, 2.0], [1.0, 0.0]]))
    assert swapped == pytest.approx(covariance[::-1, ::-1] * [[4.0, 2.0], [2.0, 1.0]])
    assert degrees_swapped == pytest.approx(degrees[::-1])
