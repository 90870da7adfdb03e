"""What everything that acts between two parts promises, held against all there is; a new one without an example fails.

The formulas, and the nearest places of a chain against a search, too.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jax.flatten_util import ravel_pytree

import nectosome.loads as ld
from nectosome.core import PairLoad, Stations, Strips
from nectosome.core.se3 import exp_so3, rotation_from_rpy
from nectosome.loads.contact import nearest

_n = jnp.asarray
STATIONS = 4
# powers of length and of force times time, so that units change without mass
LENGTH, FORCE, RATE = np.array([1, 0, 0]), np.array([1, 1, -2]), np.array([0, 0, -1])
_UNITS = np.array([3.0, 0.2, 7.0])


class Example(NamedTuple):
    """A pair and the dimension (powers of length, mass, time) of its parameters."""

    load: PairLoad
    dimensions: dict[str, np.ndarray]


def _places(seed: int, stations: tuple[int, ...]) -> ld.AttachedPlaces:
    return ld.AttachedPlaces(stations, _n(0.02 * np.random.default_rng(seed).normal(size=(len(stations), 3))))


def _end(seed: int, station: int) -> ld.BushingEnd:
    return ld.BushingEnd(_places(seed, (station,)), exp_so3(_n(np.random.default_rng(seed).normal(size=3))))


def _contact(static: float, dynamic: float) -> ld.PartContact:
    """Beads of 30 mm on a part, and a chain that gets thinner on the other."""
    return ld.PartContact(
        ld.Beads(_places(3, (0, 1, 2, 3, 3)), _n([0.03, 0.025, 0.03, 0.028, 0.02])),
        _n([0.1, 0.3, 0.2, 0.2, 0.2]),
        ld.Beads(_places(4, (0, 2, 2, 3)), _n([0.03, 0.025, 0.02, 0.02])),
        *map(_n, (300.0, 5.0, 0.01)),
        ld.Friction(*map(_n, (static, dynamic, 0.3))),
    )


_CONTACT = {
    **dict.fromkeys(("beads.at.place", "beads.radius", "chain.at.place", "chain.radius", "softness"), LENGTH),
    **dict.fromkeys(("share", "friction.static_friction", "friction.dynamic_friction"), 0 * LENGTH),
    "stiffness": FORCE - LENGTH,
    "damping": FORCE - LENGTH - RATE,
    "friction.creep": LENGTH + RATE,
}
EXAMPLES = {
    "weld": Example(
        ld.Bushing(_end(1, 2), _end(2, 0), *map(_n, (300.0, 4.0, 2.0, 0.1))),
        {
            **dict.fromkeys(("first.at.place", "second.at.place"), LENGTH),
            **dict.fromkeys(("first.rotation", "second.rotation"), 0 * LENGTH),
            "stiffness": FORCE - LENGTH,
            "damping": FORCE - LENGTH - RATE,
            "turning_stiffness": FORCE + LENGTH,
            "turning_damping": FORCE + LENGTH - RATE,
        },
    ),
    "contact": Example(_contact(0.0, 0.0), _CONTACT),
    "contact with friction": Example(_contact(0.9, 0.6), _CONTACT),
}
every = pytest.mark.parametrize("example", EXAMPLES.values(), ids=EXAMPLES)


def strips(seed: int, apart: float = 0.0) -> Strips:
    """A crooked part of some centimetres that passes the origin, turned and moving anyhow."""
    r = np.random.default_rng(seed)
    line = np.linspace(-0.03, 0.03, STATIONS)[:, None] * r.normal(size=3) + 0.01 * r.normal(size=(STATIONS, 3))
    return Strips(
        rotation=exp_so3(_n(r.normal(size=(STATIONS, 3)))),
        position=_n(line + np.array([0, 0, apart])),
        angular_velocity=_n(r.normal(size=(STATIONS, 3))),
        velocity=_n(0.3 * r.normal(size=(STATIONS, 3))),
        **vars(
            Stations.along(
                _n(np.arange(STATIONS) * 0.04),
                _n(np.full(STATIONS, 0.04)),
                _n(np.full((STATIONS, 2), 0.03)),
                _n(np.full(STATIONS, 1e-4)),
                jnp.zeros((STATIONS, 6, 6)),
            )
        ),
    )


def close(found, expected, rel: float = 1e-12, abs: float = 0.0):
    np.testing.assert_allclose(found, expected, rtol=rel, atol=abs)


def in_world(s: Strips, wrench) -> tuple[np.ndarray, np.ndarray]:
    """Force, and moment about the world's origin."""
    force = np.einsum("nij,nj->ni", s.rotation, wrench[:, 3:])
    moment = np.einsum("nij,nj->ni", s.rotation, wrench[:, :3]) + np.cross(s.position, force)
    return force.sum(axis=0), moment.sum(axis=0)


