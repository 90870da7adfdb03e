"""Units as names of columns have them: understood, or told and asked for; never taken for something else."""

import json
import math

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter
from openpyxl import Workbook

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, read
from nectosome.units import InputError, unit_to_si

T, X = 0.01 * np.arange(5), np.arange(1.0, 6.0)


def _csv(path, heading):
    rows = zip(T.tolist(), X.tolist(), strict=True)
    path.write_text(f"time (s);{heading}\n" + "".join(f"{t!r};{x!r}\n" for t, x in rows))


def _xlsx(path, heading):
    book = Workbook()
    for row in [("time (s)", heading), *zip(T.tolist(), X.tolist(), strict=True)]:
        book.active.append(row)
    book.save(path)


def _tdms(path, heading):
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("log", "time (s)", T), ChannelObject("log", heading, X)])


def _tdms_property(path, heading):
    name, unit = heading.removesuffix(")").rsplit(" (", 1)
    with TdmsWriter(path) as file:
        unit = {"unit_string": unit}
        file.write_segment([ChannelObject("log", "time (s)", T), ChannelObject("log", name, X, unit)])


FORMATS = {"csv": _csv, "xlsx": _xlsx, "tdms": _tdms, "property.tdms": _tdms_property}


def recorded(folder, heading, ending="csv", **entry):
    """The only quantity of a file with this heading, and what was warned of."""
    path = folder / f"a.{ending}"
    FORMATS[ending](path, heading)
    data = {"columns": {"x": {"column": 2, **entry}}} if entry else {}
    run = read(path, validate_as(Sheet, data, "sheet"))
    (name,) = run.data_vars
    return run[name], json.loads(run.attrs["provenance"])


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize(
    ("heading", "factor", "unit"),
    [
        ("Load cell (Volts)", 1.0, "V"),
        ("Force (Newton)", 1.0, "N"),
        ("Current (Amps)", 1.0, "A"),
        ("Torque (N.m)", 1.0, "N m"),
        ("Torque (uN.m)", 1e-6, "N m"),
        ("Torque (mNm)", 1e-3, "N m"),
        ("Viscosity (Pa.s)", 1.0, "Pa s"),
        ("Thrust (Kg f)", 9.80665, "N"),
        ("Supply (PSI)", 6894.757293168361, "Pa"),
        ("Supply (psig)", 6894.757293168361, "Pa"),
        ("Supply (mmHg)", 133.322387415, "Pa"),
        ("Supply (mbar)", 100.0, "Pa"),
        ("Flow (lpm)", 1e-3 / 60, "m3 s-1"),
        ("Speed (RPM)", math.pi / 30, "rad/s"),
        ("Angle (°)", math.pi / 180, "rad"),
        ("Angle (º)", math.pi / 180, "rad"),
        ("Gyro (dps)", math.pi / 180, "rad/s"),
        ("Power (Watt)", 1.0, "W"),
        ("Stroke (inch)", 0.0254, "m"),
        ("AccX (g)", 9.80665, "m/s2"),
        ("acceleration z (mg)", 9.80665e-3, "m/s2"),
        ("Mass (g)", 1e-3, "kg"),
    ],
)
def test_units_are_understood(tmp_path, heading, factor, unit, ending):
    x, about = recorded(tmp_path, heading, ending)
    np.testing.assert_allclose(x, factor * X, rtol=1e-15)
    assert x.attrs["units"] == unit
    assert about["warnings"] == []


@pytest.mark.parametrize("heading", ["Temp (C)", "temperature [°C]", "T (deg C)", "water temp (Celsius)"])
def test_temperatures_become_kelvin(tmp_path, heading):
    x, about = recorded(tmp_path, heading)
    np.testing.assert_allclose(x, X + 273.15, rtol=1e-15)
    assert (x.attrs["units"], about["warnings"]) == ("K", [])
    x, _ = recorded(tmp_path, heading, zero="2 °C", gain="3 mm/K")
    np.testing.assert_allclose(x, 3e-3 * (X - 2), atol=1e-15)


