"""Friction of tendons against the capstan equation: rods under a pull, and links in a row."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core.dry_friction import bend
from nectosome.description import parse_robot, with_values
from nectosome.loads.rod_loads import Tendon
from nectosome.model import build
from nectosome.solve import simulate, static
from nectosome.units import InputError

MU, PULL, OFF, LENGTH = 0.3, 4.0, 0.008, 0.4  # N, m, m
EI = 3e6 * 0.012 * 0.008**3 / 12  # N m2
ROD = f"""
name: finger
water: {{gravity: 0 m/s2}}
body:
  kind: rod
  section: rectangle
  width: 12 mm
  height: 8 mm
  length: {LENGTH} m
  young: 3 MPa
  density: 1000 kg/m3
  damping: 1 kPa s
  strains: {{bending_y: ORDER}}
  joint: {{kind: fixed}}
  loads:
    cord: {{kind: tendon, place: [0 m, {OFF} m], tension: {{kind: constant, value: {PULL} N}}, friction: {MU}}}
"""
ONE, SIX = (parse_robot(ROD.replace("ORDER", str(order))) for order in (0, 6))


def test_a_rod_of_even_curvature_gets_the_mean_of_the_capstan_tension():
    """E I theta / L = T d (1 - exp(-mu theta)) / (mu theta), theta the angle from root to tip."""
    theta = abs(float(static(ONE).state.q[0]))
    pulled = PULL * OFF * (1 - np.exp(-MU * theta)) / (MU * theta)
    assert EI * theta / LENGTH == pytest.approx(pulled, rel=1e-4)  # the bend sets in within 1e-4 rad
    assert theta > 1.5


def test_a_rod_bends_less_the_farther_from_the_pull():
    """E I k = T d exp(-mu int k dx): k = k0 / (1 + mu k0 x), the tip at log(1 + mu k0 L) / mu. Without: k0 L."""
    even = PULL * OFF / EI * LENGTH
    assert abs(float(static(SIX).state.q[0])) == pytest.approx(np.log(1 + MU * even) / MU, rel=1e-4)
    smooth = static(with_values(SIX, {"body.loads.cord.friction": 0.0}))
    assert abs(float(smooth.state.q[0])) == pytest.approx(even, rel=1e-9)


@pytest.fixture(scope="module")
def cord() -> Tendon:
    return next(one.load for one in build(ONE).loads if isinstance(one.load, Tendon))


def test_tension_falls_towards_the_tip_where_it_is_drawn_in_and_rises_where_it_is_let_out(cord):
    """The force over that of the same tension without friction: (1 - exp(-mu theta)) / (mu theta), of either sign."""
    q, t = jnp.array([-1.2]), jnp.zeros(())
    full = cord.thread.pull(q, jnp.full_like(cord.thread.weight, PULL))[0]
    assert float(full) < 0  # it bends the rod further
    for s in (1.0, -1.0):
        x = MU * s * 1.2
        got, rate = cord.at_state(t, q, jnp.array([-20.0 * s]), s * cord.initial())
        assert float(got[0] / full) == pytest.approx((1 - np.exp(-x)) / x, rel=1e-4)  # the bend sets in within 1e-4
        assert (np.abs(rate) < 1e-3).all()  # s is what it slides to


def test_friction_has_derivatives_where_the_rod_is_straight_and_where_it_turns_back(cord):
    """Straight, friction changes nothing at first order, and its force has no derivative by the speed."""
    t, zero = jnp.zeros(()), jnp.zeros(1)
    by_q, by_v = jax.jacfwd(lambda q, v: cord.force(t, q, v)[0], argnums=(0, 1))(zero, zero)
    assert np.isfinite(by_q).all()
    np.testing.assert_allclose([*by_q, *by_v], 0.0, atol=1e-9)
    assert float(jax.grad(lambda x: bend(x**2))(jnp.zeros(()))) == 0.0


def test_friction_takes_power_drawn_in_or_let_out(cord):
    """(Q - Q without) v < 0 at every speed, by T (1 - share) at most."""
    q, t = jnp.array([-1.2]), jnp.zeros(())
    full = cord.thread.pull(q, jnp.full_like(cord.thread.weight, PULL))
    rates = jnp.array([-5.0, -0.5, -1e-4, 1e-4, 1.0, 5.0])  # rad/s
    slides = cord.initial() * -jnp.sign(rates)[:, None]
    rubbed = jax.vmap(lambda v, z: jnp.dot(cord.at_state(t, q, v, z)[0] - full, v))(rates[:, None], slides)
    assert (np.asarray(rubbed) < 0).all()
    assert (np.asarray(rubbed) > -PULL * OFF * np.abs(rates) * (np.exp(MU * 1.2) - 1)).all()


ARM, K, KAPPA = 0.012, 2e4, 0.5
LINKS = "".join(
    f"""
  l{k}:
    on: {f"l{k - 1}" if k > 1 else "world"}
    kind: rigid
    shape: point
    mass: 1 kg
    volume: 0 m3
    inertia: [0.02 kg m2, 0.02 kg m2, 0.02 kg m2]
    joint: {{kind: revolute, axis: z, stiffness: {KAPPA} N m/rad, damping: 0.05 N m s/rad}}"""
    for k in (1, 2, 3)
)
ROW = f"""
name: row
water: {{gravity: 0 m/s2}}
limbs:
  drum:
    kind: rigid
    shape: point
    mass: 1 kg
    volume: 0 m3
    joint:
      {{kind: revolute, axis: z, motion: {{kind: sine, amplitude: 1.5 rad, frequency: 1 Hz, phase: 90 deg}}}}{LINKS}
