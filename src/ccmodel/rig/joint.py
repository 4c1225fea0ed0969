"""Several batches of one rig, taken together: what belongs to the rig must be stated alike in all of them.

Each recording keeps the calibration of its own batch: zeros and sensitivities of sensors, signs and accuracies may
differ from batch to batch. Estimates of stiffness and friction may differ too; those of the first batch are used.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import reduce
from typing import Any

from ccmodel.rig.batch import Rig
from ccmodel.rig.findings import Finding
from ccmodel.rig.ingest import Ingested
from ccmodel.typed import InputError

# Keys of `rig` that are alike in all batches, stated or not.
ALIKE = (
    "transmission",
    "far_end",
    "drive.pulley_radius_m",
    "load.pulley_radius_m",
    "load.spring_stiffness_Nm_per_rad",
    "cable.length_m",
)
# Keys that are alike where two batches state them: constants of sensors that a log may do without.
ALIKE_IF_STATED = tuple(
    f"{end}.{key}" for end in ("drive", "load") for key in ("encoder_counts_per_rev", "torque_constant_Nm_per_A")
)
# Keys of estimates, of which the first batch's are used.
ESTIMATES = ("cable.stiffness_N_per_m", "cable.friction_coefficient")
# Between the names of batches.
AND = " + "


def together(batches: Sequence[tuple[str, Ingested]], name: str | None = None) -> Ingested:
    """Batches of one rig as one; a batch by itself, without a name of a rig, as it is.

    Parameters
    ----------
    batches : sequence of (str, Ingested)
        Each batch with its `batch.yaml` or folder, for messages.
    name : str, optional
        Name of the whole; the default joins those of the batches.

    Returns
    -------
    Ingested
        Its recordings have ids such as ``loops/loops-1-a``. Estimates that differ are findings, warnings.

    Raises
    ------
    InputError
        A line for each thing that says that the batches are not of one rig; or if two of them have one name.
    """
    if len(batches) == 1 and name is None:
        return batches[0][1]
    (first_file, first), *others = batches
    names = [ingested.stated.batch for _, ingested in batches]
    if twice := [one for k, one in enumerate(names) if one in names[:k]]:
        files = " and ".join(file for (file, _), one in zip(batches, names, strict=True) if one == twice[0])
        raise InputError(f"{files}: two batches are called '{twice[0]}'; recordings are told apart by their batch")
    if differ := [line for file, other in others for line in _differences(first_file, first, file, other)]:
        raise InputError("\n".join(differ))
    name = name or AND.join(names)
    recordings = [
        replace(r, batch=name, id=f"{one}/{r.id}")
        for one, (_, ingested) in zip(names, batches, strict=True)
        for r in ingested.recordings
    ]
    findings = [f for _, ingested in batches for f in ingested.findings]
    findings += [f for file, other in others for f in _estimates(name, first_file, first, file, other)]
    stated = first.stated.model_copy(update={"batch": name})
    return Ingested(recordings, findings, stated, parts=tuple(names))


def _differences(first_file: str, first: Ingested, file: str, other: Ingested) -> Iterator[str]:
    """What says that two batches are not of one rig, a line each."""
    origins = first.stated.origin, other.stated.origin
    if origins[0] != origins[1]:
        yield _line(first_file, file, "origin", *origins, "measured and simulated recordings are not of one rig")
    for key in ALIKE + ALIKE_IF_STATED:
        values = _value(first.stated.rig, key), _value(other.stated.rig, key)
        if values[0] == values[1] or (key in ALIKE_IF_STATED and None in values):
            continue
        why = "batches of one rig state the same value: mend the wrong one, or diagnose them one by one"
        yield _line(first_file, file, f"rig.{key}", *values, why)


def _line(first_file: str, file: str, key: str, first: Any, other: Any, why: str) -> str:
    of_first, of_other = ("absent" if value is None else value for value in (first, other))
    return f"{file}: {key} is {of_other}, but {of_first} in {first_file}: {why}"


def _estimates(name: str, first_file: str, first: Ingested, file: str, other: Ingested) -> Iterator[Finding]:
    """Estimates that differ from the first batch's, which are used."""
    for key in ESTIMATES:
        values = _value(first.stated.rig, key), _value(other.stated.rig, key)
        if values[0] != values[1]:
            text = f"is {values[1]:g}, but {values[0]:g} in {first_file}: the search starts from the latter"
            yield Finding(name, file, None, f"rig.{key}", "warning", text)


def _value(rig: Rig, key: str) -> Any:
    return reduce(getattr, key.split("."), rig)
