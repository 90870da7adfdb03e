# ruff: noqa: E501  (tables: one case a line)
"""Files: what is read, what is written back, and the sentence for what is no robot file."""

import pickle

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nectosome.description import dump_robot, get_value, load_robot, numeric_paths, parse_robot, with_values
from nectosome.description.shapes import shape_forms
from nectosome.units import InputError

NAMED = ", ".join(form for form, shape in shape_forms().items() if not shape.model_fields)

SPHERE = "name: a\nbody: {kind: rigid, shape: point, mass: 1 kg}\n"


def test_the_flagellum_is_read_in_si(flagellum):
    assert get_value(flagellum, "E") == 7.4e6
    assert get_value(flagellum, "L") == 0.7
    assert get_value(flagellum, "tip_radius") == 0.00565
    assert flagellum.body.loads["hull"].drag_area == (0.012566370614359173, 0.0, 0.0)
    assert flagellum.limbs["filament"].on == "hook"
    assert flagellum.water.gravity == 0.0


def test_the_flagellum_reads_back_exactly(flagellum):
    assert parse_robot(dump_robot(flagellum)) == flagellum


@settings(max_examples=25)
@given(st.data())
def test_any_values_read_back_exactly(flagellum, data):
    values = {}
    for path, quantity in numeric_paths(flagellum).items():
        low, open_ = quantity.minimum, quantity.exclusive or path.endswith(".mass")  # what moves weighs something
        values[path] = data.draw(
            st.floats(low, quantity.maximum, exclude_min=open_, allow_nan=False, allow_infinity=False)
        )
    values |= {f"limbs.shaft.joint.axis.{i}": v for i, v in enumerate((1.0, 0.0, 0.0))}
    values |= {f"body.joint.axis.{i}": v for i, v in enumerate((0.0, 0.0, 1.0))}
    changed = with_values(flagellum, values)
    assert parse_robot(dump_robot(changed)) == changed


@given(st.text(alphabet=st.characters(exclude_categories=["Cs"]), min_size=1, max_size=60))
def test_any_words_read_back_exactly(words):
    robot = parse_robot(SPHERE).model_copy(update={"name": words, "about": words})
    assert parse_robot(dump_robot(robot)) == robot


def test_a_message_has_file_line_and_field(tmp_path, monkeypatch, flagellum_file):
    monkeypatch.chdir(tmp_path)
    text = flagellum_file.read_text().replace("7.4 MPa", "7.4 MP")
    (tmp_path / "robot.yaml").write_text(text)
    line = next(n for n, row in enumerate(text.splitlines(), 1) if "young" in row)
    with pytest.raises(InputError) as caught:
        load_robot("robot.yaml")
    assert str(caught.value) == (
        f'robot.yaml, line {line}, limbs.filament.young: "7.4 MP" has no unit called MP. '
        'Pressure expected, as in "7.4 MPa" or "7.4e6 Pa".'
    )
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.line) == (str(caught.value), line)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "robot: this is empty. A robot has at least a name and a body or limbs."),
        ("# nothing\n", "robot: this is empty. A robot has at least a name and a body or limbs."),
        ("just words", "robot: this has no named fields. A robot has at least a name and a body or limbs."),
        ("- a\n- b", "robot: this has no named fields. A robot has at least a name and a body or limbs."),
        (SPHERE + "name: b\n", 'robot, line 3: "name" occurs twice here, first in line 1.'),
        (SPHERE + "abuot: b\n", 'robot, line 3, abuot: there is no field "abuot" here. Did you mean "about"?'),
        (SPHERE + "about: [a\n", "robot, line 4: this is not YAML: expected ',' or ']', but got '<stream end>'."),
        (SPHERE + "about: !!python/name:os.system x\n", 'robot, line 3: the tag "tag:yaml.org,2002:python/name:os.system" is not used here. Leave it out.'),
        (SPHERE + "? [a]\n: b\n", "robot, line 3: a name is expected before the colon."),
        (SPHERE + "about: " + "[" * 40 + "]" * 40, "robot, line 3: nested too deeply."),
        (SPHERE + "about: " + "[" * 5000, "robot, line 3: nested too deeply."),
        (SPHERE + "about: &a [*a]", "robot, line 3: nested too deeply."),
        (SPHERE + "about: " + "9" * 5000, "robot, line 3: this number has too many digits."),
        (SPHERE + "---\n" + SPHERE, "robot, line 3: this is not YAML: but found another document."),
        ("name: a\nbody: {kind: rigid, shape: point, mass: 1 kg, loads: {a: {kind: drag}}}", 'robot, line 2, body.loads.a.normal: is missing. Number expected, as in "0.5".'),
        ("body: {kind: rigid, shape: point, mass: 1 kg}", "robot, line 1, name: is missing. A text expected."),
        ("name: a\nbody: 3", 'robot, line 2, body: "3" does not fit here. A group of fields expected, with the kind rigid, rod, soft_plate.'),
        ("name: a\nbody: {shape: point}", "robot, line 2, body: the kind is missing. Write one of rigid, rod, soft_plate."),
        ("name: a\nbody: {kind: rgid}", 'robot, line 2, body: there is no kind "rgid" here. Did you mean "rigid"?'),
        ("name: a\nbody: {kind: rigid, shape: ball, mass: 1 kg}", 'robot, line 2, body.shape: "ball" is not known here. Known: ' + NAMED + '. Or a mesh, as in {mesh: hull.stl, unit: mm}, or a plate, as in {drawing: fin.svg, thickness: 3 mm} or {outline: [[0 mm, 0 mm], [60 mm, 0 mm], [60 mm, 40 mm]], thickness: 3 mm}.'),
        (SPHERE + "pairs: {a: {kind: }}", "robot, line 3, pairs.a.kind: the kind is missing. Write one of bushing, contact."),
        ("name: a\nbody: {kind: }", "robot, line 2, body.kind: the kind is missing. Write one of rigid, rod, soft_plate."),
    ],
)  # fmt: skip
def test_what_is_no_robot_is_told_in_a_sentence(text, message):
    with pytest.raises(InputError) as caught:
        parse_robot(text)
    assert str(caught.value) == message


