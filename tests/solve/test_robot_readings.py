"""What is read off a robot is what its results say."""

import jax
import numpy as np
import pytest

from nectosome.description import parse_robot, with_values
from nectosome.io import load_dataset, save_dataset
from nectosome.model import build
from nectosome.solve import reading, reading_of, simulate, static
from nectosome.units import InputError

# a body that is held, with a driven arm, and a fin that follows on a spring
ROWER = """
name: rower
body: {kind: rigid, shape: point, mass: 1 kg, joint: {kind: planar, axis: z, motion: {}}}
limbs:
  arm:
    kind: rigid
    shape: cylinder
    length: 100 mm
    radius: 5 mm
    density: 1200 kg/m3
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 40 deg, frequency: 1 Hz}}
    loads: &wet {drag: {kind: drag, normal: 1.2}, water: {kind: added_mass, normal: 1}}
  fin:
    on: arm
    kind: rigid
    shape: cylinder
    length: 80 mm
    radius: 4 mm
    density: 1200 kg/m3
    joint: {kind: revolute, axis: z, stiffness: 0.02 N m/rad, damping: 1 mN m s/rad}
    loads: *wet
"""


NAMES = {
    "force.x": "N",
    "force.y": "N",
    "reaction.body.x": "N",
    "reaction.body.y": "N",
    "reaction.arm.angle": "N m",
    "fin.tip.position.y": "m",
    "fin.position.x": "m",
    "fin.velocity.x": "m/s",
    "fin.surge": "m/s",
    "fin.sway": "m/s",
    "fin.heave": "m/s",
    "fin.tilt": "rad",
    "fin.turn_rate": "rad/s",
    "fin.tip.velocity.y": "m/s",
    "arm.angle": "rad",
    "fin.heading": "rad",
    "fin.angle": "rad",
    "fin.angle.rate": "rad/s",
}


@pytest.fixture(scope="module")
def robot():
    return build(parse_robot(ROWER))


@pytest.fixture(scope="module")
def run(robot):
    return simulate(robot, 0.5, samples=6)


@pytest.fixture(scope="module")
def rowed(run):
    """What is read, by name, and the results."""
    return {name: reading(run, name) for name in NAMES}, run.to_dataset()


def test_a_reading_is_an_expression_or_a_function_of_several(robot, run, rowed):
    """The distance of two marks along a run and its dataset, and at an instant; the power of a drive with its unit."""
    found, data = rowed
    y, x = found["fin.tip.position.y"], found["fin.position.x"]
    distance = "fin.tip.position.y - fin.position.x"
    np.testing.assert_array_equal(reading(run, distance), y - x)
    np.testing.assert_allclose(reading(data, distance), y - x, atol=1e-15)
    np.testing.assert_array_equal(reading(run, lambda r: r["fin.tip.position.y"] - r["fin.position.x"]), y - x)
    traced = jax.jit(lambda run: (reading(run, distance), reading(run, lambda r: abs(r["fin.position.x"]))))(run)
    np.testing.assert_allclose(traced, [y - x, np.abs(x)], atol=1e-14)
    one = reading_of(robot, distance)
    assert (one.unit, one.dimension) == ("m", "length")
    last = jax.tree.map(lambda leaf: leaf[-1], run.value.state)
    assert jax.jit(one.value)(robot, run.value.time[-1], last) == pytest.approx(y[-1] - x[-1], rel=1e-12)
    power = reading_of(robot, "reaction.arm.angle * arm.angle.rate / 2")
    assert (power.unit, power.dimension) == ("N m rad/s", "number")


def test_an_expression_of_headings_counts_full_turns(robot):
    assert reading_of(robot, "fin.heading - arm.heading").turns
    assert not reading_of(robot, "cos(fin.heading)").turns


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("fin.angle / arm.angel", '^"arm.angel" is nothing that can be measured. Did you mean "arm.angle"'),
        ("fin.angle +", r'^"fin.angle \+" is no expression. Take \+ - '),
        ("2 * 3", "depends on nothing that is measured"),
        (lambda r: r["fin.angel"], '"fin.angel" is no quantity. Did you mean "fin.angle"'),
        (lambda r: 1.0, "depends on nothing that is measured"),
    ],
)
def test_a_wrong_formula_of_readings_gets_a_sentence(run, name, said):
    with pytest.raises(InputError, match=said):
        reading(run, name)


def test_a_load_cell_feels_what_holds_the_body(rowed):
    """The robot gives to it what its reactions give to the robot, with the other sign."""
    for axis in "xy":
        assert np.abs(rowed[0][f"force.{axis}"]).max() > 0.01
        np.testing.assert_allclose(rowed[0][f"force.{axis}"], -rowed[0][f"reaction.body.{axis}"], atol=1e-10)


def test_readings_are_those_of_the_results(rowed):
    found, data = rowed
    stations = np.flatnonzero(data["station_part"].values == "fin")
    expected = {
        "fin.tip.position.y": data["position"].values[:, stations[-1], 1],
        "fin.position.x": data["position"].values[:, stations[0], 0],
        "fin.velocity.x": data["velocity"].sel(part="fin", axis="x").values,
        "fin.heading": np.arctan2(*data["rotation"].values[:, stations[0], [1, 0], 0].T),
        "fin.angle": data["q"].sel(coordinate="fin.angle").values,
        "fin.angle.rate": data["v"].sel(coordinate="fin.angle").values,
        "reaction.arm.angle": data["reaction"].sel(prescribed="arm.angle").values,
    }
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, atol=1e-12, err_msg=name)


