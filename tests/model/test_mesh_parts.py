"""Robots with parts that are meshes: masses, places, floating, falling, as the same shapes without one."""

import math
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import nectosome as ns
from nectosome.description import RobotDescription, dump_robot, load_robot, parse_robot
from nectosome.description.plausible import meaningless
from nectosome.geometry import mesh_numbers, simplified
from nectosome.loads.buoyancy import raised
from nectosome.mechanism import Robot
from nectosome.mechanism.shapes import meshes
from nectosome.model import bind, build
from nectosome.solve import floating, righting_curve
from nectosome.units import InputError

LENGTH, RADIUS, CORNERS = 0.3, 0.02, 128
# a regular polygon has less area than its circle
AREA = 0.5 * CORNERS * RADIUS**2 * math.sin(2 * math.pi / CORNERS)


def text(shape: str, more: str = "", water: str = "") -> str:
    return f"""
name: part
water: {{gravity: 9.81 m/s2{water}}}
body:
  kind: rigid
  {shape}
  density: 1200 kg/m3
  joint: {{kind: free}}
  strips: 6
  {more}
"""


def along_x(away: tuple[float, float, float] = (0.5 * LENGTH, 0, 0)) -> trimesh.Trimesh:
    mesh = trimesh.creation.cylinder(RADIUS, LENGTH, sections=CORNERS)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.5 * np.pi, [0, 1, 0]))
    return mesh.apply_translation(away)


def described(folder: Path, mesh: trimesh.Trimesh, shape: str = "unit: m", **options: str) -> RobotDescription:
    mesh.export(folder / "part.stl")
    (folder / "part.yaml").write_text(text(f"shape: {{mesh: part.stl, {shape}}}", **options))
    return load_robot(folder / "part.yaml")


def inertia(robot: Robot) -> np.ndarray:
    return np.asarray(robot.inertia[0])


CYLINDER = f"shape: cylinder\n  length: {LENGTH} m\n  radius: {math.sqrt(AREA / math.pi)} m"


def test_a_mesh_of_a_cylinder_is_a_cylinder(tmp_path):
    """Of the same area; its polar moment is less by 2 (pi/n)^4/15 or so, which is below single precision."""
    mesh, exact = build(described(tmp_path, along_x())), build(parse_robot(text(CYLINDER)))
    assert inertia(mesh) == pytest.approx(inertia(exact), rel=1e-6, abs=1e-9)
    assert float(mesh.body_length) == pytest.approx(LENGTH, rel=1e-6)
    assert np.sum(mesh.tree.stations.volume) == pytest.approx(LENGTH * AREA, rel=1e-6)


LOADS = """
  loads:
    drag: {kind: drag, normal: 1.1, tangential: 0.05}
    water: {kind: added_mass, normal: 1}
    friction: {kind: skin_friction}
""".strip()


def test_a_mesh_falls_as_the_shape_does(tmp_path):
    """Strips of a mesh are as wide as it is: corners of a polygon lie outside of the circle with its area."""
    turned = LOADS + "\n  rotation: [0 deg, 40 deg, 0 deg]"
    runs = [
        ns.simulate(robot, time="0.4 s").to_dataset()
        for robot in (described(tmp_path, along_x(), more=turned), parse_robot(text(CYLINDER, turned)))
    ]
    away = [run["position"].values[-1, 0] - run["position"].values[0, 0] for run in runs]
    assert np.linalg.norm(away[1]) > 0.05
    assert away[0] == pytest.approx(away[1], abs=2e-3 * np.linalg.norm(away[1]))
    assert float(np.abs(runs[0]["power_balance"]).max()) < 1e-6


def test_a_mesh_sinks_in_honey_as_the_shape_does(tmp_path):
    """Viscous drag by strips: broadside, and slanting by the ratio of both coefficients."""
    more = "\n  ".join(
        [
            "rotation: [0 deg, 40 deg, 0 deg]",
            "loads: {drag: {kind: stokes_drag, coefficients: gray_hancock, wavelength: 0.6 m}}",
        ]
    )
    water = ", viscosity: 50 Pa s, density: 1400 kg/m3"
    heavy = lambda robot: robot.with_part("body", density=2000.0)  # noqa: E731
    runs = [
        ns.simulate(heavy(robot), time="2 s").to_dataset()["position"].values[:, 0]
        for robot in (described(tmp_path, along_x(), more=more, water=water), parse_robot(text(CYLINDER, more, water)))
    ]
    away = [places[-1] - places[0] for places in runs]
    assert abs(away[1][0]) > 0.1 * abs(away[1][2]) > 1e-3
    assert away[0] == pytest.approx(away[1], rel=2e-3, abs=1e-6)


