"""Plates that start from rest and reverse: closed forms, Graham's drag, vortex sheets, energy, periodic motions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State, Stations, Status, Strips, Water
from nectosome.description import parse_robot
from nectosome.description.drag import StartUp
from nectosome.loads import PlateDrag, StartingPlateDrag
from nectosome.mechanism.reduce import in_plane
from nectosome.model import bind, build
from nectosome.solve import find_symmetry, periodic, simulate, steady
from nectosome.solve.integrate import Settings
from nectosome.solve.orbit import orbit
from nectosome.units import InputError

RHO, HEIGHT, LENGTH, SPEED = 1000.0, 0.04, 0.1, 0.3
EXTRA, DISTANCE = (np.array(StartUp.model_fields[name].default) for name in ("extra", "distance"))
SCALE = 0.5 * RHO * HEIGHT * LENGTH  # of a force over C v^2
WATER = Water(jnp.asarray(RHO), jnp.asarray(0.0))
PLATE = f"""
name: plate
water: {{density: {RHO} kg/m3, gravity: 0 m/s2}}
body:
  kind: rigid
  shape: box
  length: {LENGTH} m
  width: 1 mm
  height: {HEIGHT} m
  mass: 0.1 kg
  joint: {{kind: prismatic, axis: y, MOTION}}
  loads: {{drag: {{kind: plate_drag, normal: 2, start_up: {{softness: 1e-6 m/s}}}}}}
"""


def plate(motion: str) -> str:
    return PLATE.replace("MOTION", motion)


def load(softness: float = 1e-9, length: float | None = None) -> StartingPlateDrag:
    return StartingPlateDrag(
        jnp.asarray(2.0),
        extra=jnp.asarray(EXTRA),
        distance=jnp.asarray(DISTANCE),
        softness=jnp.asarray(softness),
        length=None if length is None else jnp.asarray(length),
        rows=(0,),
    )


def strip(velocity) -> Strips:
    one = jnp.array([LENGTH])
    section = jnp.array([[1e-3, HEIGHT / 2]])
    return Strips(
        rotation=jnp.eye(3)[None],
        position=jnp.zeros((1, 3)),
        angular_velocity=jnp.zeros((1, 3)),
        velocity=jnp.asarray(velocity)[None],
        **vars(Stations.along(one, one, section, one, jnp.eye(6)[None])),
    )


@jax.jit
def driven(drag: StartingPlateDrag, velocities: jax.Array, step: jax.Array) -> jax.Array:
    """Coefficients of the drag on a plate with the velocities along y at the middles of steps of a time [s]."""

    def on(z: jax.Array, v: jax.Array) -> tuple[jax.Array, jax.Array]:
        here = strip(jnp.stack([0 * v, v, 0 * v]))
        rate = lambda z: drag.force(jnp.zeros(()), here, z, WATER)[1]  # noqa: E731
        middle = z + 0.5 * step * rate(z)
        force = drag.force(jnp.zeros(()), here, middle, WATER)[0][0, 4]
        return z + step * rate(middle), -force / SCALE

    return jax.lax.scan(on, drag.initial(), velocities)[1]


# --- closed forms ----------------------------------------------------------------------------------------------------


def test_a_plate_from_rest_has_the_drag_of_the_closed_form():
    """F/F_steady = 1 + sum kappa exp(-s/(lambda h)) at the distance s, to 1e-6; after 60 heights the steady one."""
    robot = build(parse_robot(plate(f"motion: {{kind: rate, rate: {SPEED} m/s}}")))
    times = [0.0, *np.geomspace(1e-3, 60 * HEIGHT / SPEED, 40)]
    found = simulate(robot, times[-1], samples=times, rtol=1e-10, atol=1e-13).results().data["reaction"][1]
    distance = SPEED * np.asarray(times) / HEIGHT
    expected = 1 + np.exp(-np.outer(distance, 1 / DISTANCE)) @ EXTRA
    np.testing.assert_allclose(np.asarray(found)[:, 0] / (2 * SCALE * SPEED**2), expected, rtol=1e-6)
    assert expected[-1] == pytest.approx(1.0, abs=1e-15)


def test_a_plate_that_reverses_meets_its_own_vortices():
    """After one height ahead and back at the same speed: the part of the drag that was gone comes on top, to 1e-6."""
    count = 20_000
    velocities = SPEED * jnp.concatenate([jnp.ones(count), -jnp.ones(count)])
    step = HEIGHT / SPEED / count
    found = np.asarray(driven(load(), velocities, jnp.asarray(step)))[count:]
    s = (np.arange(count) + 0.5) / count
    grown = 1 - np.exp(-1 / DISTANCE)
    expected = 1 + np.exp(-np.outer(s, 1 / DISTANCE)) @ (EXTRA * (1 + grown))
    np.testing.assert_allclose(-found / (2 * SPEED**2), expected, rtol=1e-6)


def test_the_thin_side_of_a_plate_has_its_steady_drag():
    here, z = strip((0.1, 0.0, 0.5)), load().initial()
    found, rates = load().force(jnp.zeros(()), here, z, WATER)
    np.testing.assert_array_equal(found, PlateDrag(jnp.asarray(2.0)).force(jnp.zeros(()), here, (), WATER)[0])
    assert not jnp.any(rates)


# --- published laws --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cycle_drag():
    """Drag coefficients by the power of settled sines, by Keulegan-Carpenter number."""
    frequency = 1.0

    def at(number: float) -> float:
        amplitude = number * HEIGHT / (2 * np.pi)
        motion = f"motion: {{kind: sine, amplitude: {amplitude} m, frequency: {frequency} Hz}}"
        found = periodic(build(parse_robot(plate(motion))), rtol=1e-7)
        assert found.status == Status.SOLVED
        power = -float(found.means().load_power[0, 0])
        return power / (SCALE * (2 * np.pi * frequency * amplitude) ** 3 * 4 / (3 * np.pi))

    return at


@pytest.mark.parametrize("number", [1.0, 2.0, 4.0, 10.0, 20.0, 40.0])
def test_a_long_plate_that_goes_to_and_fro_takes_the_power_of_grahams_law(cycle_drag, number: float):
    """8 KC^(-1/3) (Graham 1980), within 1.6 % from KC = 1 to 40."""
    assert cycle_drag(number) == pytest.approx(8 * number ** (-1 / 3), rel=0.017)


def test_the_drag_of_long_strokes_comes_down_to_the_steady_one(cycle_drag):
    """Graham's law has 2.0 at KC = 64, and is not made for more; this drag is 9 % above 2 there."""
    assert cycle_drag(64.0) == pytest.approx(2.18, abs=0.02)
    assert 2.0 < cycle_drag(1000.0) < 2.01


