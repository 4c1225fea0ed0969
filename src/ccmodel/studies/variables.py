"""The variable of a study: its value in a recording, and the label of a value in a legend."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from ccmodel.recording import ORIGIN, Recording
from ccmodel.steps.files import Pair


def value_of(recording: Recording, variable: str) -> float | str:
    """The value of a study's variable in a recording, in SI units.

    Parameters
    ----------
    recording : Recording
    variable : str
        "bend" (rad), "pretension" (N), "radius" (m, of the tightest bend), "frequency" (Hz) or "load_level" (share),
        the last two as noted under `excitation`; or "recording" for the recording's name.

    Returns
    -------
    float or str
        NaN where the recording does not state the value, or notes something that is no number.
    """
    if variable == "recording":
        return f"{recording.batch}/{recording.id}"
    if variable == "bend":
        return recording.path.bend_rad
    if variable == "pretension":
        return recording.pretension_N
    if variable == "radius":
        bent = recording.path.piece_bend_rad > 0
        return float((recording.path.piece_length_m[bent] / recording.path.piece_bend_rad[bent]).min(initial=np.inf))
    noted = {"frequency": "frequency_Hz", "load_level": "load_level"}[variable]
    try:
        return float(recording.excitation[noted])
    except (KeyError, TypeError, ValueError, OverflowError):
        return np.nan


def label_of(value: float | str, variable: str) -> str:
    """Label of a variable's value in a legend."""
    if isinstance(value, str):
        return value
    if np.isnan(value):
        return f"{variable.replace('_', ' ')} not stated"
    if variable == "bend":
        half_loops = value / np.pi
        whole = abs(half_loops - round(half_loops)) < 0.01
        return f"{half_loops:.0f} × 180°" if whole else f"{np.degrees(value):.0f}°"
    return {
        "pretension": f"{value:g} N",
        "radius": "straight" if np.isinf(value) else f"{100 * value:.2f} cm",
        "frequency": f"{value:g} Hz",
        "load_level": f"load {100 * value:g} %",
    }[variable]


def by_label(pairs: Sequence[Pair], variable: str) -> dict[str, list[Pair]]:
    """Pairs by the label of their recording, in the order of the variable's values; repeats share a label.

    If measured and simulated recordings are in one study, every label names the origin.
    """
    mixed = len({recorded.origin for recorded, _ in pairs}) > 1
    values = [value_of(recorded, variable) for recorded, _ in pairs]
    groups: dict[str, list[Pair]] = {}
    # Values that are not stated (NaN) come last.
    for i in pd.Series(values, dtype=object).sort_values(kind="stable").index:
        origin = f", {ORIGIN[pairs[i][0].origin]}" if mixed else ""
        groups.setdefault(label_of(values[i], variable) + origin, []).append(pairs[i])
    return groups


def origins_of(recordings: Iterable[Recording]) -> str:
    """Origins of recordings, as figures and pages name them."""
    return " and ".join(ORIGIN[origin] for origin in sorted({r.origin for r in recordings}))


def batches_by_origin(recordings: Iterable[tuple[str, str]]) -> str:
    """Which batches were measured and which simulated, for the title of a figure.

    Parameters
    ----------
    recordings : iterable of (str, str)
        Batch and origin of each recording.
    """
    batches: dict[str, set[str]] = {}
    for batch, origin in recordings:
        batches.setdefault(origin, set()).add(batch)
    return "; ".join(f"{ORIGIN[origin]}: {', '.join(sorted(batches[origin]))}" for origin in sorted(batches))


def batches_of(pairs: Iterable[Pair]) -> str:
    """The same of recordings with their simulations."""
    return batches_by_origin((recorded.batch, recorded.origin) for recorded, _ in pairs)