def test_a_foil_with_its_own_chord_is_on_a_mesh_what_it_is_on_a_box(tmp_path):
    """Its places are seen from the centre of the shape; its span is the part's extent where it is left out."""
    mesh = trimesh.creation.box((0.3, 0.06, 0.01)).apply_translation([0.15, 0, 0])
    box = "shape: box\n  length: 0.3 m\n  width: 60 mm\n  height: 10 mm"
    foil = "{kind: foil, span_along: x, ahead: y, chord: [80 mm, 40 mm], leading_edge: [40 mm, 10 mm]}"
    more = f"loads: {{lift: {foil}}}\n  rotation: [25 deg, 10 deg, 0 deg]"
    places = [
        ns.simulate(robot, time="0.5 s").to_dataset()["position"].values[:, 0]
        for robot in (described(tmp_path, mesh, more=more), parse_robot(text(box, more)))
    ]
    assert np.ptp(places[1], axis=0).max() > 0.03
    assert places[0] == pytest.approx(places[1], abs=1e-6)


@pytest.mark.parametrize(
    ("load", "field", "instead"),
    [
        (
            "kind: plate_drag, normal: 2",
            "kind",
            r"make a flat part a plate by the section of its mesh: shape: {section_of",
        ),
        ("kind: trailing_edge", "kind", r"A mesh has no tip: give the load to a box or a cylinder that ends the tail"),
        ("kind: spheroid_added_mass", "kind", r"acts on spheroid, not on a mesh\. Take mesh_added_mass\."),
        ("kind: cylinder_added_mass", "kind", r"Take mesh_added_mass, or added_mass by strips\."),
        ("kind: foil, span_along: x, ahead: y", "chord", r"Give it, or take the section of the mesh as a plate"),
        (
            "kind: stokes_drag, coefficients: gray_hancock, wavelength: 40 mm",
            "wavelength",
            r"must be more than 44\.8\d* mm where the radius is 20 mm",
        ),
    ],
)
def test_a_load_that_does_not_fit_a_mesh_says_what_to_take_instead(tmp_path, load, field, instead):
    with pytest.raises(InputError, match=instead) as caught:
        described(tmp_path, along_x(), more=f"loads: {{it: {{{load}}}}}")
    assert caught.value.field == f"body.loads.it.{field}"


def test_a_mesh_floats_as_the_shape_does(tmp_path):
    """A box whose strips are boxes: at any tilt the same water, and 60 % of it under the surface at 600 kg/m3."""
    more, surface = "offset: [0 m, 0 m, -4 mm]", ", surface: 0 m"
    box = "shape: box\n  length: 0.3 m\n  width: 60 mm\n  height: 40 mm"
    mesh = trimesh.creation.box((0.3, 0.06, 0.04)).apply_translation([0.15, 0, 0])
    both = described(tmp_path, mesh, more=more, water=surface), parse_robot(text(box, more, surface))
    no = 1e-30  # rad: zeros would be other structures
    for tilt in ((no, no, no), (0.4, no, no), (no, 0.1, no), (0.3, -0.2, 0.5)):
        robots = [build(robot.with_part("body", density=600.0, rotation=tilt)) for robot in both]
        begins = [ns.simulate(robot, time="1 ms").to_dataset().isel(time=0) for robot in robots]
        forces = [run["load_force"].sum("part").values for run in begins]
        assert forces[0] == pytest.approx(forces[1], rel=1e-6, abs=1e-6)
        assert begins[0]["a"].values == pytest.approx(begins[1]["a"].values, rel=1e-5, abs=1e-5)
        if tilt == (no, no, no):
            assert forces[0].sum(axis=0) == pytest.approx(0.0, abs=1e-5)