class VortexSheets:
    """A plate of width 1 across plane flow of an ideal fluid, which leaves both edges in sheets of vortices.

    Chorin's blobs in the plate's frame, mapped from a circle, one from each edge at each step, with the strength that
    keeps the velocity at the edge finite (Kutta). Force by the impulse of the vortices: the added mass is left out.
    """

    radius = 0.25  # of the circle: z = Z + r^2/Z
    blob = 0.05

    def velocities(self, z: np.ndarray, strength: np.ndarray, U: float) -> np.ndarray:
        """Of vortices beyond the edge at 1/2; those beyond the other one are their mirror images."""
        r2, Z, g = self.radius**2, self.circle(z), strength / (2j * np.pi)
        apart, away = Z[:, None] - Z, z[:, None] - z
        for distance in (apart, away):
            np.fill_diagonal(distance, 1.0)
        mutual = 1 / apart
        np.fill_diagonal(mutual, 0.0)
        images = 1 / (Z[:, None] + r2 / Z) - 1 / (Z[:, None] + Z.conj()) - 1 / (Z[:, None] - r2 / Z.conj())
        slope = 1 - r2 / Z**2
        w = (-1j * U * (1 + r2 / Z**2) + (mutual + images) @ g) / slope - g * r2 / Z**3 / slope**2
        smooth = away.conj() / (np.abs(away) ** 2 + self.blob**2) - 1 / away
        np.fill_diagonal(smooth, 0.0)
        return (w + smooth @ g).conj()

    def circle(self, z: np.ndarray) -> np.ndarray:
        return 0.5 * (z + self.root(z))

    def root(self, z: np.ndarray) -> np.ndarray:
        return np.sqrt(z - 0.5) * np.sqrt(z + 0.5)

    def at_edge(self, z: np.ndarray) -> np.ndarray:
        """What vortices of strength 1 add to dw/dZ there."""
        r, Z = self.radius, self.circle(z)
        return (1 / (r - Z) - 1 / (r + Z.conj()) - 1 / (r - r**2 / Z.conj()) + 1 / (r + r**2 / Z)) / (2j * np.pi)

    def impulse(self, speed, step: float, count: int) -> np.ndarray:
        """Of the vortices, over density and width, after each of so many steps of a start from rest."""
        z, strength, found = np.zeros(0, complex), np.zeros(0), []
        for k in range(count):
            U = speed((k + 0.5) * step)
            new = 0.5 + 1j * (np.sqrt(2) * U * step / 8) ** (2 / 3)  # where a single vortex would be after a step
            lacks = -2j * U + strength @ self.at_edge(z)
            z = np.append(z, new)
            strength = np.append(strength, -(lacks / self.at_edge(z[-1:])[0]).real)
            first = self.velocities(z, strength, speed(k * step))
            second = self.velocities(z + step * first, strength, speed((k + 1) * step))
            z = z + 0.5 * step * (first + second)
            found.append(2 * strength @ np.real(self.root(z)))
        return np.array(found)


