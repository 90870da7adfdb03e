"""Robots that rooms share are shared: two rooms or more take each, and each has a structure of its own."""

import ast
from pathlib import Path

import jax
from tests import small_robots

from nectosome.description import RobotDescription, parse_robot
from nectosome.model import instantiate, template_of

TESTS = Path(__file__).parents[1]
ROBOTS = {
    name: value if isinstance(value, RobotDescription) else parse_robot(value)
    for name, value in vars(small_robots).items()
    if name.isupper() and isinstance(value, str | RobotDescription)
}


def taken(file: Path) -> set[str]:
    """Robots that a file of tests imports, or takes as a fixture."""
    nodes = [*ast.walk(ast.parse(file.read_text(encoding="utf-8")))]
    imports = (n.names for n in nodes if isinstance(n, ast.ImportFrom) and n.module == "tests.small_robots")
    return {one.name for names in imports for one in names} | {n.arg.upper() for n in nodes if isinstance(n, ast.arg)}


def test_each_is_taken_by_two_rooms_or_more():
    rooms = {name: set[str]() for name in ROBOTS}
    for file in TESTS.glob("*/**/*.py"):
        for name in taken(file) & ROBOTS.keys():
            rooms[name].add(file.relative_to(TESTS).parts[0])
    assert {name: found for name, found in rooms.items() if len(found) < 2} == {}


def test_no_two_have_the_same_structure():
    """Else they are one robot with other numbers, and tests of both may share its programs."""
    shapes = {name: jax.eval_shape(instantiate, *template_of(robot)) for name, robot in ROBOTS.items()}
    structures = {jax.tree.structure(shape): name for name, shape in shapes.items()}
    assert len(structures) == len(ROBOTS) > 5
