"""Forces at a pose that is given, against closed forms."""

from math import cos, radians, sin

import numpy as np
import pytest

from nectosome.description import parse_robot
from nectosome.solve import forces, simulate
from nectosome.units import InputError

MASS, VOLUME, ARM, INERTIA, G, RHO = 2.0, 5e-4, 0.3, 0.01, 9.81, 1000.0

# a ball on an arm that swings about y in water, without drag; at 0 it hangs straight ahead along x
SWING = f"""
name: swing
water: {{gravity: {G} m/s2}}
body:
  kind: rigid
  shape: point
  mass: 1 kg # at the axis, where it counts for nothing
  volume: 0 m3
  joint: {{kind: revolute, axis: y}}
limbs:
  ball:
    kind: rigid
    shape: point
    mass: {MASS} kg
    volume: {VOLUME} m3
    inertia: [{INERTIA} kg m2, {INERTIA} kg m2, {INERTIA} kg m2]
    offset: [{ARM} m, 0 m, 0 m]
"""


@pytest.fixture(scope="module")
def swing():
    return parse_robot(SWING)


def test_weight_and_buoyancy_on_an_arm(swing):
    """(m - rho V) g l cos(angle) turns it about +y, down; to hold it still as much is missing the other way."""
    angle = radians(25)
    data = forces(swing, {"body.angle": "25 deg"})
    down = data["load_force"].sel(axis="z", part="ball")
    assert down.sel(load="weight") == pytest.approx(-MASS * G)
    assert down.sel(load="buoyancy") == pytest.approx(RHO * VOLUME * G)
    assert data["missing_force"].item() == pytest.approx(-(MASS - RHO * VOLUME) * G * ARM * cos(angle))
    assert data["position"].values[-1] == pytest.approx([ARM * cos(angle), 0, -ARM * sin(angle)])
    assert data["q"].item() == pytest.approx(angle) and data.attrs["title"] == "swing: forces at one instant"


def test_inverse_dynamics_and_the_balance_of_powers(swing):
    """(m l^2 + I) a - (m - rho V) g l cos(angle) is missing; kinetic energy grows by what all forces give."""
    angle, speed, acceleration = 0.7, -1.3, 2.0
    data = forces(swing, [angle], [speed], {"body.angle": acceleration})
    inertia = MASS * ARM**2 + INERTIA
    missing = inertia * acceleration - (MASS - RHO * VOLUME) * G * ARM * cos(angle)
    assert data["missing_force"].item() == pytest.approx(missing)
    assert data["missing_power"].item() == pytest.approx(missing * speed)
    assert data["energy"].sum() == pytest.approx(0.5 * inertia * speed**2)
    assert data["power_balance"] < 1e-12


def test_free_motion_misses_nothing(swing):
    data = forces(swing, 0.7, -1.3, None)
    inertia = MASS * ARM**2 + INERTIA
    assert data["a"].item() == pytest.approx((MASS - RHO * VOLUME) * G * ARM * cos(0.7) / inertia)
    assert data["missing_force"].item() == pytest.approx(0, abs=1e-12)


def test_an_instant_of_a_run_has_the_forces_of_the_run(drifter):
    """The q and v of a dataset lead back to the same pose, also of a body that turns freely."""
    run = simulate(drifter, 0.2, samples=3).to_dataset().isel(time=-1)
    data = forces(drifter, run["q"].values, run["v"].values, None)
    for name in ("position", "rotation", "velocity", "load_force", "a", "energy", "q", "v"):
        np.testing.assert_allclose(data[name], run[name], rtol=1e-8, atol=1e-9, err_msg=name)


LINK = f"""
name: link
water: {{gravity: {G} m/s2}}
body:
  kind: rigid
  shape: cylinder
  length: {ARM} m
  radius: 10 mm
  mass: {MASS} kg
  volume: {VOLUME} m3
  offset: [0.1 m, 0.2 m, 0.3 m]
  joint: JOINT
"""


def test_a_support_carries_weight_less_buoyancy_and_their_moment_about_the_root():
    """(m - rho V) g down at half the length, and l/2 of it about +y; the root's place in the world counts for nothing.

    Turned by 90 deg about z, the link lies along y, and the moment is about -x.
    """
    weight = (MASS - RHO * VOLUME) * G
    held = forces(parse_robot(LINK.replace("JOINT", "{kind: fixed}")))
    assert held["support_force"].values == pytest.approx([0, 0, -weight], abs=1e-12)
    assert held["support_moment"].values == pytest.approx([0, weight * ARM / 2, 0], abs=1e-12)
    turned = LINK.replace("JOINT", "{kind: fixed}\n  rotation: [0 deg, 0 deg, 90 deg]")
    assert forces(parse_robot(turned))["support_moment"].values == pytest.approx([-weight * ARM / 2, 0, 0], abs=1e-12)


def test_a_support_carries_what_turns_the_robot_too(swing):
    """The ball at speed w and acceleration a: its momentum changes by m l (-w^2, -a) along the arm and across it.

    About the axis it gives (m - rho V) g l cos(angle) - (m l^2 + I) a: the joint, free to turn, passes nothing else on.
    """
    angle, speed, acceleration = 0.7, -1.3, 2.0
    data = forces(swing, angle, speed, acceleration)
    along, across = np.array([cos(angle), 0, -sin(angle)]), np.array([-sin(angle), 0, -cos(angle)])
    rate = MASS * ARM * (acceleration * across - speed**2 * along)
    weight = (MASS + 1 - RHO * VOLUME) * G  # the body's 1 kg at the axis too
    assert data["support_force"].values == pytest.approx([0, 0, -weight] - rate)
    assert data["support_moment"].values == pytest.approx([0, -data["missing_force"].item(), 0])
    free = forces(swing, angle, speed, None)
    assert free["support_moment"].values == pytest.approx([0, 0, 0], abs=1e-12)


def test_nothing_holds_what_falls_freely():
    """Its weight is nearly 20 N, and it turns and is dragged."""
    drag = "  loads: {drag: {kind: lumped_drag, drag_area: [1e-3 m2, 1e-3 m2, 1e-3 m2]}}"
    data = forces(parse_robot(LINK.replace("JOINT", "{kind: free}\n" + drag)), v=0.3, a=None)
    assert data["support_force"].values == pytest.approx([0, 0, 0], abs=1e-12)
    assert data["support_moment"].values == pytest.approx([0, 0, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"q": {"ball.angle": 0.1}}, 'q: there is no free coordinate "ball.angle". Did you mean "body.angle"'),
        ({"q": {"body.angle": "3 mm"}}, 'q.body.angle: "3 mm" is a length'),
        ({"v": [1.0, 2.0]}, "v: 2 numbers, where the robot has 1 coordinate"),
        ({"q": "straight"}, 'q: "straight" is neither numbers nor values by coordinate'),
        ({"time": "1 m"}, 'time: "1 m" is a length'),
    ],
)
def test_what_makes_no_sense_is_told(as_users_run, swing, given, said):
    with pytest.raises(InputError) as told:
        forces(swing, **given)
    assert str(told.value).startswith(said)
