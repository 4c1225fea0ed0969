# What the rules share: the typed configuration, the batches, the studies, and the names of files.
import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError

from ccmodel.config import (
    EACH,
    ESTIMATED,
    batches_in,
    expand_studies,
    load_config,
)
from ccmodel.provenance import (
    content_digest,
    files_in,
    folder_digest,
    of_inputs,
    source_digest,
)
from ccmodel.studies.diagnosis.settings import MODEL_FILES
from ccmodel.typed import InputError

try:
    # The run's one configfile, read by its typed reader, which refuses unknown keys.
    stated = workflow.config_settings
    if workflow.is_main_process and (stated.config or len(stated.configfiles) > 1):
        raise InputError(
            "the configuration is one file: state all in it, without --config"
        )
    CONFIG = load_config(Path(workflow.configfiles[-1]))
    RAW = Path(CONFIG.raw)
    RESULTS = CONFIG.results
    BATCHES, UNUSABLE = batches_in(RAW)
    LOOPS = expand_studies(CONFIG, BATCHES)
    if CONFIG.concealed and not Path(CONFIG.concealed).is_file():
        raise InputError(f"concealed: there is no file {CONFIG.concealed}")
except InputError as error:
    print(error, file=sys.stderr)
    sys.exit(2)

# Names of all diagnoses: batches by themselves, and rigs whose batches are diagnosed together.
DIAGNOSES = [*CONFIG.diagnosed(BATCHES), *CONFIG.diagnosed_rigs]

# Every study by its name, in the order of the page.
STUDIES = LOOPS | CONFIG.judgements


wildcard_constraints:
    batch="[^/]+",
    parameters="[^/]+",
    scope="[^/]+",


def recordings_of(batch):
    return f"{RESULTS}/recordings/{batch}.nc"


def summary_of(batch):
    """File with what was read of a batch beside its recordings; jobs that read these read it too."""
    return f"{RESULTS}/recordings/{batch}.json"


def simulated_of(parameters, batch):
    return f"{RESULTS}/simulated/{parameters}/{batch}.nc"


def fit_of(parameters, batch):
    """File with the parameters of a batch: its own fit, its rig's, or a model of its diagnosis; "" for its estimates."""
    if parameters == ESTIMATED:
        return ""
    if parameters in MODEL_FILES:
        return f"{RESULTS}/diagnoses/{batch}/{MODEL_FILES[parameters]}"
    scope = batch if CONFIG.fits[parameters].batches == EACH else "shared"
    return f"{RESULTS}/fits/{parameters}/{scope}.json"


def verdict_of(diagnosed):
    """File with the verdict on a batch, or on the batches of a rig."""
    return f"{RESULTS}/diagnoses/{diagnosed}/diagnosis.json"


def fitted_to(wildcards):
    """Batches of one fit."""
    batches = CONFIG.fits[wildcards.parameters].batches
    return [wildcards.scope] if batches == EACH else batches


def diagnosed_together(wildcards):
    """A batch, or all batches of a rig; the wildcard is the name of either."""
    return CONFIG.diagnosed_rigs.get(wildcards.batch, [wildcards.batch])


def runs():
    """Every parameter set and batch that are simulated."""
    return [
        (parameters, batch)
        for parameters in CONFIG.parameter_sets
        for batch in BATCHES
        if parameters in CONFIG.sets_of(batch)
    ]


def figures(name, ending):
    return [
        f"{RESULTS}/figures/{stem.format(name=name)}.{ending}"
        for stem in STUDIES[name].figures
    ]


def csv_tables(name):
    return [
        f"{RESULTS}/tables/{stem.format(name=name)}.csv"
        for stem in STUDIES[name].tables
    ]


def tables(name):
    """The CSV files of a study and the JSON file that its part of the page shows."""
    csv = csv_tables(name)
    return csv + ([f"{RESULTS}/tables/{name}.json"] if csv else [])


def content_of(files):
    """Digest of files that are not made here. One that takes the place of another may have an older date, which
    Snakemake does not notice.
    """
    return content_digest(of_inputs(map(Path, files))["sha256"])[:16]


def in_report(file, caption, category, **labels):
    """Mark a file for `snakemake --report`, labelled with its name and with what else is given."""
    return report(
        file,
        caption=f"../report/{caption}.rst",
        category=category,
        labels=labels | {"file": Path(file).name},
    )
