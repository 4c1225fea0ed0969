"""A batch -> its diagnosis: diagnosis.json, a page, and the models that were compared."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from ccmodel import mechanisms as registry
from ccmodel import provenance
from ccmodel.diagnose.diagnosis import Diagnosis, Options
from ccmodel.diagnose.diagnosis import diagnose as run
from ccmodel.failure import ModelError
from ccmodel.model.files import model_as_dict, read_model
from ccmodel.model.parameters import Parameters
from ccmodel.recording import read_recordings
from ccmodel.report.verdict import headline
from ccmodel.rig.ingest import ingest_batch
from ccmodel.steps.files import estimates_of, read_json, write_json
from ccmodel.studies.diagnosis.page import write_diagnosis, write_not_diagnosed
from ccmodel.studies.diagnosis.settings import MODEL_FILES, Diagnosing
from ccmodel.typed import InputError

# The page of a run of the pipeline, seen from the report of a diagnosis.
PAGE_OF_RUN = "../../index.html"


def diagnose(
    batch: Path,
    out: Path,
    options: Options = Options(),  # noqa: B008
    baseline: Path | None = None,
    report: Callable[[str], None] = lambda text: None,
) -> dict:
    """Diagnose a batch folder and write the files of its diagnosis.

    Parameters
    ----------
    batch, out : Path
        Batch folder; folder of the files.
    options : Options
    baseline : Path, optional
        Model file to start from, instead of the batch's own estimates.
    report : callable
        Gets a line on each stage.

    Returns
    -------
    dict
        The content of diagnosis.json.

    Raises
    ------
    InputError
        If the batch or the model file cannot be used, or an excluded name is no mechanism.
    """
    try:
        for name in options.without:
            registry.get(name)
    except registry.UnknownMechanismError as error:
        raise InputError(f"--without: {error}") from None
    ingested = ingest_batch(batch)
    if ingested.batch is None or not ingested.recordings:
        refused = [str(f) for f in ingested.findings if f.severity == "refused"]
        raise InputError("\n".join(refused) or f"{batch}: no recording that can be used")
    not_judged = _refused(map(asdict, ingested.findings))
    inputs = provenance.of_inputs(provenance.files_in(batch), batch)
    known = read_model(baseline) if baseline else None
    if options.freeze and known is None:
        raise InputError("--freeze: there is no model to hold; name one with --baseline")
    try:
        estimates = Parameters.estimated(ingested.batch.rig)
        found = run(ingested.recordings, estimates, options, known, not_judged, report)
    except (ModelError, ValueError) as error:
        raise InputError(f"{batch}: {error}") from None
    content = _write(found, inputs, out)
    if not content["nearest"]:
        (out / MODEL_FILES["nearest"]).unlink()
    return content


def diagnose_recordings(recordings_file: Path, out: Path, settings: Diagnosing | None = None) -> None:
    """Diagnose a batch that the pipeline has read; a batch that cannot be diagnosed has files with the reason."""
    estimates, recordings = estimates_of(recordings_file), read_recordings(recordings_file)
    inputs = provenance.of_inputs([recordings_file])
    try:
        if estimates is None or not recordings:
            raise ModelError("no recording that can be used")
        not_judged = _refused(read_json(recordings_file.with_suffix(".json"))["findings"])
        found = run(recordings, estimates, options_of(settings or Diagnosing()), not_judged=not_judged)
    except (ModelError, ValueError) as error:
        name, reason = recordings_file.stem, str(error)
        out.mkdir(parents=True, exist_ok=True)
        write_json(out / "diagnosis.json", {"batch": name, "verdict": None, "why": reason})
        for file in MODEL_FILES.values():
            write_json(out / file, _no_model(reason))
        write_not_diagnosed(out / "report.html", name, reason, PAGE_OF_RUN)
        return
    _write(found, inputs, out, PAGE_OF_RUN)


def _refused(findings: Iterable[Mapping]) -> list[dict[str, str]]:
    """Files that were refused, with the reason."""
    return [{"what": Path(f["file"]).name, "why": f["text"]} for f in findings if f["severity"] == "refused"]


def options_of(settings: Diagnosing, without: Sequence[str] = (), freeze: bool = False) -> Options:
    """Options of a diagnosis from the configuration's."""
    return Options(**settings.model_dump(exclude_none=True), without=without, freeze=freeze)


def _no_model(reason: str) -> dict:
    return {"succeeded": False, "message": reason}


def _write(found: Diagnosis, inputs: dict, out: Path, page: str | None = None) -> dict:
    """Write diagnosis.json, the page and the models; without a nearest model, its file states why."""
    out.mkdir(parents=True, exist_ok=True)
    content = found.report | {"headline": headline(found.report), "provenance": inputs}
    write_json(out / "diagnosis.json", content)
    judged = found.judgement
    models = {"calibrated": judged.calibrated, "extended": judged.best}
    if found.report["nearest"]:
        models["nearest"] = judged.nearest
    for name, file in MODEL_FILES.items():
        without = _no_model(f"verdict '{judged.verdict}': the diagnosis has no {name} model")
        write_json(out / file, model_as_dict(found.model(models[name]), inputs) if name in models else without)
    write_diagnosis(out / "report.html", found, page)
    return content