@pytest.mark.parametrize(
    ("heading", "said"),
    [
        ("u [foo]", '"foo" is not a known unit: not converted'),
        ("force (C)", '"C" is not a known unit'),
        ("x-axis (g)", '"g" may be grams or an acceleration: not converted'),
        ("flap (L)", '"L" may be a unit or a word: not converted'),
        ("pressure (in)", '"in" may be a unit or a word: not converted'),
        ("thrust (kg)", 'is in "kg", a mass. If it is a force, write unit: kgf'),
        ("torque (nm)", 'is in "nm", a length. If it is a torque, write unit: N m'),
        ("x_cm", "names that may hold a unit, which is not taken: x_cm (cm)"),
        ("Force_N", "names that may hold a unit, which is not taken: Force_N (N)"),
        ("force / N", "names that may hold a unit, which is not taken: force / N (N)"),
        ("RPM", "names that may hold a unit, which is not taken: RPM (RPM)"),
    ],
)
def test_what_may_be_a_unit_is_asked_for_and_a_sheet_decides(tmp_path, heading, said):
    x, about = recorded(tmp_path, heading)
    assert [said in odd for odd in about["warnings"]] == [True]
    if "a mass" not in said and "a length" not in said:
        np.testing.assert_array_equal(x, X)
    for unit, factor, si in (("mV", 1e-3, "V"), ("kgf", 9.80665, "N"), ("g", 1e-3, "kg"), ("gn", 9.80665, "m/s2")):
        x, about = recorded(tmp_path, heading, unit=unit)
        np.testing.assert_allclose(x, factor * X, rtol=1e-15)
        assert x.attrs["units"] == si
        assert [f"and in {unit} in the sheet, which holds" in odd for odd in about["warnings"]] in ([], [True])


@pytest.mark.parametrize(
    "heading", ["motor_a", "joint_m", "side_l", "valve in", "flap left", "ai[0]", "speedBL", "gain_h"]
)
def test_names_that_end_in_letters_have_no_unit(tmp_path, heading):
    x, about = recorded(tmp_path, heading)
    assert (x.attrs["units"], about["warnings"]) == ("", [])


def test_what_tells_columns_apart_is_no_unit(tmp_path):
    (tmp_path / "a.csv").write_text("t (s),flap (L),flap (R),force (min),force (max)\n0,1,2,3,4\n0.1,1,2,3,4\n")
    run = read(tmp_path / "a.csv")
    assert list(run.data_vars) == ["flap (L)", "flap (R)", "force (min)", "force (max)"]
    assert {variable.attrs["units"] for variable in run.data_vars.values()} == {""}


@pytest.mark.parametrize("entry", [{"unit": "V"}, {}, {"unit": "Volts"}])
def test_a_zero_and_a_gain_take_the_unit_of_the_sheet_or_of_the_file(tmp_path, entry):
    for ending in FORMATS:
        x, about = recorded(tmp_path, "Load cell (Volts)", ending, zero="0.31 V", gain="46.5 N/V", **entry)
        np.testing.assert_allclose(x, 46.5 * (X - 0.31), rtol=1e-14)
        assert (x.attrs["units"], about["warnings"]) == ("N", [])


def test_a_sheet_is_asked_for_a_unit_once(tmp_path):
    with pytest.raises(
        InputError, match=r'needs the unit .* as in unit: V or unit: counts; the file\'s "foo" is not a known one'
    ):
        recorded(tmp_path, "u [foo]", zero="0.31 V", gain="46.5 N/V")
    with pytest.raises(InputError, match="as in unit: V or unit: counts; the gain is per V, and the file says N"):
        recorded(tmp_path, "u [N]", gain="46.5 N/V")
    x, _ = recorded(tmp_path, "u [foo]", unit="V", zero="0.31 V", gain="46.5 N/V")
    np.testing.assert_allclose(x, 46.5 * (X - 0.31), rtol=1e-14)


def test_pixels_and_counts_have_gains(tmp_path):
    x, _ = recorded(tmp_path, "tip (px)", gain="0.2 mm/px", zero="1 px")
    np.testing.assert_allclose(x, 2e-4 * (X - 1), rtol=1e-14)
    assert x.attrs["units"] == "m"
    x, _ = recorded(tmp_path, "ADC (counts)", gain="5 mN/count")
    np.testing.assert_allclose(x, 5e-3 * X, rtol=1e-14)


def test_a_column_is_named_with_its_unit_or_without(tmp_path):
    for name in ("Load cell", "Load cell (Volts)"):
        _csv(tmp_path / "a.csv", "Load cell (Volts)")
        sheet = validate_as(Sheet, {"columns": {"u": name}}, "sheet")
        np.testing.assert_array_equal(read(tmp_path / "a.csv", sheet)["u"], X)


@pytest.mark.parametrize(("unit", "factor"), [("J", 1.0), ("mJ", 1e-3), ("Wh", 3600.0), ("W s", 1.0)])
def test_an_energy_is_no_torque(unit, factor):
    assert unit_to_si(unit) == (factor, "J")
    assert unit_to_si("N m") == (1.0, "N m")
