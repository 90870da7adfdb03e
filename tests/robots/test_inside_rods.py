"""Tendons, chambers and muscles of rods, and rods that are made to take a shape: closed forms, power, messages."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nectosome import model
from nectosome.core import State
from nectosome.description import drive_period, dump_robot, parse_robot, with_values
from nectosome.loads import FluidChamber, Tendon
from nectosome.loads.rod_loads import Thread
from nectosome.mechanism import SoftRod
from nectosome.solve import load_stepping
from nectosome.units import InputError

HOLD = """
name: rod
water: {density: 1000 kg/m3, gravity: 0 m/s2}
body:
  kind: rod
  section: circle
  length: 0.3 m
  radius: 10 mm
  young: 0.2 MPa
  density: 1000 kg/m3
  points: 6
"""
BENDING = 0.2e6 * np.pi / 4 * 0.01**4  # E J [N m2]
AXIAL = 0.2e6 * np.pi * 0.01**2  # E A [N]
FREE = "  strains: {torsion: 1, bending_y: 2, bending_z: 2, extension: 1, shear_y: 0}\n"


def robot_of(*lines: str):
    return model.build(parse_robot(HOLD + "".join(f"  {line}\n" for line in lines)))


# a tendon, a chamber and a muscle in one rod; each does nothing until it is given a number
INSIDE = (
    HOLD
    + """
  tip_radius: 10 mm
  strains: {bending_y: 12, bending_z: 9, extension: 1}
  loads:
    pull:
      {kind: tendon, place: [0 m, 0 m], tip_place: [0 m, 0 m], along: [0, END], tension: {kind: constant, value: 0 N}}
    blow: {kind: chamber, place: [0 m, 0 m], area: 50 mm2, pressure: {kind: constant, value: 0 Pa}}
    beat: {kind: muscle, strain: bending_z, moment: WAVE}
aliases: {T: body.loads.pull.tension.value, p: body.loads.blow.pressure.value, m: body.loads.beat.moment.amplitude,
  r: body.tip_radius}
