"""Tendons over joints against closed forms: chains of hinges under antagonistic cords, winches, cranks and slides."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks.evaluations import equations

from nectosome.core import State
from nectosome.description import parse_robot, with_values
from nectosome.designs.quantities import QUANTITIES, PeriodicSwim, SteadySwim
from nectosome.mechanism import Robot
from nectosome.model import bind, build
from nectosome.solve import Equilibrium, periodic, reading, simulate, static
from nectosome.units import InputError

N, KAPPA, I, K, r, R, PHI, T0 = 3, 0.5, 0.02, 2e4, 0.012, 0.01, 0.3, 200.0  # N m/rad, kg m2, N/m, m, m, rad, N
LINK = f"""
  l{{k}}:
    on: {{on}}
    kind: rigid
    shape: point
    mass: 1 kg
    volume: 0 m3
    inertia: [{I} kg m2, {I} kg m2, {I} kg m2]
    joint: {{{{kind: revolute, axis: z, stiffness: {KAPPA} N m/rad, damping: 1e-30 N m s/rad}}}}"""
DRUM = f"""
name: chain
water: {{gravity: 0 m/s2}}
limbs:
  drum:
    kind: rigid
    shape: point
    mass: 1 kg
    volume: 0 m3
    joint:
      {{kind: revolute, axis: z, motion: {{kind: sine, amplitude: {PHI} rad, frequency: 1 Hz, phase: 90 deg}}}}"""
CHAIN = DRUM + "".join(LINK.format(k=k, on=f"l{k - 1}" if k > 1 else "world") for k in range(1, N + 1))


def cord(sign: int, over: str = "", pull: str = "") -> str:
    arms = over or ", ".join(f"l{k}: {sign * r} m" for k in range(1, N + 1))
    pull = pull or f"radius: {sign * R} m"
    return f"{{over: {{{arms}}}, stiffness: {K} N/m, pretension: {T0} N, pulled_by: {{part: drum, {pull}}}}}"


PAIR = parse_robot(f"{CHAIN}\ntendons:\n  left: {cord(1)}\n  right: {cord(-1)}\n")
CRANK = (
    CHAIN
    + f"""
tendons:
  left: {cord(1, pull="crank: 10 mm, guide: 40 mm, angle: 90 deg")}
  right: {cord(-1, pull="crank: 10 mm, guide: 40 mm, angle: -90 deg")}
