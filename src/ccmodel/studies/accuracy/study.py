"""Accuracy of the model against recordings, by two measures that other fields report.

Bias and scatter, after the validation guide of the Fire Dynamics Simulator (NIST SP 1018-3, chapter "Quantifying Model
Uncertainty"; McGrattan and Toman, Metrologia 48, 2011). With M_i modelled and E_i recorded, i = 1 .. n, and sigma_E the
relative standard uncertainty of the recordings,

    mean = 1/n sum ln(M_i / E_i),    sigma_M^2 + sigma_E^2 = 1/(n - 1) sum (ln(M_i / E_i) - mean)^2,
    delta = exp(mean + sigma_M^2 / 2 - sigma_E^2 / 2):

the model gives delta times the true value, with the relative standard deviation sigma_M. No recording can show that a
model is more accurate than the recording itself. sigma_E therefore accounts for at most half of the variance; where
this limit acts, sigma_M is an upper bound.

Comparison errors, after ASME V&V 20: E = S - D, simulated minus recorded, against the validation uncertainty

    u_val = sqrt(u_num^2 + u_input^2 + u_D^2)

of the numerical solution, of the model's inputs and of the data. The error of the model itself lies between E - k u_val
and E + k u_val; where |E| <= k u_val, the comparison cannot resolve it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from ccmodel.channels import MEASURED, TENSIONS, THETA_IN, short_name
from ccmodel.distributions import student_quantile
from ccmodel.failure import ModelError
from ccmodel.model.parameters import Parameters
from ccmodel.model.run import PRESCRIBED, ModelInput, simulate
from ccmodel.recording import Recording
from ccmodel.repeats import condition_of, pooled_scatter, without_repeat
from ccmodel.studies.accuracy.figure import ratio_figure, scatter_figure
from ccmodel.studies.accuracy.settings import Accuracy
from ccmodel.studies.loops.measures import QUANTITIES, Quantity, measure
from ccmodel.studies.loops.settings import Measuring
from ccmodel.studies.run import Outcome, Run

SETTINGS = Accuracy

JUDGED = (*map(short_name, (*MEASURED, *TENSIONS)), "width", "backlash", "lost_motion", "work_lost")
FEWEST = 3  # pairs for a standard deviation
BY_RECORDING = (
    dict.fromkeys(("batch", "recording", "origin", "quantity", "unit"), str)
    | dict.fromkeys(("recorded", "modelled", "E"), float)
    | dict.fromkeys(("u_num", "u_input", "u_sensor", "u_repeat", "u_D", "u_val"), float)
    | {"within": bool, "fitted": bool, "inputs_left_out": str}
)


@dataclass(frozen=True)
class BiasAndScatter:
    """The model's bias factor and relative standard deviation of one quantity.

    Attributes
    ----------
    delta, delta_low, delta_high : float
        Bias factor and the interval that holds it.
    sigma_M, sigma_E : float
        Relative standard deviation of the model, and that of the recordings up to its limit.
    limited : bool
        Whether half of the variance was the limit of sigma_E.
    count : int
        Number of pairs.
    """

    delta: float
    delta_low: float
    delta_high: float
    sigma_M: float
    sigma_E: float
    limited: bool
    count: int


def bias_and_scatter(
    modelled: Sequence[float], recorded: Sequence[float], sigma_E: float, coverage: float
) -> BiasAndScatter:
    """Bias and scatter of a model without the uncertainty of the recordings, by the equations above.

    Parameters
    ----------
    modelled, recorded : sequence of float
        Pairs of values, all positive.
    sigma_E : float
        Relative standard uncertainty of a recorded value.
    coverage : float
        Coverage probability of the bias's interval, for independent pairs.

    Raises
    ------
    ValueError
        With fewer than three pairs, or a value that is not positive.
    """
    M, E = np.asarray(modelled, dtype=float), np.asarray(recorded, dtype=float)
    if M.size < FEWEST:
        raise ValueError(f"{M.size} pairs, fewer than the {FEWEST} that a scatter takes")
    if not ((M > 0) & (E > 0)).all():
        raise ValueError("a value is not positive, so that no ratio can be formed")
    ratio = np.log(M / E)
    mean, variance = float(ratio.mean()), float(ratio.var(ddof=1))
    limit = np.sqrt(variance / 2)
    used = min(sigma_E, limit)
    sigma_M = np.sqrt(variance - used**2)
    centre = mean + (sigma_M**2 - used**2) / 2
    reach = student_quantile(0.5 + coverage / 2, M.size - 1) * np.sqrt(variance / M.size)
    delta, low, high = np.exp([centre, centre - reach, centre + reach]).tolist()
    return BiasAndScatter(delta, low, high, float(sigma_M), float(used), bool(sigma_E > limit), M.size)


@dataclass(frozen=True)
class Case:
    """A recording with its simulation, and the uncertainty of the model's parameters.

    Attributes
    ----------
    recorded, modelled : Recording
    parameters : Parameters
        Parameters of the simulation.
    input_sd : mapping of str to float
        Standard deviations of the fitted parameters, taken as independent; infinite for a parameter that the recordings
        do not determine.
    fitted : bool
        Whether the parameters were fitted to this recording.
    """

    recorded: Recording
    modelled: Recording
    parameters: Parameters
    input_sd: Mapping[str, float]
    fitted: bool


def judge(settings: Accuracy, runs: Sequence[Run], measuring: Measuring) -> Outcome:
    """Compare all recordings of the runs with their simulations."""
    table = comparison_table([case for run in runs for case in _cases(run)], settings, measuring)
    lines = summary(table, settings)
    flat = pd.DataFrame([line | {"inputs_left_out": " ".join(line["inputs_left_out"])} for line in lines])
    figures = [draw(table, lines, settings.coverage_factor) for draw in (scatter_figure, ratio_figure)]
    return Outcome(figures, [flat, table], {"settings": settings.model_dump(), "quantities": lines})


def _cases(run: Run) -> list[Case]:
    fit = run.fitted
    if fit.parameters is None:
        return []
    return [
        Case(recorded, simulated, fit.parameters, fit.sds, f"{recorded.batch}/{recorded.id}" in fit.recordings)
        for recorded, simulated in run.pairs
        if simulated is not None
    ]


def sensor_uncertainty(quantity: Quantity, recording: Recording) -> float | None:
    """Standard uncertainty of a quantity due to its sensors, in its unit; None where a sensor states no accuracy.

    The stated accuracy of a channel is taken as one standard deviation, that of a counted angle as its step over
    sqrt(12). A quantity is the difference of two independent readings. The uncertainty of a loop's width is that of x,
    and that of y divided by the loop's mean gradient. Averaging over samples is not credited.
    """
    known = {**recording.accuracy} | {c: step / np.sqrt(12) for c, step in recording.encoder_step_rad.items()}
    if not known.keys() >= set(quantity.channels):
        return None
    sd, *second = (known[c] for c in quantity.channels)
    if quantity is QUANTITIES["work_lost"]:
        sd *= np.ptp(recording[THETA_IN])
    elif second:
        x, y = quantity.channels
        sd = np.hypot(sd, second[0] * np.ptp(recording[x]) / np.ptp(recording[y]))
    return float(quantity.factor * np.sqrt(2) * sd)


def comparison_table(cases: Sequence[Case], settings: Accuracy, how: Measuring) -> pd.DataFrame:
    """Comparison errors: a row for each recording and quantity, with the columns of `BY_RECORDING`.

    A quantity has no row if it cannot be measured in the recording or in its simulation, if a sensor states no
    accuracy, or if the model was given one of its channels.
    """
    rows = [row for case in cases for row in _rows(case, how)]
    table = pd.DataFrame(rows, columns=[*BY_RECORDING, "condition"])
    for _, group in table.groupby(["origin", "quantity"]):
        # Repeats scatter relative to the model, which knows the initial tension of each repeat.
        positive = group[(group["recorded"] > 0) & (group["modelled"] > 0)]
        ratios = np.log(positive["recorded"] / positive["modelled"]).groupby(positive["condition"])
        scatter, _ = pooled_scatter(ratios.apply(list), relative=False)
        table.loc[group.index, "u_repeat"] = scatter * group["recorded"].abs()
    table["u_D"] = np.hypot(table["u_sensor"].astype(float), table["u_repeat"].astype(float))
    table["u_val"] = np.sqrt(sum(table[u].astype(float) ** 2 for u in ("u_num", "u_input", "u_D")))
    table["within"] = table["E"].abs() <= settings.coverage_factor * table["u_val"]
    return table[list(BY_RECORDING)].astype(BY_RECORDING)


def _rows(case: Case, how: Measuring) -> list[dict]:
    recorded, modelled = case.recorded, case.modelled
    predicted = [q for q in JUDGED if not _prescribed(QUANTITIES[q], modelled)]
    D, S = measure(recorded, predicted, how)[0], measure(modelled, predicted, how)[0]
    sensors = {q: sensor_uncertainty(QUANTITIES[q], recorded) for q in D if q in S}
    judged = [q for q, sd in sensors.items() if sd is not None]
    if not judged:
        return []
    u_num, u_input, left_out = _model_uncertainty(case, judged, how)
    return [
        {
            "batch": recorded.batch,
            "recording": recorded.id,
            "condition": condition_of(recorded),
            "origin": recorded.origin,
            "quantity": q,
            "unit": QUANTITIES[q].unit,
            "recorded": D[q],
            "modelled": S[q],
            "E": S[q] - D[q],
            "u_num": u_num[q],
            "u_input": u_input[q],
            "u_sensor": sensors[q],
            "fitted": case.fitted,
            "inputs_left_out": " ".join(left_out),
        }
        for q in judged
    ]


def _prescribed(quantity: Quantity, modelled: Recording) -> bool:
    """Whether the model was given a channel of the quantity, apart from the drive angle, which it is always given."""
    given = {c for c, source in modelled.derived_from.items() if source == PRESCRIBED} - {THETA_IN}
    return not given.isdisjoint(quantity.channels)


def _model_uncertainty(case: Case, names: Sequence[str], how: Measuring) -> tuple[dict, dict, list[str]]:
    """Standard uncertainties of simulated quantities due to the numerical solution and to the inputs; inputs left out.

    Numerical: the change when every other sample is left out; the samples are the only grid of the exact solver.
    Inputs: the change when one parameter is larger by its standard deviation, or the tension at rest by its accuracy,
    added in squares. A parameter without a finite standard deviation, or with which the model cannot be run, is left
    out.
    """
    given = ModelInput.of(case.recorded)
    base = measure(simulate(given, case.parameters), names, how)[0]
    coarse = measure(simulate(_every_other(given), case.parameters), names, how)[0]
    squares, left_out = dict.fromkeys(names, 0.0), []
    for name, value in _shifted(case).items():
        try:
            if not np.isfinite(value):
                raise ModelError(f"{name} is not determined")
            shifted = measure(simulate(given, case.parameters.with_values({name: value})), names, how)[0]
        except (ModelError, ValueError):
            left_out.append(name)
            continue
        for q in names:
            squares[q] += (shifted.get(q, base[q]) - base[q]) ** 2
    u_num = {q: abs(coarse.get(q, base[q]) - base[q]) for q in names}
    return u_num, {q: float(np.sqrt(square)) for q, square in squares.items()}, left_out


def _shifted(case: Case) -> dict[str, float]:
    """By parameter, its value plus one standard deviation."""
    shifted = {name: case.parameters.value_of(name) + sd for name, sd in case.input_sd.items()}
    read = [case.recorded.accuracy.get(tension, 0.0) for tension in case.recorded.tensions]
    if case.parameters.pretension_N is None and all(read) and case.recorded.rest_s > 0:
        shifted["pretension_scale"] = case.parameters.pretension_scale * (1 + max(read) / case.recorded.pretension_N)
    return shifted


def _every_other(given: ModelInput) -> ModelInput:
    thin: dict[str, Any] = {name: values[..., ::2] for name, values in given.series.items()}
    return replace(given, recording=given.recording[::2], **thin)


def summary(table: pd.DataFrame, settings: Accuracy) -> list[dict]:
    """Bias, scatter, and mean, root mean square and uncertainty of the comparison errors, by origin and quantity.

    A quantity with too few pairs has the reason under `gap`, and None for bias and scatter.
    """
    lines = []
    for (origin, quantity), group in table.groupby(["origin", "quantity"], sort=False):
        relative = np.hypot(group["u_D"], group["u_input"]) / group["recorded"].abs()
        sigma_E = float(np.sqrt((relative**2).mean()))
        line = {"origin": origin, "quantity": quantity, "text": QUANTITIES[quantity].text,
                "unit": QUANTITIES[quantity].unit, "recordings": len(group), "fitted": int(group["fitted"].sum()),
                "sigma_E_stated": sigma_E, **dict.fromkeys(BiasAndScatter.__annotations__), "gap": ""}  # fmt: skip
        try:
            line |= vars(bias_and_scatter(group["modelled"], group["recorded"], sigma_E, settings.coverage))
        except ValueError as gap:
            line["gap"] = str(gap)
        repeats = len(group) - len(set(group["batch"] + "/" + group["recording"].map(without_repeat)))
        line |= {"repeats": repeats, "inputs_left_out": sorted(set(" ".join(group["inputs_left_out"]).split()))}
        line |= {"E_mean": float(group["E"].mean()), "within": int(group["within"].sum())}
        line |= {f"{u}_rms": float(np.sqrt((group[u] ** 2).mean())) for u in ("E", "u_num", "u_input", "u_D", "u_val")}
        lines.append(line)
    return lines
