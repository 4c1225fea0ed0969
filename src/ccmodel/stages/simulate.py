"""A batch's recordings and, if any, a fit -> what the model says of them."""

from pathlib import Path

from ccmodel import provenance
from ccmodel.failure import ModelError
from ccmodel.model.run import simulate_recording
from ccmodel.recording import read_recordings, write_recordings
from ccmodel.stages.files import fitted, write_json


def simulate(recordings_file: Path, fit_file: Path | None, simulated_file: Path, summary_file: Path) -> None:
    """Run the model beside every recording of a batch; with its own estimates, or with what a fit or diagnosis found.

    What the model cannot be run on has no simulation, and a line in the summary.
    """
    parameters = fitted(recordings_file, fit_file).parameters
    simulated, failures = [], []
    for recording in read_recordings(recordings_file) if parameters is not None else []:
        try:
            simulated.append(simulate_recording(recording, parameters))
        except (ModelError, ValueError) as error:
            failures.append(str(error))
    inputs = [recordings_file] + ([] if fit_file is None else [fit_file])
    write_recordings(simulated_file, simulated, provenance.of_inputs(inputs))
    write_json(summary_file, {"failures": failures})
