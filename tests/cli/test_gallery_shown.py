"""The robots of the gallery pass the check, and show tells that those made for it float."""

from pathlib import Path

import pytest

from nectosome.description import dump_robot
from nectosome.robots import describe

NEUTRAL = {"eel", "fish", "jelly", "turtle", "krill", "octopus", "manta"}
ALL = ["flagella1", "flagella4", "beetle", "poseidrone_jet", *sorted(NEUTRAL)]
QUICK = {"eel", "jelly"}  # to build


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in ALL])
def test_it_is_checked_and_shown(nectosome, name):
    Path("robot.yaml").write_text(dump_robot(describe(name)))
    answer = nectosome("check", "robot.yaml")
    assert (answer.code, answer.err) == (0, "")
    assert ": ok, " in answer.out
    answer = nectosome("show", name)
    assert (answer.code, answer.err) == (0, "")
    assert name not in NEUTRAL or "none: it is neutral" in answer.out
