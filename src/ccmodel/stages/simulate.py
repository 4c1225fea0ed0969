"""A batch's recordings and, if any, a fit -> what the model says of them."""

from pathlib import Path

from ccmodel import provenance
from ccmodel.model.failure import ModelError
from ccmodel.model.run import simulate_recording
from ccmodel.recording import read_recordings, write_recordings
from ccmodel.stages.files import estimates_of, read_json, write_json


def simulate(recordings_file: Path, fit_file: Path | None, simulated_file: Path, summary_file: Path) -> None:
    """Run the model beside every recording of a batch; with the batch's own estimates, or with those fitted.

    What the model cannot be run on has no simulation, and a line in the summary.
    """
    estimates = estimates_of(recordings_file)
    found = {"succeeded": True, "values": {}} if fit_file is None else read_json(fit_file)
    simulated, failures = [], []
    for recording in read_recordings(recordings_file) if found["succeeded"] else []:
        try:
            simulated.append(simulate_recording(recording, estimates.with_values(found["values"])))
        except (ModelError, ValueError) as error:
            failures.append(str(error))
    inputs = [recordings_file] + ([] if fit_file is None else [fit_file])
    write_recordings(simulated_file, simulated, provenance.of_inputs(inputs))
    write_json(summary_file, {"failures": failures})
