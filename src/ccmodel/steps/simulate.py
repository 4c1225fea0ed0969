"""Recordings of a batch and, if any, a fit -> simulations."""

from collections.abc import Sequence
from pathlib import Path

from ccmodel import provenance
from ccmodel.failure import ModelError
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import simulate_recording
from ccmodel.progress import Progress, each_of, silent
from ccmodel.recording import Recording, read_recordings, write_recordings
from ccmodel.steps.files import fitted, write_json


def simulate(
    recordings_file: Path,
    fit_file: Path | None,
    simulated_file: Path,
    summary_file: Path,
    progress: Progress = silent,
) -> None:
    """Simulate every recording of a batch, with its own estimates or with the parameters of a fit or a diagnosis.

    A recording on which the model cannot be run has no simulation, and a line in the summary.
    """
    parameters = fitted(recordings_file, fit_file).parameters
    pairs: list[tuple[Recording, Recording]] = []
    failures: list[tuple[Recording, Exception]] = []
    if parameters is not None:
        pairs, failures = simulate_each(read_recordings(recordings_file), parameters, progress)
    inputs = [recordings_file] + ([] if fit_file is None else [fit_file])
    write_recordings(simulated_file, [simulated for _, simulated in pairs], provenance.of_inputs(inputs))
    write_json(summary_file, {"failures": [str(error) for _, error in failures]})


def simulate_each(
    recordings: Sequence[Recording], parameters: Parameters, progress: Progress = silent
) -> tuple[list[tuple[Recording, Recording]], list[tuple[Recording, Exception]]]:
    """Recordings with their simulations, and those on which the model cannot be run, with the reason."""
    pairs: list[tuple[Recording, Recording]] = []
    failures: list[tuple[Recording, Exception]] = []
    for recording in each_of(recordings, progress, lambda one: f"simulating {one.batch}/{one.id}"):
        try:
            pairs.append((recording, simulate_recording(recording, parameters)))
        except (ModelError, ValueError) as error:
            failures.append((recording, error))
    return pairs, failures
