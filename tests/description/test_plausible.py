# ruff: noqa: E501  (tables: one case a line)
"""Values that no material and no water has, and that no robot that ships has either."""

from typing import get_args

import pytest

from nectosome.description import RobotDescription, parse_robot
from nectosome.description.plausible import _ORDINARY, implausible, meaningless
from nectosome.io.schema.structure import _fields, models_in, slot
from nectosome.robots import describe, names

ROD = """
name: a
water: {density: WATER}
body: {kind: rod, section: circle, length: 0.3 m, radius: 5 mm, young: YOUNG, density: DENSITY, strains: {bending_y: 1}}
"""


def told(water: str = "1000 kg/m3", young: str = "1 MPa", density: str = "1080 kg/m3") -> list[tuple[str, str]]:
    text = ROD.replace("WATER", water).replace("YOUNG", young).replace("DENSITY", density)
    return list(implausible(parse_robot(text)))


def test_rubber_in_water_is_plausible():
    assert not told()


@pytest.mark.parametrize(
    ("values", "path", "said"),
    [
        ({"density": "1.08 kg/m3"}, "body.density", "1.08 kg/m3 is far outside of materials, foam to osmium (10 kg/m3 to 23000 kg/m3)."),
        ({"young": "450 GPa"}, "body.young", "450 GPa is far outside of materials, gels to tungsten (100 Pa to 420 GPa)."),
        ({"water": "1 kg/m3"}, "water.density", "1 kg/m3 is far outside of water, fresh to saturated with salt (950 kg/m3 to 1300 kg/m3)."),
    ],
)  # fmt: skip
def test_a_slip_of_a_unit_is_told_with_its_path_and_the_range(values, path, said):
    assert told(**values) == [(path, f"{said} Check the value and its unit.")]


def test_every_dimension_of_a_field_has_a_range():
    """Walked through all models of robot files: a new kind of quantity needs a row, too."""
    dimensions, slots = set(), [place for model in models_in(RobotDescription) for place in _fields(model).values()]
    while slots:
        here = slots.pop()
        if here.quantity is None:
            slots += [slot(inner) for inner in get_args(here.hint) if inner is not Ellipsis]
        else:
            dimensions.add(here.quantity.dimension)
    assert len(dimensions) > 25
    assert dimensions <= set(_ORDINARY)


SPRUNG = """
name: sprung
water: {current: [0 m/s, CURRENT, CURRENT]}
body:
  kind: rigid
  shape: box
  length: LENGTH
  width: 0.1 m
  height: 0.1 m
  mass: MASS
  offset: [OFF, 0 m, 0 m]
  joint: {kind: prismatic, axis: x, stiffness: STIFFNESS, damping: 1 N s/m, force: {kind: sine, amplitude: 1 N, frequency: BEAT}}
"""
PLAIN = {"LENGTH": "0.2 m", "MASS": "1 kg", "STIFFNESS": "10 N/m", "BEAT": "1 Hz", "OFF": "0 m", "CURRENT": "0.1 m/s"}


@pytest.mark.parametrize(
    ("given", "path", "said"),
    [
        ({}, None, ""),
        ({"STIFFNESS": "1e200 N/m"}, "body.joint.stiffness", "1e+200 N/m is far outside of springs, a molecule to a block of steel (1e-10 N/m to 1e13 N/m)."),
        ({"STIFFNESS": "1e-200 N/m"}, "body.joint.stiffness", "1e-200 N/m is far outside"),
        ({"STIFFNESS": "0 N/m"}, None, ""),
        ({"LENGTH": "1e9 m"}, "body.length", "1000000 km is far outside"),
        ({"MASS": "1e-25 kg"}, "body.mass", "1e-25 kg is far outside"),
        ({"BEAT": "1e9 Hz"}, "body.joint.force.frequency", "1000000 kHz is far outside of frequencies"),
        ({"OFF": "1e-17 m"}, None, ""),  # a zero that was rounded
        ({"OFF": "-1e9 m"}, "body.offset.0", "-1000000 km is far outside of lengths"),
        ({"CURRENT": "1e6 m/s"}, "water.current.1", "1000000 m/s is far outside of speeds below"),
    ],
)  # fmt: skip
def test_numbers_that_no_robot_has_are_told_by_their_dimension(given, path, said):
    """Once of a row of numbers; small ones only where their sign is fixed."""
    text = SPRUNG
    for name, value in (PLAIN | given).items():
        text = text.replace(name, value)
    found = list(meaningless(parse_robot(text)))
    assert [where for where, _ in found] == ([] if path is None else [path])
    assert all(sentence.startswith(said) for _, sentence in found)