def test_inertia_turns_and_moves_with_the_mesh(tmp_path):
    mesh = trimesh.creation.box((0.3, 0.04, 0.05))
    mesh.vertices[:, 1] += 0.3 * mesh.vertices[:, 0]
    before = build(described(tmp_path, mesh))
    R, p = Rotation.from_euler("xyz", [20, -35, 70], degrees=True).as_matrix(), np.array([0.2, -0.1, 0.05])
    mesh.vertices = mesh.vertices @ R.T + p
    after = build(described(tmp_path, mesh))
    both = np.kron(np.eye(2), R)
    assert inertia(after) == pytest.approx(both @ inertia(before) @ both.T, rel=1e-5, abs=1e-9)
    centre = np.asarray(after.tree.link_stations[0, :, 3])
    assert centre == pytest.approx(R @ np.asarray(before.tree.link_stations[0, :, 3]) + p, abs=1e-7)


def test_length_is_that_of_the_mesh_wherever_it_lies_in_its_frame(tmp_path):
    for away in ((0.15, 0, 0), (7.0, -3.0, 2.0)):
        assert float(build(described(tmp_path, along_x(away))).body_length) == pytest.approx(LENGTH, rel=1e-5)


def test_limbs_and_forces_sit_in_the_coordinates_of_the_mesh(tmp_path):
    limb = """
limbs:
  ball: {kind: rigid, shape: spheroid, length: 20 mm, radius: 10 mm, mass: 1 g, at: AT, offset: [0.6 m, 0.1 m, 0.2 m]}
"""
    for at in ("tip", "root"):
        robot = described(tmp_path, along_x((0.5, 0.1, 0)), more=limb.replace("AT", at))
        run = ns.simulate(robot, time="1 ms").to_dataset()
        first = run["position"].isel(time=0).values
        assert first[0] == pytest.approx([0.5, 0.1, 0], abs=1e-7)
        assert first[-1] == pytest.approx([0.61, 0.1, 0.2], abs=1e-7)  # 10 mm on: its centre


def test_a_shell_has_the_inertia_of_a_shell(tmp_path):
    """A thin sphere: m = rho A t, I = 2/3 m r^2, within the 0.05 % that an inscribed one of 20480 triangles lacks."""
    r, t = 0.05, 1e-3
    ball = trimesh.creation.icosphere(5, radius=r)
    found = inertia(build(described(tmp_path, ball, "unit: m, thickness: 1 mm")))
    mass = 1200 * 4 * math.pi * r * r * t
    assert found[3, 3] == pytest.approx(mass, rel=1e-3)
    assert found[:3, :3] == pytest.approx(2 / 3 * mass * r * r * np.eye(3), rel=1e-3, abs=1e-9)


def test_a_cavity_weighs_nothing_and_moves_the_centre_of_mass(tmp_path):
    outer, hollow = trimesh.creation.box((0.1, 0.04, 0.05)), trimesh.creation.box((0.08, 0.02, 0.03))
    hollow.apply_translation([0.005, 0, 0]).invert()
    robot = build(described(tmp_path, trimesh.util.concatenate([outer, hollow])))
    assert inertia(robot)[3, 3] == pytest.approx(1200 * 1.52e-4, rel=1e-6)
    assert np.sum(robot.tree.stations.volume) == pytest.approx(2e-4, rel=1e-6)
    moment, away = inertia(robot)[:3, 3:], -5e-3 * 0.48 / 1.52
    assert moment == pytest.approx(1200 * 1.52e-4 * np.array([[0, 0, 0], [0, 0, -away], [0, away, 0]]), abs=1e-8)


def test_what_the_description_gives_comes_before_the_mesh(tmp_path):
    whole = described(tmp_path, along_x())
    by_mass = build(whole.with_part("body", density=None, mass=2.0))
    assert inertia(by_mass) == pytest.approx(inertia(build(whole)) * 2 / (1200 * LENGTH * AREA), rel=1e-6, abs=1e-12)
    given = build(
        whole.with_part("body", inertia=(1.0, 2.0, 2.5), products=(0.1, 0.2, 0.3), centre_of_mass=(0.0, 0.0, 0.0))
    )
    expected = [[1, 0.1, 0.2], [0.1, 2, 0.3], [0.2, 0.3, 2.5]]
    assert inertia(given)[:3, :3] == pytest.approx(np.array(expected), rel=1e-12)
    assert np.sum(build(whole.with_part("body", volume=1e-4)).tree.stations.volume) == pytest.approx(1e-4, rel=1e-12)


