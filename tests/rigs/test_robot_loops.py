"""Several loops of a robot at once: what each does alone, where they are coupled, and on the robot as its own rig."""

from pathlib import Path

import numpy as np
import pytest
from tests.small_robots import SLIDE

from nectosome.controllers import ControlTask, FoundController, RobotLoop
from nectosome.description import parse_robot
from nectosome.rigs import Bench, Pair, RigRun, robot_bench
from nectosome.rigs.loops_file import load_loops
from nectosome.rigs.rig_file import load_rig
from nectosome.rigs.robot_bench import own_rig

from .controlled import ALONG, ASIDE, CROSS, RIG

DT = 0.05
# neutrally buoyant, with two vertical thrusters: each pushes it up or down and pitches it
THRUSTER = """
  {name}:
    on: body
    offset: [{place} m, 0 m, 0 m]
    kind: rigid
    shape: point
    mass: 0 kg
    volume: 0 m3
    joint: {{kind: fixed}}
    loads: {{{name}: {{kind: force, force: [0 N, 0 N, 0 N], frame: body}}}}
"""
CRAFT = f"""
name: craft
water: {{density: 1000 kg/m3, surface: 0 m}}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 2 L
  inertia: [0.05 kg m2, 0.05 kg m2, 0.05 kg m2]
  joint: {{kind: planar, axis: y, start: {{position: [0 m, 0 m, -1 m]}}}}
  loads:
    drag: {{kind: lumped_drag, drag_area: [0.02 m2, 0.02 m2, 0.02 m2], rotational: [0 kg m2, 0.02 kg m2, 0 kg m2]}}
limbs:
{THRUSTER.format(name="fore", place=0.2)}{THRUSTER.format(name="aft", place=-0.1)}
aliases: {{fore: limbs.fore.loads.fore.force.2, aft: limbs.aft.loads.aft.force.2}}
"""
DEPTH = "{command: aft=-10..10 N, measure: depth, reference: 1.2 m, gains: '-8, -0.5, -8'}"
PITCH = "{command: fore=-10..10 N, measure: pitch, reference: 10 deg, gains: '0.2, 0.05, 0.05'}"


def loops_of(folder, text):
    (folder / "loops.yaml").write_text(text)
    return load_loops(folder / "loops.yaml")


def laws_of(tasks: list[ControlTask], time: float) -> list[FoundController]:
    """Those of the gains that are given."""
    return [law for task in tasks if (law := task.find_law(time)) is not None]


def run_of(one: Bench, log: Path) -> RigRun:
    (run,) = one.runs([log])
    return run


def bench(folder, robot, *, time=2.0, rate=20, **loops) -> Bench:
    """Loops on the robot as its own rig."""
    rows = "".join(f"  {name}: {loop}\n" for name, loop in loops.items())
    file = loops_of(folder, f"rate: {rate} Hz\ntime: {time} s\nloops:\n{rows}")
    tasks = [*file.tasks(robot).values()]
    rig, limits, pairs = own_rig(tasks, time)
    return robot_bench(tasks, laws_of(tasks, time), time, rig, limits, pairs)


def test_loops_of_parts_that_do_not_act_on_each_other_do_together_what_each_does_alone(tmp_path):
    """To 1e-9 m and N."""
    robot = parse_robot(CROSS)
    both = run_of(bench(tmp_path, robot, along=ALONG, aside=ASIDE), tmp_path / "both.nc")
    assert both.status == "finished" and both.data.sizes["time"] == 41
    for name, loop, command in (("body.position", ALONG, "push"), ("side.position", ASIDE, "swing")):
        alone = run_of(bench(tmp_path, robot, one=loop), tmp_path / f"{command}.nc").data
        assert np.abs(alone[name].values).max() > 0.01
        for column in (name, f"{command}.command"):
            np.testing.assert_allclose(both.data[column].values, alone[column].values, rtol=0, atol=1e-9)


