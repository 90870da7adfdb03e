"""Numbers of moved parts before a run: closed forms, and those of a run of the same motion."""

import math
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.description import parse_robot, without_ramps
from nectosome.description.joints import FixedJoint
from nectosome.description.ranges import NUMBERS
from nectosome.model import build
from nectosome.model.estimated_flow import STROUHAL, estimated_flow
from nectosome.robots import describe
from nectosome.solve import periodic
from nectosome.solve.flow_numbers import flow_numbers

F, TURN, A, L, CHORD, MU = 0.8, math.radians(25), 0.03, 0.2, 0.05, 1.0016e-3
EXAMPLES = Path(__file__).parents[2] / "examples"
OF_POINTS = 1e-4  # of 64 points of a beat
SERVO = "servo: {model: HS-5646WP, supply: 6 V, full_voltage_at: 6 deg, inertia: 0.001 kg m2}"


def fin(joint: str, rotation: str = "[90 deg, 0 deg, 90 deg]", body: str = "free", loads: str = "{}") -> str:
    """A plate of 200 mm by 50 mm on a hull, whose x axis is that of the span."""
    return f"""
name: fin
water: {{gravity: 0 m/s2}}
body: {{kind: rigid, shape: spheroid, length: 0.3 m, radius: 40 mm, mass: 1.8 kg, joint: {{kind: {body}}}}}
limbs:
  fin: {{kind: rigid, shape: box, length: {L} m, width: 2 mm, height: {CHORD} m, mass: 20 g, at: root,
    rotation: {rotation}, joint: {joint}, loads: {loads}}}
"""


def sine(kind: str, axis: str, amplitude: str, more: str = "") -> str:
    motion = f"{{kind: sine, amplitude: {amplitude}, frequency: {F} Hz, ramp: 2 s}}"
    return f"{{kind: {kind}, axis: {axis}, motion: {motion}{more}}}"


def of_fin(text: str):
    return estimated_flow(parse_robot(text))["fin"]


def test_a_flipper_that_flaps_about_its_root_has_closed_forms():
    """Sweep 2 L sin of the largest angle; KC and Re of the outermost of five Gauss points: 2 pi a/c, rho w a c/mu.

    Moored the chord lies across the path all the time; the speed is f A/St.
    """
    found = of_fin(fin(sine("revolute", "z", "25 deg")))
    arc = 0.5 * (1 + np.polynomial.legendre.leggauss(5)[0][-1]) * L * TURN
    assert found.piece.row == "fin" and found.frequency == F
    assert found.sweep == pytest.approx(2 * L * math.sin(TURN), rel=OF_POINTS)
    assert found.keulegan_carpenter == pytest.approx(2 * math.pi * arc / CHORD, rel=OF_POINTS)
    assert found.reynolds == pytest.approx(1000 * 2 * math.pi * F * arc * CHORD / MU, rel=OF_POINTS)
    assert found.angle == pytest.approx(math.pi / 2, abs=1e-9)
    assert found.speed == pytest.approx(F * found.sweep / STROUHAL, rel=1e-12)


def test_a_fin_that_heaves_at_speed_meets_its_path_at_the_angle_of_its_strouhal_number():
    """tan = pi St cos of the phase, of which half of the time is beyond cos 45 deg."""
    found = of_fin(fin(sine("prismatic", "y", f"{A} m")))
    assert found.sweep == pytest.approx(2 * A, rel=OF_POINTS)
    assert found.angle_at_speed == pytest.approx(math.atan(math.pi * STROUHAL * math.sqrt(0.5)), abs=0.02)


def test_the_numbers_are_those_of_a_run_of_the_same_motion_on_a_robot_that_is_held():
    rows = "[0 deg, 0 deg, 90 deg]"
    text = fin(sine("revolute", "z", "25 deg"), rows, "fixed", "{drag: {kind: plate_drag, normal: 1.2}}")
    found, robot = of_fin(text), build(without_ramps(parse_robot(text)))
    time, tree = jnp.arange(64) / (64 * F), robot.tree

    def flows(t):
        q, v, _ = tree.complete(t, robot.start.q, robot.start.v)
        strips = robot.strips(t, shape := tree.shape(q), tree.twists(shape, v))
        return tuple(g.flow(tree, strips) for g in robot.load_groups.on_bodies)

    of_run = flow_numbers(robot, time, jax.jit(jax.vmap(flows))(time), jnp.ones(64) / 64, 1 / F)[:, 0, 1]
    numbers = dict(zip(NUMBERS, map(float, of_run), strict=True))
    for name in ("reynolds", "keulegan_carpenter"):
        assert getattr(found, name) == pytest.approx(numbers[name], rel=1e-9)
    assert found.piece.row == "paddle" and math.isnan(found.speed) and math.isnan(found.angle)