""".replace("WAVE", "{kind: wave, amplitude: 0 N m, frequency: 2 Hz, phase: 90 deg, envelope: [0, 1]}")
)


def at_rest(end: float = 1.0, **values: float | tuple[float, float]) -> dict[str, np.ndarray]:
    """Coordinates where the rod comes to rest, by strain; `values` are numbers, and places of the tendon."""
    tendon = {
        f"body.loads.pull.{n}.{k}": x for n, xs in values.items() if isinstance(xs, tuple) for k, x in enumerate(xs)
    }
    numbers = {name: x for name, x in values.items() if not isinstance(x, tuple)}
    robot = model.build(with_values(parse_robot(INSIDE.replace("END", str(end))), numbers | tendon))
    found = load_stepping(robot)
    assert found.status == 0
    rod, q = robot.tree.parts[0].body, np.asarray(found.value.q)
    assert isinstance(rod, SoftRod)
    of = [name.partition(".")[0] for name in rod.names]
    return {strain: q[np.array(of) == strain] for strain in of}


def test_a_tendon_beside_the_axis_bends_a_rod_evenly_towards_it():
    """E J kappa = T d, exactly: the tendon stays a circle at the distance d; and E A epsilon = -T."""
    T, d = 0.5, 6e-3
    q = at_rest(T=T, place=(d, 0.0), tip_place=(d, 0.0))
    np.testing.assert_allclose(q["bending_z"], [T * d / BENDING * 0.3, *np.zeros(9)], atol=1e-12)
    np.testing.assert_allclose(q["extension"], [-T / AXIAL, 0], atol=1e-12)
    np.testing.assert_allclose(q["bending_y"], 0, atol=1e-12)


def test_a_tendon_at_a_share_of_the_radius_curls_a_cone():
    r"""Turn of the tip $\int T c r / (E J) dx = \frac{2 c T L}{\pi E (r_0 - r_1)} (r_1^{-2} - r_0^{-2})$, c 0.7."""
    T, r0, r1 = 0.2, 10e-3, 4e-3
    q = at_rest(T=T, r=r1, place=(7e-3, 0.0), tip_place=(2.8e-3, 0.0))
    turn = 2 * 0.7 * T * 0.3 / (np.pi * 0.2e6 * (r0 - r1)) * (r1**-2 - r0**-2)
    assert q["bending_z"][0] == pytest.approx(turn, rel=2e-3)


def test_a_tendon_that_ends_half_way_bends_the_first_half():
    """What lies beyond its end is straight; the turn of the tip is T d / E J times its length."""
    T, d = 0.5, 6e-3
    q = at_rest(0.5, T=T, place=(0.0, d), tip_place=(0.0, d))["bending_y"]
    assert q[0] == pytest.approx(-T * d / BENDING * 0.15, rel=1e-9)  # towards +z, which is about -y
    steps = np.polynomial.legendre.legval(np.linspace(-0.8, -0.2, 7), q) / 0.3
    np.testing.assert_allclose(steps, -T * d / BENDING, rtol=0.15)  # but for ripples of the jump


def test_a_chamber_on_the_axis_makes_a_rod_longer():
    """E A epsilon = p A_c."""
    p, area = 20e3, 5e-5
    q = at_rest(p=p)
    np.testing.assert_allclose(q["extension"], [p * area / AXIAL, 0], atol=1e-12)
    np.testing.assert_allclose(q["bending_z"], 0, atol=1e-12)


def test_a_muscle_gives_its_moment_along_the_rod():
    """E J kappa(x) = m(x), where polynomials can follow."""
    q = at_rest(m=10e-3)
    expected = 10e-3 / BENDING * 0.3 * np.array([0.5, 0.5])  # x/L = P_0/2 + P_1/2
    np.testing.assert_allclose(q["bending_z"], [*expected, *np.zeros(8)], atol=1e-12)


PLAYS = "hysteresis: {direct: 0.4, thresholds: [5 kPa, 12 kPa], weights: [0.3, 0.2]}"


def after_plays(pressure: np.ndarray) -> np.ndarray:
    """The play operator as it is written."""
    out, H, r = [], np.zeros(2), np.array([5e3, 12e3])
    for p in pressure:
        H = np.maximum(p - r, np.minimum(p + r, H))
        out.append(0.4 * p + H @ [0.3, 0.2])
    return np.array(out)


def pressure_of(signal: str) -> FluidChamber:
    load = f"{{kind: chamber, place: [5 mm, 0 m], area: 10 mm2, {PLAYS}, pressure: {signal}}}"
    robot = robot_of("strains: {bending_z: 1}", f"loads: {{blow: {load}}}")
    return next(a.load for a in robot.loads if isinstance(a.load, FluidChamber))


def test_a_chamber_with_hysteresis_goes_through_its_loop():
    """As in the second of two cycles: on the way up it pushes less than on the way down."""
    blow = pressure_of("{kind: sine, amplitude: 20 kPa, offset: 5 kPa, frequency: 0.5 Hz, phase: 30 deg}")
    times = np.arange(64) / 64 * 2.0
    given = 5e3 + 20e3 * np.sin(np.pi * times + np.pi / 6)
    expected = after_plays(np.concatenate([given, given]))[64:]
    found = [float(blow.pressure(jnp.asarray(t))[0]) for t in times]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-6)
    up, down = (np.argmin(np.abs(given - 5e3) + 1e9 * (np.gradient(given) * sign < 0)) for sign in (1, -1))
    assert expected[up] < expected[down]


@pytest.mark.parametrize("ramp", ["5 ms", "2 s", "7 s"])
def test_a_ramp_before_hysteresis_leads_into_the_same_loop(ramp: str):
    """The loop is that of the whole pressure, whatever the ramp before it; at its start the chamber is at the mean."""
    sine = "{kind: sine, amplitude: 20 kPa, offset: 5 kPa, frequency: 0.5 Hz%s}"
    steady, grown = (pressure_of(sine % more).pressure for more in ("", f", ramp: {ramp}"))
    times = jnp.linspace(8.0, 10.0, 33)
    np.testing.assert_allclose(*(jax.vmap(p)(times)[0] for p in (grown, steady)), rtol=1e-12)
    mean = np.mean([float(steady(jnp.asarray(t))[0]) for t in np.arange(64) / 32])
    assert float(grown(jnp.zeros(()))[0]) == pytest.approx(mean, rel=1e-9)


def test_what_is_held_or_recorded_is_pressed_up_to_from_rest():
    held = pressure_of("{kind: constant, value: 20 kPa}").pressure(jnp.asarray(3.0))[0]
    assert float(held) == pytest.approx(after_plays(np.array([20e3]))[0])
    blow = pressure_of("{kind: recording, times: [0 s, 1 s, 2 s], values: [0 Pa, 20 kPa, 2 kPa]}")
    found = [float(blow.pressure(jnp.asarray(t))[0]) for t in (0.0, 1.0, 2.0)]
    np.testing.assert_allclose(found, after_plays(np.array([0, 20e3, 2e3])), atol=1e-9)


LOADS = """
  rest: {bending_y: [1 rad/m, 0.5 rad/m], torsion: 2 rad/m}
  loads:
    pull:
      {kind: tendon, place: [6 mm, -2 mm], tip_place: [-3 mm, 5 mm], along: [0.1, 0.9],
       tension: {kind: constant, value: 0.4 N}}
    blow:
      {kind: chamber, place: [-4 mm, 3 mm], area: 30 mm2, tip_area: 10 mm2,
       pressure: {kind: sine, amplitude: 20 kPa, frequency: 1 Hz}}
