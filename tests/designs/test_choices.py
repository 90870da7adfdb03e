"""Choices that are no numbers: servos of the catalogue side by side."""

import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from tests.small_robots import SERVO

from nectosome.description import apply_settings, dump_robot, load_robot, parse_robot
from nectosome.description.variables import read_variable
from nectosome.designs import MotionDesign, Problem, design
from nectosome.designs.sweep import saturated, sweep
from nectosome.search import Pattern
from nectosome.solve import periodic
from nectosome.units import InputError

MODEL = "body.joint.servo.model"
MODELS = ["XW540-T260-R", "XW540-T140-R"]


def test_another_model_brings_its_own_data_sheet_and_leaves_what_was_written():
    servo = parse_robot(SERVO)
    small = apply_settings(servo, [f"{MODEL}=HS-5646WP"]).body.joint.powered
    assert small == parse_robot(SERVO.replace("XW540-T140-R", "HS-5646WP")).body.joint.powered
    weak = apply_settings(servo, ["body.joint.servo.stall_torque=0.5 N m", f"{MODEL}=XC330-M288-T"])
    assert (weak.body.joint.powered.stall_torque, weak.body.joint.powered.rated_voltage) == (0.5, 5.0)


def test_a_number_of_0_beside_a_model_is_written_and_read_again():
    """Left out, the catalogue's current without a load, 0.33 A, would stand there."""
    ideal = parse_robot(SERVO.replace("XW540-T140-R", "HS-5646WP, no_load_current: 0 A"))
    assert ideal.body.joint.powered.no_load_current == 0.0
    assert parse_robot(dump_robot(ideal)) == ideal == apply_settings(ideal, [])


def test_a_sweep_over_models_has_the_cycle_of_each():
    """A disc to and fro by 30 deg at 4.9 rad/s: the servo of 40 rpm is saturated, that of 72 rpm is not."""
    servo = parse_robot(SERVO)
    found = sweep(servo, {MODEL: ",".join(MODELS), "body.joint.motion.frequency": [0.5, 1.5]}, samples=65, rtol=1e-6)
    assert found["current_peak"].dims == (MODEL, "body.joint.motion.frequency", "motor")
    assert found[MODEL].values.tolist() == MODELS
    assert saturated(found).sel({"body.joint.motion.frequency": 1.5}).values.tolist() == [True, False]
    settings = [f"{MODEL}={MODELS[1]}", "body.joint.motion.frequency=1.5Hz"]
    one = periodic(apply_settings(servo, settings), samples=65, rtol=1e-6).means()
    here = found.sel({MODEL: MODELS[1], "body.joint.motion.frequency": 1.5})
    for name in ("current_peak", "tracking_error_peak", "battery_power"):
        np.testing.assert_allclose(here[name], np.asarray(getattr(one, name)), rtol=1e-3, err_msg=name)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ("XC330-M288-T,XC330-M288-T", "takes a value twice"),
        ("XC330-M288-T,", "takes no value"),
        ("XW540", 'there is no motor "XW540" in the catalogue. Known: XW540-T140-R'),
    ],
)
def test_wrong_choices_are_told(values, said):
    with pytest.raises(InputError, match=said):
        sweep(parse_robot(SERVO), {MODEL: values})


def test_a_design_over_models_takes_the_best_of_them_that_can_follow(tmp_path):
    """Of two servos that may be geared, the slower one cannot follow at any ratio."""
    found = design(
        apply_settings(parse_robot(SERVO), ["body.joint.motion.frequency=1.5Hz"]),
        vary={MODEL: ",".join(MODELS), "body.joint.servo.gear_ratio": "0.8..1.2"},
        minimise="battery_power",
        keep=["current <= 4 A"],  # and the servo follows its motion, though nobody says so
        optimiser=Pattern(evaluations=6),
        starts=1,
        folder=tmp_path,
        executor=ThreadPoolExecutor(1),  # programs of the first choice serve the second
    )
    assert [one.choice for one in found.choices] == MODELS
    assert [one.best is None for one in found.choices] == [True, False]
    assert found.choice == MODELS[1]
    assert found.added == ("voltage_demand <= 1",)
    assert found.robot.body.joint.powered.model == MODELS[1]
    assert found.best.outputs["voltage_demand"] < 1
    folders = sorted(f"choice_{model}" for model in MODELS)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["best.yaml", *folders]
    assert (
        load_robot(tmp_path / "best.yaml") == load_robot(tmp_path / f"choice_{MODELS[1]}" / "best.yaml") == found.robot
    )
    assert not (tmp_path / f"choice_{MODELS[0]}" / "best.yaml").exists()
    with pytest.raises(InputError, match="only choices vary"):
        design(parse_robot(SERVO), vary={MODEL: ",".join(MODELS)})