def test_a_servo_follows_its_motion_and_what_hangs_on_a_passive_hinge_goes_along():
    ideal, servo = (of_fin(fin(sine("revolute", "z", "25 deg", more))) for more in ("", f", {SERVO}"))
    assert servo == ideal
    behind = "\n  tip: {kind: rigid, shape: box, length: 50 mm, width: 2 mm, height: 50 mm, mass: 5 g, on: fin, "
    text = fin(sine("revolute", "z", "25 deg")).rstrip() + behind + "joint: {kind: revolute, axis: z}}\n"
    tip = estimated_flow(parse_robot(text))["tip"]
    assert tip.sweep == pytest.approx(2 * math.hypot(L + 0.05, 0) * math.sin(TURN), rel=OF_POINTS)
    assert tip.frequency == F


def test_a_rod_whose_root_is_turned_counts_as_rigid():
    rod = f"""
name: rod
body: {{kind: rigid, shape: spheroid, length: 0.3 m, radius: 40 mm, mass: 1.8 kg, joint: {{kind: free}}}}
limbs:
  fin: {{kind: rod, section: rectangle, length: {L} m, width: 2 mm, height: {CHORD} m, young: 1 MPa,
    density: 1000 kg/m3, strains: {{bending_z: 1}}, at: root, rotation: [90 deg, 0 deg, 90 deg],
    joint: {sine("revolute", "z", "25 deg")}}}
"""
    found = of_fin(rod)
    assert found.sweep == pytest.approx(2 * L * math.sin(TURN), rel=OF_POINTS)
    assert found.keulegan_carpenter == pytest.approx(2 * math.pi * L * TURN / CHORD, rel=OF_POINTS)


def test_a_rod_that_a_servo_bends_is_bent_as_if_it_were_ideal():
    """Sweep of the end of an arc: 2 L (1 - cos)/angle."""
    bend, parts = 0.6, fin(sine("revolute", "z", "25 deg")).split("limbs")[0]
    rod = f"""limbs:
  fin: {{kind: rod, section: rectangle, length: {L} m, width: 2 mm, height: {CHORD} m, young: 1 MPa,
    density: 1000 kg/m3, at: root, rotation: [90 deg, 0 deg, 90 deg], MOVED}}"""
    swung = f"frequency: {F} Hz, phase: 20 deg"
    servo = f"drive: {{bending_z: {{ratio: -2, motion: {{kind: sine, amplitude: 0.3 rad, {swung}}}, {SERVO}}}}}"
    wave = f"strains: {{bending_z: 0}}, motion: {{bending_z: {{kind: wave, amplitude: {-bend / L} rad/m, {swung}}}}}"
    found, same = (of_fin(parts + rod.replace("MOVED", moved)) for moved in (servo, wave))
    assert found[1:] == pytest.approx(same[1:], rel=1e-12)
    assert found.sweep == pytest.approx(2 * L * (1 - math.cos(bend)) / bend, rel=1e-3)


@pytest.mark.parametrize(("spring", "damping"), [(0.05, 0.0), (0.05, 8e-3), (0.0, 0.0)])
def test_a_fin_that_a_torque_swings_has_the_amplitude_of_a_linear_oscillator(spring: float, damping: float):
    """A = T/|k - I w^2 + i c w|; without a spring nothing holds its mean, which stays at 0."""
    torque, w = (0.01 if spring else 0.0016), 2 * math.pi * F
    inertia = 0.02 * (L**2 / 3 + 0.002**2 / 12)
    amplitude = torque / abs(spring - inertia * w**2 + 1j * damping * w)
    found = of_fin(fin(
        f"{{kind: revolute, axis: z, stiffness: {spring} N m/rad, damping: {damping} N m s/rad, "
        f"torque: {{kind: sine, amplitude: {torque} N m, frequency: {F} Hz, ramp: 1 s}}}}"
    ))  # fmt: skip
    assert 0.15 < amplitude < 0.3 and found.frequency == F
    assert found.sweep == pytest.approx(2 * L * math.sin(amplitude), rel=2e-3)
    assert found.keulegan_carpenter == pytest.approx(
        2 * math.pi * 0.5 * (1 + np.polynomial.legendre.leggauss(5)[0][-1]) * L * amplitude / CHORD, rel=2e-3
    )


