"""Any robot as a rig: it answers as the robot does, through sensors, in either time, and begins and ends at 0."""

import io
import json
import math
import re
import sys
import time
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from tests.small_robots import PENDULUM, SERVO, SLIDE

from nectosome.cli import main
from nectosome.controllers import ActuatorLimits, RobotLoop, pid_of
from nectosome.core import Status
from nectosome.description import parse_robot, with_values
from nectosome.rigs import RigError
from nectosome.rigs.devices.simulated_robot import ReadingSensor, RobotSettings, SimulatedRobot, simulated_robot
from nectosome.rigs.rig_file import load_rig
from nectosome.robots.shipped import starter_of
from nectosome.solve import SampledPlant, simulate
from nectosome.solve.readings import reading
from nectosome.units import InputError

DT = 0.05
PUSHED = parse_robot(SLIDE)


def pushed(dt: float = DT, **sensor) -> SimulatedRobot:
    """A slide of 2 kg on a spring, by its force."""
    options = {name: sensor.pop(name) for name in ("pace", "seed") if name in sensor}
    return SimulatedRobot(PUSHED, {"push": "push"}, {"x": ReadingSensor("body.position", **sensor)}, dt, **options)


def run(rig: SimulatedRobot, commands, measurements: int = 1) -> np.ndarray:
    """Measurements after each command was held for DT, the first before."""
    rig.open()
    start, seen = rig.now(), [rig.measure()]
    for k, command in enumerate(commands, start=1):
        rig.write([command])
        rig.wait(start + k * DT)
        seen.append(rig.measure())
    return np.array(seen)


def test_it_answers_as_the_robot_in_a_closed_loop():
    """The commands of a PID after a step, played on the rig: the same numbers."""
    pid = pid_of([20.0, 30.0, 10.0], 0.05, ActuatorLimits(*map(jnp.asarray, (-2.0, 2.0, np.inf))))
    found = RobotLoop(SampledPlant(PUSHED, "push", "body.position", DT)).run(pid, np.full(41, 0.1))
    assert found.status == Status.SOLVED and found.output[-1] == pytest.approx(0.1, abs=0.02)
    rig = pushed()
    assert (rig.commands, rig.measurements) == ({"push": "N"}, {"x": "m"})
    np.testing.assert_allclose(run(rig, found.command[:-1])[:, 0], found.output, rtol=0, atol=1e-12)


def test_a_robot_that_begins_with_other_commands_begins_with_0_on_a_rig():
    """1 N in its file stretches its spring by 0.2 m at last; on the rig nothing pulls before it is told to."""
    rig = SimulatedRobot(with_values(PUSHED, {"push": 1.0}), {"p": "push"}, {"x": ReadingSensor("body.position")}, DT)
    rig.open()
    rig.wait(1.0)
    assert rig.measure() == (0.0,)
    rig.write([1.0])
    rig.wait(30.0)
    assert rig.measure() == pytest.approx((0.2,), abs=1e-4)


def test_a_servo_by_two_commands_moves_and_draws_current_as_in_one_simulation():
    """Amplitude and frequency of its setpoint, from the start on as in its file: 30 deg at 1 Hz."""
    servo = parse_robot(SERVO)
    sensors = {"angle": ReadingSensor("body.angle"), "current": ReadingSensor("current.body.angle")}
    motion = "body.joint.motion"
    rig = SimulatedRobot(servo, {"size": f"{motion}.amplitude", "f": f"{motion}.frequency"}, sensors, DT)
    assert rig.commands == {"size": "rad", "f": "Hz"} and rig.measurements == {"angle": "rad", "current": "A"}
    rig.open()
    rig.write([np.radians(30), 1.0])
    seen = [rig.measure()]
    for k in range(1, 31):
        rig.wait(k * DT)
        seen.append(rig.measure())
    whole = simulate(servo, 1.5, samples=31, rtol=1e-7, atol=1e-9)
    expected = np.stack([reading(whole, name) for name in ("body.angle", "current.body.angle")], axis=1)
    assert np.abs(expected[:, 0]).max() > np.radians(20)
    for k, error in enumerate((2e-4, 5e-3)):  # of steps with errors of 1e-4; 2 A at most
        np.testing.assert_allclose(np.array(seen)[1:, k], expected[1:, k], atol=error)
    rig.vent()
    rig.wait(4.0)
    assert np.abs(rig.measure()).max() < 1e-6


def test_measurements_come_in_steps_of_the_resolution():
    rig = pushed(resolution="2 mm")
    seen = run(rig, np.full(30, 1.5))[:, 0]
    exact = run(pushed(), np.full(30, 1.5))[:, 0]
    assert np.abs(seen - exact).max() <= 1e-3 + 1e-12
    assert len(np.unique(seen)) > 10
    np.testing.assert_allclose(seen / 2e-3, np.round(seen / 2e-3), atol=1e-9)