SHEETS = VortexSheets()


def single_vortex(exponent: float) -> float:
    r"""Drag coefficient of a start $U \sim t^m$ times $(s/h)^{1/3}$, by a vortex at each edge (Brown and Michael).

    Near an edge the flow without vortices is $-i U \sqrt{h \zeta}$. A vortex at $\zeta = \tau^2$, its image at
    $-\bar\tau$, and Kutta's condition give the circulation $\pi U \sqrt h |\tau|^2 / \Re\tau$; that no force acts on
    vortex and cut together puts it straight across the edge, at $|\tau|^3 = \sqrt2\,U \sqrt h\,t/(8 (2 m + 1))$. The
    impulse $2 \pi \rho\,h\,U |\tau|^2$ goes with $t^{(5 m + 2)/3}$.
    """
    m = exponent
    by_time = 8 * np.pi / 3 * (np.sqrt(2) / 8) ** (2 / 3) * (5 * m + 2) / 2 * (2 * m + 1) ** (-2 / 3)
    return by_time * (m + 1) ** (-1 / 3)


@pytest.mark.parametrize(("exponent", "constant"), [(0.0, 2.639), (1.0, 3.524)])
def test_a_start_lies_between_a_single_vortex_and_vortex_sheets(exponent: float, constant: float):
    """From 0.3 to 1 heights, at a constant speed and with a constant acceleration, to neither of which it was fitted.

    Within 14 % of the sheets up to 2 heights. Beyond, the sheets of an endless symmetric plate do not know of a wake
    that has mixed, and their force goes on to fall.
    """
    step, count, fine = 0.02, 120, 50
    impulse = SHEETS.impulse(lambda t: t**exponent, step, count)
    times = step * (np.arange(count) + 0.5)
    sheets = 2 * np.diff(np.append(0.0, impulse)) / step / times ** (2 * exponent)
    moments = (np.arange(count * fine) + 0.5) * step / fine
    velocities = HEIGHT * jnp.asarray(moments**exponent)
    found = np.asarray(driven(load(), velocities, jnp.asarray(step / fine))) / np.asarray(velocities) ** 2
    assert single_vortex(exponent) == pytest.approx(constant, abs=5e-4)

    def ways(t):
        return t ** (exponent + 1) / (exponent + 1)

    for way in (0.3, 0.5, 0.7, 1.0, 1.5, 2.0):
        near = np.abs(np.log(ways(times) / way)) < 0.15
        here = np.interp(way, ways(moments), found)
        assert here == pytest.approx(np.mean(sheets[near]), rel=0.14)
        if way <= 1:
            assert constant * way ** (-1 / 3) < here < np.mean(sheets[near])