"""


@pytest.fixture(scope="module")
def threads():
    robot = model.build(parse_robot(HOLD + FREE + LOADS))
    return {a.name: a.load for a in robot.loads if isinstance(a.load, Tendon | FluidChamber)}


def stretch(thread: Thread, q: jax.Array) -> jax.Array:
    """Length of a thread per length of its rod, |gamma + kappa x d + d'|, at its points."""
    strain = thread.rest + thread.basis @ q
    return jnp.linalg.norm(strain[:, 3:] + jnp.cross(strain[:, :3], thread.place) + thread.slope, axis=1)


def length(thread: Thread, q: jax.Array) -> jax.Array:
    """Length of a thread [m]."""
    return jnp.sum(thread.weight * stretch(thread, q))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31))
def test_what_threads_give_is_the_derivative_of_their_length_and_volume(threads, seed: int):
    """-T dl/dq and p dV/dq: so their power is -T times the rate of the length, p times that of the volume."""
    q = jnp.asarray(np.random.default_rng(seed).normal(size=11) * 0.3)
    t, pull, blow = jnp.asarray(0.2), threads["pull"], threads["blow"]
    derivative = jax.grad(length, 1)(pull.thread, q)
    np.testing.assert_allclose(pull.force(t, q, q), -0.4 * derivative, rtol=1e-9, atol=1e-13)

    def volume(q: jax.Array) -> jax.Array:
        return jnp.sum(blow.thread.weight * blow.area * stretch(blow.thread, q))

    pressure = 20e3 * np.sin(2 * np.pi * 0.2)
    np.testing.assert_allclose(blow.force(t, q, q), pressure * jax.grad(volume)(q), rtol=1e-9, atol=1e-13)


def test_the_length_of_a_thread_is_that_of_its_curve(threads):
    """Against points along the built rod, joined by straight lines."""
    robot = model.build(parse_robot((HOLD + FREE + LOADS).replace("points: 6", "points: 200")))
    q = jnp.asarray(np.random.default_rng(3).normal(size=11) * 0.3)
    shape, rod = robot.tree.shape(q), robot.tree.parts[0].body
    s = np.asarray(rod.nodes)
    there = (s >= 0.1) & (s <= 0.9)
    share = (s[there] - 0.1) / 0.8
    across = np.stack([0 * share, 6e-3 - 9e-3 * share, -2e-3 + 7e-3 * share], axis=-1)
    points = np.asarray(shape.position)[there] + np.einsum("nij,nj->ni", np.asarray(shape.rotation)[there], across)
    seen = np.linalg.norm(np.diff(points, axis=0), axis=1).sum() / (share[-1] - share[0])
    assert float(length(threads["pull"].thread, q)) == pytest.approx(seen, rel=2e-3)