tendons:
  cord: {{over: {{l1: {ARM} m, l2: {ARM} m, l3: {ARM} m}}, stiffness: {K} N/m, friction: {MU},
    pulled_by: {{part: drum, radius: 10 mm}}}}
"""
LINKS_IN_A_ROW = parse_robot(ROW)


def test_links_in_a_row_get_the_tension_that_the_bends_before_them_leave():
    """kappa q_j = r T exp(-mu (q_1 + ... + q_j)), T where it is pulled; the drum takes R T."""
    found = static(LINKS_IN_A_ROW)
    q, data = np.asarray(found.state.q), found.to_dataset().squeeze()
    T = float(data["tension"])
    np.testing.assert_allclose(KAPPA * q, ARM * T * np.exp(-MU * np.cumsum(q)), rtol=1e-4)
    assert pytest.approx(K * (0.010 * 1.5 - ARM * q.sum()) - 0.5 * K * 1e-4, rel=1e-9) == T  # beyond the softness
    assert float(data["reaction"]) == pytest.approx(0.010 * T, rel=1e-9)
    assert q[0] > 1.1 * q[1] > 1.1 * q[2] > 0


def test_the_order_of_over_is_that_of_its_way():
    """Over the links from the last to the first, each angle and each moment is that of the link opposite."""
    back = parse_robot(ROW.replace(f"l1: {ARM} m, l2: {ARM} m, l3: {ARM} m", f"l3: {ARM} m, l2: {ARM} m, l1: {ARM} m"))
    t, moving, angles = jnp.zeros(()), jnp.zeros(4), jnp.array([0.3, 0.2, 0.1])
    moments = []
    for robot, q in ((build(LINKS_IN_A_ROW), angles), (build(back), angles[::-1])):
        (group,) = robot.load_groups.tendons
        at = jnp.concatenate([jnp.array([1.5]), q])
        moments.append(group.at_state(robot.tree, t, at, moving, jnp.ones(3))[0][0])
    tension = K * (0.010 * 1.5 - ARM * 0.6) - 0.5 * K * 1e-4
    np.testing.assert_allclose(moments[0][1:], ARM * tension * np.exp(-MU * np.cumsum(angles)), rtol=1e-4)
    np.testing.assert_allclose(moments[1][1:], moments[0][:0:-1], rtol=1e-12)


def test_what_rubs_over_links_is_in_the_account():
    """Driven to and fro at 2 Hz: the power balance closes, and friction turns more to heat than it ever gives."""
    run = simulate(with_values(LINKS_IN_A_ROW, {"limbs.drum.joint.motion.frequency": 2.0}), 1.0, samples=401)
    data = run.to_dataset()
    assert float(data["power_balance"].max()) < 1e-9
    heat = data["tendon_heat"].squeeze()
    assert float(heat.max()) > 0.05
    assert float(np.maximum(-heat, 0.0).mean()) < 2e-3 * float(heat.mean())  # it gives back what it has stored


def test_friction_without_a_pull_is_refused():
    with pytest.raises(InputError, match="Give pulled_by") as told:
        parse_robot(ROW.replace("\n    pulled_by: {part: drum, radius: 10 mm}", ""))
    assert told.value.field == "tendons.cord.friction"


def test_static_says_that_a_tendon_with_friction_was_drawn_in():
    """Let out from further in it rests up to the other end of what friction holds."""
    for robot, name in ((LINKS_IN_A_ROW, "cord"), (SIX, "cord")):
        assert f"friction of {name} is that of tendons drawn in last" in static(robot).notes[-1]
    assert static(with_values(SIX, {"body.loads.cord.friction": 0.0})).notes == []


ONE_LINK = parse_robot(
    f"""
