import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.units import DIMENSIONS, format_quantity, parse_quantity, scale_to_si, show_quantity, unit_to_si

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("7.4 MPa", "pressure", 7.4e6),
        ("7.4MPa", "pressure", 7.4e6),
        ("7.4e6 Pa", "pressure", 7.4e6),
        ("2 bar", "pressure", 2e5),
        ("5 kgf cm", "torque", 0.4903325),
        ("16 ozf in", "torque", 4.4482216152605 * 0.0254),
        ("1 lbf in", "torque", 4.4482216152605 * 0.0254),
        ("1 ft", "length", 0.3048),
        ("5 min", "time", 300.0),
        ("14.4rad/s", "angular_speed", 14.4),
        ("60 rpm", "angular_speed", 2 * math.pi),
        ("1 Hz", "angular_speed", 2 * math.pi),
        ("180 deg/s", "angular_speed", math.pi),
        ("2 1/s", "angular_speed", 2.0),
        ("2.3 Hz", "frequency", 2.3),
        ("2.3 1/s", "frequency", 2.3),
        ("60 rpm", "frequency", 1.0),
        ("45 deg", "angle", math.pi / 4),
        ("45°", "angle", math.pi / 4),
        ("85 mm", "length", 0.085),
        (".5 m", "length", 0.5),
        ("-3 cm", "length", -0.03),
        ("20 µm", "length", 2e-5),
        ("0.427 kg", "mass", 0.427),
        ("427 g", "mass", 0.427),
        ("1062 kg/m3", "density", 1062.0),
        ("1062 kg/m^3", "density", 1062.0),
        ("1062 kg/m**3", "density", 1062.0),
        ("1062 kg m-3", "density", 1062.0),
        ("1.062 g/cm³", "density", 1062.0),
        ("3000 Pa s", "viscosity", 3000.0),
        ("0.5 N m", "torque", 0.5),
        ("0.5 N*m/rad", "angular_stiffness", 0.5),
        ("0.5 N m", "angular_stiffness", 0.5),
        ("0.5 N m/deg", "angular_stiffness", 90 / math.pi),
        ("0.2 N m s/rad", "angular_damping", 0.2),
        ("3 1/m", "curvature", 3.0),
        ("3 rad/m", "curvature", 3.0),
        ("3 N s/m", "damping", 3.0),
        ("9.81 m/s2", "acceleration", 9.81),
        ("0.5 L", "volume", 5e-4),
        ("1e-6 kg m2", "inertia", 1e-6),
        ("2 N/(m)", "line_force", 2.0),
        ("0.5", "number", 0.5),
        ("0", "length", 0.0),
        ("0", "pressure", 0.0),
        ("0", "angle", 0.0),
    ],
)
def test_text_becomes_the_nearest_si_float(text, dimension, value):
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=3e-16, abs=0)


@pytest.mark.parametrize(
    ("text", "value"), [("7 mm", 0.007), ("35 mm", 0.035), ("5.65 mm", 0.00565), ("0.1 km", 100.0)]
)
def test_millimetres_give_the_same_float_as_metres(text, value):
    assert parse_quantity(text, "length") == value


@pytest.mark.parametrize(
    ("text", "dimension", "message"),
    [
        (
            "7.4 MP",
            "pressure",
            '"7.4 MP" has no unit called MP. Pressure expected, as in "7.4 MPa" or "7.4e6 Pa".',
        ),
        ("7.4", "pressure", '"7.4" has no unit. Pressure expected, as in "7.4 MPa" or "7.4e6 Pa".'),
        ("85 kg", "length", '"85 kg" is a mass. Length expected, as in "85 mm" or "0.085 m".'),
        ("85 mm", "number", '"85 mm" is a length. Number expected, as in "0.5".'),
        ("85 kg s", "length", '"85 kg s" is not a length. Length expected, as in "85 mm" or "0.085 m".'),
        ("nan mm", "length", '"nan mm" must be finite. Length expected, as in "85 mm" or "0.085 m".'),
        ("-inf", "angle", '"-inf" must be finite. Angle expected, as in "45 deg" or "0.785 rad".'),
        ("1e999 m", "length", '"1e999 m" must be finite. Length expected, as in "85 mm" or "0.085 m".'),
        ("1e306 km", "length", '"1e306 km" must be finite. Length expected, as in "85 mm" or "0.085 m".'),
        ("long", "length", '"long" is not a number. Length expected, as in "85 mm" or "0.085 m".'),
        ("", "length", '"" is not a number. Length expected, as in "85 mm" or "0.085 m".'),
        ("3 N m/rad", "torque", '"3 N m/rad" is an angular stiffness. Torque expected, as in "0.5 N m" or "5 kgf cm".'),
    ],
)
def test_a_wrong_text_is_answered_with_the_way_out(text, dimension, message):
    with pytest.raises(ValueError) as caught:
        parse_quantity(text, dimension)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    "text",
    ["1 mm9**9**9", "1 (mm9)9", "1 mm^(9 9 9 9 9 9 9 9)", "1 m" + "m" * 200, "0e999999999 m x", "1 __import__", "1 (("],
)
def test_no_unit_takes_long_to_refuse(text):
    with pytest.raises(ValueError):
        parse_quantity(text, "length")


@given(FINITE, st.sampled_from(sorted(DIMENSIONS)))
def test_what_is_written_reads_back_as_the_same_float(value, dimension):
    assert parse_quantity(format_quantity(value, dimension), dimension) == value


@given(st.text(max_size=30), st.sampled_from(sorted(DIMENSIONS)))
def test_any_text_is_a_number_or_a_sentence(text, dimension):
    try:
        assert math.isfinite(parse_quantity(text, dimension))
    except ValueError as error:
        assert str(error).isprintable()
        assert str(error).endswith(".")


