"""Stated values that the calibrated model contradicts: what no relation of the recordings shows without a model."""

from ccmodel.rig.batch import Batch
from ccmodel.rig.consistency import limits
from ccmodel.rig.consistency.contradiction import LIKELY
from ccmodel.rig.consistency.scales import beyond
from ccmodel.rig.findings import Finding

_KEY = "cable.stiffness_N_per_m"


def contradicted_by_fit(stiffness_N_per_m: float, batch: Batch) -> list[Finding]:
    """The stated stiffness of the cable, if the fitted one differs by a factor that only another unit has."""
    stated = batch.rig.cable.stiffness_N_per_m
    ratio = stiffness_N_per_m / stated
    if not beyond(ratio, limits.FITTED_FACTOR) or _KEY in batch.rig.nominal:
        return []
    text = (
        f"rig.{_KEY} is {stated:g}, and the fit to the recordings ends at {stiffness_N_per_m:.3g} N/m,"
        f" {ratio:.3g} times as much: is it in another unit? Correct it, or length_m and the pulley radii; if nobody"
        " measured it, name it in rig.nominal"
    )
    return [Finding(batch.batch, "batch.yaml", None, f"rig.{_KEY}", "inconsistent", text, LIKELY)]
