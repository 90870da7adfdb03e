"""Problems as people write them: what is read, what is refused and in which words, what is changed."""

import numpy as np
import pytest

from nectosome.description import get_value, parse_robot, read_variable
from nectosome.designs import (
    Problem,
    change,
    dump_design,
    load_problem,
    read_constraint,
    restore_design,
    shipped_problem,
)
from nectosome.robots import describe
from nectosome.units import InputError

from .test_problem import SINKER

ROBOT = parse_robot(SINKER)
FLAGELLUM = describe("flagellum")
WORDS = Problem({"m": "0.09 kg .. 0.3 kg", "A": "1e-4 m2 .. 1e-2 m2"}, "speed", ("speed <= 2 m/s",), "-z")


@pytest.mark.parametrize("text", ["300 mm .. 700 mm", "300 mm..0.7 m", " 0.3 m  ..  70e1 mm "])
def test_a_range_is_two_values_with_units(text):
    variable = read_variable("L", text, FLAGELLUM)
    assert (variable.lower, variable.upper, variable.log) == (0.3, 0.7, False)
    assert read_variable("L", variable.text(), FLAGELLUM) == variable


def test_a_range_may_be_logarithmic():
    variable = read_variable("E", "1378.95 kPa .. 1681 MPa log", FLAGELLUM)
    assert (variable.lower, variable.upper, variable.log) == (1378950.0, 1681e6, True)
    assert read_variable("E", variable.text(), FLAGELLUM) == variable


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("L", "300 mm", 'L: "300 mm" is no range. Write two values'),
        ("L", "", "is no range"),
        ("L", "..", "is no range"),
        ("L", "300 mm ..", "is no range"),
        ("L", "300 .. 700 mm", '"300" has no unit'),
        ("L", "300 mn .. 700 mm", "has no unit called mn"),
        ("L", "300 kg .. 700 mm", "is a mass"),
        ("L", "700 mm .. 300 mm", "is empty: its lower end must be less"),
        ("L", "300 mm .. 300 mm", "is empty"),
        ("L", "nan mm .. 300 mm", "must be finite"),
        ("L", "-1 mm .. 300 mm", "L: "),
        ("alpha", "0 deg .. 90 deg log", "has no logarithm: its lower end must be more than 0"),
        ("E", "1 MPa .. 2 MPa logarithmic", "E: "),
        ("omga", "3 rad/s .. 4 rad/s", 'there is no quantity called "omga" in flagellum. Did you mean "omega"'),
        ("body", "3 mm .. 4 mm", 'there is no quantity called "body"'),
        ("limbs.filament.strains.torsion", "1 .. 2", "there is no quantity"),
    ],
)
def test_a_range_that_makes_no_sense_is_refused_with_a_sentence(name, text, said):
    with pytest.raises(InputError) as refused:
        read_variable(name, text, FLAGELLUM)
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("text", "again"),
    [
        ("torque <= 0.5 N m", "torque <= 0.5 N m"),
        ("speed>=300 mm/s", "speed >= 0.3 m/s"),
        ("efficiency >= 0.2", "efficiency >= 0.2"),
        ("motor 0.89 N m, 22 rad/s", "motor 0.89 N m, 22 rad/s"),
    ],
)
def test_a_constraint_is_read(text, again):
    assert read_constraint(text) == read_constraint(again) == read_constraint(str(read_constraint(text)))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is no constraint. Write it as in"),
        ("torque", "is no constraint"),
        ("torque < 0.5 N m", "is no constraint"),
        ("torque = 0.5 N m", "is no constraint"),
        ("torque <= ", "is not a number"),
        ("torqe <= 0.5 N m", 'Did you mean "torque"'),
        ("torque <= 0.5", '"0.5" has no unit'),
        ("torque <= 0.5 kg", "is a mass"),
        ("torque <= nan N m", "must be finite"),
        ("motor 0.89 N m", "is no constraint"),
        ("motor 0 N m, 22 rad/s", "must be more than 0"),
        ("motor 0.89 N m, -22 rad/s", "must be more than 0"),
        ("motor 0.89 W, 22 rad/s", "constraint: "),
        ("motor 1 N m, 2 rad/s, 3 kg", "constraint: "),
    ],
)
def test_a_constraint_that_makes_no_sense_is_refused_with_a_sentence(text, said):
    with pytest.raises(InputError) as refused:
        read_constraint(text)
    assert said in str(refused.value)


@pytest.mark.parametrize("name", ["m", "body.mass"])
def test_what_is_fixed_varies_no_more_by_whichever_name(name):
    robot, problem = change(ROBOT, WORDS, fixed=(f"{name}=0.2 kg",))
    assert list(problem.variables) == ["A"]
    assert get_value(robot, "m") == 0.2


@pytest.mark.parametrize("name", ["m", "body.mass"])
def test_a_range_takes_the_place_of_that_of_the_same_quantity(name):
    _, problem = change(ROBOT, WORDS, vary=(f"{name} = 0.1 kg .. 0.2 kg",))
    assert problem.variables == {"A": WORDS.variables["A"], name: "0.1 kg .. 0.2 kg"}


