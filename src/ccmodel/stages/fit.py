"""Recordings of a fit's batches -> fitted values."""

from collections.abc import Sequence
from math import inf
from pathlib import Path

from ccmodel import provenance
from ccmodel.config import Fit
from ccmodel.failure import ModelError
from ccmodel.inference.fit import FitResult, fit
from ccmodel.inference.observations import Observations
from ccmodel.inference.problem import Free, Problem
from ccmodel.model.parameters import Parameters
from ccmodel.recording import read_recordings
from ccmodel.stages.files import estimates_of, write_json


def fit_parameters(name: str, stated: Fit, recordings_files: Sequence[Path], result_file: Path) -> None:
    """Fit a parameter set; a fit that fails is a result that says so."""
    result = _fit(stated, recordings_files)
    write_json(result_file, {"fit": name, **result.as_dict(), "provenance": provenance.of_inputs(recordings_files)})


def _fit(stated: Fit, recordings_files: Sequence[Path]) -> FitResult:
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
    own = {name: _start(name, each, pairs[0][1], each.spread) for name, each in stated.per_recording.items()}
    return fit(Problem(observations, shared, own), stated.starts, stated.profile)


def _start(name: str, free, estimates: Parameters, spread: float | None = None) -> Free:
    """As configured, else as estimated."""
    start = free.start if free.start is not None else getattr(estimates, name)
    if start is None:
        raise ModelError(f"{name} needs a start in the configuration: the batch file has no estimate of it")
    return Free(start, *(free.bounds or (-inf, inf)), spread)
