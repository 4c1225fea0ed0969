"""A recording within its session: what its stated times and its place among the others say of its parameters."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ccmodel import mechanisms as registry
from ccmodel.model.active import Active, active_of
from ccmodel.model.parameters import Parameters, mechanism_key
from ccmodel.recording import Recording

# A drift is extrapolated to the length of the session before its middle and after it, and no further.
FURTHEST = 1.0


def with_session(parameters: Parameters, recordings: Sequence[Recording]) -> Parameters:
    """Parameters with the session's first and last start, if all recordings state theirs; otherwise without."""
    starts = [r.started_at_s for r in recordings]
    known = [s for s in starts if s is not None]
    if len(known) < len(starts) or len(set(known)) < 2:
        return replace(parameters, session_start_s=None, session_end_s=None)
    return replace(parameters, session_start_s=min(known), session_end_s=max(known))


def position_of(recording: Recording, parameters: Parameters) -> float:
    """Position of a recording in the session of the parameters: by its start, else by its order."""
    start, end = parameters.session_start_s, parameters.session_end_s
    if recording.started_at_s is None or start is None or end is None or not end > start:
        return recording.position
    return float(np.clip((recording.started_at_s - start) / (end - start) - 0.5, -FURTHEST, FURTHEST))


def known_states(recording: Recording, parameters: Parameters) -> dict[str, float]:
    """States of the mechanisms at the recording's start that follow from its stated times, by parameter."""
    if recording.started_at_s is None or recording.tensioned_at_s is None:
        return {}
    seconds = recording.started_at_s - recording.tensioned_at_s
    return {
        mechanism_key(m.name, m.place, state): value
        for m in parameters.mechanisms
        if (states := registry.get(m.name).states_after_tensioning) is not None
        for state, value in states(seconds, registry.get(m.name).default | dict(m.values)).items()
    }


def of_recording(parameters: Parameters, recording: Recording) -> Parameters:
    """Parameters in one recording: with the states that it begins at, and drifted to its place in the session.

    A drift is done when it has changed the parameters, or a mechanism that does not drift: it stands no longer among
    their mechanisms.
    """
    if not parameters.mechanisms:
        return parameters
    # With a value for every parameter, states that are not stated included.
    parameters = replace(parameters, mechanisms=tuple(active_of(parameters.mechanisms)))
    if states := known_states(recording, parameters):
        parameters = parameters.with_values(states)
    drifts = [m for m in parameters.mechanisms if registry.get(m.name).drift is not None]
    if not drifts:
        return parameters
    position = position_of(recording, parameters)
    kept = [m for m in parameters.mechanisms if m not in drifts]
    values: dict[str, float] = {}
    for m in drifts:
        name, change = str(registry.get(m.name).drift), m.values["change"] * position
        if name in registry.names():
            kept = _shifted(kept, name, m.place, change)
        else:
            values[name] = values.get(name, parameters.value_of(name)) * (1 + change)
    return replace(parameters.with_values(values), mechanisms=tuple(kept))


def _shifted(mechanisms: Sequence[Active], name: str, place: str, change: float) -> list[Active]:
    """Mechanisms with the only parameter of one of them changed; it is added if it is not there."""
    (parameter,) = registry.get(name).parameters
    before = next((m.values[parameter.name] for m in mechanisms if (m.name, m.place) == (name, place)), 0.0)
    others = [m for m in mechanisms if (m.name, m.place) != (name, place)]
    return [*others, Active(name, place, {parameter.name: before + change})]
