"""Consistency checks: whether the recordings of a batch contradict one another or `batch.yaml`."""

from collections.abc import Sequence

from ccmodel.recording import Recording
from ccmodel.rig.batch import Batch
from ccmodel.rig.findings import Finding


def check_consistency(recordings: Sequence[Recording], batch: Batch) -> list[Finding]:
    """Compare the recordings with one another and with what `batch.yaml` states.

    Parameters
    ----------
    recordings : sequence of Recording
        All recordings of the batch that can be used.
    batch : Batch
        Content of `batch.yaml`.

    Returns
    -------
    list of Finding
        A contradiction each, with the severity "inconsistent" and the confidence that it is one.
    """
    return []
