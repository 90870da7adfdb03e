"""The scorecard as a table of a page."""

import pytest

from nectosome.view.scorecard import number, percent, shown, summary, table


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.68567, "m/s", "0.6857 m/s"),
        (7.4e6, "Pa", "7.400e6 Pa"),
        (2.5e-5, "1", "2.500e-5"),
        (12345.6, "N", "12346 N"),
        (9999.7, "N", "10000 N"),
        (0.0, "", "0"),
        (None, "m", "-"),
        (float("nan"), "m", "-"),
    ],
)
def test_numbers_have_sensible_digits(value, unit, text):
    assert number(value, unit) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(2.012e-8, "2.01e-8"), (0.68567, "0.686"), (999.4, "999"), (999.6, "1000"), (19440.0, "19440"), (1139.2, "1139")],
)
def test_digits_before_the_point_are_never_cut(value, text):
    assert number(value, figures=3) == text


@pytest.mark.parametrize(("value", "text"), [(0.4, "0.40 %"), (0.0123, "0.01 %"), (None, "-"), (-15.968, "-15.97 %")])
def test_percentages(value, text):
    assert percent(value) == text


ROW = {"id": "a/speed", "quantity": "speed", "unit": "m/s", "printed": 0.68, "ours": 0.684, "error": 0.6}
ROW |= {"tolerance": 1.0, "kind": "prediction", "source": "measured", "note": "", "verdict": "match"}
NONE = ROW | {"printed": None, "source": "", "error": None, "tolerance": None, "verdict": "", "kind": "own"}


@pytest.mark.parametrize(
    ("changed", "printed", "ours"),
    [
        ({}, "0.68 m/s", "0.684 m/s"),
        ({"shown": "cm/s"}, "68 cm/s", "68.4 cm/s"),
        ({"printed": [0.5, 0.7]}, "0.5 to 0.7 m/s", "0.684 m/s"),
        ({"printed": [0.5, 0.7], "shown": "cm/s"}, "50 to 70 cm/s", "68.4 cm/s"),
        ({"unit": "N/m", "shown": "N/mm", "ours": 32551.0, "printed": None}, "-", "32.55 N/mm"),
        ({"unit": "m2", "shown": "cm2", "ours": 0.017243, "printed": None}, "-", "172.4 cm2"),
        ({"unit": "L/s", "shown": "L/s", "ours": 0.3, "printed": 0.38}, "0.38 L/s", "0.3 L/s"),  # lengths, not litres
    ],
)
def test_people_read_numbers_in_the_unit_of_their_row(changed, printed, ours):
    row = ROW | changed
    assert (shown(row, "printed"), shown(row, "ours")) == (printed, ours)
    assert f'<td class="number">{printed}</td>' in table([row]) and f'<td class="number">{ours}</td>' in table([row])


@pytest.mark.parametrize(
    ("changed", "told"),
    [({}, "1.00 %"), ({"tolerance": 0.0}, "equal"), ({"tolerance": None, "within": 5.0, "unit": "deg"}, "5 deg")],
)
def test_a_tolerance_of_a_printed_zero_is_in_its_unit_and_none_is_0_percent(changed, told):
    assert f'<td class="number">{told}</td><td class="verdict' in table([ROW | changed])


def test_verdicts_have_a_symbol_as_well_as_a_colour():
    text = table([ROW, NONE])
    assert '<td class="verdict match">✓ match</td>' in text and '<td class="verdict no">- </td><td>own' in text
    assert summary([ROW, NONE]) == "2 rows: 1 match; without a verdict: 1 own."
    assert summary([NONE]) == "1 row: without a verdict: 1 own."
    assert summary([]) == "No rows."
