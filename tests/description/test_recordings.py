# ruff: noqa: E501  (tables: one case a line)
"""Recordings in robot files: inline and by file and column; what is read, and the sentence for what cannot be."""

import numpy as np
import pytest

from nectosome.core import sampled
from nectosome.description import Samples, apply_settings, dump_robot, load_robot, parse_robot, with_recordings
from nectosome.units import InputError

HINGE = """
name: a
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [1 kg m2, 1 kg m2, 1 kg m2]
  joint: {kind: revolute, axis: z, DRIVE}
"""
MOTION = "motion: {kind: recording, file: servo.csv, column: angle}"
TIME = np.array([0.0, 0.1, 0.25, 0.3, 0.5])
ANGLE = np.array([0.0, 10.0, -5.0, 3.0, 1.0])


def robot(drive: str = MOTION) -> str:
    return HINGE.replace("DRIVE", drive)


def table(rows: str = "", head: str = "time (s),angle (deg),twist (N m)", time=TIME + 7.0) -> str:
    return f"{head}\n" + "".join(f"{t},{a},{0.1 * a}\n" for t, a in zip(time, ANGLE, strict=True)) + rows


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "servo.csv").write_text(table())
    (tmp_path / "robot.yaml").write_text(robot())
    return tmp_path


def test_a_column_of_a_file_beside_the_robot_drives_a_joint(folder):
    motion = load_robot(folder / "robot.yaml").body.joint.motion
    np.testing.assert_allclose(motion.times, TIME, atol=1e-12)
    np.testing.assert_allclose(motion.values, np.radians(ANGLE), rtol=1e-12)


def test_the_only_column_of_a_quantity_needs_no_name_and_a_factor_multiplies_it(folder):
    (folder / "robot.yaml").write_text(robot("torque: {kind: recording, file: servo.csv, factor: -2}"))
    torque = load_robot(folder / "robot.yaml").body.joint.torque
    np.testing.assert_allclose(torque.values, 0.1 * ANGLE, rtol=1e-12)
    assert torque.least() == pytest.approx(-2.0)  # -2 x 0.1 x 10
    np.testing.assert_allclose(sampled(torque, TIME), -0.2 * ANGLE, rtol=1e-12)


def test_what_was_read_is_the_robots_own(folder):
    found = load_robot(folder / "robot.yaml")
    (folder / "servo.csv").unlink()
    assert "servo.csv" not in dump_robot(found)
    assert parse_robot(dump_robot(found)) == found


def test_a_setting_names_a_file_of_the_current_folder(folder, monkeypatch):
    monkeypatch.chdir(folder)
    held = parse_robot(robot("stiffness: 1 N m/rad"))
    torque = apply_settings(held, ["body.joint.torque={kind: recording, file: servo.csv, column: twist}"])
    np.testing.assert_allclose(torque.body.joint.torque.values, 0.1 * ANGLE)
    motion = apply_settings(held, ["body.joint={kind: revolute, axis: z, " + MOTION + "}"])
    np.testing.assert_allclose(motion.body.joint.motion.values, np.radians(ANGLE), rtol=1e-12)


def test_a_sheet_says_what_the_file_does_not(folder):
    (folder / "bare.csv").write_text(table(head="a,b,c"))
    (folder / "sheet.yaml").write_text(
        "time: {column: 1, unit: s}\ncolumns: {hinge: {column: 2, unit: deg, sign: -1}}\n"
    )
    text = robot("motion: {kind: recording, file: bare.csv, column: hinge, sheet: sheet.yaml}")
    motion = parse_robot(text, str(folder / "robot.yaml")).body.joint.motion
    np.testing.assert_allclose(motion.values, -np.radians(ANGLE), rtol=1e-12)


@pytest.mark.parametrize("unit", ["1/m", "rad/m", "1/cm"])
def test_a_curvature_may_be_recorded_without_radians(folder, unit):
    (folder / "bend.csv").write_text(table(head=f"time (s),bend ({unit}),c"))
    rod = """
name: a
body:
  kind: rod
  length: 10 cm
  section: circle
  radius: 1 cm
  young: 1 MPa
  density: 1000 kg/m3
  strains: {bending_z: 0}
  motion: {bending_z: {kind: recording, file: bend.csv, column: bend}}
"""
    bend = parse_robot(rod, str(folder / "robot.yaml")).body.motion.bending_z
    np.testing.assert_allclose(bend.values, ANGLE * (100 if unit == "1/cm" else 1), rtol=1e-12)