@pytest.mark.parametrize("number", [1.0, 3.0, 6.0, 10.0])
def test_the_first_stroke_from_rest_takes_the_work_that_vortex_sheets_take(number: float):
    """Half of a sine: within 11 % from KC = 1 to 10, where it is 0.79 to 0.84 of that of a settled stroke."""
    amplitude, count, fine = number / (2 * np.pi), 100, 40
    step = np.pi / count
    middles, moments = (step * (np.arange(count) + 0.5), np.pi / (count * fine) * (np.arange(count * fine) + 0.5))
    speed = lambda t: amplitude * np.sin(t)  # noqa: E731
    force = 2 * np.diff(np.append(0.0, SHEETS.impulse(speed, step, count))) / step
    settled = 4 / 3 * amplitude**3
    sheets = np.sum(force * speed(middles)) * step / settled
    velocities = speed(moments)
    found = np.asarray(driven(load(), HEIGHT * jnp.asarray(velocities), jnp.asarray(step / fine))) / HEIGHT**2
    work = np.sum(found * velocities) * step / fine / settled
    assert work == pytest.approx(sheets, rel=0.11)
    assert 0.78 < work / (8 * number ** (-1 / 3)) < 0.85


@pytest.mark.parametrize("angle", [20.0, 30.0, 40.0])
def test_a_slender_plate_that_moves_along_itself_meets_water_without_vortices(angle: float):
    r"""Ten times as long as high: within 13 % of a slender delta wing's $\pi \sin^2\alpha$ (Polhamus 1966).

    The suction of a slender wing, $\tfrac{\pi}{4} A \alpha^2$, acts across its edges, which have a slope of A/4 to its
    axis; where the flow separates there it turns onto the normal.

    Without a length it is the steady drag across, $2 \sin^2\alpha$, at any angle.
    """
    alpha = np.deg2rad(angle)
    here = strip((-np.cos(alpha), np.sin(alpha), 0.0))

    def settled(drag: StartingPlateDrag) -> float:
        rates = lambda z: drag.force(jnp.zeros(()), here, z.reshape(1, 2), WATER)[1].ravel()  # noqa: E731
        z = jnp.linalg.solve(jax.jacfwd(rates)(jnp.zeros(2)), -rates(jnp.zeros(2)))
        return -float(drag.force(jnp.zeros(()), here, z.reshape(1, 2), WATER)[0][0, 4]) / SCALE

    assert settled(load()) == pytest.approx(2 * np.sin(alpha) ** 2, rel=1e-12)
    assert settled(load(length=10 * HEIGHT)) == pytest.approx(np.pi * np.sin(alpha) ** 2, rel=0.13)


# --- energy ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("length", [None, 0.3])
def test_no_motion_gains_energy(length: float | None):
    """What the plate gets is at most what the wake's energy rho h^2 C/4 sum kappa lambda w^2 per length loses.

    At 500 random velocities and states; so over any cycle, and over any motion from rest, it puts energy in.
    """
    drag = load(softness=0.1, length=length)
    r = np.random.default_rng(1)
    velocities, states = jnp.asarray(r.normal(size=(500, 3))), jnp.asarray(2 * r.normal(size=(500, 1, 2)))

    def balance(v: jax.Array, z: jax.Array) -> tuple[jax.Array, jax.Array]:
        force, rates = drag.force(jnp.zeros(()), strip(v), z, WATER)
        energy = lambda z: 0.25 * RHO * HEIGHT**2 * LENGTH * 2 * jnp.sum(EXTRA * DISTANCE * z**2)  # noqa: E731
        steady = PlateDrag(jnp.asarray(2.0)).force(jnp.zeros(()), strip(v), (), WATER)[0][0, 3:]
        power = (force[0, 3:] - steady) @ v
        return power, power + jax.jvp(energy, (z,), (rates,))[1]

    power, lost = jax.vmap(balance)(velocities, states)
    assert float(jnp.max(power)) > 0  # for a while a wake may push
    assert float(jnp.max(lost)) < 0


# --- in a robot ------------------------------------------------------------------------------------------------------

PADDLE = f"""
name: paddle
water: {{density: {RHO} kg/m3, gravity: 0 m/s2}}
body:
  kind: rigid
  shape: box
  length: {LENGTH} m
  width: 1 mm
  height: {HEIGHT} m
  mass: 0.1 kg
  joint: {{kind: revolute, axis: z, stiffness: 0.5 N m/rad,
           torque: {{kind: sine, amplitude: 0.1 N m, frequency: 1.5 Hz}}}}
  loads: {{drag: {{kind: plate_drag, normal: 1.3, start_up: {{softness: 20 mm/s, length: 0.4 m}}}}}}
"""
DRAG, JOINT = "body.loads.drag.", "body.joint.torque."
NUMBERS = [f"{DRAG}start_up.extra.0", f"{DRAG}start_up.distance.1", "body.height", f"{JOINT}frequency"]


