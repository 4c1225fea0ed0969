"""The table of channels."""

from dataclasses import fields

from ccmodel.channels import CHANNELS, MEASURED, PLACES_OF, TABLE, TABLE_ONE, ZERO_OF, short_name, symbol_of, unit_of
from ccmodel.mechanisms import PLACES
from ccmodel.model.parameters import Parameters


def test_names_end_in_their_units():
    printed = {"rad": "rad", "Nm": "N m", "N": "N"}
    assert {c: unit_of(c) for c in CHANNELS} == {c: printed[c.split("_")[-1]] for c in CHANNELS}
    assert (short_name("tau_in_Nm"), symbol_of("tau_in_Nm")) == ("tau_in", "τ_in")


def test_zeros_are_parameters_and_places_are_places():
    assert set(ZERO_OF.values()) < {f.name for f in fields(Parameters)}
    assert {place for places in PLACES_OF.values() for place in places} < set(PLACES)


def test_tensions_are_derived_and_the_drive_angle_is_given():
    assert set(CHANNELS) - set(MEASURED) == {"theta_in_rad", "theta_motor_rad", "T1_N", "T2_N", "T3_N", "T4_N"}
    assert set(TABLE_ONE) <= set(TABLE)
