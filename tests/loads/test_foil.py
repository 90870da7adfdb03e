"""Foils against thin-foil theory: Theodorsen's lift, Garrick's thrust, induced drag; stall; planforms.

The foil of these tests moves along -x, and is hinged at its leading edge.
"""

from dataclasses import replace
from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import hankel2

from nectosome.core import Strips, Water
from nectosome.description import parse_robot
from nectosome.description.drag import StartUp
from nectosome.loads import RigidFoil
from nectosome.loads.drag import StartingPlateDrag
from nectosome.loads.foil_theory import centre_of_pressure, lift_share, plate_added_mass_share
from nectosome.mechanism import Robot
from nectosome.mechanism.carried import AtSurface
from nectosome.model import build
from nectosome.solve import simulate

_n = jnp.asarray
RHO, SPEED, B, SPAN = 1000.0, 0.5, 0.05, 0.4
HEAVE, PITCH = 1e-4, 2e-3  # m, rad
ENDLESS = "aspect_ratio: 1e9, profile_drag: 0, broadside_drag: 0, stall: 89 deg"
FOIL = f"""
name: foil
water: {{density: {RHO} kg/m3, gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 1e-6 kg
  volume: 0 m3
  joint: {{kind: prismatic, axis: x, motion: {{kind: rate, rate: -{SPEED} m/s}}}}
limbs:
  heave:
    kind: rigid
    shape: point
    mass: 1e-6 kg
    volume: 0 m3
    joint: {{kind: prismatic, axis: y, motion: {{kind: sine, amplitude: HEAVE m, frequency: FREQUENCY Hz}}}}
  fin:
    on: heave
    kind: rigid
    shape: box
    length: 0.1 m
    width: 1 mm
    height: {SPAN} m
    mass: 1e-6 kg
    volume: 0 m3
    joint:
      kind: revolute
      axis: z
      motion: {{kind: sine, amplitude: PITCH rad, frequency: FREQUENCY Hz, phase: 40 deg}}
    loads:
      foil: {{kind: foil, span_along: z, ahead: -x, chord: 0.1 m, sections: 1, {ENDLESS}}}
"""


def theodorsen(k: float) -> complex:
    """C(k) with Hankel functions of the second kind."""
    h0, h1 = hankel2(0, k), hankel2(1, k)
    return h1 / (h1 + 1j * h0)


def jones(k: float) -> complex:
    """Transfer function of R. T. Jones' two lags."""
    return 1 - 0.165 * 1j * k / (1j * k + 0.0455) - 0.335 * 1j * k / (1j * k + 0.3)


