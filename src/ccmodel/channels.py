"""The channels of a recording: one table of their names, units, symbols, labels, zeros and places.

A channel's name ends in its SI unit. T1 to T4 are the tensions at the cable ends as in the paper: cable A has T1 at
the drive and T2 at the load, cable B has T3 and T4. Code refers to a channel by its constant, never by a literal.
"""

from dataclasses import dataclass
from typing import Any

_PRINTED_UNIT = {"rad": "rad", "Nm": "N m", "N": "N"}


@dataclass(frozen=True)
class Channel:
    """A row of the table.

    Attributes
    ----------
    name : str
        Name in recordings, tables and files, with the SI unit at its end.
    side : str
        The end of the transmission at which it is: "drive" or "load".
    symbol, tex : str
        Symbol in plain text and in TeX.
    label : str
        Quantity in words, with its symbol in TeX: the label of an axis without its unit.
    places : tuple of str
        Where a fault that shows in this channel alone can be (`ccmodel.mechanisms.PLACES`).
    zero : str or None
        Parameter of the model that is the sensor's zero.
    measured : bool
        Whether a sensor reads it and models are compared on it. The drive angle and the
        motor's are the model's input; tensions are derived from torques and sums.
    scale : float
        Factor from SI units to `plot_unit`.
    plot_unit : str
        Unit on an axis.
    """

    name: str
    side: str
    symbol: str
    tex: str
    label: str
    places: tuple[str, ...] = ()
    zero: str | None = None
    measured: bool = False
    scale: float = 1.0
    plot_unit: str = ""

    @property
    def short_name(self) -> str:
        """The name without its unit, as in diagnosis.json."""
        return self.name.rsplit("_", 1)[0]

    @property
    def unit(self) -> str:
        """SI unit as it is printed."""
        return _PRINTED_UNIT[self.name.rsplit("_", 1)[1]]

    @property
    def words(self) -> str:
        """Quantity in words with its symbol in plain text."""
        return self.label.replace(self.tex, self.symbol)

    @property
    def axis(self) -> str:
        """Label of an axis, with its unit."""
        return f"{self.label} ({self.plot_unit or self.unit})"


THETA_IN, THETA_OUT, THETA_MOTOR = "theta_in_rad", "theta_out_rad", "theta_motor_rad"
TAU_IN, TAU_OUT = "tau_in_Nm", "tau_out_Nm"
F_DRIVE, F_LOAD = "F_drive_N", "F_load_N"
T1, T2, T3, T4 = "T1_N", "T2_N", "T3_N", "T4_N"

_MILLI: dict[str, Any] = {"scale": 1e3, "plot_unit": "mN·m"}
TABLE = {
    channel.name: channel
    for channel in (
        Channel(THETA_IN, "drive", "θ_in", r"$\theta_{in}$", r"drive angle $\theta_{in}$"),
        Channel(THETA_OUT, "load", "θ_out", r"$\theta_{out}$", r"load angle $\theta_{out}$",
                ("load-sensor",), "theta_out_zero_rad", measured=True),
        Channel(TAU_IN, "drive", "τ_in", r"$\tau_{in}$", r"drive torque $\tau_{in}$",
                ("drive-pulley", "drive-sensor"), "tau_in_zero_Nm", measured=True, **_MILLI),
        Channel(TAU_OUT, "load", "τ_out", r"$\tau_{out}$", r"load torque $\tau_{out}$",
                ("load-sensor",), "tau_out_zero_Nm", measured=True, **_MILLI),
        Channel(F_DRIVE, "drive", "F_drive", r"$F_{drive}$", r"sum of tensions $F_{drive}$",
                ("drive-sensor",), "F_drive_zero_N", measured=True),
        Channel(F_LOAD, "load", "F_load", r"$F_{load}$", r"sum of tensions $F_{load}$",
                ("load-sensor",), "F_load_zero_N", measured=True),
        Channel(T1, "drive", "T1", "$T_1$", "tension $T_1$ at the drive, cable A"),
        Channel(T2, "load", "T2", "$T_2$", "tension $T_2$ at the load, cable A"),
        Channel(T3, "drive", "T3", "$T_3$", "tension $T_3$ at the drive, cable B"),
        Channel(T4, "load", "T4", "$T_4$", "tension $T_4$ at the load, cable B"),
        Channel(THETA_MOTOR, "drive", "θ_motor", r"$\theta_{motor}$",
                r"motor angle $\theta_{motor}$ at the drive pulley"),
    )
}  # fmt: skip

CHANNELS = tuple(TABLE)
TENSIONS = (T1, T2, T3, T4)
# The channels of the paper's Table I, in its order.
TABLE_ONE = (THETA_OUT, TAU_IN, TAU_OUT, *TENSIONS)
# Table I of the paper, %: normalised rms errors of its fitted model over one cycle of its own half-loop recording. Its
# last column, printed T3 a second time, is T4.
PAPER_TABLE_ONE = dict(zip(TABLE_ONE, (3.7, 19.4, 3.7, 12.8, 4.1, 9.9, 5.5), strict=True))
# What sensors measure and models are compared on; tensions follow from these and do not count a second time.
MEASURED = tuple(c.name for c in TABLE.values() if c.measured)
# By the end of the transmission.
ANGLE_AT = {"drive": THETA_IN, "load": THETA_OUT}
TORQUE_AT = {"drive": TAU_IN, "load": TAU_OUT}
SUM_AT = {"drive": F_DRIVE, "load": F_LOAD}
TENSIONS_AT = {"drive": (T1, T3), "load": (T2, T4)}
# Tensions of a cable at the drive and at the load.
CABLES = {"A": (T1, T2), "B": (T3, T4)}
# Parameter that is the zero of a torque or force sensor. An angle is zeroed at rest.
ZERO_OF = {c.name: c.zero for c in TABLE.values() if c.zero and c.name not in ANGLE_AT.values()}
PLACES_OF = {c.name: c.places for c in TABLE.values() if c.measured}


def unit_of(channel: str) -> str:
    """SI unit of a channel, as it is printed."""
    return TABLE[channel].unit


def symbol_of(channel: str) -> str:
    """Symbol of a channel in plain text."""
    return TABLE[channel].symbol


def short_name(channel: str) -> str:
    """Name of a channel without its unit, as in diagnosis.json."""
    return TABLE[channel].short_name
