"""Consistency of a batch: what its recordings and its batch file cannot all be right about.

`parity` has the relations between sensors, and between sensors and stated values; `signs`, `scales`, `clocks` and
`runs` each ask which single mistake breaks them; `limits` says how far physics alone may go. No model is run.
"""

from collections.abc import Sequence

from ccmodel.recording import Recording
from ccmodel.rig.batch import Batch
from ccmodel.rig.consistency.clocks import drifting_clocks
from ccmodel.rig.consistency.contradiction import Contradiction
from ccmodel.rig.consistency.parity import Parity
from ccmodel.rig.consistency.runs import copied_channels, foreign_runs, one_sensor_twice
from ccmodel.rig.consistency.scales import wrong_geometry, wrong_scales
from ccmodel.rig.consistency.signs import wrong_signs
from ccmodel.rig.findings import Finding


def contradictions(recordings: Sequence[Recording], batch: Batch) -> list[Contradiction]:
    """What recordings of a batch and its batch file contradict each other in.

    The checks go from what makes all others meaningless to what concerns one value: copies, geometry, signs, clocks,
    stated values, recordings among each other. A mistake of the whole batch ends them.
    """
    if not recordings:
        return []
    parities = [Parity(recording, batch) for recording in recordings]
    if found := one_sensor_twice(parities):
        return found
    copies = copied_channels(parities)
    named = {c.recording for c in copies}
    intact = [p for p in parities if p.recording.id not in named]
    if not intact:
        return copies
    for of_the_batch in (wrong_geometry, wrong_signs, drifting_clocks):
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


def check_consistency(recordings: list[Recording], batch: Batch) -> list[Finding]:
    """The contradictions of a batch as findings of severity "inconsistent"; see `contradictions`."""
    files = {entry.id: entry.file for entry in batch.recordings}
    return [
        Finding(
            batch.batch, files.get(c.recording or "", "batch.yaml"), None, c.what, "inconsistent", c.text, c.confidence
        )
        for c in contradictions(recordings, batch)
    ]