@pytest.mark.slow
def test_coupled_loops_of_depth_and_pitch_settle_together(tmp_path):
    """Each thruster pitches and sinks the craft, so that the loops disturb each other; within 1 cm and 0.5 deg at 10 s.

    Alone, the loop of the depth goes another way.
    """
    robot = parse_robot(CRAFT)
    run = run_of(bench(tmp_path, robot, time=12.0, rate=10, depth=DEPTH, pitch=PITCH), tmp_path / "both.nc").data
    depth, pitch = run["depth"].values, np.degrees(run["pitch"].values)
    assert np.abs(depth[100:] - 1.2).max() < 0.01 and np.abs(pitch[100:] - 10).max() < 0.5
    assert pitch.max() > 20
    alone = run_of(bench(tmp_path, robot, time=4.0, rate=10, depth=DEPTH), tmp_path / "depth.nc").data["depth"].values
    assert np.abs(alone - depth[:41]).max() > 0.01


def test_on_the_robot_as_its_own_rig_a_run_is_its_rehearsal_but_for_the_noise(tmp_path):
    robot = parse_robot(CROSS)
    one = bench(tmp_path, robot, along=ALONG, aside=ASIDE)
    (rehearsed,), run = one.rehearse(), run_of(one, tmp_path / "run.nc").data
    for name in ("body.position", "side.position", "push.command", "swing.command"):
        np.testing.assert_array_equal(rehearsed[name].values, run[name].values)
    noisy = bench(tmp_path, robot, along=ALONG.replace("gains", "noise: 1 mm, gains"), aside=ASIDE)
    (rehearsed,), run = noisy.rehearse(), run_of(noisy, tmp_path / "noisy.nc").data
    difference = rehearsed["body.position"].values - run["body.position"].values
    assert 0.5e-3 < np.std(difference) < 3e-3
    assert difference[0] != 0.0


def test_on_the_robot_as_its_own_rig_a_loop_is_the_closed_loop_also_where_it_saturates(tmp_path):
    """50 cm need 2.5 N and 1 N is the most: at the end of its range throughout, which ends nothing."""
    text = "{command: push=-1..1 N, measure: body.position, reference: 50 cm, gains: '20, 30, 10'}"
    one = bench(tmp_path, parse_robot(SLIDE), time=4.0, far=text)
    run = run_of(one, tmp_path / "run.nc")
    assert run.status == "finished" and (run.data["push.command"].values[2:] == 1.0).all()
    task = loops_of(tmp_path, f"loops: {{far: {text}}}").tasks(parse_robot(SLIDE))["far"]
    loop = one.loops["push"]
    found = RobotLoop(task.robot).run(loop.controller, loop.reference)
    np.testing.assert_allclose(run.data["body.position"].values, found.output, atol=1e-9)


def test_on_a_rig_file_of_the_same_robot_the_run_is_the_rehearsal_to_the_bit(tmp_path):
    (tmp_path / "cross.yaml").write_text(CROSS)
    (tmp_path / "rig.yaml").write_text(RIG)
    rows = [loop[:-1] + f", rig_command: tank.{a}, rig_measure: tank.{x}}}" for loop, a, x in
            ((ALONG, "a", "x"), (ASIDE, "b", "y"))]  # fmt: skip
    file = loops_of(tmp_path, f"loops:\n  along: {rows[0]}\n  aside: {rows[1]}\n")
    rig = load_rig(tmp_path / "rig.yaml")
    tasks, pairs = file.tasks(tmp_path / "cross.yaml", dt=rig.dt), file.pairs(rig.rig)
    assert pairs == {"along": Pair("tank.a", "tank.x"), "aside": Pair("tank.b", "tank.y")}
    assert file.seconds(tasks) == 10.0
    each = [*tasks.values()]
    one = robot_bench(each, laws_of(each, 2.0), 2.0, rig.rig, rig.limits, [*pairs.values()])
    (rehearsed,), run = one.rehearse(), run_of(one, tmp_path / "run.nc")
    assert run.status == "finished" and run.data.attrs["title"].startswith("constant, sine on ")
    for name in ("tank.x", "tank.y", "tank.a.command", "tank.b.command"):
        np.testing.assert_array_equal(rehearsed[name].values, run.data[name].values)
        assert np.ptp(run.data[name].values) > 0
