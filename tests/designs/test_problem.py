"""The design of a sinking body, whose best is known in closed form; slopes, reasons, what is refused."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.description import apply_settings, get_value, parse_robot
from nectosome.description.variables import read_variable
from nectosome.designs import QUANTITIES, Limit, MotionDesign, MotorLine, Problem, design, read_constraint
from nectosome.designs.quantities import AT_REST
from nectosome.model import build
from nectosome.robots import describe
from nectosome.search import Gradient, multistart
from nectosome.solve import steady
from nectosome.units import InputError

RHO, G = 1000.0, 9.80665
SINKER = """
name: sinker
aliases: {m: body.mass, A: body.loads.drag.drag_area.2}
body:
  kind: rigid
  shape: cylinder
  length: 60 mm
  radius: 20 mm
  mass: 0.15 kg
  joint: {kind: prismatic, axis: z}
  loads:
    drag: {kind: lumped_drag, drag_area: [0 m2, 0 m2, 1.2e-3 m2]}
"""
DISPLACED = RHO * np.pi * 0.02**2 * 0.06  # [kg]
ROBOT = parse_robot(SINKER)
WORDS = Problem(
    {"m": "0.09 kg .. 0.3 kg", "A": "1e-4 m2 .. 1e-2 m2 log"}, keep=(read_constraint("speed <= 1.1 m/s"),), forward="-z"
)


def sinking(mass: float, area: float) -> float:
    """Terminal speed [m/s]: (m - displaced) g = rho/2 A V^2."""
    return np.sqrt(2 * (mass - DISPLACED) * G / (RHO * area))


@pytest.fixture(scope="module")
def task() -> MotionDesign:
    return WORDS.task(ROBOT)


@pytest.fixture(scope="module")
def evaluate(task):
    return task.prepare()


def test_speed_and_limit_are_those_of_the_closed_form(task, evaluate):
    for u in np.random.default_rng(2).uniform(size=(4, 2)):
        got = evaluate(u, False, None)
        assert got.solved
        speed = sinking(*task.box.values(u))
        assert got.objective == pytest.approx(-speed, rel=1e-9)
        np.testing.assert_allclose(got.constraints, [speed / 1.1 - 1], atol=1e-9)
        assert got.outputs == {"speed": pytest.approx(speed), "torque": 0.0, "power": 0.0, "drive_rate": 0.0}


def test_slopes_are_those_of_central_differences_and_warm_starts_change_nothing(evaluate):
    u, h = np.array([0.4, 0.6]), 1e-5
    got = evaluate(u, True, None)
    warm = evaluate(u, True, evaluate(u + 0.05, False, None).memory)
    assert warm.objective == pytest.approx(got.objective, rel=1e-9)
    differences = [
        (evaluate(u + d, False, None).objective - evaluate(u - d, False, None).objective) for d in h * np.eye(2)
    ]
    np.testing.assert_allclose(got.gradient, np.array(differences) / (2 * h), rtol=1e-7)
    np.testing.assert_allclose(got.jacobian, -got.gradient[None] / 1.1, rtol=1e-12)


def _curved(quantities):
    return jnp.sqrt(quantities["speed"]) - 0.3 * quantities["speed"] ** 2 + quantities["power"]


def test_an_objective_is_an_expression_or_a_function_of_quantities(task):
    """sqrt(V) - 0.3 V^2 of the closed form; its derivatives are those of central differences."""
    u, h = np.array([0.4, 0.6]), 1e-5
    speed = sinking(*task.box.values(u))
    expected = np.sqrt(speed) - 0.3 * speed**2
    for objective, name in (
        ("sqrt(speed) - 0.3 * speed ** 2", "sqrt(speed) - 0.3 * speed ** 2"),
        (_curved, "_curved()"),
    ):
        other = replace(WORDS, maximise=objective, keep=()).task(ROBOT)
        evaluate = other.prepare()
        got = evaluate(u, True, None)
        assert got.objective == pytest.approx(-expected, rel=1e-9)
        assert got.outputs[name] == pytest.approx(expected, rel=1e-9)
        assert got.outputs["speed"] == pytest.approx(speed, rel=1e-9)
        ends = [[evaluate(u + s * d, False, None).objective for s in (h, -h)] for d in np.eye(2)]
        np.testing.assert_allclose(got.gradient, [(up - down) / (2 * h) for up, down in ends], rtol=1e-6)
        assert other.highest
    assert replace(WORDS, maximise="speed ** 2").task(ROBOT).units["speed ** 2"] == "m2/s2"
    keys = {WORDS.task(ROBOT).key(), *(replace(WORDS, maximise=f).task(ROBOT).key() for f in ("speed ** 2", _curved))}
    assert len(keys) == 3


def test_an_objective_without_a_value_is_not_solved():
    """Nothing drives a sinking body: its power is 0."""
    got = replace(WORDS, maximise="speed / power").task(ROBOT).prepare()(np.array([0.4, 0.6]), False, None)
    assert got.reason == "speed / power is NaN or infinite for this motion, as power is 0"
    assert np.isnan(got.objective)


def test_a_function_without_derivatives_and_one_that_workers_cannot_import_get_a_sentence(task):
    rigid = replace(WORDS, maximise=lambda q: float(q["speed"]), keep=())
    evaluate = rigid.task(ROBOT).prepare()
    assert evaluate(np.array([0.4, 0.6]), False, None).solved
    with pytest.raises(
        InputError, match=r"objective: lambda\(\) fails .* Derivatives need jax.numpy .* optimiser pattern"
    ):
        evaluate(np.array([0.4, 0.6]), True, None)
    with pytest.raises(InputError, match="maximise: worker processes cannot import this function"):
        design(ROBOT, problem=rigid)


def test_the_search_ends_at_the_limit_that_binds(task):
    """Much weight on little area is fastest; a limit of 1.1 m/s on it is met exactly."""
    result = multistart(task, Gradient(), 2, 3, executor=ThreadPoolExecutor(1))
    best = result.best()[0].best
    assert best is not None
    assert -best.objective == pytest.approx(1.1, rel=1e-5)
    assert sinking(*task.box.values(best.u)) == pytest.approx(1.1, rel=1e-5)


def test_what_does_not_sink_swims_backward_and_what_meets_no_water_is_not_solved(evaluate, task):
    floating = replace(task, variables=(read_variable("m", "0.01 kg .. 0.07 kg", ROBOT), task.variables[1]))
    up = floating.prepare()(np.array([0.5, 0.5]), False, None)
    assert up.solved
    assert up.outputs["speed"] < 0
    assert floating.accepts(up) == "swims backward"
    free = replace(task, variables=(task.variables[0], read_variable("A", "0 m2 .. 1e-2 m2", ROBOT)))
    lost = free.prepare()(np.array([0.5, 0.0]), True, None)
    assert not lost.solved
    assert lost.reason
    assert np.isnan(lost.objective)
    assert free.accepts(lost) == lost.reason


def test_the_robot_at_a_design_has_its_values_and_never_more_than_its_range(task):
    for u in (np.zeros(2), np.ones(2), np.array([0.3, 0.7])):
        robot = task.robot_at(u)
        assert [get_value(robot, name) for name in task.names] == task.box.values(u).tolist()
    for _ in range(100):
        low, high = np.sort(np.random.default_rng(7).uniform(0.01, 3, 2))
        box = replace(task, variables=(read_variable("m", f"{low} kg .. {high} kg log", ROBOT),)).box
        assert box.values(np.zeros(1)).tolist() == pytest.approx([low], abs=0)
        assert box.values(np.ones(1)).tolist() == pytest.approx([high], abs=0)


def test_a_box_leads_there_and_back(task):
    u = np.array([0.25, 0.5])
    np.testing.assert_allclose(task.box.values(u), [0.09 + 0.25 * 0.21, 1e-3], rtol=1e-12)
    np.testing.assert_allclose(task.box.design(task.robot_at(u)), u, atol=1e-12)
    outside = np.array([1.5, -0.5])
    np.testing.assert_allclose(task.box.design(task.robot_at(outside)), outside, atol=1e-12)


def test_the_key_changes_with_all_that_the_numbers_depend_on(task):
    words = WORDS
    others = [
        replace(words, vary={**words.vary, "m": "0.09 kg .. 0.31 kg"}),
        replace(words, vary={**words.vary, "A": "1e-4 m2 .. 1e-2 m2"}),
        replace(words, vary=dict(reversed(words.vary.items()))),
        replace(words, vary={"m": words.vary["m"]}),
        replace(words, maximise="power"),
        replace(words, minimise="power"),
        replace(words, keep=(read_constraint("speed <= 1.2 m/s"),)),
        replace(words, keep=(read_constraint("speed >= 1.1 m/s"),)),
        replace(words, keep=()),
        replace(words, forward="z"),
    ]
    keys = [task.key(), *(other.task(ROBOT).key() for other in others)]
    keys.append(words.task(apply_settings(ROBOT, ["body.length=61 mm"])).key())
    keys.append(words.task(apply_settings(ROBOT, ["water.density=1025 kg/m3"])).key())
    assert len(set(keys)) == len(keys)
    assert words.task(parse_robot(SINKER)).key() == task.key()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (replace(WORDS, maximise="sped"), 'maximise: "sped" is no quantity .*Did you mean "speed"'),
        (
            replace(WORDS, minimise="speed / powr"),
            '"powr" is no quantity .*mean "power"\\? There are speed, ',
        ),
        (replace(WORDS, maximise="speed //"), 'maximise: "speed //" is no expression'),
        (replace(WORDS, maximise="2 * 3"), 'maximise: "2 \\* 3" depends on no quantity'),
        (replace(WORDS, maximise=lambda q: q["sped"]), 'maximise: .*"sped" is no quantity. Did you mean "speed"'),
        (replace(WORDS, forward="up"), 'forward: "up" is no direction. Write one of x, -x'),
        (replace(WORDS, vary={}), "variables: there is nothing to choose"),
        (
            replace(WORDS, vary={"m": "0.1 kg .. 0.2 kg", "body.mass": "0.1 kg .. 0.2 kg"}),
            "body.mass is named twice",
        ),
    ],
)
def test_a_task_that_makes_no_sense_is_refused(words, said):
    with pytest.raises(InputError, match=said):
        words.task(ROBOT)


def test_a_limit_on_what_is_always_zero_is_refused():
    """Nothing of a sinking body is driven: a search would keep any limit on its torque."""
    words = replace(WORDS, keep=(read_constraint("torque <= 1 mN m"),))
    with pytest.raises(InputError, match=r"^torque: no joint or strain of this robot has a prescribed motion"):
        words.task(ROBOT).plan()


@pytest.mark.parametrize(("limit", "lacking"), [("tension <= 5 N", "tendon"), ("pressure <= 1 bar", "chamber")])
def test_a_limit_on_a_tendon_or_chamber_that_is_not_there_is_refused(limit, lacking):
    words = replace(WORDS, keep=(read_constraint(limit),))
    with pytest.raises(InputError, match=f"this robot has no {lacking}, so that this is 0"):
        words.task(ROBOT).plan()


@pytest.mark.parametrize(
    ("limit", "lacking"),
    [
        ("endurance >= 1 h", "battery with a capacity or energy"),
        ("cost_of_transport_battery <= 1", "battery"),
        ("current <= 1 A", "motor"),
    ],
)
def test_a_limit_on_a_motor_or_battery_that_is_not_there_is_refused(limit, lacking):
    words = replace(WORDS, keep=(read_constraint(limit),))
    with pytest.raises(InputError, match=f"this robot has no {lacking}. Leave it out"):
        words.task(ROBOT).plan()


def test_robots_without_a_steady_motion_are_refused():
    fixed = WORDS.task(parse_robot(SINKER.replace("{kind: prismatic, axis: z}", "{kind: fixed}")))
    with pytest.raises(InputError, match="nothing of this robot is free to move"):
        fixed.prepare()


def test_a_motor_gives_less_torque_the_faster_it_turns():
    line = read_constraint("motor 0.89 N m, 22 rad/s")
    assert line == MotorLine(0.89, 22.0)
    assert line.weights == {"torque": 1 / 0.89, "drive_rate": 1 / 22.0}
    for torque, rate, excess in ((0.89, 0.0, 0.0), (0.0, 22.0, 0.0), (0.445, 11.0, 0.0), (0.89, 11.0, 0.5)):
        assert line.excess({"torque": torque, "drive_rate": rate}) == pytest.approx(excess)
    assert read_constraint(str(line)) == line


def test_a_limit_counts_in_units_of_itself():
    assert Limit("torque", True, 0.5).excess({"torque": 0.6}) == pytest.approx(0.2)
    assert Limit("speed", False, 0.5).excess({"speed": 0.4}) == pytest.approx(0.2)
    assert Limit("speed", False, 0.0).excess({"speed": -0.4}) == pytest.approx(0.4)


@pytest.mark.slow
def test_quantities_of_the_flagellum_are_those_of_its_steady_motion():
    """Each number against the dataset of `steady`; thrust and drag of the body are one, for it swims evenly."""
    robot = describe("flagellum")
    of_others = {"tension", "pressure", "current", "electrical_power", "battery_power", "endurance", "range"}
    of_others |= {"cost_of_transport_electrical", "cost_of_transport_battery"}
    of_others |= {"frequency", "stride_length", "tail_amplitude", "strouhal", "slip", "froude_efficiency"}  # of a beat
    names = tuple(name for name in QUANTITIES if name not in {"voltage_demand", *of_others, *AT_REST})
    limits = tuple(Limit(name, True, 1.0) for name in names)  # a limit of 1 tells the quantity: excess + 1
    variable = read_variable("omega", "10 rad/s .. 20 rad/s", robot)
    task = MotionDesign(robot, (variable,), "speed", limits, "-x")
    got = dict(zip(names, task.prepare()(task.box.design(robot), False, None).constraints + 1, strict=True))
    data = steady(build(robot)).to_dataset().isel(time=0)
    speed = -float(data["velocity"].sel(part="body", axis="x"))
    torque, power = float(data["reaction"].item()), float(data["reaction_power"].item())
    thrust = float(data["load_force"].sel(part="body", axis="x").sum())
    weight = float(np.sum(np.asarray(build(robot).inertia)[:, 3, 3])) * G
    want = {
        "speed": speed,
        "speed_over_ground": speed,
        "forward_speed": speed,
        "energy_per_metre": power / speed,
        "torque": abs(torque),
        "power": power,
        "thrust": thrust,
        "drive_rate": 14.4,
    }
    want["stress"] = float(np.abs(data["bending_stress"]).max())
    want |= {"efficiency": thrust * speed / power, "cost_of_transport": power / (weight * speed)}
    want |= {"cost_of_transport_positive": power / (weight * speed)}
    bend = np.radians(42.3)  # of the hook; the filament goes on straight, and its tip stands askew
    length = 0.085 + 0.015 + 0.05 * np.sin(bend) / bend + 0.7 * np.cos(bend) + 5.65e-3 * np.sin(bend)
    want["body_lengths_per_second"] = speed / length
    for name in names:
        assert got[name] == pytest.approx(want[name], rel=1e-6), name
