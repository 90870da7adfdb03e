"""Designs of robots at rest in the water: quantities in closed form, derivatives, the example that is trimmed."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from tests.geometry import closed_surfaces as made

from nectosome.description import load_robot, parse_robot
from nectosome.designs import Problem, design
from nectosome.model import build
from nectosome.solve import floating
from nectosome.units import InputError

EXAMPLE = Path(__file__).parents[2] / "examples" / "trimmed_hull"
RHO, G, L, B, H = 1000.0, 9.81, 2.0, 0.8, 0.5
BOX = f"""
name: box
water: {{density: {RHO} kg/m3, gravity: {G} m/s2SURFACE}}
body:
  {{kind: rigid, shape: box, length: {L} m, width: {B} m, height: {H} m, mass: 320 kg,
   centre_of_mass: [0.02 m, 0.01 m, -0.1 m], joint: JOINT}}
limbs:
  lead: {{kind: rigid, shape: point, mass: 1 kg, volume: 0 m3, at: root, offset: [1.02 m, 0.01 m, -0.1 m]}}
"""
VARY = {"body.mass": "300..340 kg", "limbs.lead.offset.0": "0.5..1.5 m", "limbs.lead.mass": "0.5..20 kg"}
ALL = ("net_weight", "trim", "heel", "metacentric_height", "righting_moment")


def box(surface=True, joint="{kind: free}"):
    return parse_robot(BOX.replace("SURFACE", ", surface: 0 m" * surface).replace("JOINT", joint))


def mesh(folder):
    """The same at the surface, of triangles."""
    sides = made.box(L, B, H)
    trimesh.Trimesh(sides.vertices, sides.faces, process=False).export(folder / "hull.stl")
    shape = "shape: {mesh: hull.stl, unit: m}"
    text = BOX.replace(f"shape: box, length: {L} m, width: {B} m, height: {H} m", shape)
    (folder / "box.yaml").write_text(text.replace("SURFACE", ", surface: 0 m").replace("JOINT", "{kind: free}"))
    return load_robot(folder / "box.yaml")


def task(robot, *names):
    limits = [f"{name} >= -10 {unit}" for name, unit in _UNITS.items() if name in names]
    return Problem().changed(robot, vary=VARY, maximise=names[0], keep=limits).task(robot)


_UNITS = {"net_weight": "N", "draught": "m", "trim": "rad", "heel": "rad"}
_UNITS |= {"metacentric_height": "m", "righting_moment": "N m"}


@pytest.mark.parametrize("joint", ["{kind: free}", "{kind: fixed}"])
def test_a_box_under_water_has_the_closed_forms(joint):
    """The uplift rho g V at BG over the weight; turned by its own heel and trim, which are held."""
    u = np.array([0.5, 0.52, 0.5 / 19.5])  # the lead where the centre of mass is, of 1 kg
    found = task(box(surface=False, joint=joint), *ALL).prepare()(u, False, None).outputs
    uplift, weight = RHO * G * L * B * H, 321 * G
    assert found["net_weight"] == pytest.approx(weight - uplift, rel=1e-12)
    assert found["trim"] == pytest.approx(-np.arctan2(0.02, np.hypot(0.01, 0.1)), rel=1e-9)
    assert found["heel"] == pytest.approx(-np.arctan2(0.01, 0.1), rel=1e-9)
    bg = np.sqrt(0.02**2 + 0.01**2 + 0.1**2)
    assert found["metacentric_height"] == pytest.approx(uplift * bg / weight, rel=1e-9)
    level = np.cos(found["trim"])  # about an axis that is trimmed
    expected = uplift * bg * level * np.sin(np.radians(30) - abs(found["heel"]))  # to port, where it heels to
    assert found["righting_moment"] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("surface", [True, False])
def test_derivatives_are_those_of_finite_differences(tmp_path, surface):
    """At the surface of a mesh, whose program is the smallest; one program computes values and derivatives."""
    names = (*ALL, "draught") if surface else ALL
    evaluate = task(mesh(tmp_path) if surface else box(surface=False), *names).prepare()
    u, h = np.array([0.4, 0.3, 0.6]), 1e-4
    found = evaluate(u, True, None)
    for k in range(3):
        ahead, back = (evaluate(u + sign * h * np.eye(3)[k], True, None) for sign in (1, -1))
        assert found.gradient[k] == pytest.approx((ahead.objective - back.objective) / (2 * h), rel=1e-6, abs=1e-9)
        expected = (ahead.constraints - back.constraints) / (2 * h)
        assert found.jacobian[:, k] == pytest.approx(expected, rel=1e-4, abs=1e-8 * np.abs(found.jacobian).max())


def test_no_draught_under_water():
    evaluate = task(box(surface=False), "draught").prepare()
    assert "draught is not defined" in evaluate(np.full(3, 0.5), False, None).reason


def test_without_gravity_nothing_floats():
    robot = parse_robot(BOX.replace("9.81 m/s2SURFACE", "0 m/s2").replace("JOINT", "{kind: free}"))
    with pytest.raises(InputError, match="trim: gravity is 0"):
        task(robot, "trim").prepare()


def test_the_meshes_of_the_example_are_those_of_its_script(tmp_path):
    subprocess.run([sys.executable, str(EXAMPLE / "make.py"), str(tmp_path)], check=True)
    for name in ("hull.stl", "fin.stl"):
        assert (tmp_path / name).read_bytes() == (EXAMPLE / name).read_bytes()


@pytest.mark.slow
def test_the_example_is_trimmed():
    """Neutral by the mass of the lead, level by its place: the sums of masses and of their moments say where."""
    found = design(EXAMPLE / "hull.yaml", starts=1, workers=1)
    assert found.best is not None and found.robot is not None
    lies = floating(build(found.robot))
    mass = float(lies.centres.mass)
    assert float(lies.net_weight) == pytest.approx(0, abs=1e-6 * mass * G)
    assert abs(np.degrees(float(lies.trim))) < 0.1 + 1e-6 and float(lies.heel) == pytest.approx(0, abs=1e-9)
    assert found.best.outputs["righting_moment"] >= 0.4 - 1e-6
    centre = np.asarray(lies.centres.centre_of_mass) - np.asarray(lies.centres.centre_of_buoyancy)
    assert found.best.outputs["righting_moment"] == pytest.approx(-0.5 * mass * G * centre[2], rel=1e-4)
    assert np.degrees(np.arctan2(-centre[0], -centre[2])) == pytest.approx(np.degrees(float(lies.trim)), abs=1e-6)
