"""No step of the integration passes over a contact; impacts keep their energy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.model import bind, build
from nectosome.solve import simulate
from nectosome.solve.contact_steps import SHARES, contact_step
from nectosome.solve.integrate import Settings, begin, integrate
from nectosome.solve.runge_kutta import ESDIRK4, TSIT5

G, METHODS = 9.81, ("explicit", "implicit")
BALL = """
name: ball
water: {gravity: 9.81 m/s2, density: 1 kg/m3}
body:
  kind: rigid
  shape: point
  mass: 0.4 kg
  volume: 0 m3
  inertia: [1e-4 kg m2, 1e-4 kg m2, 1e-4 kg m2]
  joint:
    {kind: prismatic, axis: z, position: 200 mm, lower: {at: 0 mm, stiffness: 50 kN/m, softness: 0.1 mm}}
"""
STICK = """
name: stick
water: {gravity: 9.81 m/s2, density: 1 kg/m3}
limbs:
  bar:
    {on: world, kind: rigid, shape: cylinder, radius: 10 mm, length: 400 mm, mass: 1 kg,
     offset: [0 m, -0.2 m, 0 m], rotation: [0 deg, 0 deg, 90 deg]}
  stick:
    {on: world, kind: rigid, shape: cylinder, radius: 5 mm, length: 300 mm, mass: 0.1 kg, strips: 7,
     offset: [-0.15 m, 0 m, 0 m], joint: {kind: prismatic, axis: z, position: 0.5 m}}
pairs:
  touch: {kind: contact, between: [stick, bar], stiffness: 2 MN/m, damping: 500 N s/m}