def test_a_constraint_takes_the_place_of_those_on_the_same_quantity():
    _, problem = change(ROBOT, WORDS, constraints=("speed <= 1 m/s", "power <= 3 W"), objective="power", forward="z")
    assert problem.constraints == ("speed <= 1 m/s", "power <= 3 W")
    assert (problem.objective, problem.forward) == ("power", "z")
    assert change(ROBOT, WORDS)[1] == WORDS


@pytest.mark.parametrize(
    "options",
    [
        {"vary": ("m",)},
        {"vary": ("=3 kg .. 4 kg",)},
        {"fixed": ("m",)},
        {"fixed": ("mm=3 kg",)},
        {"fixed": ("m=3 mm",)},
        {"vary": ("mm=1 kg .. 2 kg",)},
        {"constraints": ("speed",)},
    ],
)
def test_a_change_that_makes_no_sense_is_refused(options):
    with pytest.raises(InputError):
        robot, problem = change(ROBOT, WORDS, **options)
        problem.task(robot)


@pytest.mark.parametrize(
    ("fixed", "vary", "said"),
    [
        ((), ("m=1 kg .. 2 kg", "body.mass=1 kg .. 3 kg"), "--vary m and --vary body.mass both set body.mass"),
        (("body.mass=2 kg",), ("m=1 kg .. 2 kg",), "--fix body.mass and --vary m both set body.mass"),
    ],
)
def test_what_is_asked_for_in_two_ways_at_once_is_refused(fixed, vary, said):
    with pytest.raises(InputError, match=said):
        change(ROBOT, WORDS, fixed=fixed, vary=vary)


def test_a_robot_and_its_problem_are_stored_and_restored():
    robot, problem = restore_design(dump_design(ROBOT, WORDS), "run")
    assert (robot, problem) == (ROBOT, WORDS)
    assert problem.task(robot).key() == WORDS.task(ROBOT).key()


@pytest.mark.parametrize(
    "about",
    [
        {},
        {"problem": {}, "robot": SINKER},
        {"problem": [], "robot": SINKER},
        {"problem": None, "robot": SINKER},
        {"problem": {"variables": [], "objective": "speed", "constraints": [], "forward": "x"}, "robot": SINKER},
        {"problem": {"variables": {}, "objective": "speed", "constraints": 3, "forward": "x"}, "robot": SINKER},
        {"problem": {"variables": {}, "objective": "speed", "constraints": [], "forward": "x"}, "robot": None},
        {"problem": {"variables": {}, "objective": "speed", "constraints": [], "forward": "x"}, "robot": 3},
        {"problem": {"variables": {}, "objective": "speed", "constraints": [], "forward": "x"}, "robot": SINKER[:60]},
    ],
)
def test_what_holds_no_robot_and_problem_is_refused(about):
    with pytest.raises(InputError, match=r"^run"):
        restore_design(about, "run")


def test_the_problem_that_ships_fits_its_robot():
    problem = shipped_problem("flagellum")
    assert problem is not None
    task = problem.task(FLAGELLUM)
    assert task.names == ("L", "tip_radius", "alpha", "omega", "E")
    assert task.constraint_names == ("torque <= 0.5 N m",)
    assert shipped_problem("nobody") is None


def test_the_stroke_that_ships_as_a_problem_fits_the_paddle():
    problem = shipped_problem("paddle")
    assert problem is not None
    task = problem.task(describe("paddle"))
    assert (task.objective, task.forward, task.names) == ("thrust", "-y", ("A", "f"))
    np.testing.assert_allclose(task.box.bounds, [np.radians([30, 75]), [0.3, 1.3]])
    assert task.constraint_names == ("drive_rate <= 67 rpm",)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is no problem file"),
        ("- 1\n", "is no problem file"),
        ("3\n", "is no problem file"),
        ("about: nothing\n", "variables: needs at least one name with a range"),
        ("variables: [L]\n", "line 1, variables: needs"),
        ("about: x\nvariables:\n", "line 2, variables: needs"),
        (
            "variables: {m: 1 kg .. 2 kg}\nconstraint: []\n",
            'line 2, constraint: is not known here. Did you mean "constraints"',
        ),
        ("variables: {m: 1 kg .. 2 kg}\nconstraints: speed <= 3 m/s\n", "line 2, constraints: must be a list"),
        ("variables: {m: 1 kg .. 2 kg, m: 3}\n", "problem.yaml, line 1"),
        ("variables: {m: 1 kg ..", "this is not YAML"),
    ],
)
def test_a_problem_file_that_makes_no_sense_is_refused_with_file_line_and_field(tmp_path, text, said):
    file = tmp_path / "problem.yaml"
    file.write_text(text)
    with pytest.raises(InputError) as refused:
        load_problem(file)
    assert str(refused.value).startswith(str(file))
    assert said in str(refused.value)


def test_a_problem_file_that_cannot_be_read_is_refused(tmp_path):
    (tmp_path / "binary.yaml").write_bytes(bytes(range(256)))
    for path in (tmp_path, tmp_path / "nowhere.yaml", tmp_path / "binary.yaml", "bad\0name"):
        with pytest.raises(InputError, match=r"cannot be read|is not a text file"):
            load_problem(path)
