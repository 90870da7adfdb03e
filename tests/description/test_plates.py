"""Plates by their outlines in robot files: what is told of wrong ones, and what is kept of right ones."""

import numpy as np
import pytest

from nectosome.description import Rigid, dump_robot, load_robot, parse_robot
from nectosome.description.plates import PlateShape
from nectosome.description.shapes import shape_forms
from nectosome.units import InputError

NAMED = ", ".join(form for form, shape in shape_forms().items() if not shape.model_fields)

FIN = """
name: fin
body:
  kind: rigid
  shape: {shape}
  density: 1100 kg/m3
"""
TRIANGLE = "[[0 mm, 0 mm], [60 mm, 0 mm], [60 mm, 40 mm]]"


def fin(shape: str, more: str = ""):
    return parse_robot(FIN.replace("{shape}", shape) + more, "robot.yaml")


def refusal(shape: str, more: str = "") -> str:
    with pytest.raises(InputError) as found:
        fin(shape, more)
    return str(found.value)


def shape_of(robot) -> PlateShape:
    assert isinstance(robot.body, Rigid) and isinstance(robot.body.shape, PlateShape)
    return robot.body.shape


def test_a_plate_is_written_as_it_was_read():
    robot = fin(f"{{outline: {TRIANGLE}, thickness: 3 mm, plane: xz}}")
    assert parse_robot(dump_robot(robot)) == robot
    plate = shape_of(robot)
    assert plate.area == pytest.approx(1.2e-3, rel=1e-15)  # 60 mm 40 mm / 2
    assert [plate.size(n) for n in ("length", "width", "height")] == [0.06, 0.003, 0.04]


def test_a_robot_with_a_drawing_holds_its_corners_from_then_on(tmp_path):
    (tmp_path / "fin.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 80 60">'
        '<polygon points="10,20 70,20 70,60"/></svg>'
    )
    file = tmp_path / "robot.yaml"
    file.write_text(FIN.replace("{shape}", "{drawing: fin.svg, origin: [10 mm, 20 mm], thickness: 3 mm}"))
    robot = load_robot(file)
    assert shape_of(robot).outline == ((0.0, 0.0), (0.06, 0.0), (0.06, -0.04))  # y of an SVG file runs down
    assert parse_robot(dump_robot(robot)) == robot and "fin.svg" not in dump_robot(robot)


def test_a_drawing_is_turned_about_its_root(tmp_path):
    """From x towards y of the part, whose y is up in the drawing."""
    (tmp_path / "fin.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 80 60">'
        '<polygon points="10,20 70,20 70,60"/></svg>'
    )
    file = tmp_path / "robot.yaml"
    drawing = "{drawing: fin.svg, origin: [10 mm, 20 mm], turn: 90 deg, thickness: 3 mm, plane: xz}"
    file.write_text(FIN.replace("{shape}", drawing))
    assert shape_of(load_robot(file)).outline == ((0.0, 0.0), (0.0, 0.06), (0.04, 0.06))


def test_an_image_of_a_flat_plate_is_turned_over_and_that_of_an_upright_one_stays():
    flat, upright = (shape_of(fin(f"{{outline: {TRIANGLE}, thickness: 3 mm, plane: {p}}}")) for p in ("xy", "xz"))
    assert flat.image().outline == ((0.0, 0.0), (0.06, 0.0), (0.06, -0.04))
    assert flat.image().image() == flat and upright.image() == upright


