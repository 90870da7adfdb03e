"""What `import nectosome as ns` gives to those who work in a notebook."""

import inspect
import re
from importlib import import_module
from pathlib import Path

import jax
import numpy as np
import pytest
from tests.small_robots import BALL

import nectosome as ns

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "python" / "index.md"


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("face") / "ball.yaml"
    path.write_text(BALL + "aliases: {heavy: body.density}\n")
    return ns.describe(str(path))


def test_names_and_rooms_are_offered_and_come():
    assert {"simulate", "measure", "controllers", "identification"} <= set(dir(ns))
    assert all(getattr(ns, name) is not None for name in dir(ns))
    assert ns.measure is import_module("nectosome.measure")
    with pytest.raises(AttributeError, match=r"nectosome has no simulat$"):
        _ = ns.simulat


def test_the_page_lists_all_public_names_and_no_others():
    face = PAGE.read_text(encoding="utf-8").partition("## The public face")[2]
    listed = re.findall(r"^\| \[`ns\.(\w+)`\]", face, re.M)
    assert sorted(listed) == sorted(ns.__all__)


def test_a_verb_is_one_function():
    """What the page's table calls is public, and takes a robot in every form or what was made of one."""
    page = PAGE.read_text(encoding="utf-8").partition("\n## ")[0]
    called = set(re.findall(r"`ns\.(\w+)\(", page))
    assert called <= set(ns.__all__)
    for name in called - {"describe", "apply_settings"}:
        assert "Raises InputError" in " ".join((inspect.getdoc(getattr(ns, name)) or "").split()), name


def test_public_functions_are_typed():
    for name in set(ns.__all__) - {"InputError"}:
        signature = inspect.signature(getattr(ns, name))
        untyped = [p.name for p in signature.parameters.values() if p.annotation is inspect.Parameter.empty]
        assert (untyped, signature.return_annotation is inspect.Signature.empty) == ([], False), name


def test_a_name_is_enough(tmp_path, ball):
    """By path here; names, descriptions and built robots are the same to all of them (`tests/model/test_inputs.py`)."""
    ns.save_robot(ball, tmp_path / "ball.yaml")
    for given in (ball, tmp_path / "ball.yaml", str(tmp_path / "ball.yaml"), ns.build(ball)):
        run = ns.simulate(given, "0.1s", samples=3)
        assert run.to_dataset().attrs["title"] == "ball: simulation"
        assert run.value.time[-1] == 0.1


def test_a_result_knows_its_robot(ball, tmp_path):
    run = ns.simulate(ns.apply_settings(ball, ["heavy=1.3g/cm3"]), 0.1, samples=3)
    ns.save_dataset(run.to_dataset({"why": "to see"}), tmp_path / "run.nc")
    saved = ns.load_dataset(tmp_path / "run.nc")
    assert "density: 1300 kg/m3" in saved.attrs["robot"] and "to see" in saved.attrs["provenance"]
    np.testing.assert_allclose(ns.reading(saved, "velocity.z"), ns.reading(run, "velocity.z"))


def test_a_static_equilibrium_is_a_result_like_any(ball):
    held = ns.apply_settings(ball, ["body.joint.stiffness=100N/m"])
    found = ns.static(held)
    data = found.to_dataset()
    sunk = float(data["load_force"].sel(axis="z").sum()) / 100
    assert (data.attrs["title"], data.attrs["status"]) == ("ball: at rest", "SOLVED")
    assert ns.reading(found, "position.z") == pytest.approx([sunk])
    assert ns.modes(found).stable