WAVE = (
    "{kind: wave, amplitude: 6 rad/m, offset: 1 rad/m, frequency: 2 Hz, wavelength: 0.4 m, "
    "envelope: [0.3, 0.6, 1], phase: 0.4 rad}"
)
SWIMS = """
  strains: {torsion: 1, bending_z: 7}
  joint: {kind: free}
  loads: {water: {kind: added_mass, normal: 1}, drag: {kind: drag, normal: 1}}
"""


@pytest.fixture(scope="module")
def made():
    return model.build(parse_robot(HOLD + SWIMS + f"  motion: {{bending_z: {WAVE}}}\n"))


def test_a_rod_takes_the_curvature_that_it_is_made_to(made):
    rod, t = made.tree.parts[0].body, 0.13
    x = made.initial()
    q, v, a = made.tree.complete(jnp.asarray(t), x.q, x.v)
    s = np.linspace(0, 1, 21)
    P = np.polynomial.legendre.legvander(2 * s - 1, 7)
    e = np.interp(s, [0, 0.5, 1], [0.3, 0.6, 1])
    w = 4 * np.pi
    angle = w * t - 2 * np.pi * s * 0.3 / 0.4 + 0.4
    rows = [k for k, name in enumerate(made.tree.coordinate_names) if "bending_z" in name]
    at = [k for k, name in enumerate(rod.names) if "bending_z" in name]
    np.testing.assert_allclose(P @ q[np.array(at) + 7] / 0.3, e * (1 + 6 * np.sin(angle)), atol=0.12)
    np.testing.assert_allclose(P @ v[np.array(rows)] / 0.3, e * 6 * w * np.cos(angle), atol=0.12 * w)
    np.testing.assert_allclose(P @ a[np.array(rows)] / 0.3, -e * 6 * w**2 * np.sin(angle), atol=0.12 * w**2)


def test_what_it_takes_to_make_the_shape_is_what_moves_a_free_rod_alike(made):
    """Inverse dynamics: the reactions, put on a rod that is free, give the accelerations that are prescribed."""
    free = model.build(parse_robot(HOLD + SWIMS))
    t, r = jnp.asarray(0.13), np.random.default_rng(0)
    x = made.initial()
    x = State(x.q + 0.1 * jnp.asarray(r.normal(size=x.q.shape)), jnp.asarray(0.2 * r.normal(size=x.v.shape)), x.z)
    rate = jax.jit(lambda x: made.rates(t, x))(x)
    q, v, a = made.tree.complete(t, x.q, x.v)
    a = a.at[made.tree.free_v].set(rate.v)
    reaction = jax.jit(lambda x, a: made.forces(t, x, a).residual)(x, rate.v)
    np.testing.assert_allclose(reaction[made.tree.free_v], 0, atol=1e-9)
    given_back = jax.jit(lambda x, u: free.rates(t, x, u))(State(q, v, free.initial().z), reaction)
    np.testing.assert_allclose(given_back.v, a, rtol=1e-6, atol=1e-6)


def test_what_is_made_goes_with_the_drives_and_has_their_period():
    description = parse_robot(HOLD + SWIMS + f"  motion: {{bending_z: {WAVE}}}\n")
    assert drive_period(description) == pytest.approx(0.5)
    assert parse_robot(dump_robot(description)) == description