TENDON = """
name: arm
body:
  kind: rod
  section: SECTION
  length: 0.3 m
  young: 1 MPa
  density: 1080 kg/m3
  strains: {bending_y: 1}
  loads: {pull: {kind: tendon, tension: {kind: constant, value: 1 N}, THREAD}}
"""
CONE = "circle\n  radius: 10 mm\n  tip_radius: 2 mm"
WAISTED = "circle\n  radius: 10 mm\n  between: [{at: 0.4, radius: 5 mm}]"
PLATE = "rectangle\n  width: 20 mm\n  height: 8 mm"
OVAL = "ellipse\n  width: 20 mm\n  height: 8 mm"


@pytest.mark.parametrize(
    ("section", "thread", "field", "said"),
    [
        (CONE, "place: [0 m, 9 mm]", "place", "9 mm from the axis at 100 % of the length it runs outside of the rod: its radius there is 2 mm."),
        (CONE, "place: [0 m, 9 mm], along: [0, 0.5]", "place", "9 mm from the axis at 50 % of the length it runs outside of the rod: its radius there is 6 mm."),
        (CONE, "place: [0 m, 9 mm], tip_place: [0 m, 3 mm]", "tip_place", "3 mm from the axis at 100 % of the length it runs outside of the rod: its radius there is 2 mm."),
        (WAISTED, "place: [6 mm, 0 m]", "place", "6 mm from the axis at 40 % of the length it runs outside of the rod: its radius there is 5 mm."),
        (OVAL, "place: [9 mm, 3 mm]", "place", "9.487 mm from the axis at 0 % of the length it runs outside of the rod: its half sizes there are 10 mm and 4 mm."),
    ],
)  # fmt: skip
def test_a_thread_outside_of_its_rod_is_told_with_the_place(section, thread, field, said):
    """(9/10)^2 + (3/4)^2 > 1 in an ellipse, which a rectangle has room for."""
    ((path, told),) = implausible(parse_robot(TENDON.replace("SECTION", section).replace("THREAD", thread)))
    assert (path, told.startswith(said), "Give a tip_place" in told) == (f"body.loads.pull.{field}", True, True)


@pytest.mark.parametrize(
    ("section", "thread"),
    [(CONE, "place: [0 m, 9 mm], tip_place: [0 m, 1.9 mm]"), (CONE, "place: [0 m, 9 mm], along: [0, 0.125]"), (WAISTED, "place: [5 mm, 0 m]"), (PLATE, "place: [9 mm, 3 mm]")],
)  # fmt: skip
def test_a_thread_inside_of_its_rod_is_plausible(section, thread):
    assert not list(implausible(parse_robot(TENDON.replace("SECTION", section).replace("THREAD", thread))))


SERVO = """
name: oar
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [0.01 kg m2, 0.01 kg m2, 0.01 kg m2]
  joint:
    kind: revolute
    axis: z
    motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz}
    servo: {model: HS-5646WP, supply: SUPPLY, full_voltage_at: 10 deg, inertia: INERTIA}
"""


def test_a_motor_without_a_rotor_and_one_at_a_far_voltage_are_told():
    def found(supply: str, inertia: str) -> list[tuple[str, str]]:
        return [*implausible(parse_robot(SERVO.replace("SUPPLY", supply).replace("INERTIA", inertia)))]

    assert not found("7.4 V", "1e-3 kg m2")
    (path, said), (other, far) = found("11.1 V", "0 kg m2")
    assert path == "body.joint.servo.inertia" and said.startswith("0 kg m2: a rotor behind its gear often has more")
    assert (other, far) == (
        "body.joint.servo.rated_voltage",
        "it is supplied by 11.1 V, far above the 6 V of its data sheet.",
    )


