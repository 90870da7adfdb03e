"""What every shape of rigid parts promises, held against all there is; a new one without an example fails."""

import math
from pathlib import Path
from xml.etree import ElementTree as ET

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
import trimesh
from scipy.integrate import quad

from nectosome.core import Water
from nectosome.description import Rigid, RobotDescription, parse_robot
from nectosome.description.robot_file import validate
from nectosome.description.shapes import shape_forms
from nectosome.export.mjcf import mjcf_of
from nectosome.export.urdf import urdf_of
from nectosome.geometry import Triangles
from nectosome.io.yaml_text import read_yaml
from nectosome.mechanism.shapes import RigidShape, shape_of
from nectosome.model import build
from nectosome.solve import floating
from nectosome.units import InputError
from nectosome.view.tubes import TubeStations, look_of, rings_of, triangles

L, R, DENSITY, AROUND = 0.3, 0.04, 700.0, 240  # so many that rings of uneven ends have its centre
EXAMPLES = {
    "box": "shape: box, length: 0.3 m, width: 80 mm, height: 50 mm",
    "capsule": "shape: capsule, length: 0.3 m, radius: 40 mm",
    "cylinder": "shape: cylinder, length: 0.3 m, radius: 40 mm",
    "mesh": "shape: {mesh: box.stl, unit: mm}",
    "plate": "shape: {outline: [[0 mm, 0 mm], [90 mm, 10 mm], [60 mm, 40 mm]], thickness: 3 mm}",
    "spheroid": "shape: spheroid, length: 0.3 m, radius: 40 mm",
}
FORMS = sorted(EXAMPLES)
SIZED = [form for form in FORMS if form not in ("mesh", "plate")]
PULL = "loads: {pull: {kind: distributed_force, force: [0 N/m, 0 N/m, 1 N/m]}}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("shapes")
    trimesh.creation.box((200.0, 90.0, 40.0)).apply_translation((30.0, 20.0, 0.0)).export(folder / "box.stl")
    return folder


def robot_of(form: str, folder: Path) -> RobotDescription:
    data, _ = read_yaml(f"{{name: a, body: {{kind: rigid, {EXAMPLES[form]}, density: {DENSITY} kg/m3, {PULL}}}}}", "a")
    return validate(data, folder=folder)


def part_of(form: str, folder: Path) -> Rigid:
    body = robot_of(form, folder).body
    assert isinstance(body, Rigid)
    return body


def water(surface: float | None = None) -> Water:
    return Water(jnp.asarray(1000.0), jnp.asarray(9.81), None if surface is None else jnp.asarray(surface))


def drawn(robot: RobotDescription, shape: RigidShape) -> Triangles:
    """The surface of its pictures, about its centre."""
    look = look_of(robot, "body")
    if look.surface is not None:
        return look.surface
    link, stations = shape.built(water())
    x, half, place, turn = (np.asarray(a) for a in (stations.x, stations.half_width, link.position, link.rotation))
    (rings,) = rings_of(TubeStations(x, half, place[None], turn[None], np.arange(len(x))), look, AROUND)
    return Triangles(rings.reshape(-1, 3) - place[0], triangles(len(rings), AROUND))


def test_every_shape_has_an_example():
    assert {*EXAMPLES, "point"} == shape_forms().keys()


@pytest.mark.parametrize("form", FORMS)
def test_a_picture_encloses_what_a_part_weighs(form: str, folder: Path):
    """Its volume, the centre of it, and the inertia about that at an even density."""
    robot, shape = robot_of(form, folder), shape_of(part_of(form, folder))
    size, centre, inertia = drawn(robot, shape).solid
    mass, own = shape.mass_and_inertia()
    assert size == pytest.approx(float(shape.volume), rel=2e-3)
    assert float(mass) == pytest.approx(DENSITY * float(shape.volume))
    np.testing.assert_allclose(centre, 0, atol=1e-6)
    np.testing.assert_allclose(DENSITY * inertia, own[:3, :3], rtol=4e-3, atol=1e-9)


@pytest.mark.parametrize("surface", [None, 0.0])
@pytest.mark.parametrize("form", FORMS)
def test_stations_displace_the_volume_of_the_part_about_its_centre(form: str, surface: float | None, folder: Path):
    part = part_of(form, folder)
    for volume in (float(shape_of(part).volume), 1e-3):
        link, stations = shape_of(part.model_copy(update={"volume": volume})).built(water(surface))
        assert float(jnp.sum(stations.volume)) == pytest.approx(volume, rel=1e-12)
        centre = jnp.sum(stations.volume[:, None] * link.position, axis=0) / volume
        np.testing.assert_allclose(centre, link.position[0], atol=1e-3)