@pytest.mark.parametrize(
    ("value", "dimension", "text"),
    [
        (7.4e6, "pressure", "7.4 MPa"),
        (0.085, "length", "85 mm"),
        (0.7, "length", "0.7 m"),
        (parse_quantity("42.3 deg", "angle"), "angle", "42.3 deg"),
        (14.4, "angular_speed", "14.4 rad/s"),
        (1062.0, "density", "1062 kg/m3"),
        (0.0, "length", "0 m"),
        (0.5, "number", "0.5"),
    ],
)
def test_quantities_are_written_as_people_would(value, dimension, text):
    assert format_quantity(value, dimension) == text


@pytest.mark.parametrize("dimension", sorted(DIMENSIONS))
def test_every_example_in_a_message_is_right(dimension):
    for text in DIMENSIONS[dimension].example.split(" or "):
        parse_quantity(text.strip('"'), dimension)


@pytest.mark.parametrize(
    ("value", "dimension", "shown"),
    [
        (0.005826, "length", "5.826 mm"),
        (0.6881, "length", "688.1 mm"),
        (0.6623, "angle", "37.95 deg"),
        (5.925e6, "pressure", "5.925 MPa"),
        (22.0, "angular_speed", "22 rad/s"),
        (0.0, "length", "0 m"),
        (0.5, "number", "0.5"),
    ],
)
def test_quantities_are_shown_in_units_that_people_read(value, dimension, shown):
    assert show_quantity(value, dimension) == shown


@pytest.mark.parametrize(
    ("written", "factor", "unit"),
    [
        *((kgf, 9.80665, "N") for kgf in ("kgf", "Kg f", "kg-f", "KGF", "kp")),
        *((gf, 9.80665e-3, "N") for gf in ("gf", "g f", "gram-force")),
        *((nm, 1.0, "N m") for nm in ("Nm", "N.m", "N-m", "N·m", "N*m", "N m")),
        *((unm, 1e-6, "N m") for unm in ("uN m", "uN.m", "µN·m", "uNm")),
        *((psi, 6894.757293168361, "Pa") for psi in ("PSI", "psig", "psi")),
        *((us, 1e-6, "s") for us in ("usec", "µs", "us", "Microseconds", "microsec")),
        *((ms, 1e-3, "s") for ms in ("msec", "millisec", "Milliseconds")),
        *((deg, math.pi / 180, "rad") for deg in ("°", "º", "deg", "Degrees", "degrees")),
        *((dps, math.pi / 180, "rad/s") for dps in ("dps", "°/s", "deg/sec")),
        *((ohm, 1e3, "ohm") for ohm in ("kΩ", "kΩ", "kOhm")),
        *((lpm, 1e-3 / 60, "m3 s-1") for lpm in ("lpm", "L/min", "l/min")),
        ("ft-lb", 0.3048 * 4.4482216152605, "N m"),
        ("kg-cm", 0.0980665, "N m"),
        ("kg cm2", 1e-4, "kg m2"),
        ("mNm", 1e-3, "N m"),
        ("mPas", 1e-3, "Pa s"),
        ("Ns", 1.0, "m kg s-1"),
        ("Volts", 1.0, "V"),
        ("Amps", 1.0, "A"),
        ("Newton", 1.0, "N"),
        ("Watt", 1.0, "W"),
        ("Seconds", 1.0, "s"),
        ("inch", 0.0254, "m"),
        ("mbar", 100.0, "Pa"),
        ("hPa", 100.0, "Pa"),
        ("mmHg", 133.322387415, "Pa"),
        ("cm H2O", 98.0665, "Pa"),
        ("RPM", 2 * math.pi / 60, "rad/s"),
        ("Pa.s", 1.0, "Pa s"),
        ("m·s⁻²", 1.0, "m/s2"),
        ("gn", 9.80665, "m/s2"),
        ("µε", 1e-6, ""),
        ("-", 1.0, ""),
        ("mm/px", 1e-3, "m px-1"),
        ("mV/°C", 1e-3, "N m A-1 s-1 K-1"),
    ],
)
def test_units_are_read_as_instruments_write_them(written, factor, unit):
    found, si = unit_to_si(written)
    assert found == pytest.approx(factor, rel=1e-15)
    assert unit_to_si(si) == (1.0, unit_to_si(unit)[1])


@pytest.mark.parametrize("written", ["MP", "mpa", "G", "S", "C", "T", "NM", "left", "a.u.", "foo", "2"])
def test_what_is_no_unit_or_one_of_several_is_none(written):
    """ "NM" may be a torque or nanometres, "C" a temperature or a charge."""
    with pytest.raises(ValueError):
        unit_to_si(written)


@pytest.mark.parametrize(("written", "zero", "boiling"), [("°C", 0, 100), ("deg C", 0, 100), ("°F", 32, 212)])
def test_a_temperature_scale_has_its_zero(written, zero, boiling):
    factor, shift, unit = scale_to_si(written)
    assert unit == "K"
    assert factor * zero + shift == pytest.approx(273.15, rel=1e-15)
    assert factor * boiling + shift == pytest.approx(373.15, rel=1e-15)
    with pytest.raises(ValueError, match="zero of its own"):
        unit_to_si(written)


def test_a_robot_takes_a_unit_in_one_spelling_only():
    with pytest.raises(ValueError, match="has no unit called Volts"):
        parse_quantity("5 Volts", "voltage")
    with pytest.raises(ValueError, match="not a force"):
        parse_quantity("5 Ns", "force")