def test_servos_follow_their_motion_unless_another_limit_is_given():
    """Whatever a problem file chooses among; without servos, or at rest, there is nothing to follow."""
    servo, ratio = parse_robot(SERVO), "body.joint.servo.gear_ratio"
    words = Problem({MODEL: ",".join(MODELS), ratio: "0.8..1.2"}, minimise="battery_power")
    changed = words.changed(servo, vary={MODEL: MODELS[0]})
    assert changed.vary == {MODEL: MODELS[0], ratio: "0.8..1.2"}
    only = Problem({ratio: "0.8..1.2"}, minimise="battery_power")
    assert only.motion(servo).constraint_names == ("voltage_demand <= 1",)
    looser = only.changed(servo, keep=["voltage_demand <= 3", "current <= 4 A"])
    assert looser.motion(servo).constraint_names == ("voltage_demand <= 3", "current <= 4 A")
    assert only.changed(servo, minimise="net_weight").motion(servo).constraint_names == ()
    prescribed = parse_robot(re.sub(r"batteries: .*|servo: .*", "", SERVO))
    assert Problem({"body.mass": "1..2 kg"}, minimise="power").motion(prescribed).constraint_names == ()


def test_a_data_sheet_that_would_give_more_than_it_takes_is_refused():
    """At 8 N m it would give 2.6 % more than it takes: no sweep goes there, and a design there has a reason."""
    servo, torque = parse_robot(SERVO), "body.joint.servo.stall_torque"
    with pytest.raises(InputError, match=r"body\.joint\.servo\.stall_torque: is more than 7\.799 N m"):
        sweep(servo, {torque: "6,8 N m"})
    task = MotionDesign(servo, (read_variable(torque, "6..8 N m", servo),), "battery_power")
    found = task.prepare()(np.array([1.0]), False, None)
    assert not found.solved and "is more than 7.799 N m" in found.reason


ALL = "limbs.disc.joint.servo.model"
# two discs on servos, written as one limb
TWO = """
name: two servos
water: {gravity: 0 m/s2}
batteries: {pack: {voltage: 12 V, resistance: 0.4 ohm}}
body: {kind: rigid, shape: point, mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2], joint: {kind: fixed}}
limbs:
  disc: {on: body, repeat: {count: 2, along: [0 m, 0.1 m, 0 m]}, DISC}
aliases: {servo: limbs.disc.joint.servo.model, f: limbs.disc.joint.motion.frequency}
""".replace(
    "DISC",
    "kind: rigid, shape: point, mass: 1 kg, inertia: [0.05 kg m2, 0.05 kg m2, 0.05 kg m2], joint: {kind: revolute, "
    "axis: x, motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz}, "
    "servo: {model: XW540-T140-R, battery: pack, full_voltage_at: 12 deg, inertia: 20 g m2}}",
)


def test_an_alias_chooses_one_model_for_several_servos():
    """Of a limb that comes twice; a list of paths does the same, and the file is read again."""
    two = parse_robot(TWO)
    paths = ("limbs.disc1.joint.servo.model", "limbs.disc2.joint.servo.model")
    assert two.aliases["servo"] == paths and [*two.number_aliases] == ["f"]
    assert parse_robot(dump_robot(two)) == two
    weak = apply_settings(two, ["servo=XW540-T260-R"])
    assert weak == apply_settings(two, [f"{path}=XW540-T260-R" for path in paths])


@pytest.mark.slow
def test_a_sweep_goes_over_the_models_of_an_alias():
    two = parse_robot(TWO)
    weak = apply_settings(two, ["servo=XW540-T260-R"])
    found = sweep(two, {"servo": ",".join(MODELS)}, settings=["f=1.5Hz"], samples=65, rtol=1e-6)
    assert found["servo"].values.tolist() == MODELS
    each = sweep(weak, {"f": [1.5]}, samples=65, rtol=1e-6)["current_peak"].values[0]
    np.testing.assert_allclose(found["current_peak"].sel(servo=MODELS[0]), each, rtol=1e-6)
    assert each[0] == pytest.approx(each[1], rel=1e-9)


def test_an_alias_is_of_numbers_or_of_choices():
    with pytest.raises(InputError, match="is no quantity of this robot") as caught:
        parse_robot(TWO.replace(f"servo: {ALL}", f"servo: [body.mass, {ALL}]"))
    assert caught.value.field == "aliases.servo"
    with pytest.raises(InputError, match='no quantity called "servo"'):
        read_variable("servo", "1..2", parse_robot(TWO))