def moved_on(s: Strips, time) -> Strips:
    """Where the stations are a little later, to first order in time."""
    position = s.position + time * jnp.einsum("nij,nj->ni", s.rotation, s.velocity)
    return eqx.tree_at(
        lambda s: (s.position, s.rotation), s, (position, s.rotation @ exp_so3(time * s.angular_velocity))
    )


def power(s: Strips, wrench):
    return jnp.sum(wrench * jnp.concatenate([s.angular_velocity, s.velocity], axis=1))


force = eqx.filter_jit(lambda load, a, b: load.force(a, b))

# --- the promises --------------------------------------------------------------------------------------------------


def test_every_pair_has_an_example():
    there = {c for c in PairLoad.__subclasses__() if c.__module__.startswith("nectosome.loads")}
    assert there == {type(e.load) for e in EXAMPLES.values()}


@every
def test_the_two_wrenches_cancel(example: Example):
    for seed in range(20):
        a, b = strips(seed), strips(seed + 100)
        (fa, ma), (fb, mb) = (in_world(s, w) for s, w in zip((a, b), force(example.load, a, b), strict=True))
        assert np.linalg.norm(fa) > 0.01
        close(fa, -fb, abs=1e-13 * np.linalg.norm(fa))
        close(ma, -mb, abs=1e-13 * np.linalg.norm(fa))


@every
def test_what_it_gives_it_has_stored(example: Example):
    """The power is less than the rate at which the energy falls, and the same without dampers and friction."""
    ideal = eqx.tree_at(lambda x: x.damping, example.load, _n(0.0))
    if isinstance(ideal, ld.Bushing):
        ideal = eqx.tree_at(lambda x: x.turning_damping, ideal, _n(0.0))
    else:
        ideal = eqx.tree_at(lambda x: x.friction, ideal, ld.Friction(*map(_n, (0.0, 0.0, 1.0))))

    @eqx.filter_jit
    def balance(load, a, b):
        falls = -jax.jvp(lambda t: load.energy(moved_on(a, t), moved_on(b, t)), (0.0,), (1.0,))[1]
        return sum(power(s, w) for s, w in zip((a, b), load.force(a, b), strict=True)), falls

    for seed in range(30):
        a, b = strips(seed), strips(seed + 100)
        given, falls = balance(ideal, a, b)
        assert abs(falls) > 0
        close(given, falls, rel=1e-9, abs=1e-12)
        given, falls = balance(example.load, a, b)
        assert given < falls


@every
def test_moving_both_parts_and_the_observer_together_changes_nothing(example: Example):
    """In another place, turned, and also where both are carried along by one rigid motion."""
    a, b = strips(1), strips(2)
    Q, shift = exp_so3(_n([0.4, -0.7, 1.1])), _n([0.3, -0.2, 1.5])
    spin, drift = _n([0.5, -2.0, 1.0]), _n([1.0, 2.0, 3.0])

    def carried(s: Strips) -> Strips:
        R, p = Q @ s.rotation, s.position @ Q.T + shift
        w = s.angular_velocity + jnp.einsum("nji,j->ni", R, spin)
        v = s.velocity + jnp.einsum("nji,nj->ni", R, drift + jnp.cross(spin, p))
        return eqx.tree_at(lambda s: (s.rotation, s.position, s.angular_velocity, s.velocity), s, (R, p, w, v))

    before = force(example.load, a, b)
    for found, expected in zip(force(example.load, carried(a), carried(b)), before, strict=True):
        close(found, expected, rel=1e-9, abs=1e-11 * float(jnp.max(jnp.abs(expected))))


