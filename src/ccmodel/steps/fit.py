"""Recordings of a fit's batches -> fitted parameters."""

from collections.abc import Sequence
from math import inf
from pathlib import Path

from ccmodel import provenance
from ccmodel.failure import ModelError
from ccmodel.inference.fit import FitResult, fit
from ccmodel.inference.observations import Observations, with_pooled_noise
from ccmodel.inference.problem import Free, Problem
from ccmodel.model.parameters import Parameters
from ccmodel.progress import Progress, silent
from ccmodel.recording import read_recordings
from ccmodel.steps.files import estimates_of, write_json
from ccmodel.steps.settings import Fit, FreeParameter, OwnParameter


def fit_parameters(
    name: str, stated: Fit, recordings_files: Sequence[Path], result_file: Path, progress: Progress = silent
) -> None:
    """Fit a parameter set and write the result as JSON; a failed fit is written too, with its reason."""
    result = _fit(stated, recordings_files, progress)
    write_json(result_file, {"fit": name, **result.as_dict(), "provenance": provenance.of_inputs(recordings_files)})


def _fit(stated: Fit, recordings_files: Sequence[Path], progress: Progress) -> FitResult:
    progress("reading the recordings", 0.0)
    pairs = [
        (recording, estimates)
        for file in recordings_files
        if (estimates := estimates_of(file)) is not None
        for recording in read_recordings(file)
    ]
    if not pairs:
        return FitResult(False, "no usable recording to fit")
    try:
        shared = {name: _start(name, free, pairs[0][1]) for name, free in stated.free.items()}
        offset_is_free = "drive_encoder_offset" in stated.per_recording
        at_start = {name: free.start for name, free in shared.items()}
        observations = [
            Observations.of(
                r, p.with_values(at_start), stated.channels, stated.step_s, stated.tolerance, offset_is_free
            )
            for r, p in pairs
        ]
    except (ModelError, ValueError) as error:
        return FitResult(False, str(error), recordings=[f"{r.batch}/{r.id}" for r, _ in pairs])
    own = {name: _start(name, one, pairs[0][1], one.spread) for name, one in stated.per_recording.items()}
    return fit(Problem(with_pooled_noise(observations), shared, own), stated.starts, stated.profile, progress)


def _start(name: str, free: FreeParameter | OwnParameter, estimates: Parameters, spread: float | None = None) -> Free:
    """An unknown of the fit; it starts at the configured value or, without one, at the batch's estimate."""
    start = free.start if free.start is not None else getattr(estimates, name)
    if start is None:
        raise ModelError(f"{name} needs a start in the configuration: the batch file has no estimate of it")
    return Free(start, *(free.bounds or (-inf, inf)), spread)