"""


def seen(g, rtol=1e-4, lag=0.0):
    """What a step says of one gap, a function of its share, with a damper that lags by so many steps."""
    gap, rate = jax.vmap(lambda s: jax.jvp(lambda s: jnp.stack([g(s)]), (s,), (jnp.ones(()),)))(jnp.asarray(SHARES))
    return contact_step(gap, rate, jnp.full(1, lag), jnp.zeros(1, bool), jnp.asarray(rtol))


def test_a_gap_that_closes_is_located_on_its_cubic():
    """From far away half of what is seen as far before it; from near within the band."""
    far, near = seen(lambda s: 8 - 27 * s**3), seen(lambda s: 1.6 - 2 * s)
    assert bool(far.passes) and bool(near.passes)
    assert float(far.share) == pytest.approx(7 ** (1 / 3) / 3, abs=1e-9)
    assert float(near.share) == pytest.approx(0.8 - 2.5e-4, abs=1e-9)


@pytest.mark.parametrize("at", [0.05, 0.31, 0.62, 0.97])
def test_a_body_that_is_thinner_than_what_is_looked_at_is_not_passed(at):
    """A gap of |x - at|, 300 softnesses long and less than 1 deep: free at every time that is looked at."""
    step = seen(lambda s: 300 * jnp.abs(s - at) - 0.9)
    assert bool(step.passes)
    assert 0 < float(step.share) <= at


@pytest.mark.parametrize(
    "free", [lambda s: 300 * jnp.abs(s - 0.4) + 40.0, lambda s: 100.0 - 99 * s, lambda s: 100 * s, lambda s: 3 + s * s]
)
def test_steps_that_only_come_near_are_not_cut(free):
    assert not bool(seen(free).passes)


def test_a_slow_contact_is_left_to_the_error_control_of_usual_tolerances():
    assert not bool(seen(lambda s: 0.2 - 0.4 * s).passes)
    assert bool(seen(lambda s: 0.2 - 0.4 * s, rtol=1e-6).passes)


def test_steps_are_a_quarter_of_a_softness_while_a_damper_sets_in():
    """0.2 softnesses a step, into the contact; none beyond one softness, none outwards, none without a damper."""
    assert float(seen(lambda s: -0.3 - 0.2 * s, lag=50.0).sets_in) == pytest.approx(0.25 / 0.2, rel=1e-12)
    assert float(seen(lambda s: 1e-4 - 0.2 * s, lag=50.0).sets_in) == pytest.approx(0.25 / 0.2, rel=1e-12)
    for gap, lag in (
        (lambda s: -1.1 - 0.2 * s, 50.0),
        (lambda s: -0.5 + 0.2 * s, 50.0),
        (lambda s: -0.3 - 0.2 * s, 0.0),
    ):
        assert np.isinf(float(seen(gap, lag=lag).sets_in))


@pytest.mark.parametrize("tableau", [TSIT5, ESDIRK4])
def test_a_step_over_a_jump_of_the_rate_is_right_where_the_jump_is_at_the_share_of_the_method(tableau):
    """The rate is 1 before the jump and 3 after it; only the stages see on which side they are."""
    s = tableau.kink_share
    assert tableau.A[-1] @ np.where(tableau.c < s, 1.0, 3.0) == pytest.approx(s + 3 * (1 - s), abs=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_an_undamped_bounce_keeps_its_energy_for_20_s(method):
    """m g 0.2 m = 0.7848 J, at default tolerances, in 48 bounces."""
    run = simulate(build(parse_robot(BALL)), 20.0, samples=4001, method=method)
    z, v = np.asarray(run.value.state.q)[:, 0], np.asarray(run.value.state.v)[:, 0]
    energy = (0.4 * G * z + 0.2 * v**2)[z > 0]
    assert energy.max() == pytest.approx(0.7848, rel=1e-3)
    assert energy.min() == pytest.approx(0.7848, rel=1e-3)
    assert np.max(z[-200:]) == pytest.approx(0.2, rel=1e-3)


def _fallen(height: float, times) -> np.ndarray:
    """Heights of the stick by another integrator, whose steps are too short to pass the bar."""
    s, w = np.polynomial.legendre.leggauss(7)
    x, w, k, c, d = 0.15 * s, 0.5 * w, 2e6, 500.0, 1e-4

    def rate(t, y):
        far = np.hypot(x, y[0])
        depth, up = 0.015 - far, y[0] / far
        xi = np.clip(depth / d, 0, 1)
        spring = k * d * (xi**3 - 0.5 * xi**4 + np.maximum(depth / d - 1, 0))
        push = np.maximum(spring - c * xi**2 * (3 - 2 * xi) * up * y[1], 0)
        return [y[1], -G + np.sum(w * push * up) / 0.1]

    return solve_ivp(rate, (0, times[-1]), [height, 0.0], rtol=1e-8, atol=1e-10, max_step=1e-3, t_eval=times).y[0]


@pytest.mark.parametrize("method", ["explicit", pytest.param("implicit", marks=pytest.mark.slow)])
def test_a_stick_that_falls_across_a_bar_is_stopped_from_any_height(method):
    """One batch, at default tolerances; a whole free fall is a step or two."""
    robot, heights = build(parse_robot(STICK)), np.array([0.1, 0.5, 1.2])
    start, times = robot.initial(), np.linspace(0, 0.6, 61)

    def fall(z):
        x = State(z[None], start.v, start.z)
        return simulate(robot, 0.6, samples=61, method=method, initial=x).value.state.q[:, 0]

    found = np.asarray(jax.jit(jax.vmap(fall))(jnp.asarray(heights)))
    for own, height in zip(found, heights, strict=True):
        np.testing.assert_allclose(own, _fallen(height, times), atol=1e-3)


def _bounced(height: float, stiffness: float, damping: float, mass: float, times=(0.5, 1.0)) -> list[float]:
    """Heights of the damped ball: parabolas, and phases of a contact by another integrator up to their ends."""
    d, times, heights = 1e-4, list(times), []
    t, z, v, phase = 0.0, height, 0.0, "free"

    def spring(x):
        return stiffness * d * (x**3 - 0.5 * x**4 if phase == "soft" else x - 0.5)

    def grip(x):
        return x**2 * (3 - 2 * x) if phase == "soft" else 1.0

    def rate(_, y):
        return [y[1], -G + (spring(-y[0] / d) - damping * grip(-y[0] / d) * y[1]) / mass]

    # where the force over the grip passes 0, the depth its softness, and the gap opens
    def slack(_, y):
        x = -y[0] / d
        free = (x - 0.5 * x**2) / (3 - 2 * x) if phase == "soft" else x - 0.5
        return stiffness * d * free - damping * y[1]

    full, opens = lambda _, y: y[0] / d + 1, lambda _, y: y[0] / d
    slack.direction, opens.direction = -1, 1
    while times:
        if phase == "free":
            falls = (v + np.sqrt(v**2 + 2 * G * z)) / G
            while times and times[0] <= t + falls:
                s = times.pop(0) - t
                heights.append(z + v * s - 0.5 * G * s**2)
            t, z, v, phase = t + falls, 0.0, v - G * falls, "soft"
            continue
        full.direction = -1 if phase == "soft" else 1
        events = [full, opens, slack] if damping > 0 else [full, opens]
        for event in events:
            event.terminal = True
        run = solve_ivp(
            rate, (t, times[0]), [z, v], method="DOP853", rtol=5e-14, atol=1e-15, max_step=1e-4, events=events
        )
        t, (z, v) = run.t[-1], run.y[:, -1]
        if run.status == 0:
            heights.append(z)
            times.pop(0)
        elif run.t_events[0].size:
            z, phase = -d, "hard" if phase == "soft" else "soft"
        else:
            z, phase = 0.0 if run.t_events[1].size else z, "free"
    return heights


_NAMES = (
    "body.joint.position",
    "body.joint.lower.stiffness",
    "body.joint.lower.damping",
    "body.mass",
)
_programs = {}


def slopes_of(method: str, rtol: float, damping: float, by=(0, 1, 2, 3)):
    """Heights after 0.5 and 1 s by start, stiffness, damping and mass, by one program for all, and by differences."""
    text = BALL.replace("softness: 0.1 mm", "softness: 0.1 mm, damping: 5 N s/m")
    theta, make = bind(parse_robot(text), _NAMES)
    if method not in _programs:

        def heights(x, rtol):
            run = simulate(make(x), 1.0, samples=3, method=method, rtol=rtol, atol=1e-2 * rtol)
            return run.value.state.q[1:, 0]

        _programs[method] = jax.jit(jax.jacfwd(heights), static_argnums=1)
    theta = np.array(theta)
    theta[2] = damping
    exact = []
    for k, x in ((k, theta[k]) for k in by):
        step = np.eye(4)[k] * 1e-5 * x
        more, less = _bounced(*(theta + step)), _bounced(*(theta - step))
        exact.append((np.array(more) - np.array(less)) / (2e-5 * x) if x else np.zeros(2))
    return np.asarray(_programs[method](jnp.asarray(theta), rtol)).T[[*by]], np.array(exact)


@pytest.mark.parametrize("method", ["explicit", pytest.param("implicit", marks=pytest.mark.slow)])
def test_a_damper_that_stops_all_within_one_softness_has_derivatives_too(method):
    """20 kN s/m stop the ball within 40 um, from where it creeps on; at default tolerances."""
    own, exact = slopes_of(method, 1e-4, 2e4, by=(0, 2))
    np.testing.assert_allclose(own, exact, rtol=0.01)


@pytest.mark.parametrize("damping", [0.0, 5.0, 15.0, 30.0])
@pytest.mark.parametrize(
    ("method", "rtol", "within"),
    [
        ("explicit", 1e-4, 1e-4),
        pytest.param("explicit", 1e-8, 1e-5, marks=pytest.mark.slow),
        pytest.param("implicit", 1e-4, 3e-4, marks=pytest.mark.slow),
        pytest.param("implicit", 1e-8, 1e-4, marks=pytest.mark.slow),
    ],
)
def test_a_motion_has_derivatives_through_bounces(method, rtol, within, damping):
    """One and several of them; the damper lets go while the ball is still in the contact."""
    own, exact = slopes_of(method, rtol, damping)
    checked = [0, 1, 3] if damping == 0 else slice(None)  # without a damper there is no derivative by it
    np.testing.assert_allclose(own[checked], exact[checked], rtol=within)


ROLLING = """
name: puck
water: {gravity: 9.81 m/s2, density: 0.001 kg/m3}
body:
  {kind: rigid, shape: spheroid, length: 40 mm, radius: 20 mm, mass: 0.3 kg,
   inertia: [4.8e-5 kg m2, 4.8e-5 kg m2, 4.8e-5 kg m2],
   joint: {kind: planar, axis: [0, -1, 0], start: {position: [0 m, 0 m, 90 mm]}}}
