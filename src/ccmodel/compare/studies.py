"""What varies in a study: the value of a variable in a recording, and how the legend names it."""

from collections.abc import Iterable

import numpy as np

from ccmodel.recording import Recording


def value_of(recording: Recording, variable: str) -> float | str:
    """The value of a study's variable in a recording, in SI units.

    Parameters
    ----------
    recording : Recording
    variable : str
        "bend" (rad), "pretension" (N), "radius" (m, of the tightest bend), "frequency" (Hz) and "load_level" (share)
        as noted of the excitation, or "recording" for its name.

    Returns
    -------
    float or str
        NaN where the recording does not say.
    """
    if variable == "recording":
        return recording.id
    if variable == "bend":
        return recording.path.bend_rad
    if variable == "pretension":
        return recording.pretension_N
    if variable == "radius":
        bent = recording.path.piece_bend_rad > 0
        return float((recording.path.piece_length_m[bent] / recording.path.piece_bend_rad[bent]).min(initial=np.inf))
    noted = {"frequency": "frequency_Hz", "load_level": "load_level"}[variable]
    return float(recording.excitation.get(noted, np.nan))


def label_of(value: float | str, variable: str) -> str:
    """How a legend names a value of a variable."""
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
        "radius": f"{100 * value:.2f} cm",
        "frequency": f"{value:g} Hz",
        "load_level": f"load {100 * value:g} %",
    }[variable]


def grouped(recordings: Iterable[Recording], variable: str) -> dict[str, list[Recording]]:
    """Recordings by the label of a variable's value, in the order of the values; repeats come together."""
    groups: dict[str, list[Recording]] = {}
    for recording in sorted(recordings, key=lambda r: value_of(r, variable)):
        groups.setdefault(label_of(value_of(recording, variable), variable), []).append(recording)
    return groups
