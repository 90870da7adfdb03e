import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.measure.signals.unit_text import product

SYMBOLS = st.dictionaries(
    st.sampled_from(["N", "m", "s", "rad", "kg", "Pa"]), st.integers(-3, 3).filter(bool), max_size=4
)


@pytest.mark.parametrize(
    ("factors", "unit"),
    [
        ([("m", 1), ("s", -1)], "m/s"),
        ([("m/s", 1), ("s", -1)], "m/s2"),
        ([("m", 1), ("s", -2)], "m/s2"),
        ([("N", 1), ("m", 1)], "N m"),
        ([("N", 2), ("Hz", -1)], "N2/Hz"),
        ([("m/s2", 2), ("Hz", -1)], "m2/(s4 Hz)"),
        ([("1", 1), ("s", -1)], "1/s"),
        ([("m", 1), ("m", -1)], "1"),
        ([("", 1), ("s", -1)], "1/s"),
        ([("N/(m s)", 1), ("s", 1)], "N/m"),
        ([("N m s/rad", 1), ("rad/s", 1)], "N m"),
        ([("kg*m^2/s", 1)], "kg m2/s"),
        ([("rad or m", 1), ("s", -1)], "(rad or m)/s"),
        ([("N/m s", 1), ("s", 1)], "(N/m s) s"),
    ],
)
def test_powers_of_a_symbol_add_up(factors, unit):
    assert product(*factors) == unit


@given(SYMBOLS, SYMBOLS)
def test_what_a_product_writes_it_reads_again(a, b):
    """A product with its own inverse is 1, whatever was written in between."""
    text = product(*a.items(), *b.items())
    assert product((text, 1), *((symbol, -n) for symbol, n in (*a.items(), *b.items()))) == "1"
    assert product((text, 1)) == text