ON_BOTH = {"drag", "plate_drag", "added_mass", "force", "distributed_force", "foil", "skin_friction", "stokes_drag"}
ON_BOTH |= {"trailing_edge"}
ON_RIGID = {"lumped_drag", "spheroid_added_mass", "cylinder_added_mass", "given_added_mass", "jet", "leg"}
ON_RIGID |= {"mesh_added_mass", "near_floor", "pulsed_thrust", "thruster", "wall_contact"}
ON_RODS = {"tendon", "chamber", "muscle"}


@pytest.mark.parametrize(("part", "loads"), [("rigid", ON_BOTH | ON_RIGID), ("rod", ON_BOTH | ON_RODS)])
@pytest.mark.parametrize(
    ("load", "field", "said"),
    [
        ("{kind: propeller}", "", 'there is no kind "propeller" here. Known: '),
        ("{kind: }", ".kind", "the kind is missing. Write one of "),
        ("{}", "", "the kind is missing. Write one of "),
        ("3", "", '"3" does not fit here. A group of fields expected, with the kind '),
    ],
)
def test_all_loads_that_act_on_such_a_part_are_told_and_no_others(part, loads, load, field, said):
    with pytest.raises(InputError) as caught:
        parse_robot(f"name: a\nbody: {{kind: {part}, loads: {{p: {load}}}}}")
    message = caught.value.message
    assert caught.value.field == f"body.loads.p{field}"
    assert message.startswith(said)
    assert set(message.removeprefix(said).rstrip(".").split(", ")) == loads


def test_the_nearest_load_is_suggested_in_place_of_the_list():
    with pytest.raises(InputError) as caught:
        parse_robot("name: a\nbody: {kind: rigid, shape: point, mass: 1 kg, loads: {p: {kind: jett}}}")
    assert caught.value.message == 'there is no kind "jett" here. Did you mean "jet"?'


def test_an_empty_value_is_told(flagellum_file):
    text = flagellum_file.read_text().replace("rate: 14.4 rad/s", "rate: ")
    with pytest.raises(InputError) as caught:
        parse_robot(text)
    assert caught.value.field == "limbs.shaft.joint.motion.rate"
    assert caught.value.message.startswith("an empty value does not fit here. Angular speed expected")


def test_an_alias_bomb_is_defused():
    bomb = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
        f"{new}: &{new} [{', '.join(['*' + old] * 9)}]\n" for old, new in zip("abcdefgh", "bcdefghi", strict=True)
    )
    with pytest.raises(InputError, match="too large"):
        parse_robot(bomb)


def test_anchors_repeat_a_value():
    robot = parse_robot("name: a\nbody: {kind: rigid, shape: cylinder, length: &size 1 m, radius: *size, mass: 1 kg}\n")
    assert robot.body.radius == 1.0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xff\xfe\x00\x01", "this is not a text file."),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "this is not a text file."),
        (b"name: a\x00b\n", "this is not YAML"),
        (b"#" * 4_000_001, "too large."),
    ],
)
def test_what_is_no_text_is_told(tmp_path, content, message):
    file = tmp_path / "robot.yaml"
    file.write_bytes(content)
    with pytest.raises(InputError, match=message):
        load_robot(file)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file or directory"):
        load_robot(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="cannot be read: Is a directory"):
        load_robot(tmp_path)
    with pytest.raises(InputError, match="cannot be read: embedded null byte"):
        load_robot("a\0b")
