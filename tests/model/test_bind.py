"""Descriptions become robots: by name, by file, by a vector of some of their quantities."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.description import dump_robot, get_value, parse_robot, with_values
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
    assert weight.shape == (len(description.parts),)


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
