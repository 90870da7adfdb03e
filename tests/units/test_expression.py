"""Formulas of quantities: arithmetic as Python has it, dotted names, nothing else of Python; functions; units."""

import numpy as np
import pytest

from nectosome.units import InputError
from nectosome.units.expression import Expression, FunctionFormula

VALUES = {"a": 1.7, "tail.bending_z.0": -0.4, "tail.0.4.position.x": 2.5, "mean.heading": 0.3, "e5": 7.0}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("-abs(tail.bending_z.0) - 2 ** 3 ** 2", -0.4 - 512),
        ("-a ** 2 / 4 + 1e-3", -(1.7**2) / 4 + 1e-3),
        ("min(a, tail.0.4.position.x) * max(0, mean.heading)", 1.7 * 0.3),
        ("exp(-(a - 2)**2) + tanh(a) + sqrt(a)", np.exp(-0.09) + np.tanh(1.7) + np.sqrt(1.7)),
        ("sin(a) + cos(a) + log(a)", np.sin(1.7) + np.cos(1.7) + np.log(1.7)),
        (" 3 * e5 - +1.5e5 ", 21 - 1.5e5),
        ("0.5", 0.5),
    ],
)
def test_it_is_the_arithmetic_of_python(text, expected):
    formula = Expression(text)
    assert formula.value(VALUES) == pytest.approx(expected, rel=1e-15)
    many = formula.value({name: np.array([x, x]) for name, x in VALUES.items()})
    np.testing.assert_allclose(np.broadcast_to(many, 2), expected, rtol=1e-15)


def test_it_names_its_quantities_once():
    assert Expression("abs(b.c) + a - b.c * goal.heading").names == ("b.c", "a", "goal.heading")


def test_what_has_no_value_is_nan():
    assert np.isnan(Expression("sqrt(0 - a)").value({"a": np.float64(1.0)}))
    assert np.isinf(Expression("1 / (a - a)").value({"a": np.float64(1.0)}))


@pytest.mark.parametrize(
    "text",
    [
        "", "a +", "a = 1", "a; a", "(a)(a)", "a[0]", "[a]", "lambda: a", "a if a else a", "a < a", "a and a", "'a'",
        "f'{a}'", "a := 1", "abs", "abs + 1", "a @ a", "a // a", "a % a", "~a", "not a", "1j",
        "__import__('os').system('true')", "a.__class__()", "(1).real", "abs.__call__(a)", "a\nb",
        "x" * 3000,
        "(" * 300 + "a" + ")" * 300, "-" * 200 + "a", "abs(*a)", "abs(x=a)", "min(a)", "abs()", "sqt(a)", "\0",
    ],
)  # fmt: skip
def test_nothing_else_of_python_is_taken(text):
    with pytest.raises(InputError) as told:
        Expression(text)
    assert str(told.value).startswith("expression: ")


def test_what_is_no_text_is_told(as_users_run):
    with pytest.raises(InputError, match="expression: the int 3 is given where an expression is expected"):
        Expression(3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r'"sqt" is no function. Did you mean "sqrt"'):
        Expression("sqt(a)")


UNITS = {"v": "m/s", "p": "W", "f": "N", "n": "1", "e": "J/m", "w": "rad/s", "d": "kg/m3"}


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("v / p", "m/s/W"),
        ("p / v", "N"),
        ("f * v / p", "1"),
        ("1 / p", "1/W"),
        ("sqrt(v)", "m0.5/s0.5"),
        ("d * v ** 2 / 2", "Pa"),
        ("max(0, v - 0.1)", "m/s"),
        ("e - f", "J/m"),
        ("exp(-n) * w", "rad/s"),
        ("w * w", "rad2/s2"),
        ("2 ** n", "1"),
        ("v - 0.1 * p", ""),
        ("v ** n", ""),
    ],
)
def test_its_unit_follows_from_those_of_its_quantities(text, unit):
    assert Expression(text).unit(UNITS) == unit


def test_a_function_takes_its_quantities_by_name():
    formula = FunctionFormula(lambda q: q["v"] / q["p"], UNITS)
    assert formula.names == ("v", "p")
    assert formula.value({"v": 3.0, "p": 4.0}) == 0.75
    assert np.isnan(formula.value({"v": 3.0, "p": 0})) or np.isinf(formula.value({"v": 3.0, "p": 0}))
    assert formula.unit(UNITS) == ""


def test_the_key_of_a_function_is_that_of_what_it_does():
    def scaled(factor):
        return FunctionFormula(lambda q: factor * q["v"], UNITS).key

    assert scaled(1.0) == scaled(1.0)
    assert len({scaled(1.0), scaled(2.0), FunctionFormula(lambda q: q["p"], UNITS).key}) == 3


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda q: q["vv"], r'lambda\(\): "vv" is no quantity. Did you mean "v"\? There are v, p, f, n, e, w, d'),
        (lambda q: "3", 'gives the text "3"; a number is expected'),
        (lambda q: None, "gives nothing"),
        (lambda q: [q["v"]], "gives a list"),
        (lambda: 1.0, "fails with TypeError: .*takes 0 positional arguments"),
        (3, "the int 3 is given where a name, an expression or a function of quantities is expected"),
    ],
)
def test_a_function_that_gives_no_number_gets_a_sentence(function, said):
    with pytest.raises(InputError, match=f"^maximise: .*{said}"):
        FunctionFormula(function, UNITS, "maximise")


def test_a_function_reads_its_quantities_before_it_decides():
    formula = FunctionFormula(lambda q: q["v"] if q["v"] < 5 else q["p"], UNITS)
    with pytest.raises(InputError, match='"p" is read at some values only'):
        formula.value({"v": 7.0})
