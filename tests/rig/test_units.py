import math

import pytest

from ccmodel.rig.units import UnitError, factor, gain_factor, is_unit, quantity_of


@pytest.mark.parametrize(
    ("found", "needed", "expected"),
    [
        *((text, "Nm", 1.0) for text in ("N*m", "Nm", "N·m", "N m", "N.m", "N-m", "[Nm]", "newton_meter")),
        *((text, "Nm", 1e-3) for text in ("mNm", "N mm", "Nmm", "mN·m", "mN*m")),
        ("Ncm", "Nm", 0.01),
        ("ozf*in", "Nm", 0.00706155),
        *((text, "rad", math.pi / 180) for text in ("deg", "°", "º", "Grad", "degrees")),
        *((text, "rad", 2 * math.pi) for text in ("rev", "turn", "U", "Umdr")),
        ("mrad", "rad", 1e-3),
        ("kgf", "N", 9.80665),
        ("gf", "N", 9.80665e-3),
        ("ozf", "N", 0.27801385),
        ("lbf", "N", 4.44822162),
        *((text, "count", 1.0) for text in ("counts", "cnt", "ticks", "Inkr", "LSB")),
        ("mA", "A", 1e-3),
        ("mV", "V", 1e-3),
        *((text, "s", 1e-6) for text in ("us", "µs", "μs", "usec")),
        ("min", "s", 60.0),
    ],
)
def test_what_labs_write(found, needed, expected):
    assert factor(found, needed) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("found", "needed", "said"),
    [
        ("deg", "count", "found 'deg', an angle; needed is counts"),
        ("count", "rad", "found 'count', counts; needed is an angle"),
        ("A", "Nm", "a current; needed is a torque"),
        ("V", "N", "a voltage; needed is a force"),
        ("g", "N", "a mass; needed is a force"),
        ("rpm", "rad", "an angular speed; needed is an angle"),
        ("furlong", "rad", "unit 'furlong' is not known"),
        ("grad", "rad", "two readings: write 'deg' for degrees or 'gon'"),
        ("nm", "Nm", "two readings: write 'Nm'"),
    ],
)
def test_a_unit_that_does_not_fit(found, needed, said):
    with pytest.raises(UnitError, match=said.replace("(", r"\(")):
        factor(found, needed)


def test_a_gain_leads_from_one_dimension_to_another():
    assert gain_factor("0.0234 N*m/A", "mA", "Nm") == pytest.approx(0.0234e-3)
    assert gain_factor("0.18 deg/count", "count", "rad") == pytest.approx(0.18 * math.pi / 180)
    assert gain_factor("-2 lbf/V", "V", "N") == pytest.approx(-2 * 4.44822162)
    assert gain_factor("5e-3 rad/mm", "m", "rad") == pytest.approx(5.0)
    with pytest.raises(UnitError, match="gives no N; the gain's unit must be that of N per V"):
        gain_factor("0.1 V/N", "V", "N")
    with pytest.raises(UnitError, match="a number and its unit"):
        gain_factor("about two", "V", "N")


@pytest.mark.parametrize(
    "text", ["A**9**9**9", "9^9^9^9 A", "2**99999999999*A", "((9**9)**9)**9*A", "A^(10)", "A" + "*A" * 40]
)
def test_powers_without_an_end_are_no_unit(text):
    assert not is_unit(text)


@pytest.mark.parametrize("text", ["m/s^2", "kg*m**2", "V/Hz**0.5", "s^-1", "m²"])
def test_powers_of_units_are_read(text):
    assert is_unit(text)


def test_what_is_no_unit():
    assert not any(map(is_unit, ("", "-", "1", "[-]", "hello world", "__import__('os')", "1e9")))
    assert quantity_of("hello") == ""