def test_noise_has_its_deviation_and_differs_from_run_to_run_and_by_its_seed():
    """5000 values of 1 mm: the deviation within 3 %, that is three of its own."""
    rig, same, other = pushed(noise=1e-3), pushed(noise="1 mm"), pushed(noise=1e-3, seed=1)
    values = []
    for one in (rig, same, other, rig):
        one.open()
        values.append(np.array([one.measure() for _ in range(5000)])[:, 0])
    assert values[0].std() == pytest.approx(1e-3, rel=0.03)
    assert abs(values[0].mean()) < 5e-5
    np.testing.assert_array_equal(values[0], values[1])
    for different in values[2:]:
        assert abs(np.corrcoef(values[0], different)[0, 1]) < 0.05


@pytest.mark.parametrize("steps", [2, 1.5])
def test_a_delay_is_that_many_steps(steps):
    """Between steps on a straight line; before the start nothing had moved."""
    commands = np.random.default_rng(1).uniform(-2, 2, 20)
    exact, late = run(pushed(), commands)[:, 0], run(pushed(delay=steps * DT), commands)[:, 0]
    np.testing.assert_allclose(late, np.interp(np.arange(21) - steps, np.arange(21), exact), atol=1e-12)
    assert late[3] != 0.0 and late[1] == 0.0


def test_beyond_its_range_a_sensor_has_no_reading():
    rig = pushed(range="-50..50 mm")
    seen = run(rig, np.full(60, 1.0))[:, 0]
    exact = run(pushed(), np.full(60, 1.0))[:, 0]
    np.testing.assert_array_equal(np.isnan(seen), exact > 0.05)
    assert 5 < np.isnan(seen).sum() < 60 and rig.true[0] == exact[-1]


def test_a_tare_takes_the_offset_of_a_sensor_off(tmp_path, monkeypatch, capsys):
    """It reads 3 mm more than there are, and sees up to 10 mm of its own."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slide.yaml").write_text(SLIDE)
    (tmp_path / "rig.yaml").write_text(
        "dt: 50 ms\ndevices:\n  tank:\n    kind: robot\n    robot: slide.yaml\n    commands: {push: push}\n"
        "    measurements:\n      x: {reading: body.position, offset: 3 mm, range: -1..10 mm} # drifts\n"
        "commands: {tank.push: {low: 0 N, high: 1 N, slew: 1 N/s}}\n"
    )
    before = load_rig(tmp_path / "rig.yaml").rig
    before.connect()
    assert before.measure() == (pytest.approx(3e-3, rel=1e-9),)
    assert main(["rig", "tare", "--config", "rig.yaml", "--channel", "tank.x", "--apply"]) == 0
    assert (
        "x: {zero: 0.003 m, reading: body.position, offset: 3 mm, range: -1..10 mm} # drifts"
        in (tmp_path / "rig.yaml").read_text()
    )
    after = load_rig(tmp_path / "rig.yaml").rig
    after.open()
    assert after.measure() == (pytest.approx(0.0, abs=1e-12),)
    after.write([0.02])  # 4 mm at last
    after.wait(30.0)
    assert after.measure() == (pytest.approx(4e-3, abs=1e-5),)
    after.write([0.04])  # 8 mm, which it reads as 11 mm
    after.wait(60.0)
    assert math.isnan(after.measure()[0])


CELL = (
    "dt: 50 ms\ndevices:\n  tank:\n    kind: robot\n    robot: slide.yaml\n    commands: {push: push}\n"
    "    measurements:\n      x: {reading: body.position, slope: 1 um/count, true_slope: 1.25 um/count, noise: 40 "
    "count, resolution: 1 count, offset: 81234 count, range: -8388607..8388606 count, zero: 0 count} # as an HX711\n"
    "commands: {tank.push: {low: 0 N, high: 1 N, slew: 1 N/s}}\n"
)


@pytest.fixture
def cell(tmp_path, monkeypatch):
    """A rig file whose sensor gives counts, with another slope than the file says."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slide.yaml").write_text(SLIDE)
    (tmp_path / "rig.yaml").write_text(CELL)
    return tmp_path / "rig.yaml"


