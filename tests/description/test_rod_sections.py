"""Sections and materials along rods: in the file, or in a table beside it; what is refused."""

import pytest

from nectosome.description import dump_robot, load_robot, numeric_paths, parse_robot
from nectosome.units import InputError

ROD = """name: beam
body:
  kind: rod
  section: circle
  radius: 10 mm
  length: 200 mm
  young: 300 kPa
  density: 1100 kg/m3
  strains: {bending_y: 3}
"""
TABLE = "x (mm),radius (mm),young (kPa),density (g/cm3)\n0,10,300,1.1\n100,8,100,1.2\n200,6,50,1.3\n"


@pytest.fixture
def beside(tmp_path):
    """A robot whose sections stand in a table beside it, by the text of that."""

    def load(table: str, rod: str = ROD):
        (tmp_path / "fin.csv").write_text(table)
        (tmp_path / "robot.yaml").write_text(rod + "  between: fin.csv\n")
        return load_robot(tmp_path / "robot.yaml")

    return load


def test_a_table_is_the_sections_that_it_lists(beside):
    """Its last row is the tip. A column of fractions says the same; saved robots do not need the file."""
    written = ROD + (
        "  tip_radius: 6 mm\n  tip_young: 50 kPa\n  tip_density: 1300 kg/m3\n"
        "  between: [{at: 0.5, radius: 8 mm, young: 100 kPa, density: 1200 kg/m3}]\n"
    )
    found = beside(TABLE)
    assert found.body == parse_robot(written).body
    assert parse_robot(dump_robot(found)).body == found.body
    fractions = TABLE.replace("x (mm)", "at").replace("\n100,", "\n0.5,").replace("\n200,", "\n1,")
    assert beside(fractions).body == found.body
    assert {"body.between.0.young", "body.tip_density"} <= numeric_paths(found).keys()


def test_what_a_section_leaves_out_goes_over_evenly():
    body = parse_robot(ROD + "  tip_radius: 6 mm\n  between: [{at: 0.5, young: 100 kPa}]\n").body
    assert body.sections("radius") == [(0.0, 0.01), (1.0, 0.006)]
    assert body.along("young") == [(0.0, 3e5), (0.5, 1e5), (1.0, 3e5)]
    assert body.along("density") == [(0.0, 1100.0)]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("0,10,300", "0,11,300", "line 5, body.radius: differs from the first row of fin.csv. Write the same in both"),
        ("young (kPa)", "young", "line 7, body.young: differs from the first row of fin.csv"),
        ("young (kPa)", "joung (kPa)", 'body.between: fin.csv has a column "joung", which no section has. It may have'),
        ("young (kPa)", "wall (kPa)", "body.wall: is missing, but stands in the first row of fin.csv"),
        ("100,8,100", "100,8,", "body.between: fin.csv, column young: there is no number in row 2."),
        ("200,6", "90,6", "body.between: fin.csv, row 3: places must increase along the rod."),
        ("200,6", "290,6", "body.between: fin.csv, row 3: is at 1.45 of the length, outside of the rod"),
        ("100,8,100", "100,8,-100", 'body.between.0.young: "-100 kPa" is out of range: it must be more than 0 Pa.'),
        ("x (mm)", "y (mm)", 'fin.csv has a column "y"'),
        ("x (mm)", "x", "fin.csv gives x no unit of length. Write it into its heading, as in x (mm)."),
        ("\n100,8,100,1.2\n200,6,50,1.3", "", "fin.csv has 1 rows; a rod takes 2 to 200."),
    ],
)
def test_a_wrong_table_is_told(beside, old, new, told):
    with pytest.raises(InputError) as error:
        beside(TABLE.replace(old, new))
    assert told in str(error.value)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("between: none.csv", "body.between: none.csv: cannot be read: No such file or directory."),
        ("between: ../fin.csv", "body.between: ../fin.csv is outside of the folder of the robot file."),
        ("between: [{at: 0.5}]", "body.between.0.radius: is missing: a section of this rod has radius."),
        ("between: [{at: 0.5, young: 3 mm}]", 'body.between.0.young: "3 mm" is a length. Pressure expected'),
        ("tip_density: 0 kg/m3", 'body.tip_density: "0 kg/m3" is out of range'),
        ("tip_damping: {loss_factor: 0.1}", "body.tip_damping: a loss factor that is constant over a band is one for"),
        ("wall: 10 mm", "body.wall: 10 mm at 0 % of the length leaves no room inside: half of the section is 10 mm."),
        ("tip_wall: 1 mm", "body.tip_wall: the rod has no wall at its root. Give wall as well, or leave this out."),
        ("filling: {density: 1 g/cm3}", "body.filling: the rod is solid. Give the thickness of its wall"),
        ("wall: 1 mm\n  filling: {young: 1 kPa}", "body.filling.density: is missing"),
        ("ribs: {count: 5, thickness: 2 mm}", "body.ribs.radius: is missing: ribs of this rod have radius."),
        ("ribs: {count: 5, thickness: 2 mm, radius: 9 mm}", "body.ribs.radius: 9 mm is inside of the rod, whose"),
        ("ribs: {count: 200, thickness: 2 mm, radius: 1 cm}", "body.ribs.thickness: 200 ribs are 400 mm together"),
    ],
)  # fmt: skip
def test_wrong_sections_are_told(more, told):
    with pytest.raises(InputError) as error:
        parse_robot(f"{ROD}  {more}\n")
    assert told in str(error.value)


def test_the_shear_of_a_hollow_rectangle_is_refused():
    text = ROD.replace("circle\n  radius: 10 mm", "rectangle\n  width: 10 mm\n  height: 20 mm\n  wall: 1 mm")
    parse_robot(text)
    with pytest.raises(InputError, match=r"body.strains.shear_z: the shear of a hollow rectangle is not known here"):
        parse_robot(text.replace("bending_y: 3", "bending_y: 3, shear_z: 0"))
