"""Descriptions become robots: by name, by file, by a vector of some of their quantities."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.random_robots import random_robot, skew_mesh

from nectosome.description import RobotDescription, dump_robot, get_value, parse_robot, with_values
from nectosome.description.drives import servos
from nectosome.model import bind, build, instantiate, template_of
from nectosome.model.build import numeric_values
from nectosome.robots import describe, names
from nectosome.units import InputError


def assert_same(a, b, rtol=0.0):
    assert jax.tree.structure(a) == jax.tree.structure(b)
    for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True):
        np.testing.assert_allclose(x, y, rtol=rtol, atol=rtol * np.max(np.abs(y), initial=0))


@pytest.fixture(scope="module")
def flagellum():
    return describe("flagellum")


@pytest.fixture(scope="module")
def robot(flagellum):
    return build(flagellum)


def test_the_flagellum_has_the_masses_and_the_stiffness_of_its_table(robot):
    assert robot.coordinate_names[0] == "body.position"
    assert robot.prescribed_names == ("shaft.angle",)
    assert len(robot.coordinate_names) == 1 + 3 * 4
    r, tip = 0.0125, 0.00565
    cone = np.pi * 0.7 * (r**2 + r * tip + tip**2) / 3
    masses = [0.427, 0.059, 1062 * np.pi * r**2 * 0.05, 1062 * cone]
    np.testing.assert_allclose(robot.weight(), masses, rtol=1e-12)
    assert float(robot.added[0, 3, 3]) == 0.267
    filament = robot.tree.parts[robot.tree.part("filament")].body
    fourth = np.sum(r ** np.arange(5) * tip ** np.arange(4, -1, -1)) / 5  # mean of r^4 along the taper
    i = filament.names.index("bending_y.0")
    assert float(filament.stiffness[i, i]) == pytest.approx(7.4e6 * np.pi / 4 * fourth / 0.7, rel=1e-12)
    assert float(filament.damping[i, i]) == pytest.approx(9000 * np.pi / 4 * fourth / 0.7, rel=1e-12)


def test_theta0_builds_the_described_robot(flagellum, robot):
    theta0, from_theta = bind(flagellum, ("L", "E", "alpha", "omega", "tip_radius"))
    np.testing.assert_allclose(theta0, [0.7, 7.4e6, np.deg2rad(42.3), 14.4, 0.00565])
    assert_same(jax.jit(from_theta)(theta0), robot, rtol=1e-13)
    assert_same(from_theta(theta0), robot, rtol=1e-13)


def test_a_changed_vector_builds_the_changed_description(flagellum):
    paths = ("L", "E", "limbs.hook.loads.drag.lift", "limbs.shaft.mass")
    theta0, from_theta = bind(flagellum, paths)
    theta = theta0 * jnp.array([1.1, 0.5, -1.0, 2.0])
    changed = with_values(flagellum, dict(zip(paths, np.asarray(theta).tolist(), strict=True)))
    assert_same(jax.jit(from_theta)(theta), build(changed), rtol=1e-13)


def test_logarithms_and_ties(flagellum):
    """E enters as its logarithm, and the hook's radius is that of the filament's root."""
    paths = ("E", "limbs.filament.radius")
    theta0, from_theta = bind(flagellum, paths, log=("E",), tie={"limbs.hook.radius": "limbs.filament.radius"})
    np.testing.assert_allclose(theta0, [np.log(7.4e6), 0.0125], rtol=1e-15)
    wanted = {"E": 3e6, "limbs.filament.radius": 0.02, "limbs.hook.radius": 0.02}
    built = jax.jit(from_theta)(jnp.array([np.log(3e6), 0.02]))
    assert_same(built, build(with_values(flagellum, wanted)), rtol=1e-12)


def test_unknown_names_are_told(flagellum):
    with pytest.raises(InputError, match="there is no quantity called"):
        bind(flagellum, ("limbs.filament.yung",))
    with pytest.raises(InputError, match=r"there is no robot called \"flagelum\".*flagellum"):
        describe("flagelum")


@pytest.mark.parametrize("name", names())
def test_a_robot_that_ships_survives_its_file(name, tmp_path):
    description = describe(name)
    text = dump_robot(description)
    again = parse_robot(text)
    assert again == description
    assert dump_robot(again) == text
    file = tmp_path / "robot.yaml"
    file.write_text(text)
    assert describe(str(file)) == description
    for alias in description.aliases:
        assert np.isfinite(get_value(description, alias))


@pytest.mark.parametrize("name", names())
def test_no_quantity_of_a_robot_that_ships_is_looked_at_while_tracing(name):
    description = describe(name)
    template, theta = template_of(description, tuple(numeric_values(description)))
    assert theta.shape == (len(template.paths),)
    weight = jax.eval_shape(lambda theta: instantiate(template, theta).weight(), theta)
    assert weight.shape == (len(description.carriers),)


QUICK = ("flagellum", "beetle_free")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name not in QUICK)) for name in names()]
)
def test_every_quantity_of_a_robot_that_ships_can_be_bound(name):
    """All of them at once, those that are 0 as well."""
    description = describe(name)
    values = numeric_values(description)
    theta0, from_theta = bind(description, tuple(values))
    np.testing.assert_array_equal(theta0, [float(value) for value in values.values()])
    robot = from_theta(theta0)
    assert robot.description == description
    assert np.all(np.isfinite(robot.weight()))


NO_ARRAY = {
    "poisson": "bending and extension do not depend on it",
    "limits.torque": "results compare with it",
    "limits.speed": "results compare with it",
}
LARGE = ("beetle", "beetle_free", "octopus", "flagella4", "krill", "ray", "turtle")


def without_effect(description) -> list[str]:
    """Quantities whose numbers change no array of the robot."""
    template, theta = template_of(description, tuple(numeric_values(description)))
    arrays = jax.jit(lambda theta: [x for x in jax.tree.leaves(instantiate(template, theta)) if x.dtype == float])
    rng = np.random.default_rng(0)
    theta = np.where(theta == 0, 0.01, theta) * rng.uniform(0.97, 1.03, theta.shape)
    before = np.concatenate([np.ravel(x) for x in arrays(theta)])

    def changes(k: int) -> bool:
        after = np.concatenate([np.ravel(x) for x in arrays(theta * np.where(np.arange(theta.size) == k, 1.02, 1.0))])
        return not np.array_equal(before, after, equal_nan=True)

    def shared(path: str) -> str:
        """A ray takes the numbers of an envelope beside its place: of those of its row, or of its own."""
        owner, of_row = path.rpartition(".envelope.")[0], re.sub(r"_\d+(?=\.joint\.motion\.envelope)", "", path)
        return owner if of_row == path and f"{owner}.place" in template.paths else of_row

    row = {path: shared(path) for path in template.paths}
    without = [path for k, path in enumerate(template.paths) if not changes(k) and not path.endswith((*NO_ARRAY,))]
    known = {row[path] for path in {*template.paths} - {*without}}
    return [path for path in without if row[path] not in known]


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LARGE)) for name in names()])
def test_every_quantity_of_a_robot_that_ships_has_an_effect(name):
    assert without_effect(describe(name)) == []


HINGES = """
name: hinges
body: {kind: rigid, shape: box, length: 0.2 m, width: 0.1 m, height: 0.05 m, density: 900 kg/m3}
batteries: {pack: {voltage: 12 V, resistance: 0.1 ohm, energy: 9 kJ}}
limbs:
  gap: {kind: rigid, shape: capsule, length: 0.1 m, radius: 1 cm, density: 1 g/cm3, joint: {kind: revolute, axis: z,
    flexure: {gap: 5 mm, width: 2 cm, thickness: 1 mm, young: 2 GPa}}}
  known: {kind: rigid, shape: spheroid, length: 0.1 m, radius: 1 cm, mass: 9 g, joint: {kind: revolute, axis: z,
    flexure: {gap: 5 mm, width: 2 cm, stiffness: 0.3 N m/rad, young: 2 GPa}},
    loads: {water: {kind: given_added_mass, matrix: [[2, 0, 0, 0, 0, 0], [0, 2, 0, 0, 0, 0], [0, 0, 2, 0, 0, 0],
    [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]]}}}
  wheel: {kind: rigid, shape: point, mass: 0.1 kg, inertia: [1 g m2, 1 g m2, 1 g m2], joint: {kind: revolute, axis: z,
    motion: {kind: rate, rate: 3 rad/s}, servo: {model: NAME, battery: pack,
    velocity_loop: {full_voltage_at: 1 rad/s, integral_time: 0.1 s, schedule: [{at: 1 rad/s, factor: 2}]}}}}
  motor: {kind: rigid, shape: point, mass: 0.1 kg, inertia: [1 g m2, 1 g m2, 1 g m2], joint: {kind: revolute, axis: z,
    motor: {torque_constant: 0.02 N m/A, resistance: 1 ohm, supply: 6 V, duty_cycle: {kind: constant, value: 0.5}}}}
  slide: {kind: rigid, shape: point, mass: 0.1 kg, joint: {kind: prismatic, axis: x,
    motion: {kind: sine, amplitude: 1 cm, frequency: 1 Hz}}}
  ball: {kind: rigid, shape: point, mass: 0.1 kg, joint: {kind: spherical, motion: {yaw: {kind: constant,
    value: 0.1 rad}}}}
