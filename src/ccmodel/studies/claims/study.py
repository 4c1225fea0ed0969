"""The paper's statements in numbers: of recordings with intervals, of the simulations of them, of the model alone."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import pandas as pd

from ccmodel.failure import ModelError
from ccmodel.model.parameters import Parameters
from ccmodel.recording import Recording
from ccmodel.steps.files import Pair
from ccmodel.studies.claims import model_runs
from ccmodel.studies.claims.claim import Claim
from ccmodel.studies.claims.figure import model_figure, recordings_figure
from ccmodel.studies.claims.model_alone import model_claims
from ccmodel.studies.claims.recordings import recorded_claims
from ccmodel.studies.claims.settings import Claims
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.run import Outcome, Run
from ccmodel.studies.variables import batches_of

SETTINGS = Claims


def judge(claims: Claims, runs: Sequence[Run], measuring: Measuring) -> Outcome:
    """Judge all claims; a run's label is the variable of its study.

    The model alone runs with the parameters of the first run that has any.
    """
    pairs = {variable: [p for run in runs if run.label == variable for p in run.pairs] for variable in claims.studies}
    parameters = next((run.fitted.parameters for run in runs if run.fitted.parameters is not None), None)
    if parameters is not None and parameters.load_stiffness_Nm_per_rad is None:
        parameters = None
    found = claims_of(pairs, parameters, claims, measuring)
    table = pd.DataFrame([{"claim": c.name} | _stated(c) | asdict(row) for c in found for row in c.rows])
    stated = [{"name": c.name} | _stated(c) | {"sentence": c.sentence} for c in found]
    origins = batches_of([pair for group in pairs.values() for pair in group])
    figures = [recordings_figure(found, origins), model_figure(found, _loops(parameters, claims))]
    return Outcome(figures, [table], {"coverage": claims.coverage, "claims": stated})


def claims_of(
    pairs: Mapping[str, Sequence[Pair]], parameters: Parameters | None, claims: Claims, how: Measuring
) -> list[Claim]:
    """All claims, in the order of the paper.

    Parameters
    ----------
    pairs : mapping of str to sequence of (Recording, Recording or None)
        Recordings with their simulations, by the variable of their study: "bend", "pretension", "radius".
    parameters : Parameters or None
        Parameters of the model alone, with the stiffness of a load; None if no batch states them.
    claims : Claims
    how : Measuring
    """
    return recorded_claims(pairs, parameters, claims, how) + model_claims(parameters, claims, how)


def _stated(claim: Claim) -> dict[str, str]:
    by_model = "" if claim.by_model is None else str(claim.by_model)
    return {"section": claim.section, "says": claim.says, "borne_out": str(claim.borne_out), "by_model": by_model}


def _loops(parameters: Parameters | None, claims: Claims) -> dict[str, Recording]:
    if parameters is None:
        return {}
    try:
        return model_runs.loop_placements(parameters, claims.model)
    except ModelError:
        return {}
