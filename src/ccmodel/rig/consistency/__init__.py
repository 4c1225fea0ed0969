"""Consistency of a batch: what its recordings and its batch file cannot all be right about.

`parity` has the relations between sensors, and between sensors and stated values; `signs`, `exchanges`, `rectified`,
`scales`, `clocks` and `runs` each ask which single mistake breaks them; `transmissions` and `sessions` compare torques
and times with what is stated; `limits` says how far physics alone may go. No model is run.
"""

from collections.abc import Sequence

from ccmodel.recording import Recording
from ccmodel.rig.batch import Batch
from ccmodel.rig.consistency.clocks import drifting_clocks
from ccmodel.rig.consistency.contradiction import Contradiction
from ccmodel.rig.consistency.parity import Parity
from ccmodel.rig.consistency.rectified import rectified_torques
from ccmodel.rig.consistency.runs import copied_channels, foreign_runs, one_sensor_twice
from ccmodel.rig.consistency.scales import doubtful_stiffness, doubtful_travel, wrong_geometry, wrong_scales
from ccmodel.rig.consistency.sessions import overlapping
from ccmodel.rig.consistency.signs import wrong_signs
from ccmodel.rig.consistency.transmissions import doubtful_pair, pair_as_single, single_as_pair
from ccmodel.rig.findings import Finding, Severity


def contradictions(parities: Sequence[Parity]) -> list[Contradiction]:
    """What recordings of a batch and its batch file contradict each other in.

    The checks go from what makes all others meaningless to what concerns one value: kind of transmission, times of
    starts, copies, geometry, signs, clocks, stated values, recordings among each other. A mistake of the whole batch
    ends them.
    """
    if found := one_sensor_twice(parities) or pair_as_single(parities) or single_as_pair(parities):
        return found
    copies = [*overlapping(parities), *copied_channels(parities)]
    named = {c.recording for c in copies}
    intact = [p for p in parities if p.recording.id not in named]
    if not intact:
        return copies
    for of_the_batch in (wrong_geometry, rectified_torques, wrong_signs, drifting_clocks):
        found = of_the_batch(intact)
        if any(c.recording is None for c in found):
            return [*copies, *found]
        copies += found
    named = {c.recording for c in copies}
    intact = [p for p in intact if p.recording.id not in named]
    if not intact:
        return copies
    found = wrong_scales(intact)
    return [*copies, *(found or foreign_runs(intact))]


def doubts(parities: Sequence[Parity]) -> list[Contradiction]:
    """What is probably wrong with a batch that contradicts itself in nothing."""
    return [*doubtful_pair(parities), *doubtful_travel(parities), *doubtful_stiffness(parities)]


def check_consistency(recordings: list[Recording], batch: Batch) -> list[Finding]:
    """The contradictions of a batch as findings of severity "inconsistent", otherwise its doubts as warnings."""
    if not recordings:
        return []
    files = {entry.id: entry.file for entry in batch.recordings}
    parities = [Parity(recording, batch) for recording in recordings]
    severity: Severity = "inconsistent"
    if not (found := contradictions(parities)):
        severity, found = "warning", doubts(parities)
    return [
        Finding(batch.batch, files.get(c.recording or "", "batch.yaml"), None, c.what, severity, c.text, c.confidence)
        for c in found
    ]