def test_density_thickness_and_mass_are_traced(tmp_path):
    robot = described(tmp_path, along_x(), "unit: m, thickness: 1 mm")
    theta, make = bind(robot, ("body.density", "body.shape.thickness"))
    mass = jax.jit(lambda theta: make(theta).inertia[0, 3, 3])
    density, thickness = jax.jit(jax.grad(mass))(theta)
    assert float(density) == pytest.approx(float(mass(theta)) / 1200, rel=1e-12)
    assert float(thickness) == pytest.approx(float(mass(theta)) / 1e-3, rel=1e-12)


def test_a_saved_run_opens_without_the_mesh(tmp_path):
    from nectosome.view.display.bodies import bodies_of
    from nectosome.view.saved import saved_run

    robot = described(tmp_path, along_x())
    ns.save_dataset(ns.simulate(robot, time="10 ms").to_dataset(), tmp_path / "run.nc")
    (tmp_path / "part.stl").unlink()
    run = saved_run(ns.load_dataset(tmp_path / "run.nc"), "run.nc")
    again = parse_robot(run.attrs["robot"])
    assert dump_robot(again) == dump_robot(robot)
    (body,) = bodies_of(run, again).values()
    assert np.ptp(body.vertices, axis=0) == pytest.approx([LENGTH, 2 * RADIUS, 2 * RADIUS], rel=0.01)
    middle = 0.5 * (body.corners(0).min(axis=0) + body.corners(0).max(axis=0))
    assert middle == pytest.approx([0.5 * LENGTH, 0, 0], abs=2e-4)


def test_a_floating_mesh_keeps_its_energy(tmp_path):
    """Kinetic energy, m g z and the energy rho g E of the raised water, while it bobs and rolls in and out of it."""
    more = "offset: [0 m, 0 m, 10 mm]\n  rotation: [40 deg, 20 deg, 0 deg]"
    wedge = trimesh.creation.box((0.3, 0.1, 0.06))
    wedge.vertices[:, 1:] *= np.where(wedge.vertices[:, :1] > 0, 0.4, 1.0)
    robot = build(described(tmp_path, wedge, more=more, water=", surface: 0 m").with_part("body", density=450.0))
    run = ns.simulate(robot, time="1.5 s", samples=61, rtol=1e-10, atol=1e-12, method="explicit")
    corners, data = robot.load_groups.on_bodies[1].load.corners[0], run.to_dataset()
    place, turn = data["position"].values[:, 0], data["rotation"].values[:, 0]
    mass, water = inertia(robot), 1000 * 9.81
    raise_ = jax.jit(raised)
    stored = [
        water * float(raise_(corners, jnp.asarray(-p[2]), jnp.asarray(R[2]))) for p, R in zip(place, turn, strict=True)
    ]
    v = np.asarray(run.value.state.v)
    moving = 0.5 * np.einsum("ti,ij,tj->t", v, _at_root(robot, mass), v)
    high = place[:, 2] + turn[:, 2] @ _centre(mass)
    energy = moving + mass[3, 3] * 9.81 * high + np.array(stored)
    assert np.ptp(moving) > 0.05 * np.ptp(stored) > 0
    assert energy == pytest.approx(energy[0], abs=1e-7 * np.ptp(stored))


def wigley(path: Path) -> float:
    """Write a Wigley hull, 2.5 x 0.25 x 0.156 m, with upright sides of 94 mm over its water line, and return BM.

    y = B/2 (1 - (2 x/L)^2)(1 - (z/T)^2): V = 4/9 L B T with its centre 5/8 T up from the keel,
    I = 2/3 (B/2)^3 L 16/35.
    """
    L, B, T = 2.5, 0.25, 0.156
    z = np.append(np.linspace(-T, 0, 21), np.linspace(0, 0.094, 9)[1:])
    x, z = np.meshgrid(np.linspace(-L / 2, L / 2, 61), z, indexing="ij")
    y = B / 2 * (1 - (2 * x / L) ** 2) * (1 - np.minimum(z / T, 0) ** 2)
    port, starboard = np.stack([x, y, z], axis=-1), np.stack([x, -y, z], axis=-1)
    deck = np.stack([port[:, -1], starboard[:, -1]], axis=1)
    faces = []
    for side in (port, starboard[:, ::-1], deck):
        a, b, c, d = side[:-1, :-1], side[:-1, 1:], side[1:, 1:], side[1:, :-1]
        faces += [np.stack([a, b, c], axis=-2).reshape(-1, 3, 3), np.stack([a, c, d], axis=-2).reshape(-1, 3, 3)]
    corners = np.concatenate(faces)
    trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)).export(path)
    return 2 / 3 * (B / 2) ** 3 * L * 16 / 35 / (4 / 9 * L * B * T)