def test_surge_sway_and_heave_are_along_the_axes_of_the_body(rowed):
    """Of a level fin with the heading p: surge = v_x cos p + v_y sin p, sway = v_y cos p - v_x sin p."""
    found, data = rowed
    vx, vy, vz = (data["velocity"].sel(part="fin", axis=axis).values for axis in "xyz")
    c, s = np.cos(found["fin.heading"]), np.sin(found["fin.heading"])
    assert np.abs(found["fin.sway"]).max() > 0.1
    np.testing.assert_allclose(found["fin.surge"], vx * c + vy * s, atol=1e-12)
    np.testing.assert_allclose(found["fin.sway"], vy * c - vx * s, atol=1e-12)
    np.testing.assert_allclose(found["fin.heave"], vz, atol=1e-12)
    np.testing.assert_allclose(found["fin.tilt"], 0.0, atol=1e-7)


def test_a_saved_run_reads_as_the_run_itself(rowed, tmp_path):
    """Held values as they are; the rest of its robot, built again, at its coordinates."""
    save_dataset(rowed[1], tmp_path / "rowed.nc")
    saved = load_dataset(tmp_path / "rowed.nc")
    for name, values in rowed[0].items():
        np.testing.assert_allclose(reading(saved, name), values, rtol=1e-9, atol=1e-9, err_msg=name)


def test_a_saved_run_of_a_body_that_turns_freely_reads_as_the_run_itself(drifter):
    run = simulate(drifter, 0.2, samples=3)
    saved = run.to_dataset()
    for name in ("turn_rate", "heading", "body.tip.velocity.z", "body.tip.tilt", "body.bending_y.1", "heave"):
        np.testing.assert_allclose(reading(saved, name), reading(run, name), rtol=1e-8, atol=1e-10)


def test_what_is_no_run_is_said_to_be_none(as_users_run, rowed):
    data = rowed[1]
    for wrong, said in (
        (data.drop_vars("rotation"), "a dataset without rotation is given where a run is expected"),
        ("rower.nc", 'the text "rower.nc" is given where a run is expected'),
        (data.assign_attrs(robot=""), "this dataset does not tell its robot"),
    ):
        with pytest.raises(InputError, match=said):
            reading(wrong, "heading")
    followed = data.assign(command=("sample", [0.0]))
    assert reading(followed, "fin.velocity.x").size == 6
    with pytest.raises(InputError, match=r'"arm.angle" was not saved with this run'):
        reading(followed, "arm.angle")  # the controller moved it


def test_coordinates_tell_their_units(rowed, drifter):
    assert rowed[1]["coordinate_unit"].sel(coordinate="fin.angle") == "rad"
    data = simulate(drifter, 0.01, samples=3).to_dataset()
    units = dict(zip(data["coordinate"].values, data["coordinate_unit"].values, strict=True))
    assert (units["body.vx"], units["body.wz"], units["body.bending_y.0"]) == ("m", "rad", "rad")
    assert "strain times length" in data["coordinate"].attrs["comment"]


def test_a_heading_goes_on_beyond_half_a_turn():
    far = with_values(parse_robot(ROWER), {"limbs.arm.joint.motion.amplitude": 9.0})
    run = simulate(build(far), 0.25, samples=6)
    expected = 9.0 * np.sin(2 * np.pi * run.value.time)
    assert expected[-1] > 2 * np.pi
    np.testing.assert_allclose(reading(run, "arm.heading"), expected, rtol=1e-9, atol=1e-9)


def test_readings_tell_their_units(robot):
    assert {name: reading_of(robot, name).unit for name in NAMES} == NAMES


@pytest.mark.parametrize(
    "name", ["arm.anlge", "force.w", "reaction.fin.angle", "depth", "tip.position.x", "fin.x", "fin.climb", ""]
)
def test_what_cannot_be_read_is_told(robot, name):
    with pytest.raises(InputError):
        reading_of(robot, name)


def test_a_rod_is_read_at_its_marks_too():
    """A moment at the tip bends it to a circle of the curvature k = M / (E J): x = sin(k s)/k, -z = (1 - cos k s)/k."""
    rod = "{kind: rod, section: circle, length: 300 mm, radius: 5 mm, young: 1 MPa, density: 1000 kg/m3, points: 2,"
    rod += " strains: {bending_y: 0}, marks: [0.3], loads: {turn: {kind: force, force: [0 N, 0 N, 0 N],"
    rod += " moment: [0 N m, 2 mN m, 0 N m]}}}"
    found = static(build(parse_robot(f"name: arc\nwater: {{gravity: 0 m/s2}}\nbody: {rod}")))
    k = 2e-3 / (1e6 * np.pi / 4 * 5e-3**4)
    for place, s in (("0.3", 0.09), ("tip", 0.3)):
        assert reading(found, f"body.{place}.position.x")[0] == pytest.approx(np.sin(k * s) / k, rel=1e-9)
        assert reading(found, f"body.{place}.position.z")[0] == pytest.approx((np.cos(k * s) - 1) / k, rel=1e-9)
        assert reading(found, f"body.{place}.pitch")[0] == pytest.approx(-k * s, rel=1e-9)
    np.testing.assert_allclose(reading(found.to_dataset(), "body.0.3.pitch"), -k * 0.09, rtol=1e-9)
    with pytest.raises(InputError, match=r'"body.0.4.pitch" is nothing that can be measured'):
        reading_of(found.value.system, "body.0.4.pitch")
