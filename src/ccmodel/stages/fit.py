"""Recordings of a fit's batches -> fitted values."""

from collections.abc import Sequence
from pathlib import Path

from ccmodel import provenance
from ccmodel.config import Fit
from ccmodel.identify.fit import fit
from ccmodel.recording import read_recordings
from ccmodel.stages.files import estimates_of, write_json


def fit_parameters(name: str, problem: Fit, recordings_files: Sequence[Path], result_file: Path) -> None:
    """Fit a parameter set; a fit that fails is a result that says so."""
    pairs = [
        (recording, estimates)
        for file in recordings_files
        if (estimates := estimates_of(file)) is not None
        for recording in read_recordings(file)
    ]
    result = fit(pairs, problem)
    write_json(result_file, {"fit": name, **result.as_dict(), "provenance": provenance.of_inputs(recordings_files)})
