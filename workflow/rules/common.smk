# What the rules share: the typed configuration, the batches that are there, and which file belongs to what.
import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError

from ccmodel.config import (
    EACH,
    ESTIMATED,
    EXTENDED,
    PHASE_FIGURES,
    batches_in,
    expand_studies,
    load_config,
)
from ccmodel.provenance import files_in, source_digest
from ccmodel.typed import InputError

try:
    # The run's one configfile, read by its typed reader, which refuses unknown keys.
    CONFIG = load_config(Path(workflow.configfiles[-1]))
    RAW = Path(CONFIG.raw)
    RESULTS = CONFIG.results
    BATCHES, UNUSABLE = batches_in(RAW)
    STUDIES = expand_studies(CONFIG, BATCHES)
except InputError as error:
    print(error, file=sys.stderr)
    sys.exit(2)


wildcard_constraints:
    batch="[^/]+",
    parameters="[^/]+",
    scope="[^/]+",
    study="[^/]+",


def recordings_of(batch):
    return f"{RESULTS}/recordings/{batch}.nc"


def simulated_of(parameters, batch):
    return f"{RESULTS}/simulated/{parameters}/{batch}.nc"


def fit_of(parameters, batch):
    """What a batch is simulated with: the fit of its own, the one that all share, or the model that its diagnosis found."""
    if parameters == EXTENDED:
        return f"{RESULTS}/diagnoses/{batch}/model.json"
    scope = batch if CONFIG.fits[parameters].batches == EACH else "shared"
    return f"{RESULTS}/fits/{parameters}/{scope}.json"


def diagnosed():
    """Batches that are diagnosed."""
    return BATCHES if CONFIG.diagnose == EACH else CONFIG.diagnose


def fits():
    return sorted({fit_of(name, batch) for name in CONFIG.fits for batch in BATCHES})


def runs():
    """Every (parameter set, recordings, simulated)."""
    return [
        (p, recordings_of(b), simulated_of(p, b))
        for p in CONFIG.parameter_sets
        for b in (diagnosed() if p == EXTENDED else BATCHES)
    ]


def fit_if_any(parameters, batch):
    """The fit's file in a list; an empty one for what a batch states beforehand."""
    return [] if parameters == ESTIMATED else [fit_of(parameters, batch)]


def claim_runs():
    """Every (variable, parameter set, batch) of the studies that the claims are judged by."""
    return [
        (variable, CONFIG.parameters_of(STUDIES[study]), batch)
        for variable, study in CONFIG.claims.studies.items()
        for batch in STUDIES[study].batches
    ]