@pytest.mark.parametrize(
    ("shape", "field", "says"),
    [
        (
            "plank",
            "shape",
            f'"plank" is not known here. Known: {NAMED}. Or a mesh, as in {{mesh: hull.stl',
        ),
        ("{thickness: 3 mm, plane: xz}", "shape.outline", "is missing. Give the corners of the plate, a drawing, or"),
        (f"{{outline: {TRIANGLE}}}", "shape.thickness", 'is missing. Length expected, as in "85 mm" or "0.085 m".'),
        ("{outline: [[0 mm, 0 mm], [1 mm, 0 mm]], thickness: 3 mm}", "shape.outline", "has 2 points, where 3 to 500"),
        (
            "{outline: [[0 mm, 0 mm], [9, 0 mm], [1 mm, 1 mm]], thickness: 3 mm}",
            "shape.outline.1.0",
            '"9" has no unit. Length expected',
        ),
        (
            "{outline: [[0 mm, 0 mm], [9 mm, 0 mm, 1 mm], [1 mm, 1 mm]], thickness: 3 mm}",
            "shape.outline.1",
            "a list of two values expected, 3 given.",
        ),
        (f"{{outline: {TRIANGLE}, unit: mm, thickness: 3 mm}}", "shape.unit", "belongs to a drawing or a section."),
        (f"{{outline: {TRIANGLE}, drawing: a.svg, thickness: 3 mm}}", "shape.outline", "the file has the outline."),
        (f"{{outline: {TRIANGLE}, turn: 5 deg, thickness: 3 mm}}", "shape.turn", "belongs to a drawing or a section."),
        ("{drawing: a.svg, section_of: a.stl, thickness: 3 mm}", "shape.section_of", "comes from a.svg already."),
        ("{drawing: a.svg, across: 1 mm, thickness: 3 mm}", "shape.across", "belongs to a section of a mesh."),
        ("{section_of: a.stl, unit: mm, path: b, thickness: 3 mm}", "shape.path", "belongs to a drawing."),
        ("{section_of: a.stl, thickness: 3 mm}", "shape.unit", "is missing: a mesh has numbers without one."),
        ("{section_of: a.stl, unit: um, thickness: 3 mm}", "shape.section_of", "one of m, cm, mm, in, ft, not um."),
        ("{section_of: a.stl, unit: mm, thickness: 3 mm}", "shape.section_of", "a.stl: cannot be read: No such file"),
        ("{section_of: a.svg, unit: mm, thickness: 3 mm}", "shape.section_of", "a.svg: is no mesh that can be read"),
        ("{section_of: /a.stl, unit: mm, thickness: 3 mm}", "shape.section_of", "is outside of the folder"),
        ("{drawing: none.svg, thickness: 3 mm}", "shape.drawing", "none.svg: cannot be read: No such file"),
        ("{drawing: ../fin.svg, thickness: 3 mm}", "shape.drawing", "is outside of the folder of the robot file."),
        ("{drawing: /dev/zero, thickness: 3 mm}", "shape.drawing", "is outside of the folder of the robot file."),
        ("{drawing: fin.png, thickness: 3 mm}", "shape.drawing", 'fin.png: is no drawing by its ending: ".png".'),
        ("{outlines: 3, thickness: 3 mm}", "shape.outlines", 'no field "outlines" here. Did you mean "outline"?'),
    ],
)
def test_a_wrong_plate_is_told_by_its_field(shape: str, field: str, says: str):
    told = refusal(shape)
    assert f"robot.yaml, line 5, body.{field}: " in told and says in told


def test_a_plate_has_no_other_sizes_and_a_foil_on_it_lies_in_its_plane():
    plate = f"{{outline: {TRIANGLE}, thickness: 3 mm}}"
    assert "body.length: a plate has no length" in refusal(plate, "  length: 3 mm\n")
    foil = "  loads:\n    lift: {kind: foil, span_along: %s, ahead: %s%s}\n"
    assert "lift.span_along: the plate lies in the xy plane" in refusal(plate, foil % ("z", "x", ""))
    assert "lift.ahead: the plate lies in the xy plane" in refusal(plate, foil % ("y", "z", ""))
    assert "lift.chord: is missing. Give it beside" in refusal(plate, foil % ("y", "x", ", leading_edge: [0 m, 0 m]"))
    box = "box\n  length: 6 cm\n  width: 4 cm\n  height: 3 mm"
    assert "lift.chord: is missing. Only a plate" in refusal(box, foil % ("y", "x", ""))


def test_crossed_touching_and_doubled_outlines_are_refused_with_the_place():
    def told(*points: tuple[float, float]) -> str:
        rows = ", ".join(f"[{x} mm, {y} mm]" for x, y in points)
        return refusal(f"{{outline: [{rows}], thickness: 3 mm}}")

    assert "begin at points 0 and 2, counted from 0, meet at (20 mm, 15 mm)" in told((0, 0), (40, 30), (40, 0), (0, 30))
    # a corner on another edge, a spike, edges on one another, no area
    assert "points 0 and 2, counted from 0, meet at (20 mm, 0 m)" in told((0, 0), (40, 0), (40, 20), (20, 0), (0, 20))
    assert "meet at (40 mm, 20 mm)" in told((0, 0), (40, 0), (40, 20), (60, 20), (30, 20), (0, 20))
    assert "meet at" in told((0, 0), (40, 0), (20, 0))
    doubled = told((0, 0), (40, 0), (40, 30), (0, 0))
    assert "points 3 and 0, counted from 0, are the same. The last point is joined to the first by itself." in doubled


def test_the_check_agrees_with_the_signs_of_exact_arithmetic_on_random_polygons():
    """A polygon of five random corners is simple just where no two of its five pairs of edges apart cross."""
    from fractions import Fraction

    from nectosome.geometry.outlines import check_outline

    rng = np.random.default_rng(3)

    def side(a, b, c):
        (ax, ay), (bx, by), (cx, cy) = (map(Fraction, map(float, p)) for p in (a, b, c))
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) > 0

    found = []
    for _ in range(200):
        p = rng.uniform(-1, 1, (5, 2))
        edges = [(p[k], p[(k + 1) % 5]) for k in range(5)]
        apart = [(edges[i], edges[j]) for i in range(5) for j in range(i + 2, 5) if (i, j) != (0, 4)]
        crossed = any(side(a, b, c) != side(a, b, d) and side(c, d, a) != side(c, d, b) for (a, b), (c, d) in apart)
        try:
            check_outline(p)
            found.append(crossed)
        except InputError:
            found.append(not crossed)
    assert not any(found)
