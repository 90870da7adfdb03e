"""The small table of an answer's numbers."""

import numpy as np

from nectosome.studio.numbers import NumberTable
from nectosome.studio.session import _waiting


def test_numbers_stand_in_readable_units_with_a_history_of_their_own():
    numbers = NumberTable()
    numbers.add({"speed": 0.5, "power": 2.0, "torque": np.nan})
    numbers.add({"speed": 0.25, "power": 2.0, "torque": np.nan})
    page = numbers.html([("steady <motion>", False)])
    assert 'id="studio-speed">250</td>' in page
    assert ">mm/s</td>" in page
    assert "torque" not in page
    assert "steady &lt;motion&gt;" in page
    assert 'data-count="2"' in page
    assert page.count("<polyline") == 2


def test_what_was_never_known_has_no_row_whatever_lies_between():
    numbers = NumberTable()
    for thrust in (0.0, np.nan, 0.0):
        numbers.add({"thrust": thrust, "power": 1.0})
    page = numbers.html([])
    assert "thrust" not in page
    assert "power" in page


def test_of_another_robot_they_begin_anew():
    numbers = NumberTable()
    numbers.add({"speed": 0.5})
    numbers.forget()
    assert "speed" not in numbers.html([("", False)])
    numbers.add({"power": 1.0})
    page = numbers.html([("steady", False), ("no", True)])
    assert "speed" not in page
    assert "<polyline" not in page
    assert '#D55E00">no</div>' in page
    assert page.count("#D55E00") == 1


def test_numbers_and_picture_of_the_last_answer_are_pale_while_the_next_one_is_computed():
    table = NumberTable()
    table.add({"speed": 0.3})
    words = [(_waiting(True, 1.2, 2.6), False)]
    assert table.html(words, old=True).count("opacity:0.4") == 2 and "opacity" not in table.html(words)
    assert words[0][0] == "computing; what is shown is the last answer: 1 s so far, about 1 s left"
    assert _waiting(True, 3.0, 2.6).endswith("3 s so far") and _waiting(True, 1.0, None).endswith("1 s so far")
    assert _waiting(False, 12.0, None).startswith("computing; the first answer of a robot compiles")
