"""Numbers with +- in robot files, and what of a robot is not known exactly."""

import copy
import math
import pickle
from statistics import NormalDist

import numpy as np
import pytest

from nectosome.description import apply_settings, dump_robot, parse_robot, resolve
from nectosome.description.uncertainty import SIGMAS, STATED, idle_correlations, sources_of, together
from nectosome.description.variables import read_variable
from nectosome.designs.axes import axis_of
from nectosome.io.schema.quantity import Quantity, Uncertain
from nectosome.io.schema.structure import value_at
from nectosome.units import InputError

PRESSURE = Quantity("pressure", 0.0, exclusive=True)
FINS = """
name: two fins
body:
  kind: rigid
  shape: spheroid
  length: 300 mm
  radius: 40 mm
  density: 1000 kg/m3
  joint: {kind: planar, axis: z}
  loads: {hull: {kind: lumped_drag, drag_area: [10 cm2, 150 cm2, 150 cm2]}}
limbs:
  fin:
    kind: rigid
    on: body
    at: root
    shape: box
    length: 90 mm +- 1 mm each
    width: 2 mm
    height: 60 mm
    density: 1100 +- 20 kg/m3
    offset: [0 mm, 60 mm +- 0.5 mm each, 0 mm]
    repeat: {mirror: y}
    joint: {kind: revolute, axis: z, stiffness: 0.1 N m/rad, rest: 5 deg +- 1 deg}
    loads:
      cross: {kind: plate_drag, normal: 1.3, start_up: none}
      water: {kind: added_mass, normal: 1 +- 5 %}
aliases: {k: limbs.fin.joint.stiffness}
"""


ROD = """
name: rod
limbs:
  arm:
    {kind: rod, section: circle, length: 0.2 m, radius: 10 mm, young: 1 MPa, poisson: 0.49 +- 0.01,
     density: 1000 kg/m3, strains: {bending_z: 1}, loads: %s}
"""


@pytest.fixture(scope="module")
def fins():
    return parse_robot(FINS)


@pytest.fixture(scope="module")
def sources(fins):
    return {source.name: source for source in sources_of(fins)}


@pytest.mark.parametrize(
    ("text", "value", "plus_minus", "each"),
    [
        ("1.2 +- 0.1 MPa", 1.2e6, 1e5, False),
        ("1.2 MPa +- 8 %", 1.2e6, 9.6e4, False),
        ("1.2MPa±100kPa each", 1.2e6, 1e5, True),
        ("1.2 +/- 0.1 MPa", 1.2e6, 1e5, False),
    ],
)
def test_a_number_is_read_with_its_spread(text, value, plus_minus, each):
    read = PRESSURE.read(text, units_required=True)
    assert (float(read), read.each) == (value, each)
    assert read.plus_minus == pytest.approx(plus_minus, rel=1e-15)
    for other in (pickle.loads(pickle.dumps(read)), copy.deepcopy(read)):
        assert (other, other.plus_minus, other.each) == (read, read.plus_minus, each)


@pytest.mark.parametrize(
    ("quantity", "text", "why"),
    [
        (PRESSURE, "1.2 MPa +- 0 MPa", "has no spread: what follows"),
        (PRESSURE, "1.2 MPa +- -1 MPa", "has no spread: what follows"),
        (PRESSURE, "1.2 MPa +- 8", '"8" has no unit'),
        (PRESSURE, "1.2 MPa +- 3 mm", "Pressure expected"),
        (PRESSURE, "1.2 +- 8 %", '"1.2" has no unit'),
        (Quantity("number", 0.0, 1.0), "0.9 +- 0.2", "with its spread it must be from 0 to 1"),
        (Quantity("length", 0.0, fixed=True), "9 mm +- 1 mm", "so it has no spread"),
    ],
)
def test_a_spread_that_makes_no_sense_is_refused(quantity, text, why):
    with pytest.raises(ValueError, match=why):
        quantity.read(text, units_required=True)


def test_a_file_with_spreads_is_written_and_read_back_with_them(fins):
    again = parse_robot(dump_robot(fins))
    assert dump_robot(again) == dump_robot(fins)
    assert [s.values for s in sources_of(again)] == [s.values for s in sources_of(fins)]


def test_images_of_a_limb_have_its_spread(fins):
    there = [value_at(fins, f"limbs.fin{k}.offset.1") for k in (1, 2)]
    assert there == [0.06, -0.06]
    assert [x.plus_minus for x in there] == pytest.approx([5e-4, 5e-4], rel=1e-12)