@every
def test_the_formula_holds_in_any_units(example: Example):
    length, rate = np.prod(_UNITS**LENGTH), np.prod(_UNITS**RATE)

    def scaled(s: Strips) -> Strips:
        moved = (s.position * length, s.angular_velocity * rate, s.velocity * length * rate)
        return eqx.tree_at(lambda s: (s.position, s.angular_velocity, s.velocity), s, moved)

    def of(load, name: str):
        for part in name.split("."):
            load = getattr(load, part)
        return load

    load = example.load
    assert len(jax.tree.leaves(load)) == len(example.dimensions)
    for name, powers in example.dimensions.items():
        load = eqx.tree_at(lambda x, n=name: of(x, n), load, of(load, name) * np.prod(_UNITS**powers))
    a, b = strips(1), strips(2)
    units = np.prod(_UNITS**FORCE) * np.array([length] * 3 + [1.0] * 3)
    for found, expected in zip(force(load, scaled(a), scaled(b)), force(example.load, a, b), strict=True):
        close(found, expected * units, rel=1e-9, abs=1e-10)
    close(load.energy(scaled(a), scaled(b)), example.load.energy(a, b) * units[0], rel=1e-9)


@every
def test_gradients_are_those_of_finite_differences(example: Example):
    x, unravel = ravel_pytree((example.load, strips(3), strips(4)))

    def of(x):
        return jnp.concatenate([w.ravel() for w in unravel(x)[0].force(*unravel(x)[1:])])

    @jax.jit
    def slopes(x):
        step = 1e-7 * jnp.maximum(jnp.abs(x), 1e-2)
        ends = [jax.vmap(of)(x + sign * jnp.diag(step)) for sign in (1, -1)]
        return jax.jacfwd(of)(x), jax.jacrev(of)(x), (ends[0] - ends[1]).T / (2 * step)

    forward, reverse, differences = slopes(x)
    scale = float(jnp.max(jnp.abs(forward)))
    close(reverse, forward, rel=1e-9, abs=1e-11 * scale)
    close(forward, differences, rel=1e-5, abs=1e-7 * scale)


@every
def test_gradients_are_finite_at_rest_and_in_one_place(example: Example):
    still = eqx.tree_at(lambda s: (s.velocity, s.angular_velocity), strips(3), (jnp.zeros((STATIONS, 3)),) * 2)

    def of(x):
        return jnp.concatenate([w.ravel() for w in x[0].force(*x[1:])])

    for other in (still, strips(4)):
        found = jax.jit(jax.jacfwd(of))((example.load, still, other))
        assert all(jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves(found))


# --- each of them --------------------------------------------------------------------------------------------------


def test_a_tie_that_is_as_it_wants_to_be_does_nothing():
    a = strips(1)
    a = eqx.tree_at(lambda s: (s.velocity, s.angular_velocity), a, (jnp.zeros((STATIONS, 3)),) * 2)
    bushing = ld.Bushing(_end(5, 1), _end(5, 1), *map(_n, (300.0, 4.0, 2.0, 0.1)))
    for w in bushing.force(a, a):
        close(w, 0 * w, abs=1e-13)


def test_a_weld_turns_back_by_the_sine_of_the_turn():
    bushing = ld.Bushing(_end(5, 1), _end(5, 1), *map(_n, (300.0, 0.0, 2.0, 0.0)))
    bushing = eqx.tree_at(lambda t: (t.first.at.place, t.second.at.place), bushing, (jnp.zeros((1, 3)),) * 2)
    a = strips(1)
    b = eqx.tree_at(lambda s: s.rotation, a, rotation_from_rpy(_n([0.0, 0.0, 0.7])) @ a.rotation)
    (_, turn), _ = (in_world(s, w) for s, w in zip((a, b), bushing.force(a, b), strict=True))
    close(turn, [0, 0, 2 * np.sin(0.7)], rel=1e-12, abs=1e-12)