def test_drag_and_added_mass_of_the_water_count_where_a_force_drives():
    """Harmonic balance of (m + m_w) a + rho A/2 |v| v on a slide: of |sin| sin the first harmonic is 8/(3 pi)."""
    force, mass, area, w = 0.2, 0.02 + 0.4, 0.06, 2 * math.pi * F
    water = (
        f"{{drag: {{kind: lumped_drag, drag_area: [0 m2, {area} m2, 0 m2]}}, "
        "water: {kind: given_added_mass, mass: [0 kg, 0.4 kg, 0 kg]}}"
    )
    push = f"{{kind: prismatic, axis: y, force: {{kind: sine, amplitude: {force} N, frequency: {F} Hz}}}}"
    v = 0.5 * of_fin(fin(push, loads=water)).sweep * w
    drag = 8 / (3 * math.pi) * 0.5 * 1000 * area * v**2
    assert drag > 0.08
    assert math.hypot(mass * w * v, drag) == pytest.approx(force, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["eel", "fish"])
def test_what_forces_bend_moves_as_in_a_periodic_motion(name: str):
    """Held, sweep and KC within 10 %; free, KC of the run smaller, by a factor of 2.5 at most."""
    free = describe(name)
    root, limb = next(iter(free.parts)), [*free.parts][-1]
    held = free.with_part(root, joint=FixedJoint(kind="fixed"))
    found = estimated_flow(free)[limb]

    def kc_of(run) -> float:
        numbers = run.to_dataset()["flow_number"].sel(part=limb).values[[*NUMBERS].index("keulegan_carpenter")]
        return float(np.nanmax(numbers))

    moored = periodic(held)
    data = moored.to_dataset()
    place = data["position"].values[:, data["station_part"].values == limb]
    sweep = np.linalg.norm(place[:, None] - place, axis=-1).max()
    assert found.sweep == pytest.approx(sweep, rel=0.1)
    assert found.keulegan_carpenter == pytest.approx(kc_of(moored), rel=0.1)
    assert 1 < found.keulegan_carpenter / kc_of(periodic(free)) < 2.5


def test_motions_are_estimated_beside_forces_that_share_no_period():
    """A torque at pi times the frequency, or one that was recorded: the fin alone moves."""
    limb = (
        "\n  arm: {{kind: rigid, shape: box, length: 50 mm, width: 2 mm, height: 9 mm, mass: 5 g, on: body, joint: "
        + ("{{kind: revolute, axis: z, torque: {}}}}}\n")
    )
    text, alone = fin(sine("revolute", "z", "25 deg")), of_fin(fin(sine("revolute", "z", "25 deg")))
    recorded = "{kind: recording, times: [0 s, 1 s, 2 s, 3 s], values: [0 N m, 1 mN m, 2 mN m, 0 N m]}"
    for torque in ("{kind: sine, amplitude: 1 mN m, frequency: 2.51327 Hz}", recorded):
        found = estimated_flow(parse_robot(text.rstrip() + limb.format(torque)))
        assert [*found] == ["fin"] and found["fin"] == alone


def test_links_that_tendons_pull_are_estimated_too():
    """The drum of the tail turns by 40 deg at 1.5 Hz; each link swings by more than the one before it."""
    found = estimated_flow(describe(EXAMPLES / "tendon_tail.yaml"))
    sweeps = [found[name].sweep for name in ("first", "second", "third", "fin")]
    assert [found[name].frequency for name in ("first", "fin")] == [1.5, 1.5]
    assert 0.02 < sweeps[0] < sweeps[1] < sweeps[2] < sweeps[3] < 0.4


@pytest.mark.parametrize(
    "joint",
    [
        "{kind: revolute, axis: z}",
        "{kind: revolute, axis: z, motion: {kind: constant, value: 20 deg}}",
        "{kind: revolute, axis: z, motion: {kind: recording, times: [0 s, 1 s, 2 s, 3 s], "
        "values: [0 deg, 9 deg, 5 deg, 0 deg]}}",
    ],
)
def test_nothing_is_estimated_of_what_no_periodic_motion_moves(joint: str):
    assert estimated_flow(parse_robot(fin(joint))) == {}


def test_a_fin_that_feathers_along_its_path_meets_no_water_across():
    """A plate that slides along its own chord; the Keulegan-Carpenter number of what does not move across is none."""
    assert estimated_flow(parse_robot(fin(sine("prismatic", "z", f"{A} m"), "[0 deg, 0 deg, 0 deg]"))) == {}
    assert np.isfinite(of_fin(fin(sine("prismatic", "y", f"{A} m"))).keulegan_carpenter)