MADE = f"  motion: {{bending_z: {WAVE}}}\n"
MISTAKES = {
    "no free strain": (
        "  strains: {bending_y: 1}\n" + MADE,
        r"strains do not name bending_z",
    ),
    "too coarse": (
        "  strains: {bending_z: 2}\n" + MADE,
        r"order 2 miss \d+ % .* It takes order",
    ),
    "no wave": (
        "  strains: {bending_z: 2}\n  motion: {bending_z: {kind: wave, amplitude: 1 rad/m, frequency: 1 Hz, "
        "envelope: [0]}}\n",
        "is 0 everywhere",
    ),
    "muscle of a held strain": (
        "  strains: {bending_z: 2}\n  loads: {beat: {kind: muscle, strain: torsion, moment: "
        "{kind: wave, amplitude: 1 N m, frequency: 1 Hz}}}\n",
        "torsion is not free",
    ),
    "a tendon that pushes": (
        "  strains: {bending_z: 2}\n  loads: {pull: {kind: tendon, place: [1 mm, 0 m], tension: "
        "{kind: sine, amplitude: 1 N, frequency: 1 Hz, offset: 0.5 N}}}\n",
        "it cannot push",
    ),
    "a play without a weight": (
        "  strains: {bending_z: 2}\n  loads: {blow: {kind: chamber, place: [1 mm, 0 m], area: 1 mm2, pressure: "
        "{kind: constant, value: 1 kPa}, hysteresis: {thresholds: [1 kPa], weights: []}}}\n",
        "there are 0 weights for 1 thresholds",
    ),
    "from end to start": (
        "  strains: {bending_z: 2}\n  loads: {pull: {kind: tendon, place: [1 mm, 0 m], along: [0.5, 0.2], tension: "
        "{kind: constant, value: 1 N}}}\n",
        "must be less than the second",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_told(name: str):
    text, message = MISTAKES[name]
    with pytest.raises(InputError, match=message):
        parse_robot(HOLD + text)


def test_muscles_are_of_rods_only():
    muscle = "{kind: muscle, strain: bending_z, moment: {kind: wave, amplitude: 1 N m, frequency: 1 Hz}}"
    rigid = f"name: r\nbody: {{kind: rigid, shape: point, mass: 1 kg, loads: {{own: {muscle}}}}}\n"
    with pytest.raises(InputError, match="acts on a rod, not on a rigid part"):
        parse_robot(rigid)


def test_sections_go_over_from_one_to_the_next():
    """Half widths at the stations, and the mass, which the Gauss points see but for kinks."""
    text = HOLD.replace("radius: 10 mm", "radius: 4 mm\n  tip_radius: 2 mm").replace("points: 6", "points: 40")
    text += "  strains: {bending_z: 2}\n  between: [{at: 0.2, radius: 12 mm}, {at: 0.7, radius: 8 mm}]\n"
    robot = model.build(parse_robot(text))
    rod = robot.tree.parts[0].body
    assert isinstance(rod, SoftRod)
    radius = np.interp(rod.nodes, [0, 0.2, 0.7, 1], [4e-3, 12e-3, 8e-3, 2e-3])
    np.testing.assert_allclose(robot.tree.stations.half_width, np.stack([radius, radius], axis=-1), rtol=1e-12)
    cones = [0.2 * (4**2 + 4 * 12 + 12**2), 0.5 * (12**2 + 12 * 8 + 8**2), 0.3 * (8**2 + 8 * 2 + 2**2)]
    mass = 1000 * 0.3 * np.pi / 3 * sum(cones) * 1e-6
    assert float(robot.weight()[0]) == pytest.approx(mass, rel=1e-3)


@pytest.mark.parametrize(
    ("between", "message"),
    [
        ("[{at: 0.7, radius: 1 mm}, {at: 0.2, radius: 1 mm}]", "in the order in which they come"),
        ("[{at: 0.7, width: 1 mm}]", r"between.0.radius: is missing: a section of this rod has radius"),
        ("[{at: 0.7, radius: 1 mm, width: 1 mm}]", r"between.0.width: is none of its sizes"),
    ],
)
def test_sections_that_do_not_fit_are_told(between: str, message: str):
    with pytest.raises(InputError, match=message):
        parse_robot(HOLD + f"  strains: {{bending_z: 2}}\n  between: {between}\n")