@pytest.mark.parametrize("form", SIZED)
def test_what_it_weighs_has_derivatives_by_its_sizes(form: str, folder: Path):
    part = part_of(form, folder)
    sizes = {name: getattr(part, name) for name in part.own_shape.sizes}

    def inertia(values: jax.Array):
        return shape_of(part.model_copy(update=dict(zip(sizes, values, strict=True)))).mass_and_inertia()[1]

    at = jnp.array([*sizes.values()])
    for k in range(len(sizes)):
        step = 1e-6 * jnp.eye(len(sizes))[k]
        slope = (inertia(at + step) - inertia(at - step)) / 2e-6
        np.testing.assert_allclose(jax.jacfwd(inertia)(at)[..., k], slope, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_a_mirror_image_weighs_the_same_on_the_other_side(form: str, folder: Path):
    part, flip = part_of(form, folder), np.diag([1.0, -1.0, 1.0])
    mass, inertia = shape_of(part).mass_and_inertia()
    other, image = shape_of(part.image()).mass_and_inertia()
    assert float(other) == pytest.approx(float(mass))
    np.testing.assert_allclose(image[:3, :3], flip @ inertia[:3, :3] @ flip, atol=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_solids_of_other_programs_have_its_volume_or_are_boxes_around_it(form: str, folder: Path):
    shape = shape_of(part_of(form, folder))
    (solid,) = shape.solids()
    a, b, c = solid.half
    ball, tube = 4 / 3 * np.pi * a * b * c, 2 * np.pi * a * b * c
    own = {"box": 8 * a * b * c, "mesh": 8 * a * b * c, "ellipsoid": ball, "cylinder": tube}
    own["capsule"] = 2 * np.pi * a * b * (c - a) + 4 / 3 * np.pi * a**3
    least = float(shape.volume)
    assert own[solid.kind] == pytest.approx(least) if form in SIZED else own[solid.kind] >= least * (1 - 1e-6)


CAPSULE = f"""
name: hull
water: {{surface: 0 m}}
body:
  kind: rigid
  shape: capsule
  length: {L} m
  radius: {R} m
  density: 500 kg/m3
  strips: 40
  loads: {{water: {{kind: added_mass, normal: 1}}}}
  joint: {{kind: free, start: {{position: [0 m, 0 m, 5 mm]}}}}
"""


def radius(x: float) -> float:
    beyond = max(abs(x - L / 2) - (L / 2 - R), 0.0)
    return math.sqrt(R**2 - beyond**2)


def integral(of) -> float:
    return quad(lambda x: of(x, radius(x)), 0, L, points=[R, L - R], epsabs=1e-16, epsrel=1e-12)[0]


def test_a_capsule_is_a_cylinder_with_half_spheres(folder: Path):
    """Against quadrature over its sections, discs about the middle."""
    shape = shape_of(part_of("capsule", folder))
    volume = integral(lambda x, r: np.pi * r**2)
    assert float(shape.volume) == pytest.approx(volume, rel=1e-10)
    assert float(shape.volume) == pytest.approx(np.pi * R**2 * (L - 2 * R) + 4 / 3 * np.pi * R**3, rel=1e-12)
    along = integral(lambda x, r: np.pi * r**4 / 2)
    across = integral(lambda x, r: np.pi * r**4 / 4 + np.pi * r**2 * (x - L / 2) ** 2)
    own, place = shape.own_inertia(jnp.asarray(volume))
    np.testing.assert_allclose(own, np.diag([along, across, across]), rtol=1e-9)
    np.testing.assert_allclose(place, 0)
    places, radii = shape.spheres(np.array([0.0, 1.0]))
    np.testing.assert_allclose(places[:, 0] + np.array([-1, 1]) * radii, [0, L], atol=1e-15)


def test_a_capsule_floats_and_carries_water():
    """Half as heavy as water it lies half in; strips of added mass 1 carry what it displaces, across."""
    robot = build(parse_robot(CAPSULE))
    found = floating(robot)
    assert float(found.draught) == pytest.approx(R, rel=1e-6)
    assert float(found.waterplane) == pytest.approx(np.pi * R**2 + 2 * R * (L - 2 * R), rel=0.01)
    displaced = 1000 * float(robot.tree.stations.volume.sum())
    carried = np.asarray(robot.added).sum(axis=0)
    np.testing.assert_allclose(np.diag(carried)[3:], [0, displaced, displaced], rtol=2e-3)


def test_other_programs_get_a_capsule():
    """MuJoCo knows capsules; URDF does not: a cylinder and two spheres."""
    described = parse_robot(CAPSULE.replace("added_mass, normal: 1", "drag, normal: 1"))
    robot = build(described)
    model = mujoco.MjModel.from_xml_string(ET.tostring(mjcf_of(robot, described).root, encoding="unicode"))
    kind, size = next((k, s) for k, s in zip(model.geom_type, model.geom_size, strict=True) if s[0] > 0.01)
    assert kind == mujoco.mjtGeom.mjGEOM_CAPSULE
    np.testing.assert_allclose(size[:2], [R, L / 2 - R])
    root = ET.fromstring(urdf_of(robot, described).text)
    shapes = [(g[0].tag, *map(float, g[0].attrib.values())) for g in root.iterfind(".//collision/geometry")]
    assert shapes == [("cylinder", R, pytest.approx(L - 2 * R)), ("sphere", R), ("sphere", R)]
    middles = [float(o.attrib["xyz"].split()[0]) for o in root.iterfind(".//collision/origin")]
    assert middles == pytest.approx([L / 2, R, L - R])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("length: 70 mm", "body.length: must be more than 80 mm, twice the radius"),
        ("width: 70 mm, length: 0.3 m", "body.width: a capsule has no width, it needs only length and radius."),
        ("bend: 5 deg, length: 0.3 m", "body.bend: a capsule has no bend"),
    ],
)
def test_a_wrong_capsule_is_told_by_its_field(given: str, says: str):
    with pytest.raises(InputError) as error:
        parse_robot(f"{{name: a, body: {{kind: rigid, shape: capsule, radius: 40 mm, mass: 1 kg, {given}}}}}")
    assert says in str(error.value)
