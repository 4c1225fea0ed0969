"""A batch -> diagnosis.json, a page for a person, and the two models that were compared."""

from collections.abc import Callable
from pathlib import Path

from ccmodel import provenance
from ccmodel.diagnose.diagnosis import Diagnosis
from ccmodel.diagnose.diagnosis import diagnose as run
from ccmodel.model.failure import ModelError
from ccmodel.model.files import model_as_dict
from ccmodel.model.parameters import Parameters
from ccmodel.report.diagnosis import headline, write_diagnosis
from ccmodel.rig.ingest import ingest_batch
from ccmodel.stages.files import write_json
from ccmodel.typed import InputError


def diagnose(batch: Path, out: Path, tell: Callable[[str], None] = lambda text: None) -> str:
    """Diagnose a batch folder; the sentence that its page opens with.

    Raises
    ------
    InputError
        If the batch cannot be used.
    """
    ingested = ingest_batch(batch)
    refused = [f for f in ingested.findings if f.severity == "refused"]
    if ingested.batch is None or not ingested.recordings:
        raise InputError("\n".join(map(str, refused)) or f"{batch}: no recording that can be used")
    not_judged = [{"what": Path(f.file).name, "why": f.text} for f in refused]
    try:
        found = run(ingested.recordings, Parameters.estimated(ingested.batch.rig), not_judged, tell)
    except ModelError as error:
        raise InputError(f"{batch}: {error}") from None
    out.mkdir(parents=True, exist_ok=True)
    _write(found, batch, out)
    return headline(found.said)


def _write(found: Diagnosis, batch: Path, out: Path) -> None:
    inputs = provenance.of_inputs(sorted(p for p in batch.iterdir() if p.is_file()))
    # The same input gives the same files wherever it stands.
    inputs["sha256"] = {Path(name).name: digest for name, digest in inputs["sha256"].items()}
    write_json(out / "diagnosis.json", found.said | {"provenance": inputs})
    for name, trial in (("calibrated", found.judgement.calibrated), ("model", found.judgement.best)):
        write_json(out / f"{name}.json", model_as_dict(found.model(trial), inputs))
    write_diagnosis(out / "report.html", found)
