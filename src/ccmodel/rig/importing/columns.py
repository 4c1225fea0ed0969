"""Columns that an import writes, with their units as pint reads them."""

from ccmodel.rig.batch import COLUMNS

TIME = "time_s"
# A column's name ends in its unit.
_UNITS = {"s": "s", "counts": "count", "A": "A", "V": "V", "rad": "rad", "Nm": "Nm", "N": "N"}
UNIT_OF = {column: _UNITS[column.rpartition("_")[2]] for column in COLUMNS}
# Every column but time, which follows from the drive angle's samples.
CHANNELS = tuple(column for column in UNIT_OF if column != TIME)


def is_encoder(column: str) -> bool:
    """Whether a column holds the counts of an encoder: whole numbers that must not be interpolated."""
    return column.endswith("_encoder_counts")