def test_a_gear_that_would_lock_is_told():
    """Teeth that pass on 0.4 let 2 - 1/0.4 < 0 of a load through; the model 1/(2 - 0.4)."""
    text = SERVO.replace("SUPPLY", "6 V").replace("INERTIA", "1e-3 kg m2")
    assert not [*implausible(parse_robot(text.replace("full_", "efficiency: 0.5, full_")))]
    ((path, said),) = implausible(parse_robot(text.replace("full_", "efficiency: 0.4, full_")))
    assert path == "body.joint.servo.efficiency"
    assert "locks against its load, where here 62% of the load reach the motor" in said


def test_a_fast_current_is_told_by_its_axis():
    text = (
        ROD.replace("density: WATER", "current: [0 m/s, 30 m/s, 0 m/s]")
        .replace("YOUNG", "1 MPa")
        .replace("DENSITY", "1 g/cm3")
    )
    assert [path for path, _ in implausible(parse_robot(text))] == ["water.current.1"]


@pytest.mark.parametrize("name", names())
def test_robots_that_ship_are_plausible(name):
    """But for the strips of the rowing paper's hinges, which stand there as printed."""
    printed = 1 if name.startswith(("beetle", "paddle")) else 0
    for told in (implausible(describe(name)), meaningless(describe(name))):
        assert [path.rpartition(".")[2] for path, _ in told] == ["as_printed"] * printed


@pytest.mark.parametrize("name", ["eel", "catshark"])
def test_a_swimmer_that_sheds_no_wake_is_told(name):
    """By a muscle, and by a motion that is prescribed."""
    whole = describe(name)
    assert whole.body is not None
    loads = {key: load for key, load in whole.body.loads.items() if load.kind != "trailing_edge"}
    found = list(implausible(whole.model_copy(update={"body": whole.body.model_copy(update={"loads": loads})})))
    assert [path for path, _ in found] == ["body.loads"] and "no trailing_edge" in found[0][1]


FIN = """
name: fish
body: {kind: rigid, shape: cylinder, length: 0.2 m, radius: 15 mm, mass: 0.1 kg, joint: {kind: free}}
limbs:
  fin: {kind: rigid, shape: box, length: 40 mm, width: 2 mm, height: HEIGHT, mass: 5 g, loads: {water: {LOAD}}}
"""


@pytest.mark.parametrize(
    ("load", "height", "said"),
    [
        ("kind: added_mass, normal: 1", "200 mm", None),
        ("kind: foil, span_along: z, ahead: -x, chord: 40 mm", "10 mm", "its aspect ratio is 0.25, where lift is that of a slender body. Take added_mass, drag and a trailing_edge, on a box or a rod."),
        ("kind: foil, span_along: z, ahead: -x, chord: 40 mm", "60 mm", None),
        ("kind: foil, span_along: z, ahead: -x, chord: [0 mm, 40 mm, 0 mm], aspect_ratio: 6", "10 mm", None),
    ],
)  # fmt: skip
def test_strips_go_along_slender_fins_and_sections_along_long_spans(load: str, height: str, said: str | None):
    found = list(implausible(parse_robot(FIN.replace("LOAD", load).replace("HEIGHT", height))))
    assert found == ([] if said is None else [("limbs.fin.loads.water", said)])


@pytest.mark.parametrize(("height", "told"), [("200 mm", 0), ("4.1 mm", 0), ("3 mm", 1)])
def test_a_thick_bar_that_starts_as_a_plate_is_told(height: str, told: int):
    text = FIN.replace("LOAD", "kind: plate_drag, normal: 1, start_up: {}").replace("HEIGHT", height)
    found = list(implausible(parse_robot(text)))
    assert [path for path, _ in found] == told * ["limbs.fin.loads.water.start_up"]
    assert all("its part is 0.67 times as thick as high" in why for _, why in found)