@cache
def cycle(k: float, heave: float, pitch: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Phases of a cycle [n], forces of the drives per span [n, 3] and their powers [n, 3], after the wake has settled.

    Drives of the tow [N/m], the heave [N/m] and the pitch [N].
    """
    frequency = k * SPEED / B / (2 * np.pi)
    text = FOIL
    for name, value in (("HEAVE", heave), ("PITCH", pitch), ("FREQUENCY", frequency)):
        text = text.replace(f"{name} ", f"{value} ")
    times = np.append(0.0, (11 + np.arange(32) / 32) / frequency)
    run = simulate(build(parse_robot(text)), times[-1], samples=list(times), rtol=1e-9, atol=1e-12, method="implicit")
    found = run.results().data
    force, power = (np.asarray(found[name][1])[1:] / SPAN for name in ("reaction", "reaction_power"))
    return 2 * np.pi * frequency * times[1:], force, power


def thin_foil(k: float, heave: float, pitch: float, lag: complex) -> tuple[complex, complex, float, float]:
    """Amplitudes of the drives' force [N/m] and torque [N], mean thrust [N/m] and mean power [W/m].

    Theodorsen (1935) with the hinge at a = -1, and Garrick (1936); h is positive downwards, alpha with the nose up.
    """
    w, a = k * SPEED / B, -1.0
    h, alpha = 1j * heave, 1j * pitch * np.exp(1j * np.deg2rad(40))  # h = -y, alpha = -theta, of sines
    dh, dalpha = 1j * w * h, 1j * w * alpha
    Q = dh + SPEED * alpha + B * (0.5 - a) * dalpha
    mass = np.pi * RHO * B**2
    lift = mass * (1j * w * dh + SPEED * dalpha - B * a * 1j * w * dalpha) + 2 * np.pi * RHO * SPEED * B * lag * Q
    moment = (
        mass * (B * a * 1j * w * dh - SPEED * B * (0.5 - a) * dalpha - B**2 * (1 / 8 + a**2) * 1j * w * dalpha)
        + 2 * np.pi * RHO * SPEED * B**2 * (a + 0.5) * lag * Q
    )
    S = (2 * lag * Q - B * dalpha) / np.sqrt(2)
    thrust = 0.5 * np.pi * RHO * B * abs(S) ** 2 - 0.5 * (alpha * lift.conjugate()).real
    power = 0.5 * (lift * dh.conjugate() - moment * dalpha.conjugate()).real
    return -lift, moment, thrust, power


MOTIONS = pytest.mark.parametrize(("heave", "pitch"), [(HEAVE, 0.0), (0.0, PITCH), (HEAVE, PITCH)])


@pytest.mark.parametrize("k", [0.1, 0.5, 1.0, 2.0])
@MOTIONS
def test_force_and_moment_of_a_foil_that_swings_are_theodorsens(k: float, heave: float, pitch: float):
    """To rounding with the two lags of R. T. Jones, and within their 3 % of Theodorsen's function."""
    phases, force, _ = cycle(k, heave, pitch)
    for column, which in ((1, 0), (2, 1)):
        found = 2 * np.mean(force[:, column] * np.exp(-1j * phases))
        for lag, within in ((jones(k), 1e-4), (theodorsen(k), 0.03)):
            expected = thin_foil(k, heave, pitch, lag)[which]
            assert abs(found - expected) < within * abs(expected)


@pytest.mark.parametrize("k", [0.1, 0.5, 1.0, 2.0])
@MOTIONS
def test_thrust_and_power_are_garricks(k: float, heave: float, pitch: float):
    """Of the same theory with the two lags, to the order of the squared amplitudes."""
    _, force, power = cycle(k, heave, pitch)
    *_, thrust, effort = thin_foil(k, heave, pitch, jones(k))
    assert np.mean(force[:, 0]) == pytest.approx(thrust, rel=2e-3, abs=1e-3 * effort / SPEED)
    assert np.mean(power[:, 1:].sum(axis=1)) == pytest.approx(effort, rel=2e-3)


@pytest.mark.parametrize("k", [0.1, 0.5, 1.0, 2.0])
def test_the_efficiency_of_a_heaving_foil_is_garricks(k: float):
    """$\\eta = (F^2 + G^2)/F$ with Theodorsen's function F + i G."""
    _, force, power = cycle(k, HEAVE, 0.0)
    exact = abs(theodorsen(k)) ** 2 / theodorsen(k).real
    assert np.mean(force[:, 0]) * SPEED / np.mean(power[:, 1]) == pytest.approx(exact, rel=0.03)


# --- steady flow -----------------------------------------------------------------------------------------------------


def foil(**changes) -> RigidFoil:
    """A rectangular foil of aspect ratio 4, chord 0.1 m; ahead along x, normal along y, span along z."""
    axes = jnp.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    numbers = {"aspect_ratio": 4.0, "thickness": 0.0, "profile_drag": 0.0, "broadside": 2.0, "stall": 1.5}
    numbers |= {"softness": 1e-6, "lift": 1.0, "suction": 1.0} | changes
    return RigidFoil(
        axes,
        jnp.array([B]),
        **{name: jnp.asarray(value) for name, value in numbers.items()},
        place=jnp.zeros((1, 3)),
        width=jnp.array([SPAN]),
    )


def strips(u: float, w: float, turning: float = 0.0) -> Strips:
    one, none = jnp.ones(1), jnp.zeros((1, 3))
    return Strips(
        x=one,
        half_length=one,
        weight=0 * one,
        half_width=jnp.ones((1, 2)),
        round_axes=one,
        volume=one,
        inertia=jnp.zeros((1, 6, 6)),
        rotation=jnp.eye(3)[None],
        position=none,
        angular_velocity=none.at[0, 2].set(turning),
        velocity=none.at[0].set(jnp.array([u, w, 0.0])),
    )


@jax.jit
def steady(load: RigidFoil, u: float, w: float) -> jax.Array:
    """Wrench once states have settled, at a velocity (u ahead, w along the normal), over dynamic pressure and area."""
    here, water = strips(u, w), Water(jnp.asarray(RHO), jnp.asarray(0.0))
    speed = jnp.hypot(u, w)

    def on(z: jax.Array, _) -> tuple[jax.Array, None]:
        return z + 0.5 * B / speed * load.force(jnp.zeros(()), here, z, water)[1], None

    z, _ = jax.lax.scan(on, load.initial(), None, length=1000)
    return load.force(jnp.zeros(()), here, z, water)[0][0] / (0.5 * RHO * speed**2 * 2 * B * SPAN)


def lift_and_drag(load: RigidFoil, alpha: float, backward: bool = False) -> tuple[float, float, float]:
    """Coefficients of lift, drag and moment about the mid-chord by the chord, with the nose up."""
    way = np.array([np.cos(alpha) * (-1 if backward else 1), -np.sin(alpha)])  # of the foil; water comes from -y
    wrench = np.asarray(steady(load, *way))
    across = np.array([way[1], -way[0]]) if backward else np.array([-way[1], way[0]])
    return float(wrench[3:5] @ across), float(-wrench[3:5] @ way), float(wrench[2] / (2 * B))


@pytest.mark.parametrize("ratio", [0.5, 1.0, 4.0, 20.0])
def test_lift_and_induced_drag_of_a_finite_wing(ratio: float):
    r"""$C_L = 2\pi\kappa\alpha$, $C_D = C_L^2/(\pi A)$, to higher orders; lift at the centre of pressure.

    The added mass's own moment in a stream, $\tfrac\pi2 k \alpha$ with the nose up, is not that of the load.
    """
    for alpha in (0.01, 0.05):
        lift, drag, moment = lift_and_drag(foil(aspect_ratio=ratio), alpha)
        assert lift == pytest.approx(2 * np.pi * float(lift_share(jnp.asarray(ratio))) * alpha, rel=2 * alpha**2)
        assert drag == pytest.approx(lift**2 / (np.pi * ratio), abs=2 * lift * alpha**3)
        munk = np.pi / 2 * float(plate_added_mass_share(jnp.asarray(ratio))) * np.sin(alpha) * np.cos(alpha)
        arm = 0.5 - float(centre_of_pressure(jnp.asarray(ratio)))
        assert moment + munk == pytest.approx(arm * lift, rel=2 * alpha**2)


# A vortex lattice of horseshoes, 8 along the chord and 40 along the span, of rectangles at 2 deg: aspect ratio, lift
# slope, and place of the lift behind the leading edge in chords. One of 12 by 40, of another hand, is within 1 %.
LATTICE = ((0.5, 0.797, 0.115), (1.0, 1.501, 0.170), (2.0, 2.532, 0.211), (3.0, 3.208, 0.226), (8.0, 4.644, 0.243))


@pytest.mark.parametrize(("ratio", "slope", "centre"), LATTICE)
def test_moments_about_the_leading_edge_are_those_of_a_lattice(ratio: float, slope: float, centre: float):
    """Within 6 %, as the lift is; at the quarter chord it would be twice as much at an aspect ratio of 0.5."""
    alpha = np.deg2rad(2.0)
    lift, _, moment = lift_and_drag(foil(aspect_ratio=ratio), alpha)
    munk = np.pi / 2 * float(plate_added_mass_share(jnp.asarray(ratio))) * np.sin(alpha) * np.cos(alpha)
    at_edge = 0.5 * lift - (moment + munk)
    assert at_edge == pytest.approx(slope * centre * alpha, rel=0.06)
    assert at_edge / lift == pytest.approx(centre, abs=0.0035)


def test_an_endless_wing_has_lift_without_drag():
    """To the orders of angle that `cos(alpha)^2` leaves, and of the other edge, which takes part by 1e-5."""
    alpha = 0.05
    lift, drag, _ = lift_and_drag(foil(aspect_ratio=1e9, broadside=0.0), alpha)
    assert lift == pytest.approx(2 * np.pi * np.sin(alpha), rel=2 * alpha**4)
    assert abs(drag) < 2 * lift * alpha**3


def test_a_foil_with_less_lift_and_suction_has_the_drag_of_what_it_lacks():
    """C_L = k C_L1; of the suction C_L1 alpha - C_L1^2 / (pi A) of the whole lift, a share k^2 s of it is left."""
    alpha, k, s = np.deg2rad(2.0), 0.8, 0.7
    (whole, induced, _), (lift, drag, _) = (
        lift_and_drag(f, alpha) for f in (foil(broadside=0.0), foil(broadside=0.0, lift=k, suction=s))
    )
    normal, suction = whole * np.cos(alpha) + induced * np.sin(alpha), whole * np.sin(alpha) - induced * np.cos(alpha)
    assert lift == pytest.approx(k * normal * np.cos(alpha) + k**2 * s * suction * np.sin(alpha), rel=1e-6)
    assert drag == pytest.approx(k * normal * np.sin(alpha) - k**2 * s * suction * np.cos(alpha), rel=1e-6)
    assert drag > induced * k


def test_water_from_behind_makes_the_other_edge_lead():
    ahead, behind = (lift_and_drag(foil(), 0.1, backward) for backward in (False, True))
    assert behind == pytest.approx((*ahead[:2], -ahead[2]), rel=1e-9)


KAPPA, LAMBDA = StartUp().extra, StartUp().distance
STILL = Water(_n(RHO), _n(0.0))
PASSING = jax.jit(lambda load, u, w, z: load.force(jnp.zeros(()), strips(u, w), z, STILL))


def test_a_foil_across_its_path_is_a_plate_with_a_start_up():
    """At no speed ahead, whatever the memory of both: one force, and one rate of the two states."""
    load = StartingPlateDrag(_n(2.0), extra=_n(KAPPA), distance=_n(LAMBDA), softness=_n(1e-3), length=None, rows=(0,))
    for w, q in ((0.3, (0.0, 0.0)), (-0.2, (0.25, -0.1)), (1e-3, (0.2, 0.3))):
        wake = jnp.array([q])
        here = replace(strips(0.0, w), half_width=jnp.array([[1e-3, B]]), weight=jnp.array([SPAN]))
        expected, rate = load.force(jnp.zeros(()), here, wake, STILL)
        z = jnp.concatenate([jnp.array([[0.1, 0.2, 0.6]]), wake], axis=1)
        wrench, rates = PASSING(foil(softness=1e-3), 0.0, w, z)
        np.testing.assert_allclose(wrench[0, 3:], expected[0, 3:], rtol=1e-12)
        np.testing.assert_allclose(rates[:, 3:], rate, rtol=1e-12)


def test_no_motion_gains_energy_by_starts_and_reversals():
    """Work on the water less what its wake gains, in any state: what the drag across adds to a foil without it."""
    rng = np.random.default_rng(3)
    for u, w, *q in rng.normal(size=(50, 4)):
        x = rng.uniform()
        z = jnp.array([[0.0, 0.0, x, *q]])
        with_it, rates = PASSING(foil(), u, w, z)
        without, _ = PASSING(foil(broadside=0.0), u, w, z)
        steady_drag = (1 - x * u**2 / (u**2 + w**2)) * RHO * B * 2 * SPAN * np.abs(w) ** 3
        work = -float(with_it[0, 4] - without[0, 4]) * w - steady_drag
        gain = 2 * RHO * B**2 * 2 * SPAN * np.sum(np.array(KAPPA) * LAMBDA * q * np.asarray(rates[0, 3:]))
        assert work > gain * (1 - 1e-9)


def test_a_stalled_foil_is_a_plate_across_the_flow():
    """Before stall thin-foil theory; across the flow the drag coefficient of the plate; no lift there."""
    thin = foil(stall=np.deg2rad(15))
    before, attached = (lift_and_drag(f, np.deg2rad(8)) for f in (thin, foil()))
    assert before[0] == pytest.approx(attached[0], rel=0.01)
    lift, drag, _ = lift_and_drag(thin, np.pi / 2)
    assert drag == pytest.approx(2.0, rel=1e-3)
    assert abs(lift) < 1e-3


def test_lift_has_a_largest_value_at_stall():
    """Of an endless foil: thin-foil theory up to 8 deg, then 1.1 to 1.4 at the most, within 5 deg of stall."""
    endless = foil(aspect_ratio=1e6, stall=np.deg2rad(15))
    angles = np.arange(2, 31)
    lift = np.array([lift_and_drag(endless, np.deg2rad(angle))[0] for angle in angles])
    assert lift[6] == pytest.approx(2 * np.pi * np.sin(np.deg2rad(8)), rel=0.01)
    assert 1.1 < lift.max() < 1.4
    assert abs(angles[lift[:19].argmax()] - 15) <= 5


def test_stall_comes_late_on_the_upstroke():
    """A foil that pitches by 15 +- 10 deg about its mid-chord at k = 0.1 has a clockwise loop of lift.

    Its form is that of dynamic stall (McCroskey 1982): more lift on the way up than on the way down at the same angle,
    and at the most more than in steady flow.
    """
    load, k, count = foil(aspect_ratio=1e6, stall=np.deg2rad(15)), 0.1, 400
    omega = k * SPEED / B
    water = Water(jnp.asarray(RHO), jnp.asarray(0.0))
    phases = jnp.linspace(0, 4 * np.pi, 2 * count + 1)

    @jax.jit
    def lifts(load: RigidFoil) -> jax.Array:
        def on(z: jax.Array, phase: jax.Array) -> tuple[jax.Array, jax.Array]:
            angle, rate = jnp.deg2rad(15 - 10 * jnp.cos(phase)), jnp.deg2rad(10 * jnp.sin(phase)) * omega
            here = strips(SPEED * jnp.cos(angle), -SPEED * jnp.sin(angle), rate)
            force, rates = load.force(jnp.zeros(()), here, z, water)
            up = force[0, 3] * jnp.sin(angle) + force[0, 4] * jnp.cos(angle)
            return z + (phases[1] / omega) * rates, up / (RHO * SPEED**2 * B * SPAN)

        return jax.lax.scan(on, load.initial(), phases)[1]

    lift = np.asarray(lifts(load))[count:]
    up, down = lift[: count // 2 + 1], lift[count // 2 :][::-1]
    inner = slice(count // 10, count // 2 - count // 10)
    assert np.all(up[inner] > down[inner])
    assert lift.max() > 1.2 * max(lift_and_drag(load, np.deg2rad(angle))[0] for angle in range(10, 26))


# --- in the surface --------------------------------------------------------------------------------------------------


def upright(count: int, first: int | None = None) -> RigidFoil:
    """The foil in sections along z, or only the first of them, with the numbers of all."""
    points, weights = np.polynomial.legendre.leggauss(count)
    some = slice(None, first)
    place = jnp.zeros((count, 3)).at[:, 2].set(0.5 * SPAN * points)[some]
    load = foil(thickness=0.01, profile_drag=0.02, stall=0.3)
    half_chord = jnp.full(count, B)[some]
    return replace(load, half_chord=half_chord, place=place, width=jnp.asarray(0.5 * SPAN * weights)[some])


def test_a_foil_half_under_water_is_its_lower_half():
    """At its aspect ratio, whatever the motion: wrench, rates of its states under water, and added mass."""
    whole, half, r = upright(8), upright(8, 4), np.random.default_rng(0)
    assert float(jnp.sum(half.width)) == pytest.approx(0.5 * SPAN, rel=1e-14)
    moving = strips(1.0, 0.3)
    at = eqx.tree_at(lambda s: (s.velocity, s.angular_velocity), moving, (_n(r.normal(size=(1, 3))),) * 2)
    state = whole.initial() + 0.1 * r.normal(size=(8, 5))
    deep, surface = (Water(_n(RHO), _n(9.81), height) for height in (None, _n(0.0)))
    force = jax.jit(RigidFoil.force)
    found, rates = force(whole, _n(0.0), at, state, surface)
    expected, lower = force(half, _n(0.0), at, state[:4], deep)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-10)  # a box in closed form is 1e-9 of it thicker
    np.testing.assert_allclose(rates[:4], lower, rtol=1e-12)
    assert surface.surface is not None

    @jax.jit
    def added(load: RigidFoil, at: Strips, water: Water) -> jax.Array:
        once = AtSurface.of(load.inertia(at, water), _n(0.0), at, water)[0].under[0]
        return once + AtSurface.of_sections(load, _n(0.0), at, water).under

    under = added(whole, at, surface)
    np.testing.assert_allclose(under, half.inertia(at, deep)[0], rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("share", [0.0, 0.05, 0.37, 0.5, 0.81, 1.0])
def test_what_a_foil_has_under_water_grows_evenly_with_its_depth(share: float):
    """Upright, without turning: the force of the deep foil times the share of its span, also within a section."""
    load, here = upright(5), strips(1.0, 0.3)
    deep, surface = (Water(_n(RHO), _n(9.81), h) for h in (None, _n((share - 0.5) * SPAN)))
    force = jax.jit(RigidFoil.force)
    found, expected = (force(load, _n(0.0), here, load.initial(), water)[0][0, 3:] for water in (surface, deep))
    np.testing.assert_allclose(found, share * expected, rtol=1e-9, atol=1e-9)


# --- planforms -------------------------------------------------------------------------------------------------------

WING = """
name: wing
water: {density: 1000 kg/m3, gravity: 0 m/s2}
body: {kind: rigid, shape: box, length: 0.2 m, width: 50 mm, height: 2 mm, mass: 20 g, joint: {kind: free}, loads: {}}
"""


def wing(loads: str) -> Robot:
    return build(parse_robot(WING.replace("loads: {}", f"loads: {{wing: {{kind: foil, {loads}}}}}")))


def test_a_rectangular_fin_carries_the_water_of_a_plate():
    """Of chord 50 mm and span 0.2 m along x, lying in the x-y plane, about its centre; by strips."""
    added = np.asarray(wing("span_along: x, ahead: y, chord: 50 mm, sections: 8").added)[0]
    k = float(plate_added_mass_share(jnp.asarray(4.0)))
    mass = k * RHO * np.pi * 0.025**2 * 0.2
    expected = np.diag([k * RHO * np.pi * 0.025**4 / 8 * 0.2, mass * 0.2**2 / 12, 0, 0, 0, mass])
    np.testing.assert_allclose(added, expected, atol=1e-12)


def test_a_swept_fin_has_its_chords_where_they_are():
    """A fin whose leading edge runs back by 40 mm over the span; the couple of its mass is that of the centroids."""
    swept = wing("span_along: x, ahead: y, chord: 50 mm, leading_edge: [25 mm, -15 mm], sections: 8")
    added = np.asarray(swept.added)[0]
    mass = added[5, 5]
    assert added[0, 5] == pytest.approx(mass * -0.02, rel=1e-12)  # the middle of all chords is at y = -20 mm
    assert added[1, 5] == pytest.approx(0, abs=1e-12)
