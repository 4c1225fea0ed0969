"""Fit parameters of the model to recordings."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ccmodel.config import Fit
from ccmodel.model.paper import ModelError
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import PRESCRIBED, ModelInput, simulate
from ccmodel.recording import Recording

# Relative step of the derivatives: the exact solver rounds at 1e-13, and a front that reaches a corner a little earlier
# or later than before blurs a sample less, the smaller the step.
DIFFERENCE_STEP = 1e-6
# Far below what repeated recordings differ by (1 %).
TOLERANCE = 1e-5
# Why scipy's least_squares stops, by its status.
STOPPED = {
    -1: "the optimiser was given improper input",
    0: "stopped at the largest number of evaluations without converging",
    1: "converged: no direction leads downhill",
    2: "converged: the error no longer falls",
    3: "converged: the parameters no longer change",
    4: "converged: neither the error falls nor the parameters change",
}


@dataclass(frozen=True)
class FitResult:
    """What a fit found, or why there is none.

    Attributes
    ----------
    succeeded : bool
    message : str
        The optimiser's reason for stopping, or what went wrong.
    values : dict
        Fitted values by parameter name, SI units; empty where the fit failed.
    at_bound : list of str
        Parameters that ended on one of their bounds: the data, or the bounds, are not enough.
    cost : float or None
        Mean square of the errors, each over its channel's peak to peak.
    evaluations : int
    recordings : list of str
        What was fitted.
    """

    succeeded: bool
    message: str
    values: dict[str, float]
    at_bound: list[str]
    cost: float | None
    evaluations: int
    recordings: list[str]

    def as_dict(self) -> dict:
        """Plain data for a JSON file."""
        return asdict(self)


def fit(recordings: Iterable[tuple[Recording, Parameters]], problem: Fit) -> FitResult:
    """Least squares over all samples that are judged, every channel over its own peak to peak.

    Parameters
    ----------
    recordings : iterable of (Recording, Parameters)
        Each with its batch's beforehand estimates; what is free is shared by all.
    problem : Fit
        What is free, between which bounds, compared in which channels.

    Returns
    -------
    FitResult
        A failed fit is a result that says so, not an exception.
    """
    given = [(ModelInput.of(r, problem.step_s), p) for r, p in recordings]
    names = [f"{g.recording.batch}/{g.recording.id}" for g, _ in given]
    if not given:
        return FitResult(False, "no usable recording to fit", {}, [], None, 0, [])
    start = _start(problem, given[0][1])
    unknown = [name for name, value in start.items() if value is None]
    if unknown:
        text = f"{unknown[0]} needs a start in the configuration: the batch file has no estimate of it"
        return FitResult(False, text, {}, [], None, 0, names)
    low, high = (np.array([problem.free[n].bounds[i] for n in start]) for i in (0, 1))
    x0 = np.array(list(start.values()))
    if (outside := (x0 < low) | (x0 > high)).any():
        name = list(start)[int(np.argmax(outside))]
        return FitResult(False, f"{name} starts at {start[name]:.4g}, outside its bounds", {}, [], None, 0, names)

    # Every parameter is searched for as z = 1 at its start and of the order of one, also where it starts at zero.
    scale = np.where(x0 != 0, np.abs(x0), 0.01 * (high - low))

    def physical(z: NDArray) -> dict[str, float]:
        return dict(zip(start, (x0 + (z - 1) * scale).tolist(), strict=True))

    def residuals(z: NDArray) -> NDArray:
        values = physical(z)
        return np.concatenate([_errors(g, p.with_values(values), problem.channels) for g, p in given])

    bounds = 1 + (low - x0) / scale, 1 + (high - x0) / scale
    try:
        found = least_squares(
            residuals,
            np.ones_like(x0),
            bounds=bounds,
            x_scale="jac",
            diff_step=DIFFERENCE_STEP,
            ftol=TOLERANCE,
            xtol=TOLERANCE,
        )
    except (ModelError, ValueError) as error:
        return FitResult(False, str(error), {}, [], None, 0, names)
    at_bound = [n for n, active in zip(start, found.active_mask, strict=True) if active]
    values = physical(found.x)
    mean_square = float(np.mean(found.fun**2))
    return FitResult(bool(found.success), STOPPED[found.status], values, at_bound, mean_square, int(found.nfev), names)


def _start(problem: Fit, estimates: Parameters) -> dict[str, float]:
    """Start values: as configured, else as estimated."""
    return {
        name: free.start if free.start is not None else getattr(estimates, name) for name, free in problem.free.items()
    }


def _errors(given: ModelInput, parameters: Parameters, channels: list[str]) -> NDArray:
    recording, simulated = given.recording, simulate(given, parameters)
    judged = recording.time_s >= max(recording.rest_s, recording.settled_s)
    errors = [
        (simulated[c][judged] - recording[c][judged]) / np.ptp(recording[c][judged])
        for c in channels
        if c in recording and simulated.derived_from[c] != PRESCRIBED
    ]
    if not errors:
        raise ModelError(f"{recording.batch}/{recording.id}: none of {', '.join(channels)} was recorded")
    return np.concatenate(errors)
