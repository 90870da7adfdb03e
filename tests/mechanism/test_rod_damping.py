"""Damping of a rod's material: what it means, and the ways to give it."""

import numpy as np
import pytest

from nectosome.description import dump_robot, parse_robot
from nectosome.description.robot_file import apply_settings
from nectosome.model import build
from nectosome.solve import modes
from nectosome.units import InputError

BEAM = """
name: beam
water: {gravity: 0 m/s2}
body:
  kind: rod
  section: rectangle
  width: 20 mm
  height: 8 mm
  length: 0.3 m
  young: 3 MPa
  density: 1000 kg/m3
  damping: DAMPING
  strains: {torsion: 1, bending_y: 3}
  joint: {kind: fixed}
"""
WAYS = {
    "4 kPa s": 4e3,
    "{uniaxial: 12 kPa s}": 4e3,
    "{loss_factor: 0.2, frequency: 5 Hz}": 0.2 * 3e6 / (3 * 2 * np.pi * 5),
    "{loss_modulus: 0.6 MPa, frequency: 5 Hz}": 0.6e6 / (3 * 2 * np.pi * 5),
}


@pytest.mark.parametrize(("way", "shear"), WAYS.items())
def test_bending_loses_by_three_times_the_shear_viscosity(way, shear):
    """Of q = a sin(w t): loss factor = lost in a cycle / (2 pi stored) = w D / K, 3 eta w / E in bending, eta w / G in
    torsion; that of a test in bending comes back at its frequency."""
    robot = build(parse_robot(BEAM.replace("DAMPING", way)))
    rod = robot.tree.rods[0].things
    K, D = (np.diag(np.asarray(x).reshape(-1, 6, 6)[0]) for x in (rod.stiffness, rod.damping))
    w, twist = 2 * np.pi * 5, [name.startswith("torsion") for name in robot.coordinate_names]
    lost = np.where(twist, shear * w / 1e6, 3 * shear * w / 3e6)
    np.testing.assert_allclose(w * D / K, lost, rtol=1e-9)
    if "factor" in way or "modulus" in way:
        np.testing.assert_allclose((w * D / K)[~np.array(twist)], 0.2, rtol=1e-9)


def test_a_bending_mode_decays_by_its_uniaxial_viscosity():
    """Damping ratio eta_E w / (2 E) at the frequency w of each mode, the first 3.516 sqrt(E I / rho A) / L^2."""
    text = BEAM.replace("DAMPING", "{uniaxial: 9 kPa s}").replace("torsion: 1, ", "")
    swinging = modes(parse_robot(text))
    w = np.abs(swinging.eigenvalue)
    assert w[0] == pytest.approx(3.516 / 0.3**2 * np.sqrt(3e6 / 1000 / 12) * 0.008, rel=2e-3)
    np.testing.assert_allclose(swinging.damping_ratio[:2], 9e3 * w[:2] / (2 * 3e6), rtol=1e-6)


def test_losses_are_written_back_and_set():
    """A group of fields comes back as given, has paths of its own, and may replace a number and be replaced by one."""
    robot = parse_robot(BEAM.replace("DAMPING", "{loss_factor: 0.2, frequency: 5 Hz}"))
    assert parse_robot(dump_robot(robot)) == robot
    double = apply_settings(robot, ["body.damping.loss_factor=0.4"])
    assert double.body.shear_viscosity == pytest.approx(2 * robot.body.shear_viscosity)
    number = apply_settings(robot, ["body.damping=4 kPa s"])
    assert number.body.shear_viscosity == 4e3
    assert apply_settings(number, ["body.damping={uniaxial: 9 kPa s}"]).body.shear_viscosity == 3e3
    stiffer = apply_settings(robot, ["body.young=6 MPa"])  # the loss factor stays
    assert stiffer.body.shear_viscosity == pytest.approx(2 * robot.body.shear_viscosity)


@pytest.mark.parametrize(
    ("damping", "field", "says"),
    [
        ("{}", "damping.uniaxial", "is missing"),
        ("{uniaxial: 9 kPa s, loss_factor: 0.1}", "damping.loss_factor", "Leave one of the two out"),
        ("{loss_factor: 0.1}", "damping.frequency", "is missing. Give the frequency at which the loss_factor"),
        ("{uniaxial: 9 kPa s, frequency: 2 Hz}", "damping.frequency", "goes with"),
        ("{loss_modulus: -2 kPa, frequency: 2 Hz}", "damping.loss_modulus", "at least 0 Pa"),
        ("{uniaxal: 9 kPa s}", "damping.uniaxal", "uniaxial"),
        ("9 kPa", "damping", "Pa s"),
        ("[9 kPa s]", "damping", "a list is no quantity"),
    ],
)
def test_a_wrong_damping_is_refused(damping, field, says):
    with pytest.raises(InputError, match=says) as told:
        parse_robot(BEAM.replace("DAMPING", damping))
    assert told.value.field == f"body.{field}"
