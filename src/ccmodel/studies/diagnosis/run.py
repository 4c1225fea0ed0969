"""A batch -> its diagnosis: diagnosis.json, a page, and the models that were compared."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from ccmodel import mechanisms as registry
from ccmodel import provenance
from ccmodel.diagnosis.run import Diagnosis, Options
from ccmodel.diagnosis.run import diagnose as run
from ccmodel.failure import ModelError
from ccmodel.model.files import model_as_dict, read_model
from ccmodel.model.parameters import Parameters
from ccmodel.progress import Progress, silent, within
from ccmodel.recording import Recording, read_recordings
from ccmodel.report.verdict import headline
from ccmodel.rig.findings import Finding
from ccmodel.rig.ingest import ingest_batch
from ccmodel.steps.files import estimates_of, read_json, write_json
from ccmodel.studies.diagnosis import inconsistent
from ccmodel.studies.diagnosis.page import write_diagnosis, write_inconsistent, write_not_diagnosed
from ccmodel.studies.diagnosis.settings import MODEL_FILES, Diagnosing
from ccmodel.typed import InputError

# The page of a run of the pipeline, seen from the report of a diagnosis.
PAGE_OF_RUN = "../../index.html"
# Shares of the time at which the batch is read, and at which the page is written.
INGEST, PAGE = 0.05, 0.95


def diagnose(
    batch: Path,
    out: Path,
    options: Options = Options(),  # noqa: B008
    baseline: Path | None = None,
    progress: Progress = silent,
    trust_inputs: bool = False,
) -> dict:
    """Diagnose a batch folder and write the files of its diagnosis.

    Parameters
    ----------
    batch, out : Path
        Batch folder; folder of the files.
    options : Options
    baseline : Path, optional
        Model file to start from, instead of the batch's own estimates.
    progress : Progress
    trust_inputs : bool
        Whether to diagnose even if the inputs contradict one another.

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
    ingested = ingest_batch(batch, within(progress, 0.0, INGEST))
    contradict = not trust_inputs and any(f.is_inconsistent for f in ingested.findings)
    if ingested.batch is None or not (ingested.recordings or contradict):
        refused = [str(f) for f in ingested.findings if f.severity == "refused"]
        raise InputError("\n".join(refused) or f"{batch}: no recording that can be used")
    inputs = provenance.of_inputs(provenance.files_in(batch), batch)
    known = read_model(baseline) if baseline else None
    if options.freeze and known is None:
        raise InputError("--freeze: there is no model to hold; name one with --baseline")
    if contradict:
        content = inconsistent.report(ingested.batch.batch, ingested.findings, options.freeze)
        content = _write_inconsistent(content, ingested.recordings, inputs, out)
    else:
        try:
            estimates, not_judged = Parameters.estimated(ingested.batch.rig), _not_judged(ingested.findings)
            found = run(ingested.recordings, estimates, options, known, not_judged, within(progress, INGEST, PAGE))
        except (ModelError, ValueError) as error:
            raise InputError(f"{batch}: {error}") from None
        progress("writing the page", PAGE)
        content = _write(found, inputs, out)
    if not content["nearest"]:
        (out / MODEL_FILES["nearest"]).unlink()
    return content


def diagnose_recordings(
    recordings_file: Path, out: Path, settings: Diagnosing | None = None, progress: Progress = silent
) -> None:
    """Diagnose a batch that the pipeline has read; a batch that cannot be diagnosed has files with the reason."""
    estimates, recordings = estimates_of(recordings_file), read_recordings(recordings_file)
    settings, inputs = settings or Diagnosing(), provenance.of_inputs([recordings_file])
    findings = [Finding(**f) for f in read_json(recordings_file.with_suffix(".json"))["findings"]]
    if estimates is not None and not settings.trust_inputs and any(f.is_inconsistent for f in findings):
        content = inconsistent.report(recordings_file.stem, findings)
        _write_inconsistent(content, recordings, inputs, out, PAGE_OF_RUN)
        return
    try:
        if estimates is None or not recordings:
            raise ModelError("no recording that can be used")
        found = run(recordings, estimates, options_of(settings), None, _not_judged(findings), progress)
    except (ModelError, ValueError) as error:
        name, reason = recordings_file.stem, str(error)
        out.mkdir(parents=True, exist_ok=True)
        write_json(out / "diagnosis.json", {"batch": name, "verdict": None, "why": reason})
        _write_models(out, {}, dict.fromkeys(MODEL_FILES, reason))
        write_not_diagnosed(out / "report.html", name, reason, PAGE_OF_RUN)
        return
    _write(found, inputs, out, PAGE_OF_RUN)


def _not_judged(findings: Iterable[Finding]) -> list[dict]:
    """Files that were refused, and contradictions of inputs that are trusted, with the reason."""
    refused = [{"what": Path(f.file).name, "why": f.text} for f in findings if f.severity == "refused"]
    trusted = [f for f in findings if f.severity == "inconsistent"]
    return [*refused, *({"what": f.place, "why": f.text, "confidence": f.confidence} for f in trusted)]


def options_of(settings: Diagnosing, without: Sequence[str] = (), freeze: bool = False) -> Options:
    """Options of a diagnosis from the configuration's."""
    stated = settings.model_dump(exclude_none=True, exclude={"trust_inputs"})
    return Options(**stated, without=without, freeze=freeze)


def _write_models(out: Path, models: Mapping[str, dict], reasons: Mapping[str, str]) -> None:
    """Write the model files; one without a model states the reason."""
    for name, file in MODEL_FILES.items():
        write_json(out / file, models.get(name) or {"succeeded": False, "message": reasons[name]})


def _without(verdict: str) -> dict[str, str]:
    """Why a verdict lacks a model, by the model's name."""
    return {name: f"verdict '{verdict}': the diagnosis has no {name} model" for name in MODEL_FILES}


def _write_inconsistent(
    report: dict, recordings: Sequence[Recording], inputs: dict, out: Path, page: str | None = None
) -> dict:
    """Write diagnosis.json and the page of inputs that contradict one another, and files that state no model."""
    out.mkdir(parents=True, exist_ok=True)
    content = report | {"headline": headline(report), "provenance": inputs}
    write_json(out / "diagnosis.json", content)
    _write_models(out, {}, _without(report["verdict"]))
    write_inconsistent(out / "report.html", content, recordings, page)
    return content


def _write(found: Diagnosis, inputs: dict, out: Path, page: str | None = None) -> dict:
    """Write diagnosis.json, the page and the models; without a nearest model, its file states why."""
    out.mkdir(parents=True, exist_ok=True)
    content = found.report | {"headline": headline(found.report), "provenance": inputs}
    write_json(out / "diagnosis.json", content)
    judged = found.judgement
    models = {"calibrated": judged.calibrated, "extended": judged.best}
    if found.report["nearest"]:
        models["nearest"] = judged.nearest
    written = {name: model_as_dict(found.model(candidate), inputs) for name, candidate in models.items()}
    _write_models(out, written, _without(judged.verdict))
    write_diagnosis(out / "report.html", found, page)
    return content
