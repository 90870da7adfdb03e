"""Problems as people write them: what is read, what is refused and in which words, what is changed."""

import numpy as np
import pytest

from nectosome.description import parse_robot
from nectosome.description.variables import Box, read_variable
from nectosome.designs import MotionDesign, Problem, load_problem, problem_of, read_constraint, shipped_problem
from nectosome.robots import describe
from nectosome.units import InputError

from .test_problem import SINKER

ROBOT = parse_robot(SINKER)
FLAGELLUM = describe("flagellum")
RANGES = {"m": "0.09..0.3kg", "A": "1e-4 m2 .. 1e-2 m2"}
WORDS = Problem(RANGES, "speed", keep=(read_constraint("speed <= 2 m/s"),), forward="-z")


@pytest.mark.parametrize(
    "text", ["300 mm .. 700 mm", "300 mm..0.7 m", " 0.3 m  ..  70e1 mm ", "300..700mm", "300 .. 700 mm", "0.3..0.7m"]
)
def test_a_range_is_two_values_with_units(text):
    variable = read_variable("L", text, FLAGELLUM)
    assert (variable.lower, variable.upper, variable.log) == (0.3, 0.7, False)
    assert read_variable("L", variable.text(), FLAGELLUM) == variable


def test_a_range_may_be_logarithmic():
    variable = read_variable("E", "1378.95 kPa .. 1681 MPa log", FLAGELLUM)
    assert (variable.lower, variable.upper, variable.log) == (1378950.0, 1681e6, True)
    assert read_variable("E", variable.text(), FLAGELLUM) == variable


@pytest.mark.parametrize(
    ("name", "text", "ends", "levels"),
    [
        ("L", "300..700:100mm", (0.3, 0.7), 5),
        ("L", "300..700 mm : 150 mm", (0.3, 0.6), 3),
        ("L", "0.3m..360mm:10mm", (0.3, 0.36), 7),
        ("E", "1..16 MPa : 2 log", (1e6, 16e6), 5),
    ],
)
def test_a_range_may_be_in_steps(name, text, ends, levels):
    """To the last one that they lead to; values between them are those that people write."""
    variable = read_variable(name, text, FLAGELLUM, steps=True)
    assert (variable.lower, variable.upper, variable.levels) == (*ends, levels)
    assert read_variable(name, variable.text(), FLAGELLUM, steps=True) == variable
    values = Box((variable,)).values(np.linspace(0, 1, levels)[:, None])[:, 0]
    step = 2.0 if variable.log else (ends[1] - ends[0]) / (levels - 1)
    expected = ends[0] * step ** np.arange(levels) if variable.log else ends[0] + step * np.arange(levels)
    assert values.tolist() == [float(f"{x:.12g}") for x in expected]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("L", "300 mm", 'L: "300 mm" is no range. Write LOW..HIGH'),
        ("L", "", "is no range"),
        ("L", "..", "is no range"),
        ("L", "300 mm ..", "is no range"),
        ("L", "300..700", '"300" has no unit'),
        ("L", "300..700:100mm", "has a step, which only sweeps and designs of a motion take"),
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
    assert list(WORDS.changed(ROBOT, fixed=[name]).vary) == ["A"]


@pytest.mark.parametrize("name", ["m", "body.mass"])
def test_a_range_takes_the_place_of_that_of_the_same_quantity(name):
    assert WORDS.changed(ROBOT, vary={name: "0.1..0.2kg"}).vary == {"A": RANGES["A"], name: "0.1..0.2kg"}


def test_a_limit_takes_the_place_of_those_on_the_same_quantity():
    problem = WORDS.changed(ROBOT, keep=["speed <= 1 m/s", read_constraint("power <= 3 W")], minimise="power")
    assert [str(limit) for limit in problem.keep] == ["speed <= 1 m/s", "power <= 3 W"]
    assert (problem.maximise, problem.minimise, problem.forward) == ("", "power", "-z")
    assert WORDS.changed(ROBOT, forward="z").forward == "z"
    assert WORDS.changed(ROBOT) == WORDS


@pytest.mark.parametrize(
    ("words", "highest"),
    [({}, True), ({"minimise": "power"}, False), ({"maximise": "power"}, True), ({"minimise": "speed"}, False)],
)
def test_an_objective_is_maximised_or_minimised(words, highest):
    """The sign of the numbers that a search makes small."""
    task = Problem(RANGES, **words).task(ROBOT)
    assert isinstance(task, MotionDesign)
    assert task.highest == highest
    found = task.prepare()(np.full(2, 0.5), False, None)
    assert found.objective == (-1 if highest else 1) * found.outputs[task.objective]
    other = Problem(RANGES, maximise="speed").task(ROBOT)
    assert (task.key() == other.key()) == (words == {})


@pytest.mark.parametrize(
    "changes",
    [
        {"vary": {"m": ""}},
        {"vary": {"": "3..4kg"}},
        {"vary": {"mm": "1..2kg"}},
        {"keep": ["speed"]},
        {"maximise": "spead"},
        {"minimise": "efficency"},
        {"maximise": "speed", "minimise": "power"},
    ],
)
def test_a_change_that_makes_no_sense_is_refused(changes):
    with pytest.raises(InputError):
        WORDS.changed(ROBOT, **changes).task(ROBOT)


@pytest.mark.parametrize(
    ("fixed", "vary", "said"),
    [
        ([], ("m", "body.mass"), "vary m and vary body.mass both set body.mass"),
        (["body.mass"], ("m",), "set body.mass and vary m both set body.mass"),
    ],
)
def test_what_is_asked_for_in_two_ways_at_once_is_refused(fixed, vary, said):
    with pytest.raises(InputError, match=said):
        WORDS.changed(ROBOT, fixed=fixed, vary=dict.fromkeys(vary, "1..2kg"))


def test_the_problem_of_a_robot_stands_beside_its_file_or_ships_with_it(tmp_path):
    assert problem_of("flagellum") == shipped_problem("flagellum")
    assert problem_of(tmp_path / "fin.yaml") == Problem()
    (tmp_path / "fin.design.yaml").write_text("vary: {m: 1..2kg}\nminimise: power\n")
    assert problem_of(str(tmp_path / "fin.yaml")) == Problem({"m": "1..2kg"}, minimise="power")


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
        ("", "this is empty. A problem says at least what may vary."),
        ("- 1\n", "has no named fields"),
        ("3\n", "has no named fields"),
        ("about: nothing\n", "line 1, vary: is missing"),
        ("vary: {}\n", "line 1, vary: needs at least one name with a range"),
        ("vary: [L]\n", "line 1, vary: a list does not fit here"),
        ("about: x\nvary:\n", "line 2, vary: an empty value"),
        (
            "vary: {m: 1 kg .. 2 kg}\nkeeps: []\n",
            'line 2, keeps: there is no field "keeps" here. Did you mean "keep"',
        ),
        (
            "vary: {m: 1 kg .. 2 kg}\nkeep: speed <= 3 m/s\n",
            'line 2, keep: "speed <= 3 m/s" does not fit here. A list expected.',
        ),
        ("vary: {m: 1 kg .. 2 kg}\nkeep: [speed <= 3 s]\n", 'line 2, keep.0: "3 s" is a time'),
        ("vary: {m: 1..2kg}\nmaximise: spead\n", 'line 2, maximise: "spead" is no quantity of a motion'),
        ("vary: {m: 1..2kg}\nforward: q\n", 'line 2, forward: "q" is not known here'),
        ("vary: {m: 1 kg .. 2 kg, m: 3}\n", "problem.yaml, line 1"),
        ("vary: {m: 1 kg ..", "this is not YAML"),
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