def test_images_and_copies_around_an_axis_have_the_spreads_of_their_angles(fins):
    turned = FINS.replace("repeat:", "rotation: [0 deg, 0 deg, 120 deg +- 2 deg each]\n    repeat:")
    angles = [value_at(parse_robot(turned), f"limbs.fin{k}.rotation.2") for k in (1, 2)]
    assert angles == pytest.approx([math.radians(120), math.radians(-120)], rel=1e-12)
    around = turned.replace("{mirror: y}", "{count: 3, around: x}").replace("120 deg", "10 deg")
    rows = [value_at(parse_robot(around), f"limbs.fin{k}.rotation") for k in (1, 2, 3)]
    for row in rows:  # turned about x, the yaw of the first is a pitch and a yaw of the others
        spreads = [getattr(x, "plus_minus", 0.0) for x in row]
        assert math.hypot(spreads[1] / math.cos(0), spreads[2] * math.cos(row[1])) == pytest.approx(
            math.radians(2), rel=1e-6
        )
        assert all(x.each for x in row if hasattr(x, "each"))
    for angle in angles:
        assert (angle.plus_minus, angle.each) == (pytest.approx(math.radians(2), rel=1e-8), True)


def test_arithmetic_keeps_the_spread_of_what_is_turned_and_shifted():
    x = Uncertain(3.0, 0.3)
    assert [(-x).plus_minus, (2 * x).plus_minus, (x + 1).plus_minus, (0.0 - x).plus_minus] == [0.3, 0.6, 0.3, 0.3]
    assert (x + Uncertain(1.0, 0.4)).plus_minus == 0.5  # in quadrature
    assert type(x / 2) is float


def test_what_is_off_together_is_one_source(fins, sources):
    assert set(sources["density"].values) == {"limbs.fin1.density", "limbs.fin2.density"}  # one batch
    assert set(sources["plate_drag normal"].values) == {f"limbs.fin{k}.loads.cross.normal" for k in (1, 2)}  # one law
    assert set(sources["k"].values) == set(resolve(fins, "k"))
    for k in (1, 2):  # built one by one
        assert set(sources[f"fin{k}.length"].values) == {f"limbs.fin{k}.length"}
    assert len(sources["lumped_drag drag_area"].values) == 3


def test_what_a_file_says_takes_the_place_of_the_range_of_a_law(sources):
    own = next(source for source in sources.values() if "limbs.fin1.loads.water.normal" in source.values)
    assert own.why == STATED
    assert "added_mass normal" not in sources


def test_the_file_has_the_median_and_the_ends_are_those_of_95_percent(sources):
    for source in sources.values():
        assert source.at(0.0) == source.values
    at = sources["fin1.length"].at
    assert at(SIGMAS)["limbs.fin1.length"] == pytest.approx(0.091, rel=1e-12)
    assert at(-SIGMAS)["limbs.fin1.length"] == pytest.approx(0.09**2 / 0.091, rel=1e-12)  # by a factor: never below 0
    drag = sources["plate_drag normal"]
    ends = [drag.at(x)["limbs.fin1.loads.cross.normal"] / 1.3 for x in (-SIGMAS, SIGMAS)]
    assert ends == pytest.approx([0.75, 1.35], rel=1e-12)
    rest = [*sources["rest"].at(SIGMAS).values()]
    assert rest == pytest.approx([math.radians(6)] * 2, rel=1e-12)  # of its image too
    assert NormalDist().cdf(SIGMAS) == pytest.approx(0.975, rel=1e-12)


def test_a_setting_takes_the_spread_with_it(fins):
    assert "density" not in {
        s.name for s in sources_of(apply_settings(fins, ["limbs.fin1.density=1000kg/m3"])) if len(s.values) > 1
    }
    given = apply_settings(fins, ["k=0.2 +- 0.01 N m/rad"])
    own = next(s for s in sources_of(given) if s.name == "k")
    assert own.why == STATED
    assert set(own.values.values()) == {0.2}


def test_correlations_are_those_of_numbers_with_a_spread(fins):
    text = dump_robot(fins) + "correlations: [{between: [limbs.fin1.density, limbs.fin1.length], value: -0.6}]\n"
    robot = parse_robot(text)
    names = [source.name for source in sources_of(robot)]
    matrix = together(robot, sources_of(robot))
    i, k = names.index("density"), names.index("fin1.length")
    assert matrix[i, k] == matrix[k, i] == -0.6
    assert abs(matrix).sum() == len(names) + 1.2
    exact = apply_settings(robot, ["limbs.fin1.length=90mm"])
    assert abs(together(exact, sources_of(exact))).sum() == len(sources_of(exact))
    assert idle_correlations(robot) == []
    ((path, why),) = idle_correlations(exact)
    assert path == "correlations.0" and "no spread is given of limbs.fin1.length" in why