def test_a_calibration_finds_the_true_slope_of_counts_within_its_standard_error(cell, monkeypatch, capsys):
    """1.25 um/count and 81234 counts at rest; of 40 readings with noise of 40 counts, means are off by 6 counts."""
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n" * 6))
    argv = [
        "rig",
        "calibrate",
        "--config",
        "rig.yaml",
        "--channel",
        "tank.x",
        "--known",
        "0 m, 2 mm, 4 mm, 6 mm, 8 mm, 0 m",
    ]
    assert main([*argv, "--apply", "--json"]) == 0
    told = capsys.readouterr()
    assert told.err.splitlines()[1] == "load 2 of 6: 2 mm is on the simulated sensor: press Enter."
    found = json.loads(told.out)["tables"]["calibration"]
    slope, zero = found["slope"], found["zero"]
    assert slope["value"]["unit"] == "m/count" and zero["value"]["unit"] == "count"
    assert 0 < slope["error"]["value"] < 5e-3 * 1.25e-6
    assert abs(slope["value"]["value"] - 1.25e-6) < 2 * slope["error"]["value"]
    assert abs(zero["value"]["value"] - 81234) < 2 * zero["error"]["value"] < 40
    rig = load_rig(cell).rig  # as the file is now, without a load
    rig.open()
    rig.write([0.04])  # 8 mm at last
    rig.wait(30.0)
    seen = []
    for _ in range(100):
        rig.wait(rig.now() + DT)
        seen.append(rig.measure())
    assert np.mean(seen) == pytest.approx(8e-3, rel=5e-3)
    assert "# as an HX711" in cell.read_text()


def test_a_tare_is_in_counts_and_leaves_the_slope(cell):
    assert main(["rig", "tare", "--config", "rig.yaml", "--channel", "tank.x", "--apply"]) == 0
    found = re.search(r"slope: 1 um/count, true_slope: 1.25 um/count.*zero: (\S+) count", cell.read_text())
    assert found is not None and float(found[1]) == pytest.approx(81234, abs=30)


@pytest.mark.parametrize(
    ("old", "new", "field", "words"),
    [
        ("slope: 1 um/count, true", "true", "slope", "is missing"),
        ("slope: 1 um/count", "slope: 1 N/count", "slope", "m per count or volt is expected"),
        ("slope: 1 um/count", "slope: 1 um", "slope", "m per count or volt is expected"),
        ("slope: 1 um/count", "slope: 0 um/count", "slope", "not 0"),
        ("slope: 1.25 um/count", "slope: 1.25 um/V", "true_slope", "Give both per count"),
        ("noise: 40 count", "noise: 1 mm", "noise", "count is needed"),
        ("noise: 40 count", "noise: -40 count", "noise", "at least 0"),
        ("-8388607..8388606 count", "-1..1 m", "range", "count is needed"),
    ],
)
def test_a_sensor_of_counts_is_refused_where_its_numbers_do_not_fit(cell, old, new, field, words):
    assert CELL.count(old) == 1
    cell.write_text(CELL.replace(old, new))
    with pytest.raises(InputError, match=words) as told:
        load_rig(cell)
    assert told.value.field == f"devices.tank.measurements.x.{field}" and told.value.line == 8


def test_in_real_time_it_takes_that_time_and_is_where_the_model_is_at_that_step():
    """However late this machine reads it: one of the steps that the clock was at about then."""
    exact = run(pushed(), np.full(200, 1.0))[:, 0]
    rig = pushed(pace="real")
    rig.open()
    start = rig.now()

    def step() -> int:
        return int((rig.now() - start) / DT)

    rig.write([1.0])
    written = step() + 1  # at the latest
    for k in range(1, 11):
        rig.wait(start + k * DT)
        before, (x,), after = step(), rig.measure(), step() + 1
        assert before >= k - 1
        assert np.abs(exact[max(before - written, 0) : after + 1] - x).min() < 1e-12
    assert rig.now() - start >= 10 * DT


def test_a_model_that_cannot_keep_up_with_the_clock_says_so(monkeypatch):
    rig = pushed(dt=0.01, pace="real")
    rig.open()
    hold = rig._plant.hold
    monkeypatch.setattr(rig._plant, "hold", lambda *given: time.sleep(0.3) or hold(*given))
    with pytest.raises(RigError, match=r"the model cannot keep up with the clock: 0.0\d+ s of it took \d\.\d+ s"):
        rig.wait(rig.now() + 0.0405)


def test_a_vent_is_0_at_once_and_each_end_may_come_twice():
    rig = pushed()
    rig.vent()
    rig.close()
    for _ in range(2):
        before = rig.now()
        rig.open()
        assert rig.measure() == (0.0,)
        rig.write([2.0])
        rig.vent()
        rig.vent()
        rig.wait(rig.now() + 1.0)
        assert rig.measure() == (0.0,) and rig.now() == pytest.approx(before + 1.0)
        rig.close()
        rig.close()
    with pytest.raises(RigError, match="measured before it was opened"):
        rig.measure()
    rig.wait(rig.now() + 1.0)  # its clock goes on
    assert rig.now() == pytest.approx(before + 2.0)