@pytest.mark.slow
def test_a_periodic_motion_has_the_derivatives_of_finite_differences():
    """Angles and states of a paddle on a spring that a torque drives, by numbers of its load and its own: to 1e-5."""
    theta, make = bind(parse_robot(PADDLE), tuple(NUMBERS))
    symmetry = find_symmetry(make(theta))
    shares = jnp.linspace(0.0, 1.0, 9)

    def cycle(theta: jax.Array, rtol: float):
        robot, times = make(theta), shares / theta[-1]
        settings = Settings("implicit", *map(jnp.asarray, (rtol, 1e-2 * rtol, 100_000)), longest=times[-1] / 20)
        found = orbit(in_plane(robot), symmetry, robot.initial(), times, settings)
        states: State = found.value.states
        one = jnp.concatenate([states.q, jax.tree.leaves(states.z)[0].reshape(9, -1)], axis=1)
        return one, found.status

    slopes, status = jax.jit(jax.jacfwd(lambda theta: cycle(theta, 1e-8), has_aux=True))(theta)
    assert int(status) == Status.SOLVED
    motion = jax.jit(lambda theta: cycle(theta, 1e-10)[0])
    assert 0.1 < float(jnp.max(jnp.abs(motion(theta)[:, 0]))) < 1.5
    for k, number in enumerate(theta):
        move = 3e-4 * number * jnp.eye(len(theta))[k]
        quotient = (motion(theta + move) - motion(theta - move)) / (6e-4 * number)
        scale = jnp.max(jnp.abs(quotient))
        assert float(scale) > 0
        np.testing.assert_allclose(slopes[..., k], quotient, atol=1e-5 * float(scale))


def test_a_plate_that_sinks_steadily_has_its_steady_drag():
    """Lying, heavier than its water by 50 g, on a slide: C rho A V^2/2 = m' g to rounding."""
    text = PLATE.replace("axis: y, MOTION", "axis: z").replace("mass: 0.1 kg", "mass: 0.1 kg\n  volume: 50 cm3")
    text = text.replace("gravity: 0", "gravity: 9.81").replace("width: 1 mm", f"width: {HEIGHT} m")
    found = steady(build(parse_robot(text.replace(f"height: {HEIGHT} m", "height: 1 mm"))))
    assert found.status == Status.SOLVED
    assert float(found.value.state.v[0, 0]) == pytest.approx(-np.sqrt(0.05 * 9.81 / (2 * SCALE)), rel=1e-12)


def test_an_amplitude_and_a_start_up_count_the_same_vortices():
    both = PADDLE.replace("normal: 1.3,", "normal: 1.3, amplitude: 0.1 m,")
    with pytest.raises(InputError) as caught:
        parse_robot(both)
    assert caught.value.field == "body.loads.drag.amplitude"
    assert caught.value.message.endswith(
        "start_up gives a plate that goes to and fro its larger drag already. Leave it out, or write start_up: none."
    )


def test_a_plate_without_a_start_up_is_the_load_that_it_was():
    """No states; made for strokes that are long enough for a steady drag."""
    described = parse_robot(PADDLE.replace("{softness: 20 mm/s, length: 0.4 m}", "none"))
    robot = build(described)
    assert not jax.tree.leaves(robot.initial().z)
    assert PlateDrag in [type(one.load) for one in robot.loads]
    with_it, without = (one.parts["body"].loads["drag"].own_ranges for one in (parse_robot(PADDLE), described))
    assert {one.number: one.low for one in with_it} == {"reynolds": 100.0, "keulegan_carpenter": 1.0}
    assert {one.number: one.low for one in without} == {"reynolds": 100.0, "keulegan_carpenter": 64.0}


def test_it_tells_what_it_assumes():
    described = parse_robot(PADDLE)
    robot = build(described)
    drag = next(one.load for one in robot.loads if isinstance(one.load, StartingPlateDrag))
    told = {one.what: one.value for one in drag.assumed(described.parts["body"].loads["drag"], robot.water)}
    assert told.pop("drag at a start, of the steady one") == pytest.approx(1 + EXTRA.sum())
    assert told == {"which fades over": "0.189 and 1.6 heights"}