@pytest.mark.parametrize(
    ("pairs", "why"),
    [
        ("[{between: [limbs.fin1.density, limbs.fin1.lenght], value: 0.5}]", "no quantity called limbs.fin1.lenght"),
        ("[{between: [limbs.fin1.density, limbs.fin1.length], value: 1.5}]", "from -1 to 1"),
    ],
)
def test_a_correlation_that_makes_no_sense_is_refused(fins, pairs, why):
    with pytest.raises(InputError, match=why):
        parse_robot(dump_robot(fins) + f"correlations: {pairs}\n")


def test_correlations_that_no_numbers_have_together_are_refused(fins):
    a, b, c = "limbs.fin1.density", "limbs.fin1.length", "limbs.fin2.length"
    rows = [f"{{between: [{x}, {y}], value: {r}}}" for x, y, r in ((a, b, 0.9), (a, c, 0.9), (b, c, -0.9))]
    robot = parse_robot(dump_robot(fins) + f"correlations: [{', '.join(rows)}]\n")
    with pytest.raises(InputError, match="no numbers have all these correlations"):
        together(robot, sources_of(robot))


def test_images_of_angles_differ_together_unless_each_is_its_own(fins):
    turned = FINS.replace("repeat:", "rotation: [0 deg, 0 deg, 120 deg +- 2 deg]\n    repeat:")
    (source,) = (s for s in sources_of(parse_robot(turned)) if "limbs.fin1.rotation.2" in s.values)
    found = source.at(SIGMAS)
    assert [found[f"limbs.fin{k}.rotation.2"] for k in (1, 2)] == pytest.approx(np.radians([122, -122]), rel=1e-9)


def test_quantities_of_one_alias_differ_together():
    text = FINS.replace("150 cm2, 150 cm2]", "150 cm2 +- 20 %, 150 cm2 +- 20 %]")
    both = text.replace("aliases: {", "aliases: {q: [body.loads.hull.drag_area.1, body.loads.hull.drag_area.2], ")
    names = [source.name for source in sources_of(parse_robot(both))]
    assert "q" in names
    assert not any("drag_area.1" in name for name in names)


def test_the_correlation_is_that_of_values_whatever_their_signs(fins):
    text = dump_robot(fins).replace("5 deg", "-5 deg")
    pair = "correlations: [{between: [limbs.fin1.density, limbs.fin1.joint.rest], value: 0.8}]\n"
    robot = parse_robot(text + pair)
    sources = sources_of(robot)
    at = [next(s for s in sources if path in s.values) for path in ("limbs.fin1.density", "limbs.fin1.joint.rest")]
    matrix = together(robot, sources)
    assert matrix[sources.index(at[0]), sources.index(at[1])] == -0.8  # of places, which move sizes
    up, down = (at[1].at(x)["limbs.fin1.joint.rest"] for x in (-1.0, 1.0))
    assert down < math.radians(-5) < up


def test_nothing_is_drawn_that_its_field_does_not_allow():
    """Poisson's ratio is 0.5 at most."""
    (source,) = (s for s in sources_of(parse_robot(ROD % "{}")) if "limbs.arm.poisson" in s.values)
    width = math.log1p(0.01 / 0.49) / SIGMAS
    drawn = [source.at(x)["limbs.arm.poisson"] for x in (-3.0, 0.0, 1.0, 3.0)]
    assert drawn == pytest.approx([0.49 * math.exp(-3 * width), 0.49, 0.49 * math.exp(width), 0.5], rel=1e-12)


@pytest.mark.parametrize("name", ["muscle", "tendon"])
def test_what_pulls_inside_a_rod_is_no_load_of_the_water(name):
    load = {
        "muscle": "{kind: muscle, strain: bending_z, moment: {kind: wave, amplitude: 1 mN m +- 10 %, frequency: 1 Hz, "
        "wavelength: 0.2 m}}",
        "tendon": "{kind: tendon, place: [5 mm, 0 mm], tension: {kind: constant, value: 1 N +- 10 %}}",
    }[name]
    rod = ROD % f"{{pull: {load}}}"
    assert not any(source.of_water for source in sources_of(parse_robot(rod)))


def test_ends_of_ranges_and_values_of_axes_have_no_spread(fins):
    with pytest.raises(InputError, match="which the ends of a range have not"):
        read_variable("k", "0.05..0.2 +- 0.01 N m/rad", fins)
    with pytest.raises(InputError, match="which values of an axis have not"):
        axis_of("k", "0.1 +- 0.01 N m/rad, 0.2 N m/rad", fins)