def test_connected_it_is_measured_and_takes_no_command():
    rig = pushed()
    rig.connect()
    assert rig.measure() == (0.0,)
    with pytest.raises(RigError, match="written before it was opened"):
        rig.write([1.0])


def test_a_command_that_the_quantity_cannot_have_is_refused():
    servo = parse_robot(SERVO)
    sensors = {"angle": ReadingSensor("body.angle")}
    rig = SimulatedRobot(servo, {"f": "body.joint.motion.frequency"}, sensors, DT)
    rig.open()
    for command, message in ((-1.0, '"-1 Hz" is out of range'), (math.nan, "must be finite")):
        with pytest.raises(RigError, match=f"f: .*{message}"):
            rig.write([command])


def test_a_simulation_that_fails_is_an_error_with_its_reason():
    rig = pushed()
    rig.open()
    rig.write([1e300])
    with pytest.raises(RigError, match=r"0 s after its start, with push 1e\+300 N, the simulation failed"):
        rig.wait(DT)
    rig.vent()
    rig.close()


def test_a_rig_from_its_settings(tmp_path):
    """The file of the robot is beside it; other values of its quantities; steps of a share of dt."""
    (tmp_path / "slide.yaml").write_text(SLIDE)
    sensors = {"x": ReadingSensor("body.position", "1 mm", "0.1 mm", 0.02, "-1..1 m")}
    rig = simulated_robot(
        RobotSettings("slide.yaml", {"push": "push"}, sensors, {"m": "4 kg"}, 0, 0.01, True), tmp_path, DT
    )
    assert (rig.dt, rig.pace, rig.name) == (0.01, "real", "simulated slide")
    heavy = SimulatedRobot(with_values(PUSHED, {"m": 4.0}), {"push": "push"}, {"x": ReadingSensor("body.position")}, DT)
    plain = {"x": ReadingSensor("body.position")}
    light = simulated_robot(RobotSettings("slide.yaml", {"push": "push"}, plain, {"m": "4 kg"}), tmp_path, DT)
    np.testing.assert_array_equal(run(light, [1.0] * 5), run(heavy, [1.0] * 5))


@pytest.mark.parametrize(
    ("given", "field", "message"),
    [
        ({"robot": "eeel"}, "robot", "eeel"),
        ({"set": {"m": "4 N"}}, "set.m", "4 N"),
        ({"time_step": 0.02}, "time_step", "0.02 s, and dt is 0.05 s"),
        ({"commands": {"a": "pusch"}}, "commands.a", 'Did you mean "push"'),
        ({"commands": {"a": "body.joint.position"}}, "commands", "says how the robot starts"),
        ({"sensor": {"reading": "heeding"}}, "measurements", "heeding"),
        ({"sensor": {"noise": "1 deg"}}, "measurements.x.noise", "1 deg"),
        ({"sensor": {"resolution": -1.0}}, "measurements.x.resolution", "at least 0"),
        ({"sensor": {"range": "1 m"}}, "measurements.x.range", "LOW..HIGH"),
        ({"sensor": {"range": "2..1 m"}}, "measurements.x.range", "smaller end"),
    ],
)  # fmt: skip
def test_a_mistake_in_the_settings_names_its_field(tmp_path, given, field, message):
    (tmp_path / "slide.yaml").write_text(SLIDE)
    sensor = ReadingSensor(**({"reading": "body.position"} | given.pop("sensor", {})))
    settings = {"robot": "slide.yaml", "commands": {"push": "push"}, "measurements": {"x": sensor}} | given
    with pytest.raises(InputError) as told:
        simulated_robot(RobotSettings(**settings), tmp_path, DT)
    assert told.value.field == field
    assert message in str(told.value)


def test_the_rig_of_a_robot_on_the_page_is_read(tmp_path):
    """Of the swimmer that `nectosome new tail` writes."""
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "rigs.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```yaml\n(.*?)```", page.partition("## A rig of any robot")[2], re.DOTALL)[:1]
    (tmp_path / "tank.yaml").write_text(text)
    (tmp_path / "tail.yaml").write_text(starter_of("tail").read_text(encoding="utf-8"))
    found = load_rig(tmp_path / "tank.yaml").rig
    assert found.commands == {"tank.swing": "rad"}
    assert found.measurements == {"tank.speed": "m/s", "tank.place": "m"}


def test_a_quantity_that_cannot_be_0_is_no_command():
    with pytest.raises(InputError, match=r"with a body.length of 0, and a rig begins and ends so: .* more than 0 m"):
        SimulatedRobot(parse_robot(PENDULUM), {"l": "body.length"}, {"a": ReadingSensor("body.angle")}, DT)