limbs:
  bar: {on: world, kind: rigid, shape: cylinder, radius: 10 mm, length: 3 m, mass: 1 kg, volume: 0 m3}
pairs:
  floor:
    {kind: contact, between: [body, bar], stiffness: 30 kN/m, damping: 10 N s/m, static_friction: 0.21,
     dynamic_friction: 0.2, creep: 10 mm/s}
"""


def test_what_sticks_in_a_bounce_has_derivatives_by_explicit_steps():
    """A wheel touches down twice at 1.1 m/s; its grip decays by 1e5 1/s. Differences are those of tight tolerances."""
    robot = build(parse_robot(ROLLING))
    start = robot.initial()

    def end(speed, rtol):
        settings = Settings("explicit", rtol, 1e-2 * rtol, jnp.asarray(100_000))
        m = begin(jnp.zeros(()), State(start.q, start.v.at[0].set(speed), start.z), settings, jnp.asarray(1e-3))
        _, x = integrate(robot, m, jnp.array([0.45]), settings)
        return jnp.concatenate([x.q[0], x.v[0]])

    both = jax.jit(lambda speed, rtol: jax.jvp(lambda speed: end(speed, rtol), (speed,), (jnp.ones(()),)))
    more, less = (both(jnp.asarray(1.1 + step), 1e-10)[0] for step in (1e-5, -1e-5))
    own, exact = both(jnp.asarray(1.1), 1e-4)[1], (more - less) / 2e-5
    np.testing.assert_allclose(own, exact, rtol=2e-3)


def test_a_first_step_that_is_far_too_long_leaves_no_short_ones_behind():
    """Drag of 5 kg/m stops 1 kg from 10 m/s, v = 10/(1 + 50 t); a step of 100 s over it ends beyond 1e30 m/s."""
    robot = build(
        parse_robot("""
name: sled
water: {gravity: 0 m/s2}
body:
  {kind: rigid, shape: point, mass: 1 kg, volume: 0 m3, joint: {kind: prismatic, axis: x, velocity: 10 m/s},
   loads: {drag: {kind: lumped_drag, drag_area: [100 cm2, 1 m2, 1 m2]}}}
""")
    )
    settings = Settings("explicit", jnp.asarray(1e-6), jnp.asarray(1e-8), jnp.asarray(1000))
    m, x = integrate(robot, begin(jnp.zeros(()), robot.initial(), settings, jnp.asarray(100.0)), jnp.ones(1), settings)
    assert m.status == 0
    assert float(x.v[0, 0]) == pytest.approx(10 / 51, rel=1e-4)
