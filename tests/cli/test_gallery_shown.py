"""The robots of the gallery pass the check, and show tells that those made for it float."""

from pathlib import Path

import pytest

from nectosome.description import dump_robot
from nectosome.robots import describe

NEUTRAL = {"eel", "fish", "jelly", "turtle", "krill", "octopus", "manta", "ray"}
ALL = ["flagella1", "flagella4", "beetle", "poseidrone_jet", *sorted(NEUTRAL)]
QUICK = {"eel", "jelly"}  # to build


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in ALL])
def test_it_is_checked_and_shown(nectosome, name):
    Path("robot.yaml").write_text(dump_robot(describe(name)))
    answer = nectosome("check", "robot.yaml")
    told = [line for line in answer.err.splitlines(keepends=True) if "it passes through blade" not in line]
    assert len(told) == len(answer.err.splitlines()) - 2 * (name == "krill")  # its blades, where they hang straight
    assert (answer.code, _told("".join(told))) == (0, name == "beetle")
    assert ": ok, " in answer.out
    answer = nectosome("show", name)
    assert (answer.code, _told(answer.err)) == (0, name == "beetle")
    assert name not in NEUTRAL or "none: it is neutral" in answer.out


def _told(said: str) -> bool:
    """Whether it was told that hinges are as printed, and nothing else."""
    assert said == "" or (said.count("\n") == 1 and "flexure.as_printed" in said)
    return said != ""
