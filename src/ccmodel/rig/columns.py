"""Columns of a log with their units as pint reads them."""

from ccmodel.rig.batch import COLUMNS

TIME = "time_s"
# A column's name ends in its unit.
_UNITS = {"s": "s", "counts": "count", "A": "A", "V": "V", "rad": "rad", "Nm": "Nm", "N": "N"}
UNIT_OF = {column: _UNITS[column.rpartition("_")[2]] for column in COLUMNS}
# Those that an import is told of: time follows from the samples of the drive angle.
CHANNELS = tuple(column for column in UNIT_OF if column != TIME)


def is_encoder(column: str) -> bool:
    """Whether a column holds the counts of an encoder: whole numbers that must not be interpolated."""
    return column.endswith("_encoder_counts")