name: link
water: {{gravity: 0 m/s2}}
limbs:
  drum: {{kind: rigid, shape: point, mass: 1 kg, volume: 0 m3,
    joint: {{kind: revolute, axis: z, motion: {{kind: sine, amplitude: 0 rad, frequency: 0.1 Hz, offset: 1.5 rad}}}}}}
  link: {{kind: rigid, shape: point, mass: 1 kg, volume: 0 m3, inertia: [0.001 kg m2, 0.001 kg m2, 0.001 kg m2],
    joint: {{kind: revolute, axis: z, position: 0 rad, stiffness: {KAPPA} N m/rad, damping: 0.2 N m s/rad}}}}
tendons:
  cord: {{over: {{link: {ARM} m}}, stiffness: 200 N/m, friction: {MU}, softness: 10 um,
    pulled_by: {{part: drum, radius: 10 mm}}}}
"""
)


@pytest.mark.parametrize(("start", "s"), [(0.0, 1.0), (0.2, -1.0)])
def test_a_link_stays_at_either_end_of_what_friction_of_its_cord_holds(start: float, s: float):
    """kappa q = r T exp(-mu s q), T = k (R q_d - r q): as it comes from below, or from above; for 30 s."""
    robot = build(with_values(ONE_LINK, {"limbs.link.joint.position": start, "tendons.cord.friction": 3.0}))
    q = np.asarray(simulate(robot, 30.0, samples=7).to_dataset()["q"])[:, 0]
    expected = 0.05
    for _ in range(200):
        expected = ARM * 200 * (0.015 - 5e-6 - ARM * expected) * np.exp(-3.0 * s * expected) / KAPPA
    assert q[1:] == pytest.approx(np.full(6, expected), rel=2e-3)


def test_a_cycle_of_a_link_turns_the_area_of_its_loop_to_heat():
    """Moved to and fro from q1 to q2 under an even tension: T r int exp(mu q) - exp(-mu q) dq; the account closes."""
    moves = "motion: {kind: sine, amplitude: AMPLITUDE rad, frequency: 0.5 Hz, offset: OFFSET rad}"
    link = moves.replace("AMPLITUDE", "0.5").replace("OFFSET", "0.7")
    drum = moves.replace("AMPLITUDE", f"{0.5 * ARM / 0.01}").replace("OFFSET", f"{0.7 * ARM / 0.01 + 0.5}")
    text = f"""
name: link
water: {{gravity: 0 m/s2}}
limbs:
  drum: {{kind: rigid, shape: point, mass: 1 kg, volume: 0 m3, joint: {{kind: revolute, axis: z, {drum}}}}}
  link: {{kind: rigid, shape: point, mass: 1 kg, volume: 0 m3, joint: {{kind: revolute, axis: z, {link}}}}}
tendons:
  cord: {{over: {{link: {ARM} m}}, stiffness: 200 N/m, friction: {MU}, softness: 1 um,
    pulled_by: {{part: drum, radius: 10 mm}}}}
"""
    run = simulate(build(parse_robot(text)), 4.0, samples=8001, rtol=1e-6, atol=1e-9).to_dataset()
    last = run.isel(time=slice(4000, None))
    T = float(last["tension"].max())
    assert pytest.approx(1.0 - 1e-4, rel=1e-9) == T  # 200 N/m 5 mm, less half of the softness
    loop = 2 * T * ARM / MU * (np.cosh(MU * 1.2) - np.cosh(MU * 0.2))
    heat = np.asarray(last["tendon_heat"])[:, 0]
    work = np.asarray(last["reaction_power"]).sum(axis=1)
    assert np.trapezoid(heat, last["time"]) == pytest.approx(loop, rel=5e-4)  # of its presliding
    assert np.trapezoid(work, last["time"]) == pytest.approx(np.trapezoid(heat, last["time"]), rel=1e-6)
    assert np.trapezoid(np.maximum(-heat, 0.0), last["time"]) < 1e-4 * loop  # it gives back what it has stored
    assert float(run["power_balance"].max()) < 1e-9