def test_samples_are_put_in_exactly_and_checked():
    held = parse_robot(robot("stiffness: 1 N m/rad"))
    values = (np.random.default_rng(0).normal(size=1000) / 3).tolist()
    times = np.linspace(0.0, 4.0, 1000).tolist()
    found = with_recordings(held, {"body.joint.torque": Samples(times, values, "N m")})
    assert found.body.joint.torque.values == tuple(values)
    assert found.body.joint.torque.times == tuple(times)
    with pytest.raises(InputError, match="is driven in N m, and was recorded in N"):
        with_recordings(held, {"body.joint.torque": Samples(times, values, "N")})
    with pytest.raises(InputError, match="the times must increase"):
        with_recordings(held, {"body.joint.torque": Samples([0.0, 1.0, 1.0], [0.0, 1.0, 2.0], "N m")})
    with pytest.raises(InputError, match="a joint with a motion cannot have a torque as well"):
        driven = parse_robot(robot("motion: {kind: constant, value: 1 deg}"))
        with_recordings(driven, {"body.joint.torque": Samples(times, values, "N m")})


def inline(times: str, values: str) -> str:
    return robot(f"motion: {{kind: recording, times: {times}, values: {values}}}")


@pytest.mark.parametrize(
    ("text", "rows", "message"),
    [
        (inline("[0 s, 1 s, 1 s, 2 s]", "[0, 0, 0, 0]"), "", "body.joint.motion.times: the times must increase: 1 s, number 3, comes after 1 s."),
        (inline("[0 s, 1 s, 0.5 s, 2 s]", "[0, 0, 0, 0]"), "", "the times must increase: 0.5 s, number 3, comes after 1 s."),
        (inline("[0 s, 1 s, 2 s, 3 s]", "[0, .nan, 0, 0]"), "", 'body.joint.motion.values.1: "nan" must be finite.'),
        (inline("[0 s, 1 s, 2 s, 3 s]", "[0, 1 m, 0, 0]"), "", "body.joint.motion.values.1:"),
        (inline("[0 s, 1 s, 2 s, 3 s]", "[0, 1, 0, 0]"), "", 'body.joint.motion.values.1: "1" has no unit.'),
        (inline("[0 s, 1 s, 2 s, 3 s]", "[0, 0, 0]"), "", "body.joint.motion.values: there are 3 values at 4 times."),
        (inline("[0 s, 1 s, 2 s]", "[0, 0, 0]"), "", "body.joint.motion.values: a smooth curve needs at least 4 samples, 3 given."),
        (inline("[1 s, 2 s, 3 s, 4 s]", "[0, 0, 0, 0]"), "", "body.joint.motion.times.0: nothing is known of the motion before 1 s. Let the first time be at most 0 s."),
        (robot("motion: {kind: recording}"), "", "body.joint.motion.times: is missing. Give times and values, or a file and a column."),
        (robot("motion: {kind: recording, column: angle}"), "", "body.joint.motion.file: is missing."),
        (robot("motion: {kind: recording, file: servo.csv}").replace("servo", "two"), "", "body.joint.motion.column: two.csv has several columns of this quantity: a, b. Name one."),
        (robot("motion: {kind: recording, file: none.csv}").replace("none", "force"), "", "body.joint.motion.column: no column of force.csv is an angle; it has force [N]."),
        (robot("motion: {kind: recording, file: servo.csv, column: angle, times: [0 s, 1 s]}"), "", "body.joint.motion.times: the file has the samples."),
        (robot(MOTION.replace("angle}", "angel}")), "", 'body.joint.motion.column: servo.csv has no column "angel". Did you mean "angle"?'),
        (robot(MOTION.replace("angle}", "twist}")), "", "body.joint.motion.column: servo.csv has it in N m. Angle expected"),
        (robot(MOTION.replace("servo", "none")), "", "body.joint.motion.file: "),
        (robot(), "7.6,,0\n", "body.joint.motion.column: servo.csv, angle: 1 row missing, the first is row 7, at 7.6 s."),
        (robot(), "7.4,1,0\n", "servo.csv, line 7, time: the time 7.4 s comes after 7.5 s."),
        (robot(), "7.5,1,0\n", "servo.csv, line 7, time: the time 7.5 s occurs twice."),
        (robot(), "9.5,1,0\n", "body.joint.motion.file: servo.csv, row 7: nothing was recorded between 7.5 s and 9.5 s."),
    ],
)  # fmt: skip
def test_what_is_no_recording_is_told(folder, text, rows, message):
    (folder / "servo.csv").write_text(table(rows))
    (folder / "two.csv").write_text("time (s),a (deg),b (deg)\n0,1,2\n1,2,3\n")
    (folder / "force.csv").write_text("time (s),force (N)\n0,1\n1,2\n")
    with pytest.raises(InputError) as caught:
        parse_robot(text, str(folder / "robot.yaml"))
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{folder / 'robot.yaml'}, line ")


def test_a_column_without_a_unit_is_refused(folder):
    (folder / "servo.csv").write_text(table(head="time (s),angle,twist"))
    with pytest.raises(InputError, match="gives it no unit"):
        load_robot(folder / "robot.yaml")


def test_forces_may_have_gaps_in_time(folder):
    (folder / "servo.csv").write_text(table("9.5,1,0\n"))
    text = robot("torque: {kind: recording, file: servo.csv, column: twist}")
    assert len(parse_robot(text, str(folder / "robot.yaml")).body.joint.torque.times) == 6
