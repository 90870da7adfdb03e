"""Rewards as expressions: arithmetic as Python has it, dotted names, and nothing else of Python."""

import numpy as np
import pytest

from nectosome.gym import Reward
from nectosome.units import InputError

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
    reward = Reward(text)
    assert reward.value(VALUES) == pytest.approx(expected, rel=1e-15)
    many = reward.value({name: np.array([x, x]) for name, x in VALUES.items()})
    np.testing.assert_allclose(np.broadcast_to(many, 2), expected, rtol=1e-15)


def test_it_names_its_quantities_once():
    assert Reward("abs(b.c) + a - b.c * goal.heading").names == ("b.c", "a", "goal.heading")


def test_what_has_no_value_is_nan():
    assert np.isnan(Reward("sqrt(0 - a)").value({"a": np.float64(1.0)}))
    assert np.isinf(Reward("1 / (a - a)").value({"a": np.float64(1.0)}))


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
        Reward(text)
    assert str(told.value).startswith("reward: ")


def test_what_is_no_text_is_told(as_users_run):
    with pytest.raises(InputError, match="reward: the int 3 is given where an expression is expected"):
        Reward(3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r'"sqt" is no function. Did you mean "sqrt"'):
        Reward("sqt(a)")
