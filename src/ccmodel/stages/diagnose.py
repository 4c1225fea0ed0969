"""A batch -> diagnosis.json, a page for a person, and the two models that were compared."""

import html
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from ccmodel import mechanisms as registry
from ccmodel import provenance
from ccmodel.config import Diagnosing
from ccmodel.diagnose.diagnosis import Diagnosis, Options
from ccmodel.diagnose.diagnosis import diagnose as run
from ccmodel.failure import ModelError
from ccmodel.model.files import model_as_dict, read_model
from ccmodel.model.parameters import Parameters
from ccmodel.recording import read_recordings
from ccmodel.report.diagnosis import headline, write_diagnosis
from ccmodel.rig.ingest import ingest_batch
from ccmodel.stages.files import estimates_of, read_json, write_json
from ccmodel.typed import InputError


def diagnose(
    batch: Path,
    out: Path,
    without: Sequence[str] = (),
    tell: Callable[[str], None] = lambda text: None,
    judged: Diagnosing | None = None,
    baseline: Path | None = None,
    freeze: bool = False,
) -> dict:
    """Diagnose a batch folder, beside what a model file has already; what diagnosis.json says.

    Raises
    ------
    InputError
        If the batch or the model file cannot be used, or there is no mechanism of a name in `without`.
    """
    try:
        for name in without:
            registry.get(name)
    except registry.UnknownMechanismError as error:
        raise InputError(f"--without: {error}") from None
    ingested = ingest_batch(batch)
    if ingested.batch is None or not ingested.recordings:
        refused = [str(f) for f in ingested.findings if f.severity == "refused"]
        raise InputError("\n".join(refused) or f"{batch}: no recording that can be used")
    not_judged = _refused(map(asdict, ingested.findings))
    inputs = provenance.of_inputs(provenance.files_in(batch), batch)
    try:
        estimates = Parameters.estimated(ingested.batch.rig)
        known = read_model(baseline) if baseline else None
        if freeze and known is None:
            raise InputError("--freeze: there is no model to hold; name one with --baseline")
        options = _options(judged, without)
        found = run(ingested.recordings, estimates, options, known, freeze, not_judged, tell)
    except (ModelError, ValueError) as error:
        raise InputError(f"{batch}: {error}") from None
    return _write(found, inputs, out)


def _refused(findings: Iterable[Mapping]) -> list[dict[str, str]]:
    """Of what was found wrong with a batch, what took a recording away."""
    return [{"what": Path(f["file"]).name, "why": f["text"]} for f in findings if f["severity"] == "refused"]


def _options(judged: Diagnosing | None, without: Sequence[str] = ()) -> Options:
    return Options(**(judged or Diagnosing()).model_dump(exclude_none=True), without=without)


def diagnose_recordings(recordings_file: Path, out: Path, judged: Diagnosing | None = None) -> None:
    """The same for recordings that the pipeline has read; a batch that cannot be diagnosed has a file that says why."""
    estimates, recordings = estimates_of(recordings_file), read_recordings(recordings_file)
    inputs = provenance.of_inputs([recordings_file])
    try:
        if estimates is None or not recordings:
            raise ModelError("no recording that can be used")
        not_judged = _refused(read_json(recordings_file.with_suffix(".json"))["findings"])
        found = run(recordings, estimates, _options(judged), not_judged=not_judged)
    except (ModelError, ValueError) as error:
        out.mkdir(parents=True, exist_ok=True)
        write_json(out / "diagnosis.json", {"batch": recordings_file.stem, "verdict": None, "why": str(error)})
        for name in ("calibrated", "model"):
            write_json(out / f"{name}.json", {"succeeded": False, "message": str(error)})
        (out / "report.html").write_text(f"<p>{recordings_file.stem}: not diagnosed: {html.escape(str(error))}</p>\n")
        return
    _write(found, inputs, out)


def _write(found: Diagnosis, inputs: dict, out: Path) -> dict:
    out.mkdir(parents=True, exist_ok=True)
    said = found.report | {"headline": headline(found.report), "provenance": inputs}
    write_json(out / "diagnosis.json", said)
    for name, trial in (("calibrated", found.judgement.calibrated), ("model", found.judgement.best)):
        write_json(out / f"{name}.json", model_as_dict(found.model(trial), inputs))
    (out / "nearest.json").unlink(missing_ok=True)  # of an earlier run
    if found.report["nearest"]:
        write_json(out / "nearest.json", model_as_dict(found.model(found.judgement.nearest), inputs))
    write_diagnosis(out / "report.html", found)
    return said
