"""Claims that the model decides by itself: deadband and load, place of the loop, sections of the discretisation."""

from operator import itemgetter

import numpy as np

from ccmodel.failure import ModelError
from ccmodel.model.paper import SECTIONS as PAPER_SECTIONS
from ccmodel.model.parameters import Parameters
from ccmodel.studies.claims import model_runs
from ccmodel.studies.claims.claim import MODEL_ALONE, Claim, Row, Verdict, percent, spread_percent, three_digits
from ccmodel.studies.claims.settings import Claims
from ccmodel.studies.loops.measures import QUANTITIES, measure
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.variables import label_of


def model_claims(parameters: Parameters | None, claims: Claims, how: Measuring) -> list[Claim]:
    """Claims on the model; none without parameters."""
    if parameters is None:
        return []
    try:
        return [_load(parameters, claims, how), _placement(parameters, claims, how), _sections(parameters, claims)]
    except ModelError as error:
        return [Claim("model-studies", "VI", "studies of the model alone", Verdict.OPEN, str(error))]


def _rows(quantities: tuple[str, ...], condition: str, at: float, values: dict, gaps: dict) -> list[Row]:
    return [
        Row(q, QUANTITIES[q].unit, condition, at, MODEL_ALONE, model=values.get(q), gap=gaps.get(q, ""))
        for q in quantities
    ]


def _load(parameters: Parameters, claims: Claims, how: Measuring) -> Claim:
    """Lost motion and backlash over the stiffness of the load's spring."""
    study, quantities = claims.model, ("lost_motion", "width", "backlash", "slack_share")
    taut: list[tuple[float, dict[str, float]]] = []
    slack: list[tuple[float, dict[str, float]]] = []
    rows = []
    for stiffness in study.load_stiffness_Nm_per_rad:
        simulated = model_runs.run(parameters, model_runs.even(study), study, stiffness)
        values, gaps = measure(simulated, quantities, how)
        rows += _rows(quantities, f"load {stiffness:g} N·m/rad", stiffness, values, gaps)
        if "slack_share" in values and "lost_motion" in values:
            (slack if values["slack_share"] > claims.seen_percent else taut).append((stiffness, values))
    changes = {q: spread_percent([v[q] for _, v in taut if q in v]) for q in ("lost_motion", "width")}
    compared = [change for change in changes.values() if change is not None]
    whole = spread_percent([v["lost_motion"] for _, v in taut + slack])
    verdict = Verdict.PART if whole is not None and whole > claims.small_percent else Verdict.YES
    if any(change >= claims.small_percent for change in compared):
        verdict = Verdict.NO
    elif len(compared) < len(changes):
        verdict = Verdict.OPEN
    says = "the deadband depends on friction under pretension, not on the load"
    return Claim("deadband-and-load", "VI", says, verdict, _load_sentence(taut, slack, changes), rows)


def _load_sentence(taut: list, slack: list, changes: dict) -> str:
    if not taut:
        return "With every load a cable goes slack." if slack else "With no load was there a lost motion to compare."
    taut, slack = (sorted(rows, key=itemgetter(0)) for rows in (taut, slack))
    (soft, first), (stiff, _) = taut[0], taut[-1]
    lost, width = (None if c is None else f"{percent(c)} %" for c in (changes["lost_motion"], changes["width"]))
    if lost is None:
        sentence = (
            f"Only with a spring of {soft:g} N·m/rad does no cable go slack: the lost motion is"
            f" {first['lost_motion']:.4g} rad, and was not compared between loads."
        )
    else:
        sentence = (
            f"With springs of {soft:g} to {stiff:g} N·m/rad no cable goes slack: the lost motion is"
            f" {first['lost_motion']:.4g} rad and changes by {lost}, the loop's width"
            f" {f'by {width}' if width else 'was not compared'}."
        )
    if slack:
        stiffness, values = slack[-1]
        sentence += (
            f" Once one does, the statement fails: at {stiffness:g} N·m/rad a cable is slack for"
            f" {values['slack_share']:.0f} % of the cycle and the lost motion is {values['lost_motion']:.3g} rad."
        )
    return sentence


def _placement(parameters: Parameters, claims: Claims, how: Measuring) -> Claim:
    """Transmission with the one loop at the drive end, in the middle and at the load end."""
    study = claims.model
    quantities = ("lost_motion", "backlash", "width", "slope", "work_lost")
    found, rows = {}, []
    for i, (place, simulated) in enumerate(model_runs.loop_placements(parameters, study).items()):
        found[place], gaps = measure(simulated, quantities, how)
        rows += _rows(quantities, f"loop {place}", i, found[place], gaps)
    spreads = (spread_percent([v[q] for v in found.values() if q in v]) for q in ("lost_motion", "slope"))
    profile = [spread for spread in spreads if spread is not None]
    moves = Verdict.YES if max(profile, default=0.0) > claims.small_percent else Verdict.NO
    verdict = moves if len(profile) == 2 else Verdict.OPEN
    parts = []
    for place, values in found.items():
        lost, width, slope = (three_digits(values.get(q)) for q in ("lost_motion", "width", "slope"))
        parts.append(f"{place}: lost motion {lost} rad, width {width} mN·m, slope {slope}")
    sentence = (
        f"One loop of {np.degrees(study.bend_rad):.0f}° and {label_of(study.loop_radius_m, 'radius')} radius"
        f" {'; '.join(parts)}. With the bend, and so the capstan loss, the same, what moves is the stretch of the"
        " straight cable before and behind the loop."
    )
    says = "where the loop lies does not change the capstan effect, but the stretch and with it the transmission"
    return Claim("loop-placement", "VI", says, verdict, sentence, rows)


def _sections(parameters: Parameters, claims: Claims) -> Claim:
    """Error of the paper's discretisation over the number of its sections."""
    study, rows, parts, enough = claims.model, [], [], []
    for bend in study.sections_bend_rad:
        path, name = model_runs.even(study, bend), label_of(bend, "bend")
        exact = model_runs.run(parameters, path, study)
        errors = {}
        for n in study.sections:
            errors[n] = model_runs.error_percent(model_runs.run(parameters, path, study, sections=n), exact)
            rows.append(Row("sections_error", "%", f"{name}, {n} sections", n, MODEL_ALONE, model=errors[n]))
        needed = model_runs.sections_needed(errors, study.sections_error_percent)
        fewest = f"more than {max(errors)}" if needed is None else str(needed)
        own = f"; the paper's {PAPER_SECTIONS} leave {errors[PAPER_SECTIONS]:.2g} %" if PAPER_SECTIONS in errors else ""
        parts.append(f"{name}: {fewest} of those tried{own}")
        enough.append(errors.get(PAPER_SECTIONS, np.inf) <= study.sections_error_percent)
    sentence = (
        f"Sections for an error below {study.sections_error_percent:g} % of peak to peak in the worst channel, against"
        " the exact solver: " + "; ".join(parts) + "."
    )
    says = f"simulates with {PAPER_SECTIONS} sections of each cable, and names no error"
    verdict = Verdict.YES if all(enough) else Verdict.PART if any(enough) else Verdict.NO
    return Claim("sections", "III-B and IV", says, verdict, sentence, rows)