def test_a_period_is_that_of_the_drives(ball):
    driven = ns.apply_settings(ball, ["body.joint.force={kind: sine, amplitude: 1 N, frequency: 4 Hz}", "heavy=1g/cm3"])
    assert float(ns.periodic(driven).value.time[-1]) == 0.25
    with pytest.raises(ns.InputError, match="period: nothing of this robot is driven to and fro or round"):
        ns.periodic(ball)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda ball, run: ns.simulate(ball, "1"), 'time: "1" has no unit. Time expected, as in "0.5 s"'),
        (lambda ball, run: ns.simulate(ball, "1 m"), 'time: "1 m" is a length'),
        (lambda ball, run: ns.simulate(ball, None), 'time: "null" is no quantity'),
        (lambda ball, run: ns.simulate(ball, -1.0), 'time: "-1.0" is out of range: it must be more than 0.'),
        (lambda ball, run: ns.simulate(run.to_dataset(), 1.0), "a dataset is given where a robot is expected"),
        (lambda ball, run: ns.steady(run), "a run is given where a robot is expected"),
        (lambda ball, run: ns.periodic(ball, "3 Hz"), 'period: "3 Hz" is a'),
        (lambda ball, run: ns.static(3), "the int 3 is given where a robot is expected"),
        (lambda ball, run: ns.reading(ball, "depth"), "a RobotDescription is given where a run is expected"),
        (lambda ball, run: ns.reading(run, 3), "the int 3 is given where the name of a reading is expected"),
        (lambda ball, run: ns.simulate(ball, 1.0, method="rk4"), 'method: "rk4" is none of auto, implicit, explicit'),
        (lambda ball, run: ns.simulate(ball, 1.0, samples=2.5), 'samples: "2.5" must be a whole number of at least 2'),
        (lambda ball, run: ns.simulate(ball, 1.0, samples="a"), 'samples: "a" must be a whole number'),
        (lambda ball, run: ns.simulate(ball, 1.0, rtol="a"), 'rtol: "a" is out of range'),
        (
            lambda ball, run: ns.simulate(ball, 1.0, initial=ns.build(ns.describe("poseidrone")).initial()),
            "initial: it is of a robot of another structure: it has",
        ),
        (
            lambda ball, run: ns.apply_settings("ball", ["heavy=1g/cm3"]),
            'the text "ball" is given where a robot\'s desc',
        ),
        (lambda ball, run: ns.save_robot(ns.build(ball), "x.yaml"), "a Robot is given where a robot's description"),
        (lambda ball, run: ns.sweep(ball, ["heavy"]), "over: a list is given where names with values are expected"),
        (lambda ball, run: ns.identify(ball, [], vary=["heavy"], compare={}), "vary: a list is given where names"),
        (
            lambda ball, run: ns.identify(ball, None, vary={"heavy": (1, 2)}, compare={"z": "position.z"}),
            "campaign: noth",
        ),
        (lambda ball, run: ns.fit(lambda x, a: a * x, [1, 2], [1, 2], ["a"]), "vary: a list is given where names"),
        (
            lambda ball, run: ns.fit(lambda x, a: a * x, [1, 2], "y", {"a": (0, 2)}),
            'y: the text "y" is given where numb',
        ),
        (
            lambda ball, run: ns.fit(lambda x, a: a * x, [1, 2], [1, 2], {"b": (0, 2)}),
            "curve: cannot be called with x and",
        ),
        (lambda ball, run: ns.fit("a x", [1, 2], [1, 2], {"a": (0, 2)}), 'curve: the text "a x" is given where a func'),
        (
            lambda ball, run: ns.fit(lambda x, a: a * x, [1, 2], [1, 2], {"a": (0, 2)}, errors=[1, 2, 3]),
            "errors: has the",
        ),
        (lambda ball, run: ns.correct(None, []), "nothing (None) is given where a robot is expected"),
        (lambda ball, run: ns.show_run(ball, "x.html"), "a RobotDescription is given where a result or its dataset"),
        (lambda ball, run: ns.show_sweep(run, "x.html"), "this dataset is no sweep: it lacks speed"),
        (lambda ball, run: ns.save_dataset(ball, "x.nc"), "a RobotDescription is given where a result or its dataset"),
        (lambda ball, run: ns.reading(run, "climb"), '"climb" is nothing that can be measured'),
        (lambda ball, run: ns.sweep(run.to_dataset(), {"heavy": [1000.0]}), "a dataset is given where a robot is"),
        (lambda ball, run: ns.design(run.to_dataset()), "a dataset is given where a robot is expected"),
        (lambda ball, run: ns.modes(run.to_dataset()), "a dataset is given where a robot is expected"),
        (lambda ball, run: ns.critical("ball", "P", "1..5N"), 'there is no robot called "ball"'),
        (lambda ball, run: ns.forces(ball, {"x": 1.0}), 'q: there is no free coordinate "x"'),
    ],
)
def test_a_wrong_argument_is_told_in_a_sentence(as_users_run, ball, call, said):
    run = ns.simulate(ball, 0.1, samples=3)
    with pytest.raises(ns.InputError) as told:
        call(ball, run)
    assert str(told.value).startswith(said)


def test_a_robot_with_other_numbers_is_saved_and_read_again(ball, tmp_path):
    other = ns.apply_settings(ball, ["heavy=1.3g/cm3"])
    ns.save_robot(other, tmp_path / "other.yaml")
    assert ns.load_robot(tmp_path / "other.yaml") == other != ball
    with pytest.raises(ns.InputError, match="it is a folder"):
        ns.save_robot(other, tmp_path)


def test_what_is_printed_is_one_line(ball):
    robot = ns.build(ball)
    run = ns.simulate(robot, 0.1, samples=3)
    assert repr(ball) == str(ball) == "<RobotDescription ball: parts body; short names heavy>"
    assert repr(robot) == "<Robot: parts body; 1 degrees of freedom, 0 driven>"
    assert repr(run) == "<SimulationRun: SOLVED, solved, 3 times from 0 s to 0.1 s>"
    assert repr(run.value).startswith("<Trajectory: 3 times from 0 s to 0.1 s, State(q=f64[3,1]")
    jax.jit(lambda run: repr(run) and run.status)(run)  # what is traced has a repr too
