"""A robot that is written to a file and read back is the same robot, number by number."""

from pathlib import Path

import numpy as np
import pytest

from nectosome.description import dump_robot, load_robot, parse_robot
from nectosome.model import template_of
from nectosome.robots import describe, names
from nectosome.robots.shipped import file_names, starter_names, starter_of

ROOT = Path(__file__).parents[2]
EXAMPLES = [file for file in (ROOT / "examples").glob("**/*.yaml") if "\nbody:" in file.read_text()]
ROBOTS = {
    **{name: lambda name=name: describe(name) for name in names()},
    **{f"new {n}": lambda n=n: load_robot(starter_of(n)) for n in starter_names() if n not in file_names()},
    **{file.name: lambda file=file: load_robot(file) for file in EXAMPLES},
}


def test_examples_are_among_them():
    assert {"cantilever.yaml", "gripper.yaml"} <= set(ROBOTS)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_reads_back_exactly(name):
    first = ROBOTS[name]()
    text = dump_robot(first)
    again = parse_robot(text)
    assert again == first
    assert dump_robot(again) == text
    (blueprint, numbers), (other, others) = template_of(first), template_of(again)
    assert other.plan.key == blueprint.plan.key  # what `build` makes is a function of these two
    assert other.paths == blueprint.paths
    assert np.asarray(others).tobytes() == np.asarray(numbers).tobytes()