def test_a_hull_with_a_small_margin_floats_by_all_of_its_triangles(tmp_path):
    """Wigley's, GM 5.69 mm of BM 34.3 mm; arms of a wall-sided hull, sin(phi) (GM + BM/2 tan(phi)^2), about so."""
    bm, mass = wigley(tmp_path / "hull.stl"), 1000 * 4 / 9 * 2.5 * 0.25 * 0.156
    (tmp_path / "hull.yaml").write_text(
        "name: hull\nwater: {density: 1000 kg/m3, surface: 0 m}\n"
        f"body: {{kind: rigid, shape: {{mesh: hull.stl, unit: m}}, mass: {mass} kg, joint: {{kind: free}}}}\n"
    )
    described = load_robot(tmp_path / "hull.yaml")
    height = described.body.shape.numbers.centre[2]
    low = -0.156 * 3 / 8 + bm - 0.00569 - height
    robot = build(described.with_part("body", centre_of_mass=(0.0, 0.0, low)))
    found = floating(robot)
    assert float(found.metacentric_heights[0]) == pytest.approx(0.00569, rel=0.01)
    assert float(found.draught) == pytest.approx(0.156, rel=0.002)
    assert abs(float(found.heel)) < np.radians(1e-3)
    heels = np.radians([2.0, -2.0])
    arms = righting_curve(robot, found, heels)
    assert arms == pytest.approx(np.sin(heels) * (0.00569 + bm / 2 * np.tan(heels) ** 2), rel=0.015)


def test_a_thin_plate_floats_by_the_surface_that_is_kept_of_it(tmp_path):
    """By all of its 3072 triangles."""
    found = floating(build(described(tmp_path, plate(), water=", surface: 0 m").with_part("body", density=250.0)))
    assert float(found.draught) == pytest.approx(1e-3, rel=1e-3)
    assert float(found.waterplane) == pytest.approx(0.06, rel=1e-3)
    assert float(found.metacentric_heights[0]) == pytest.approx(0.2**2 / 12e-3 - 1.5e-3, rel=3e-3)


def test_boxes_stand_for_a_surface_that_lost_its_walls(tmp_path):
    """They are exact for a box along x."""
    boxes = meshes._boxes(described(tmp_path, plate()).parts["body"].shape)
    assert boxes.volume == pytest.approx(0.3 * 0.2 * 0.004, rel=1e-6)
    np.testing.assert_allclose(boxes.bounds, [[-0.15, -0.1, -0.002], [0.15, 0.1, 0.002]], rtol=1e-5)


def test_it_is_said_where_boxes_stand_for_a_surface_that_lost_its_walls(tmp_path, monkeypatch):
    """500 triangles do not keep the walls of 1 mm of a tube of 200 mm apart."""
    monkeypatch.setattr(mesh_numbers, "simplified", lambda surface: simplified(surface, 500))
    tube = trimesh.creation.annulus(0.099, 0.1, 0.2, sections=64).subdivide().subdivide()
    path, told = next(iter(meaningless(described(tmp_path, tube))))
    assert path == "body.shape"
    assert "at the water's surface buoyancy is that of 60 boxes across x" in told


def plate():
    found = trimesh.creation.box((0.3, 0.2, 0.004))
    for _ in range(4):
        found = found.subdivide()
    return found


def _centre(mass: np.ndarray) -> np.ndarray:
    moment = mass[:3, 3:] / mass[3, 3]
    return np.array([moment[2, 1], moment[0, 2], moment[1, 0]])


def _at_root(robot: Robot, mass: np.ndarray) -> np.ndarray:
    """Inertia about the origin of the mesh, of which the velocities of its joint are."""
    x, y, z = np.asarray(robot.tree.link_stations[0, :, 3])
    shift = np.block([[np.eye(3), np.zeros((3, 3))], [-np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.eye(3)]])
    return shift.T @ mass @ shift