tendons:
  wound: {over: {gap: 1 cm}, stiffness: 1 kN/m, pulled_by: {part: wheel, radius: 1 cm}, friction: 0.1}
  turned: {over: {known: 1 cm}, stiffness: 1 kN/m, pulled_by: {part: motor, crank: 1 cm, guide: 3 cm}, slack: 1 mm}
"""

DECIDED = {
    "limbs.gap.joint.stiffness": r"limbs.gap.joint.flexure decides it. Take limbs.gap.joint.flexure.gap, ",
    "limbs.gap.joint.flexure.ratio": r"Take limbs.gap.joint.flexure.gap\.",
    "limbs.known.loads.water.inertia.1": r"limbs.known.loads.water.matrix decides it",
    "limbs.known.loads.water.matrix.4.2": r"Take limbs.known.loads.water.matrix.2.4\.",
    "limbs.known.bend": r"limbs.known.shape decides it",
    "limbs.wheel.joint.position": r"Take limbs.wheel.joint.motion.rate, limbs.wheel.joint.motion.start",
    "limbs.wheel.joint.servo.friction": r"Take limbs.wheel.joint.servo.no_load_current\.",
    "limbs.wheel.joint.servo.dead_band": r"Take limbs.wheel.joint.servo.velocity_loop.full_voltage_at",
    "limbs.motor.joint.motor.no_load_current": r"Take limbs.motor.joint.motor.friction\.",
    "limbs.slide.joint.velocity": r"limbs.slide.joint.motion decides it",
    "limbs.ball.joint.start.orientation.2": r"Take limbs.ball.joint.motion.yaw.value\.",
    "tendons.wound.pulled_by.angle": r"Take tendons.wound.pulled_by.radius\.",
    "limbs.known.density": "is left out here",
    "limbs.known.joint.flexure.thickness": "is left out here",
}


@pytest.fixture(scope="module")
def hinges():
    return parse_robot(HINGES.replace("NAME", next(iter(servos()))))


def test_every_quantity_of_hinges_has_an_effect(hinges):
    assert without_effect(hinges) == []


@pytest.mark.parametrize("seed", [6, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(7, 60))])
def test_every_quantity_of_a_random_robot_has_an_effect(seed: int):
    assert without_effect(random_robot(seed)) == []


@pytest.mark.parametrize("path", DECIDED)
def test_what_another_field_decides_is_refused_with_its_way_out(hinges, path):
    assert path not in numeric_values(hinges)
    for refused in (lambda: bind(hinges, (path,)), lambda: with_values(hinges, {path: 0.2})):
        with pytest.raises(InputError, match=DECIDED[path]) as error:
            refused()
        assert error.value.field == path
    if "decides" in DECIDED[path] or "Take" in DECIDED[path]:
        changed = HINGES.replace("NAME", next(iter(servos()))) + f"aliases: {{x: {path}}}"
        with pytest.raises(InputError, match=DECIDED[path]):
            parse_robot(changed)


def test_the_thickness_of_a_shell_of_known_mass_is_decided_by_that():
    """The number of it: that it is a shell places its matter along the surface."""
    mesh = skew_mesh().model_copy(update={"thickness": 1e-3})
    own = {"kind": "rigid", "shape": mesh, "joint": {"kind": "free"}}
    known, dense = (
        RobotDescription.model_validate({"name": "shell", "body": {**own, **more}})
        for more in ({"mass": 0.2}, {"density": 1200.0})
    )
    assert without_effect(known) == without_effect(dense) == []
    assert "body.shape.thickness" in numeric_values(dense)
    with pytest.raises(InputError, match=r"body\.mass decides it"):
        bind(known, ("body.shape.thickness",))


def test_a_robot_read_back_is_the_same_robot(flagellum, robot):
    assert_same(build(parse_robot(dump_robot(flagellum))), robot)


@pytest.mark.parametrize("shape", ["circle", "rectangle", "ellipse"])
def test_sections_of_a_described_rod(shape):
    """Full widths in the file, half widths in the robot, tapered evenly."""
    size = "radius: 10 mm" if shape == "circle" else "width: 20 mm\n  height: 8 mm\n  tip_height: 4 mm"
    part = build(parse_robot(ROD.format(shape=shape, size=size))).tree.one(0)
    s, rod = np.array(part.body.nodes), part.stations
    half_z = 0.01 + 0 * s if shape == "circle" else 0.004 - 0.002 * s
    np.testing.assert_allclose(rod.half_width, np.stack([0.01 + 0 * s, half_z], axis=-1), rtol=1e-14)
    area = {"circle": np.pi * 0.01 * half_z, "ellipse": np.pi * 0.01 * half_z, "rectangle": 4 * 0.01 * half_z}[shape]
    np.testing.assert_allclose(rod.volume, rod.weight * area, rtol=1e-13)


ROD = """
name: rod
body:
  kind: rod
  section: {shape}
  {size}
  length: 0.5 m
  young: 1 MPa
  density: 1000 kg/m3
  strains: {{bending_y: 0}}
  points: 3
"""