def test_parts_that_are_apart_do_not_feel_each_other():
    for w in force(_contact(0.9, 0.6), strips(1), strips(2, apart=0.5)):
        assert not jnp.any(w)


def test_friction_is_largest_where_it_begins_to_slip():
    """mu_s N at the creep, to the hyperbolic tangent of 4; mu_d N well beyond."""
    friction = ld.Friction(_n(0.9), _n(0.6), _n(1e-3))
    v = jnp.stack([x * _n([0.6, 0.8, 0.0]) for x in (0.5e-3, 1e-3, 2e-3, 1.0)])
    f = jnp.linalg.norm(friction.force(jnp.full(4, 2.0), v), axis=1)
    assert f[1] == pytest.approx(0.6 * 2 * np.tanh(4.0) + 0.3 * 2, rel=1e-12)
    assert f[0] < f[1]
    assert f[2] < f[1]
    assert f[3] == pytest.approx(0.6 * 2, rel=1e-6)


_coordinate = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
_point = st.tuples(_coordinate, _coordinate, _coordinate)
_search = jnp.linspace(0.0, 1.0, 20001)[:, None]
_nearest = jax.jit(nearest)


@given(st.tuples(_point, _point, _point), _point, st.tuples(*3 * (st.floats(0.01, 0.3),)))
def test_nearest_places_are_those_that_a_search_finds(nodes, point, radius):
    nodes, point, radius = _n(nodes), _n(point), _n(radius)
    found = _nearest(point[None], nodes, radius)
    for k in range(2):
        places = nodes[k] + _search * (nodes[k + 1] - nodes[k])
        r = radius[k] + _search[:, 0] * (radius[k + 1] - radius[k])
        best = float(jnp.min(jnp.linalg.norm(point - places, axis=1) - r))
        assert float(found.distance[0]) <= best + 1e-12
        if k == found.segment[0]:
            assert float(found.distance[0]) == pytest.approx(best, abs=2e-4)
    k, s = int(found.segment[0]), float(found.share[0])
    centre, r = nodes[k] + s * (nodes[k + 1] - nodes[k]), radius[k] + s * (radius[k + 1] - radius[k])
    assert float(jnp.linalg.norm(point - centre) - r) == pytest.approx(float(found.distance[0]), abs=1e-12)


def test_the_forces_converge_with_the_number_of_beads():
    """A straight rod, 0.4 m, across a thick cylinder: beads at Gauss points, against very many of them."""

    def pushed(count: int) -> float:
        s, w = np.polynomial.legendre.leggauss(count)
        x = np.stack([0.2 * s, np.zeros(count), np.full(count, 0.055)], axis=1)
        contact = ld.PartContact(
            ld.Beads(ld.AttachedPlaces((0,) * count, _n(x)), _n(np.full(count, 0.01))),
            _n(0.5 * w),
            ld.Beads(ld.AttachedPlaces((0, 0), _n([[0, -1.0, 0], [0, 1.0, 0]])), _n([0.05, 0.05])),
            *map(_n, (1000.0, 0.0, 1e-3)),
            ld.Friction(*map(_n, (0.0, 0.0, 1.0))),
        )
        one = jax.tree.map(lambda x: x[:1], strips(1))
        one = eqx.tree_at(lambda s: (s.rotation, s.position), one, (jnp.eye(3)[None], jnp.zeros((1, 3))))
        return float(eqx.filter_jit(contact.force)(one, one)[0][0, 5])

    exact = pushed(2000)
    off = [abs(pushed(count) / exact - 1) for count in (10, 40, 160)]
    assert exact > 0
    assert off[1] < 0.1
    assert off[2] < 0.01
