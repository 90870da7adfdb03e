"""Rods that are curved without stress, by a drawn line or a table: where they lie, and what is refused."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.description import Rod, dump_robot, load_robot, parse_robot
from nectosome.geometry.centre_lines import fit_line
from nectosome.model import build
from nectosome.units import InputError

ROD = """name: hook
body:
  kind: rod
  section: circle
  radius: 3 mm
  length: 222.166 mm
  young: 300 kPa
  density: 1100 kg/m3
  strains: {bending_z: 3}
  points: 20
  joint: {kind: fixed}
"""
X = np.linspace(0, 0.18, 15)
WAVE = np.stack([X, 0.03 * np.sin(2 * np.pi * X / 0.18)], axis=-1)
LINE = "x (mm),y (mm)\n" + "".join(f"{1e3 * x:.6f},{1e3 * y:.6f}\n" for x, y in WAVE)
TABLE = "x (mm),bending_z (1/m)\n0,1\n100,5\n222.166,9.88664\n"


@pytest.fixture
def beside(tmp_path):
    """A robot by the words of its rest, beside files of a line and of a table."""

    def load(rest: str, table: str = TABLE):
        (tmp_path / "line.csv").write_text(LINE)
        (tmp_path / "bend.csv").write_text(table)
        (tmp_path / "robot.yaml").write_text(f"{ROD}  rest: {rest}\n")
        return load_robot(tmp_path / "robot.yaml")

    return load


def test_a_rod_at_rest_lies_on_its_line_without_energy(beside):
    """A sine of 30 mm, turned so that it begins along x: all nodes are within a thousandth of the length of it."""
    robot = beside("{file: line.csv}")
    assert "15 points by polynomials of order" in robot.body.rest.note
    assert "turned by" in robot.body.rest.note
    soft = jax.tree.map(lambda x: x[0], build(robot).tree.rods[0].things)
    q = soft.start()
    found = np.asarray(jax.jit(lambda q: soft.shape(q))(q).position)
    fine = np.linspace(0, 0.18, 4001)
    line = np.stack([fine, 0.03 * np.sin(2 * np.pi * fine / 0.18), 0 * fine], axis=-1)
    angle = fit_line(np.stack([*WAVE.T, 0 * X], axis=-1), 0.222166).turned
    assert angle == pytest.approx(np.arctan(0.03 * 2 * np.pi / 0.18), abs=0.05)  # as it is drawn
    cos, sin = np.cos(angle), np.sin(angle)
    line = line @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]).T
    off = np.linalg.norm(found[:, None] - line, axis=-1).min(axis=1)
    assert off.max() < 1e-3 * 0.222
    assert np.linalg.norm(found[-1] - line[-1]) < 1e-3 * 0.222
    assert float(0.5 * q @ soft.stiffness @ q) == 0.0
    assert jnp.any(soft.rest[..., 2] != 0)


def test_points_in_the_file_are_those_of_a_table_and_files_are_written_without_them(beside):
    points = ", ".join(f"[{1e3 * x:.6f} mm, {1e3 * y:.6f} mm]" for x, y in WAVE)
    inline, read = parse_robot(f"{ROD}  rest: {{line: [{points}]}}\n"), beside("{file: line.csv}")
    np.testing.assert_allclose(inline.body.rest.bending_z, read.body.rest.bending_z, rtol=1e-4, atol=1e-6)
    again = parse_robot(dump_robot(read)).body.rest
    assert again.bending_z == read.body.rest.bending_z
    assert again.note == ""


def test_a_table_of_curvatures_is_their_polynomial(beside):
    """1 + 8.88664 s + ... runs evenly here: 1/m at the root, 9.88664/m at the tip, which order 1 has."""
    rest = beside("{file: bend.csv}").body.rest
    np.testing.assert_allclose(rest.bending_z, [5.44332, 4.44332], rtol=1e-3)
    assert "bending_z up to 9.89 rad/m by a polynomial of order 1" in rest.note


@pytest.mark.parametrize(
    ("rest", "table", "told"),
    [
        ("{line: [[0 mm, 0 mm], [1 mm, 0 mm]]}", TABLE, "rest.line: has 2 points, and a curved line needs at least 4."),
        ("{line: [[0 mm, 0 mm], [1 mm]]}", TABLE, "rest.line.1: at least 2 values expected, 1 given."),
        ("{file: none.csv}", TABLE, "none.csv: cannot be read"),
        ("{file: ../bend.csv}", TABLE, "rest.file: ../bend.csv is outside of the folder of the robot file."),
        ("{order: 3}", TABLE, "rest.order: goes with a line or a file. Leave it out."),
        ("{file: line.csv, bending_z: 3 1/m}", TABLE, "rest.bending_z: the file has the shape. Leave"),
        ("{file: bend.csv}", TABLE.replace("(1/m)", "(mm)"), 'bend.csv gives bending_z the unit "m", and it is rad/m.'),
        ("{file: bend.csv}", TABLE.replace("bending_z (1/m)", "w"), "bend.csv is no shape of a rod: it has columns"),
        ("{file: bend.csv}", "at,bending_z (1/m)\n0,0\n0.5,5\n0.51,0\n1,0\n", "polynomials of order 12 miss"),
        ("{file: bend.csv}", "x (mm),y (mm)\n0,0\n50,0\n80,0\n100,5\n", "rest.file: is a line of"),
    ],
)  # fmt: skip
def test_what_is_no_shape_is_told(beside, rest, table, told):
    with pytest.raises(InputError) as error:
        beside(rest, table)
    assert told in str(error.value)


def test_the_finger_that_ships_is_curved_by_the_line_beside_it():
    """Points of z = -2.5e-7 x^4 [mm], 110 mm far: polynomials of order 3 are enough."""
    finger = load_robot(Path(__file__).parents[2] / "examples" / "graded_finger" / "finger.yaml").limbs["finger"]
    assert isinstance(finger, Rod)
    assert "its line of 12 points by polynomials of order 3" in finger.rest.note
    whole = np.arctan(4 * 2.5e-7 * 110**3)  # by which it turns from root to tip
    assert finger.rest.bending_y[0] * finger.length == pytest.approx(whole, rel=0.03)