"""
)
DRIVE, BOTH = "limbs.drum.joint.motion", ("left", "right")


def test_a_chain_of_equal_hinges_shares_the_pull_of_two_antagonistic_cords():
    """kappa q = r (T_l - T_r) = 2 k r (R phi - n r q) at each hinge; the drum takes R (T_l - T_r)."""
    found = static(PAIR)
    q = 2 * K * r * R * PHI / (KAPPA + 2 * K * r**2 * N)
    np.testing.assert_allclose(found.state.q, q, rtol=1e-12)
    data = found.to_dataset().squeeze()
    half = K * (R * PHI - N * r * q)
    np.testing.assert_allclose(data["tension"], [T0 + half, T0 - half], rtol=1e-12)
    assert float(data["reaction"]) == pytest.approx(2 * R * half, rel=1e-10)
    assert list(data["tendon"].values) == ["left", "right"]
    for run in (found, found.to_dataset()):  # as a load cell in the cord
        assert reading(run, "tension.left") == pytest.approx(T0 + half, rel=1e-12)
    swim = SteadySwim(found.value.system, Equilibrium(found.state, jnp.zeros(1)), (1.0, 0.0, 0.0), jnp.zeros(3))
    assert float(QUANTITIES["tension"].of_steady(swim)) == pytest.approx(T0 + half, rel=1e-12)


def test_cords_that_hardly_stretch_bend_the_chain_by_what_the_drum_winds_up():
    stiff = {"stiffness": 1e9, "softness": 1e-8}  # N/m, m
    found = static(with_values(PAIR, {f"tendons.{name}.{key}": x for name in BOTH for key, x in stiff.items()}))
    np.testing.assert_allclose(found.state.q, R * PHI / (N * r), rtol=1e-6)


def test_a_slack_cord_gives_no_force():
    """Turned back by far, the drum leaves the left cord loose: kappa q = -r T_r, T_r = T + k (n r q + R phi)."""
    turned, T = 3.0, 10.0  # rad, N
    found = static(
        with_values(PAIR, {f"{DRIVE}.amplitude": -turned} | {f"tendons.{name}.pretension": T for name in BOTH})
    )
    q = -r * (T + K * R * turned) / (KAPPA + K * r**2 * N)
    np.testing.assert_allclose(found.state.q, q, rtol=1e-10)
    data = found.to_dataset().squeeze()
    left = data.sel(tendon="left")
    assert float(left["tension"]) == float(left["tendon_energy"]) == 0
    assert float(left["tendon_stretch"]) < 0
    assert float(data.sel(tendon="right")["tension"]) == pytest.approx(-KAPPA * q / r, rel=1e-9)


@pytest.mark.parametrize("turned", [-3.0, 0.2, 3.0])
def test_a_cord_is_tight_where_its_gap_is_negative_and_nowhere_else(turned):
    """Steps of the integration end where it gets slack; the gap is the slack over 0.1 mm."""
    robot = build(PAIR)
    x = eqx.tree_at(lambda x: x.q, robot.initial(), jnp.full(N, turned))
    q, v, _ = robot.tree.complete(jnp.zeros(()), x.q, x.v)
    out, gaps = robot.tendons(q, v, x.z), robot.gaps(jnp.zeros(()), x).gap
    np.testing.assert_allclose(gaps, -out.stretch / 1e-4, rtol=1e-12)
    np.testing.assert_array_equal(gaps < 0, out.tension > 0)


def test_where_the_sign_of_its_arms_changes_a_cord_crosses_over():
    arms = {f"tendons.{name}.over.l3": -sign * r for name, sign in (("left", 1), ("right", -1))}
    found = static(with_values(PAIR, arms))
    q = 2 * K * r * R * PHI / (KAPPA + 2 * K * r**2 * N)
    np.testing.assert_allclose(found.state.q, [q, q, -q], rtol=1e-12)


stiffness = jax.jit(lambda robot, x: jax.jacfwd(lambda q: robot.residual(jnp.zeros(()), State(q, x.v, x.z), x.v))(x.q))


def test_pretension_keeps_both_cords_stiff():
    """K = kappa 1 + 2 k r^2 (all ones) while both are taut; M of the chain is I (n - max(i, j))."""
    robot = build(PAIR)
    ones = np.ones((N, N))
    np.testing.assert_allclose(stiffness(robot, robot.initial()), KAPPA * np.eye(N) + 2 * K * r**2 * ones, rtol=1e-12)
    loose = build(with_values(PAIR, {f"tendons.{name}.pretension": 1e-9 for name in BOTH}))
    one = KAPPA * np.eye(N) + K * r**2 * ones  # the drum, at 0.3 rad, has wound up the left one alone
    np.testing.assert_allclose(stiffness(loose, loose.initial()), one, rtol=1e-12)


def test_a_chain_swings_at_the_frequencies_of_its_springs_and_cords():
    """M q'' + (kappa 1 + 2 k r^2 J) q = 0 about the shape that it takes at rest; total energy stays."""
    still = with_values(PAIR, {f"{DRIVE}.frequency": 1e-30})
    M = I * (N - np.maximum(*np.indices((N, N))))
    stiff = KAPPA * np.eye(N) + 2 * K * r**2 * np.ones((N, N))
    squares, shapes = np.linalg.eig(np.linalg.solve(M, stiff))
    rest = np.linalg.solve(stiff, 2 * K * r * R * PHI * np.ones(N))
    run = simulate(still, 0.5, samples=101, rtol=1e-10, atol=1e-13).to_dataset()
    modal = np.linalg.solve(shapes, -rest)
    swings = rest + (np.cos(np.sqrt(squares) * run["time"].values[:, None]) * modal) @ shapes.T
    np.testing.assert_allclose(run["q"], swings, atol=1e-8)
    springs = 0.5 * KAPPA * (run["q"] ** 2).sum("coordinate")
    energy = run["energy"].sum("form") + springs + run["tendon_energy"].sum("tendon")
    np.testing.assert_allclose(energy, float(energy[0]), rtol=1e-9)
    np.testing.assert_allclose(run["tendon_heat"], 0.0, atol=1e-12)


powers = jax.jit(
    lambda robot, q, v: jax.jvp(lambda s: robot.tendons(q + s * v, v, robot.start.z).energy, (0.0,), (1.0,))[1]
)


@pytest.mark.parametrize("described", [PAIR, parse_robot(CRANK)], ids=["winch", "crank"])
def test_what_cords_take_from_joints_and_drum_they_store_or_turn_to_heat(described):
    """Damped, driven at 2 Hz until they go slack: they never push, and the account closes at every sample."""
    values = {f"tendons.{name}.{key}": x for name in BOTH for key, x in (("damping", 40), ("pretension", 2))}
    driven = with_values(described, {**values, f"{DRIVE}.frequency": 2.0, f"{DRIVE}.amplitude": 1.0})
    run = simulate(driven, 1.0, samples=201)
    data, robot = run.to_dataset(), run.value.system
    assert float(data["power_balance"].max()) < 1e-12
    assert float(data["tension"].min()) == 0.0
    assert float(data["tendon_heat"].min()) >= 0.0
    assert float(data["tendon_heat"].max()) > 0.1

    @jax.jit
    @jax.vmap
    def stored(t, x):
        return powers(robot, *robot.tree.complete(t, x.q, x.v)[:2])

    taken = data["load_power"].sel(load=["left", "right"]).sum("part")
    np.testing.assert_allclose(taken, -stored(run.value.time, run.value.state) - data["tendon_heat"].values, atol=1e-10)


def test_a_cord_that_relaxes_faster_than_it_is_stretched_does_not_push():
    robot = build(with_values(PAIR, {"tendons.left.damping": 1e3}))
    q = jnp.zeros(N + 1)
    rates = jnp.array([-1.0, 0.0, 1.0])[:, None] * jnp.eye(N + 1)[0]
    tension = jax.vmap(lambda v: robot.tendons(q, v, robot.start.z).tension[0])(100 * rates)
    np.testing.assert_allclose(tension, [0.0, T0, T0 + 1e3 * R * 100], rtol=1e-12)


def test_the_mean_and_the_largest_tension_of_a_cycle():
    """Driven to and fro, both cords taut: their tensions have the mean T0, and designs are held by the largest one."""
    damped = with_values(PAIR, {f"limbs.l{k}.joint.damping": 0.05 for k in range(1, N + 1)})
    found = periodic(damped, samples=65)
    means, tension = found.means(), found.to_dataset()["tension"].values
    np.testing.assert_allclose(means.tension, T0, rtol=1e-6)
    np.testing.assert_allclose(means.tension_peak, tension.max(axis=0), rtol=1e-12)
    assert float(means.tension_peak[0]) > T0 + 1
    swim = PeriodicSwim(found.value.system, means, jnp.array([1.0, 0.0, 0.0]), found.value.time)
    assert float(QUANTITIES["tension"].of_cycle(swim)) == tension.max()


def of_residual(text):
    robot = build(parse_robot(text))
    x = robot.initial()
    return equations(jax.make_jaxpr(lambda x, a: robot.residual(jnp.asarray(0.3), x, a))(x, x.v).jaxpr)


def test_more_tendons_add_no_equation():
    counts = {
        of_residual(CHAIN + "\ntendons:\n" + "".join(f"  t{k}: {cord(1)}\n" for k in range(m))) for m in (1, 2, 8)
    }
    assert len(counts) == 1


def test_a_crank_pulls_by_the_distance_of_its_pin_from_the_guide():
    """At 0 the pin stands square to both guides; from there the pulls are those of the places of pin and guide."""
    robot = build(parse_robot(CRANK))
    angles = np.linspace(-4, 4, 33)
    q = jnp.zeros((33, N + 1)).at[:, 0].set(angles)
    found = jax.vmap(lambda q: robot.tendons(q, jnp.zeros_like(q), robot.start.z))(q)
    pin = 0.01 * np.exp(1j * angles)
    for side, guide in ((0, -0.04j), (1, 0.04j)):
        pull = np.abs(pin - guide) - np.hypot(0.01, 0.04)
        np.testing.assert_allclose(found.tension[:, side], np.maximum(T0 + K * pull, 0.0), rtol=1e-9, atol=1e-3)


def test_a_slide_pulls_by_its_displacement():
    """One end of a cord with the ratio 2, as over a loose pulley: force 2 T on the slide."""
    slide = CHAIN.replace("kind: revolute, axis: z, motion", "kind: prismatic, axis: x, motion")
    slide = slide.replace(f"{PHI} rad", "3 mm") + f"\ntendons:\n  left: {cord(1, pull='ratio: 2')}\n"
    found = static(parse_robot(slide))
    q = r * (T0 + 2 * K * 0.003) / (KAPPA + K * r**2 * N)
    np.testing.assert_allclose(found.state.q, q, rtol=1e-10)
    assert float(found.to_dataset()["reaction"].squeeze()) == pytest.approx(2 * KAPPA * q / r, rel=1e-9)


@pytest.mark.parametrize("pretension", [0.3, T0])
def test_forces_are_differentiated_by_every_number_of_a_tendon(pretension):
    """Against central differences, beyond the softness and inside of it."""
    described = with_values(parse_robot(CRANK), {"tendons.left.pretension": pretension, "tendons.left.damping": 3.0})
    names = ("over.l2", "stiffness", "damping", "pretension", "softness", "slack")
    ways = ("crank", "guide", "angle")
    paths = tuple(f"tendons.left.{name}" for name in (*names, *(f"pulled_by.{way}" for way in ways)))
    theta, make = bind(with_values(described, {"tendons.left.slack": 1e-5}), paths)
    v = jnp.array([0.1, -0.2, 0.05])

    @jax.jit
    def forces(theta):
        robot: Robot = make(theta)
        return robot.residual(jnp.asarray(0.0), State(0.02 * v, v, robot.initial().z), jnp.zeros(N))

    exact = jax.jit(jax.jacfwd(forces))(theta)
    for k, value in enumerate(np.asarray(theta)):
        h = 1e-4 * value
        difference = (forces(theta.at[k].add(h)) - forces(theta.at[k].add(-h))) / (2 * h)
        np.testing.assert_allclose(exact[:, k], difference, rtol=1e-5, atol=1e-6)


HOLES = "l1: {{before: [{d} mm, {h} mm], after: [{e} mm, {i} mm]}}"
D, H, E, J = 25.0, 8.0, 40.0, 12.0  # mm


def bowed(d: float = D, h: float = H, e: float = E, i: float = J, more: str = "") -> str:
    one = DRUM + LINK.format(k=1, on="world")
    holes = HOLES.format(d=d, h=h, e=e, i=i)
    return f"{one}\ntendons:\n  left: {cord(1, holes + more)}\n"


def way(q: float) -> float:
    """Between the holes [m], one turned by q about the axis."""
    turned = 1e-3 * (E + 1j * J) * np.exp(1j * q)
    return float(abs(turned - 1e-3 * (-D + 1j * H)))


def test_a_cord_between_holes_is_as_long_as_the_way_between_them():
    """Whatever the angle; its moment is the tension times what the way gets shorter by."""
    robot = build(parse_robot(bowed()))
    own = jax.jit(lambda q: robot.tendons(*robot.tree.complete(jnp.zeros(()), q, 0 * q)[:2], robot.initial().z).stretch)
    still = jax.jit(lambda q: robot.residual(jnp.zeros(()), State(q, 0 * q, robot.initial().z), 0 * q))
    straight = float(own(jnp.zeros(1))[0])
    for q in (-1.0, 0.4, 1.2):
        x = jnp.array([q])
        longer = way(q) - way(0.0)
        assert float(own(x)[0]) - straight == pytest.approx(longer, rel=1e-10)
        arm = -(way(q + 1e-5) - way(q - 1e-5)) / 2e-5
        tension = max(T0 + K * (longer + R * PHI), 0.0)
        assert float(-still(x)[0]) == pytest.approx(tension * arm - KAPPA * q, rel=1e-7)


def test_equal_holes_have_their_height_as_arm_where_the_hinge_is_straight():
    equal = build(parse_robot(bowed(20, 12, 20, 12))).load_groups.tendons[0]
    drawn, arms = equal._drawn(jnp.zeros(len(equal.parts)))
    assert float(drawn.sum()) == 0.0
    assert sorted(np.asarray(arms).ravel()) == pytest.approx([-R, 0.012])


def test_holes_are_numbers_like_others_and_are_refused_where_they_do_nothing():
    robot = parse_robot(bowed())
    higher = with_values(robot, {"tendons.left.over.l1.after.1": 0.02})
    assert higher.tendons["left"].over["l1"].after == (pytest.approx(0.04), 0.02)
    theta, make = bind(robot, ("tendons.left.over.l1.after.1",))
    found = [float(static(make(theta + step)).state.q[0]) for step in (-1e-6, 1e-6)]
    slope = float(jax.jacfwd(lambda theta: static(make(theta)).state.q[0])(theta)[0])
    assert slope == pytest.approx((found[1] - found[0]) / 2e-6, rel=1e-5)
    with pytest.raises(InputError, match="its arm is 0 where the joint is at 0") as told:
        parse_robot(bowed(13, 7, 26, -14))
    assert told.value.field == "tendons.left.over.l1.after"
    bent = bowed().replace("kind: revolute, axis: z, stiff", "kind: revolute, axis: z, position: -60 deg, stiff")
    with pytest.raises(InputError, match="where the cord is beyond the axis") as told:
        parse_robot(bent)
    assert told.value.field == "tendons.left.over.l1"


@pytest.mark.parametrize("sign", [1, -1])
def test_the_arm_of_holes_keeps_its_sign_in_their_range(sign):
    low, high = parse_robot(bowed(h=sign * H, i=sign * J)).tendons["left"].over["l1"].range
    group = build(parse_robot(bowed(h=sign * H, i=sign * J))).load_groups.tendons[0]
    arms = lambda q: float(group._drawn(jnp.array([0.0, q]))[1][0, 1])  # noqa: E731
    for q in (low, high):
        assert arms(q) == pytest.approx(0.0, abs=1e-12)
        assert arms(q - 0.01) * arms(q + 0.01) < 0
    assert all(sign * arms(q) > 0 for q in np.linspace(low, high, 12)[1:-1])
