"""What every load promises, held against every load there is; a new load without an example here fails."""

import importlib
import inspect
import pkgutil
import re
from functools import cache
from operator import attrgetter

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float
from tests.load_examples import ACCELERATION, DENSITY, EXAMPLES, FORCE, LENGTH, MOMENT, NUMBER, RATE, SPEED, Example

import nectosome.loads as ld
from nectosome.core import CrankRate, CrankState, JointLoad, Load, Rate, ReshapingLoad, Stations, Strips, Water, wetted
from nectosome.core.se3 import exp_so3
from nectosome.description.foil_planform import FoilLoad

_n = jnp.asarray


def close(found, expected, rel: float = 1e-12, abs: float = 0.0):
    np.testing.assert_allclose(found, expected, rtol=rel, atol=abs)


def _name(example: Example) -> str:
    load = example.load
    if isinstance(load, JointLoad):
        return f"{type(load).__name__}-{example.joint}"
    options = [name for name in ("follower", "separated") if getattr(load, name, False)]
    return "-".join([type(load).__name__, *options, *["cranked"] * _cranked(load)])


def _cranked(load: Load | JointLoad) -> bool:
    """Whether a joint turns its crank."""
    return getattr(load, "crank" if isinstance(load, ld.Jet) else "speed", 0.0) is None


def _state(load: Load, time: float | Array = 1.0):
    """Initial state, with that of a crank, at which a jet fills, in units of time that are so much smaller."""
    return CrankState(_n(1.2), _n(9.0) / time, load.initial()) if _cranked(load) else load.initial()


ON_BODIES = [e for e in EXAMPLES if isinstance(e.load, Load)]
ON_JOINTS = [e for e in EXAMPLES if isinstance(e.load, JointLoad)]
DISSIPATIVE = [e for e in EXAMPLES if e.load.dissipative]
every = pytest.mark.parametrize
STATIONS = 4


def test_every_load_has_an_example():
    for module in pkgutil.walk_packages(ld.__path__, "nectosome.loads."):
        importlib.import_module(module.name)
    there = {c for base in (Load, JointLoad) for c in _leaves(base) if c.__module__.startswith("nectosome.loads")}
    assert {c.__name__ for c in there} <= {type(e.load).__name__ for e in EXAMPLES}


def _leaves(kind: type) -> set[type]:
    below = kind.__subclasses__()
    return set().union(*map(_leaves, below)) if below else {kind}


@every("example", EXAMPLES, ids=_name)
def test_every_parameter_is_named_with_its_dimension(example: Example):
    assert set(_arrays(example.load)) == set(example.dimensions)


def _arrays(x: eqx.Module, within: str = "") -> list[str]:
    """Names of all numbers, those of parts with a dot."""
    found = []
    for name, value in vars(x).items():
        found += _arrays(value, f"{name}.") if isinstance(value, ld.GroundContact | Rate) else []
        found += [within + name] if eqx.is_inexact_array(value) else []
    return found


_NEEDED = {
    "reynolds": {"speed", "length"},
    "keulegan_carpenter": {"across", "height"},
    "reduced_frequency": {"across", "ahead", "chord"},
    "stalled": {"stalled"},
    "aspect_ratio": {"aspect_ratio"},
    "formation": {"jet"},
}


@every("example", ON_BODIES, ids=_name)
def test_a_load_tells_the_flow_that_its_ranges_are_about(example: Example):
    """Ranges without a flow would never warn; each number has what it is made of, at the same places."""
    kind = FoilLoad if isinstance(example.load, ld.Foil) else getattr(example.load, "described_by", None)
    ranges = getattr(kind, "ranges", ())
    flow = example.load.flow(around(example.load, 3))
    assert bool(ranges) == (flow is not None)
    if flow is not None:
        known = {name: value for name, value in flow._asdict().items() if value is not None}
        assert set().union(*(_NEEDED[one.number] for one in ranges)) <= {*known}
        assert len({value.shape[0] for value in known.values()}) == 1


# --- the scene a load on a body sees -------------------------------------------------------------------------------


class Stream(eqx.Module):
    """A current that changes with time and place: c = velocity cos(rate t) + gradient (x - origin)."""

    velocity: Float[Array, "3"]
    gradient: Float[Array, "3 3"]
    rate: Float[Array, ""]
    origin: Float[Array, "3"]

    def __call__(self, t: Array, x: Array) -> Array:
        return self.velocity * jnp.cos(self.rate * t) + self.gradient @ (x - self.origin)


def around(load: Load, seed: int) -> Strips:
    """Those of a load: a bell has two gaps with two strips at two places each."""
    return strips(seed, 2 * STATIONS if isinstance(load, ld.BellJet) else STATIONS)


@cache
def strips(seed: int, n: int = STATIONS) -> Strips:
    """Random stations near the surface z = 0.1, their length and sections of a few centimetres."""
    r = np.random.default_rng(seed)
    root = r.normal(size=(n, 6, 6))
    return Strips(
        rotation=exp_so3(jnp.asarray(r.normal(size=(n, 3)))),
        position=jnp.asarray(r.normal(size=(n, 3)) * [1.0, 1.0, 0.01] + [0.0, 0.0, 0.1]),
        angular_velocity=jnp.asarray(r.normal(size=(n, 3))),
        velocity=jnp.asarray(r.normal(size=(n, 3))),
        **vars(
            Stations.along(
                jnp.asarray(0.08 * np.arange(n) + 0.04),
                jnp.asarray(r.uniform(0.05, 0.1, n)),
                jnp.asarray(r.uniform(0.02, 0.04, (n, 2))),
                jnp.asarray(r.uniform(1e-4, 1e-3, n)),
                jnp.asarray(root @ root.transpose(0, 2, 1)),
                jnp.resize(jnp.array([2.0, 0.0, 3.0, 2.0]), n),
            )
        ),
    )


@cache
def many_strips() -> Strips:
    """Two hundred motions."""
    return jax.tree.map(lambda *x: jnp.stack(x), *(strips(seed) for seed in range(200)))


@cache
def water(place: str) -> Water:
    r = np.random.default_rng(7)
    stream = Stream(*(jnp.asarray(x) for x in (r.normal(size=3), r.normal(size=(3, 3)), 2.0, r.normal(size=3))))
    surface = jnp.asarray(0.1) if "surface" in place else None
    floor = None if "deep" in place else jnp.asarray(0.1)
    return Water(jnp.asarray(1025.0), jnp.asarray(9.81), surface, stream if "current" in place else None, floor)


@eqx.filter_jit
def wrench(load: Load, s: Strips, w: Water, t: Array = _n(0.3), time: Array = _n(1.0)) -> Float[Array, "n 6"]:  # noqa: B008
    f, _ = load.force(t, s, _state(load, time), w)
    return jnp.zeros((s.weight.shape[0], 6)) if f is None else f


@eqx.filter_jit
def added(load: Load, s: Strips, w: Water) -> Float[Array, "n 6 6"]:
    m = load.inertia(s, w)
    return jnp.zeros((s.weight.shape[0], 6, 6)) if m is None else m


@eqx.filter_jit
def powers(load: Load, many: Strips, w: Water) -> Float[Array, "motions"]:
    f = jax.vmap(lambda s: wrench(load, s, w))(many)
    return jnp.sum(f * jnp.concatenate([many.angular_velocity, many.velocity], axis=-1), axis=(1, 2))


def at_rest(s: Strips) -> Strips:
    return eqx.tree_at(lambda s: (s.velocity, s.angular_velocity), s, (jnp.zeros_like(s.velocity),) * 2)


PLACES = ("deep", "surface, current")

# --- the promises --------------------------------------------------------------------------------------------------


@every("place", ("deep", "surface"))
@every("example", [e for e in DISSIPATIVE if e in ON_BODIES], ids=_name)
def test_a_dissipative_load_takes_energy_out_whatever_the_motion(example: Example, place: str):
    power = powers(example.load, many_strips(), water(place))
    assert jnp.all(power <= 0)
    assert jnp.min(power) < 0


@every("example", [e for e in DISSIPATIVE if e in ON_JOINTS], ids=_name)
def test_a_dissipative_joint_load_takes_energy_out(example: Example):
    """But for what it stores, in any of its states."""
    x, v, w = np.random.default_rng(0).normal(size=(3, 200, 1))
    load, some = example.load, jax.tree.map(lambda z: z + np.tanh(w), example.load.initial())
    force, rate = jax.vmap(load.at_state)(x, v, some)
    power = jnp.sum(force * v, axis=-1)
    if jax.tree.leaves(some):
        power += jax.vmap(lambda z, rate: jax.jvp(load.stored, (z,), (rate,))[1])(some, rate)
    assert jnp.all(power <= 0)
    assert jnp.min(power) < 0


@every("place", PLACES)
@every("example", [e for e in ON_BODIES if e.load.by_station], ids=_name)
def test_a_load_that_goes_by_station_takes_the_strips_of_two_parts_as_those_of_each(example: Example, place: str):
    """With the numbers of two loads, one for each station."""
    other = jax.tree.map(lambda x: 1.3 * x, example.load)
    both = jax.tree.map(lambda a, b: jnp.concatenate([a, b]), strips(1), strips(2))
    numbers = jax.tree.map(lambda a, b: jnp.stack([a] * STATIONS + [b] * STATIONS), example.load, other)
    for of in (wrench, added):
        each = [of(load, strips(seed), water(place)) for load, seed in ((example.load, 1), (other, 2))]
        close(of(numbers, both, water(place)), np.concatenate(each), rel=1e-14)


@every("place", PLACES)
@every("example", [e for e in ON_BODIES if e.load.on_first], ids=_name)
def test_a_load_on_the_first_station_looks_at_no_other(example: Example, place: str):
    s = strips(1)
    whole, alone = (wrench(example.load, x, water(place)) for x in (s, jax.tree.map(lambda x: x[:1], s)))
    close(whole, np.pad(alone, ((0, STATIONS - 1), (0, 0))))


@every("place", PLACES)
@every("example", ON_BODIES, ids=_name)
def test_turning_and_shifting_body_and_world_together_changes_nothing(example: Example, place: str):
    upright = example.vertical or "surface" in place
    Q = exp_so3(jnp.array([0.0, 0.0, 1.1]) if upright else jnp.array([0.4, -0.7, 1.1]))
    shift = jnp.array([3.0, -2.0, 0.0 if upright else 1.5])
    s, w, load = around(example.load, 1), water(place), example.load
    moved = eqx.tree_at(lambda s: (s.rotation, s.position), s, (Q @ s.rotation, s.position @ Q.T + shift))
    if w.current is not None:
        c = w.current
        turned = Stream(Q @ c.velocity, Q @ c.gradient @ Q.T, c.rate, Q @ c.origin + shift)
        w = eqx.tree_at(lambda w: w.current, w, turned)
    for name in example.turns:
        load = eqx.tree_at(lambda x, name=name: getattr(x, name), load, Q @ getattr(load, name))
    before = wrench(example.load, s, water(place))
    close(wrench(load, moved, w), before, rel=1e-9, abs=1e-11 * float(1 + jnp.max(jnp.abs(before))))
    close(added(load, moved, w), added(example.load, s, water(place)), rel=1e-12)


_STRIPS_DIMENSIONS = {
    "rotation": NUMBER,
    "position": LENGTH,
    "angular_velocity": RATE,
    "velocity": SPEED,
    "x": LENGTH,
    "half_length": LENGTH,
    "weight": LENGTH,
    "half_width": LENGTH,
    "volume": (3, 0, 0),
}
_WATER_DIMENSIONS = {"density": DENSITY, "gravity": ACCELERATION, "surface": LENGTH, "floor": LENGTH}
_WATER_DIMENSIONS |= {"viscosity": (-1, 1, -1)}
_STREAM_DIMENSIONS = {"velocity": SPEED, "gradient": RATE, "rate": RATE, "origin": LENGTH}
_UNITS = np.array([3.0, 0.2, 7.0])  # the same thing in units of length, mass and time that are so much smaller


def _in_other_units(x, dimensions: dict[str, tuple[int, int, int]]):
    for name, powers in dimensions.items():
        value = attrgetter(name)(x)
        if value is not None:
            x = eqx.tree_at(attrgetter(name), x, value * np.prod(_UNITS**powers))
    return x


def _matrix_units() -> np.ndarray:
    length, mass, _ = _UNITS
    return mass * np.block(
        [[np.full((3, 3), length**2), np.full((3, 3), length)], [np.full((3, 3), length), np.ones((3, 3))]]
    )


@every("place", PLACES)
@every("example", ON_BODIES, ids=_name)
def test_the_formula_holds_in_any_units(example: Example, place: str):
    s, w = around(example.load, 2), water(place)
    scaled = _in_other_units(s, _STRIPS_DIMENSIONS)
    scaled = eqx.tree_at(lambda s: s.inertia, scaled, s.inertia * _matrix_units())
    other = _in_other_units(w, _WATER_DIMENSIONS)
    if w.current is not None:
        other = eqx.tree_at(lambda w: w.current, other, _in_other_units(w.current, _STREAM_DIMENSIONS))
    load = _in_other_units(example.load, example.dimensions)
    units = np.concatenate([np.full(3, np.prod(_UNITS**MOMENT)), np.full(3, np.prod(_UNITS**FORCE))])
    expected = wrench(example.load, s, w) * units
    close(wrench(load, scaled, other, _n(0.3 * _UNITS[2]), _n(_UNITS[2])), expected, rel=1e-9, abs=1e-10)
    close(added(load, scaled, other), added(example.load, s, w) * _matrix_units(), rel=1e-12)


@every("example", ON_JOINTS, ids=_name)
def test_the_formula_of_a_joint_load_holds_in_any_units(example: Example):
    displacement = NUMBER if example.joint == "revolute" else LENGTH
    z = example.load.initial()
    # where dry friction slides its own times, which no unit changes, do not show
    x, v = jnp.array([0.4]), jnp.array([-1.3e9 if jax.tree.leaves(z) else -1.3])
    unit = np.prod(_UNITS**displacement)
    load = _in_other_units(example.load, example.dimensions)
    expected = example.load.force(x, v) * np.prod(_UNITS ** (MOMENT if example.joint == "revolute" else FORCE))
    close(load.force(x * unit, v * unit / _UNITS[2]), expected, rel=1e-12)


def weighed(scene: tuple[Load, Strips, Water], weights: tuple[Array, Array]) -> Array:
    """Weighted sum of the wrenches and of the added mass."""
    return jnp.sum(weights[0] * wrench(*scene)) + jnp.sum(weights[1] * added(*scene))


# in reverse: JAX makes it of the forward derivatives, so that these are checked, too
slopes = eqx.filter_jit(eqx.filter_grad(weighed))


def _weights(scene: tuple[Load, Strips, Water]) -> tuple[np.ndarray, ...]:
    """Random, over the largest wrench and the largest added mass."""
    random = np.random.default_rng(1)
    results = np.asarray(wrench(*scene)), np.asarray(added(*scene))
    return tuple(random.normal(size=one.shape) / (np.abs(one).max() or 1.0) for one in results)


def _place(name: str) -> Water:
    """Still water of 3 m depth, or at the surface in a current: numbers of one program."""
    w = water("surface, current")
    still = (jnp.asarray(3.0), jnp.zeros(3), jnp.zeros((3, 3)))
    return eqx.tree_at(lambda w: (w.surface, w.current.velocity, w.current.gradient), w, still) if name == "deep" else w


def check_gradients(load: Load, water: Water) -> None:
    """By the numbers of each array of the load, the strips and the water, changed at random in proportion."""
    scene, random = (load, around(load, 3), water), np.random.default_rng(0)
    weights = _weights(scene)
    numbers, rest = eqx.partition(scene, eqx.is_inexact_array)
    leaves, structure = jax.tree.flatten(numbers)
    for k, (x, slope) in enumerate(zip(leaves, jax.tree.leaves(slopes(scene, weights)), strict=True)):
        change = np.maximum(np.abs(x), 1e-3) * random.normal(size=x.shape)
        ends = []
        for h in (1e-6, -1e-6):
            moved = jax.tree.unflatten(structure, [*leaves[:k], np.asarray(x + h * change), *leaves[k + 1 :]])
            ends.append(float(weighed(eqx.combine(moved, rest), weights)))
        expected = (ends[0] - ends[1]) / 2e-6
        assert np.sum(slope * change) == pytest.approx(expected, rel=1e-6, abs=1e-7 * (1 + abs(expected)))


@every("place", PLACES)
@every("example", ON_BODIES, ids=_name)
def test_gradients_are_those_of_finite_differences(example: Example, place: str):
    check_gradients(example.load, _place(place))


def _without_end(example: Example):
    """Slow, but for loads that ask whether there is a surface, a floor or a current."""
    asks = r"water\.(surface|floor|current) is"
    own = re.search(asks, inspect.getsource(importlib.import_module(type(example.load).__module__)))
    return pytest.param(example, marks=() if own else pytest.mark.slow, id=_name(example))


@every("example", [_without_end(e) for e in ON_BODIES])
def test_gradients_in_water_without_end_are_those_of_finite_differences(example: Example):
    """Without a surface, a floor and a current: other programs."""
    check_gradients(example.load, water("deep"))


@every("example", ON_JOINTS, ids=_name)
def test_gradients_of_joint_loads_are_those_of_finite_differences(example: Example):
    state = jax.tree.map(lambda z: z + 0.3, example.load.initial())
    x, unravel = ravel_pytree((example.load, jnp.array([0.4]), jnp.array([-1.3]), state))

    @jax.jit
    def force(x: Array) -> Array:
        return jnp.concatenate(jax.tree.leaves(unravel(x)[0].at_state(*unravel(x)[1:])))

    step = 1e-6 * jnp.maximum(jnp.abs(x), 1e-3)
    ends = [jax.vmap(force)(x + sign * jnp.diag(step)) for sign in (1, -1)]
    forward = jax.jacfwd(force)(x)
    close(jax.jacrev(force)(x), forward)
    close(forward, (ends[0] - ends[1]).T / (2 * step), rel=1e-7, abs=1e-7)


@every("place", PLACES)
@every("example", ON_BODIES, ids=_name)
def test_gradients_are_finite_at_rest(example: Example, place: str):
    moving = around(example.load, 3)
    scene = example.load, at_rest(moving), _place(place)
    found = slopes(scene, _weights((example.load, moving, _place(place))))
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(found))


@every("place", ("deep", "surface"))
@every("example", [e for e in ON_BODIES if e.load.dissipative or e.load.inertial], ids=_name)
def test_still_water_does_nothing_to_a_body_at_rest(example: Example, place: str):
    assert not jnp.any(wrench(example.load, at_rest(strips(4)), water(place)))


@every("example", ON_BODIES, ids=_name)
def test_added_mass_is_symmetric_and_never_negative(example: Example):
    for seed in range(5):
        m = added(example.load, around(example.load, seed), water("deep"))
        close(m, jnp.swapaxes(m, 1, 2))
        assert jnp.all(jnp.linalg.eigvalsh(m) >= -1e-15)
        assert bool(jnp.any(m)) == example.load.carries


@eqx.filter_jit
def _carried(load: ReshapingLoad, t: Array, s: Strips, z, w: Water) -> tuple[Array, Array]:
    return load.carried(t, s, z, w)


@eqx.filter_jit
def _as_it_goes(load: ReshapingLoad, s: Strips, w: Water, z, t: Array) -> tuple[Array, Array, Array]:
    """Added mass, its rate as the load says it, and as it is by the motion."""
    rate, drift = load.force(t, s, z, w)[1], jnp.einsum("nij,nj->ni", s.rotation, s.velocity)
    if isinstance(rate, CrankRate):
        rate = CrankState(z.speed, _n(0.0), rate.own)

    def at(t: Array, place: Array, z) -> tuple[Array, Array]:
        return load.carried(t, eqx.tree_at(lambda s: s.position, s, place), z, w)

    (now, told), (growth, _) = jax.jvp(at, (t, s.position, z), (jnp.ones(()), drift, rate))
    return now, told, growth


@every("example", [e for e in ON_BODIES if isinstance(e.load, ReshapingLoad)], ids=_name)
def test_added_mass_that_changes_is_an_inertia_and_changes_as_it_says(example: Example):
    """As its load's state goes on, and as it moves."""
    load, w, z, t = example.load, water("surface"), _state(example.load), jnp.asarray(0.3)
    s = around(load, 4)
    now, told, growth = _as_it_goes(load, s, w, z, t)
    close(now, jnp.swapaxes(now, -1, -2))
    assert jnp.min(jnp.linalg.eigvalsh(now)) >= -1e-15
    assert jnp.max(jnp.abs(told)) > 0.1
    close(told, growth, rel=1e-12, abs=1e-14)
    other, t = _in_other_units(load, example.dimensions), t * _UNITS[2]
    moved = _in_other_units(s, _STRIPS_DIMENSIONS)
    scaled = _carried(other, t, moved, _state(other, _UNITS[2]), _in_other_units(w, _WATER_DIMENSIONS))
    close(scaled[0], now * _matrix_units(), rel=1e-12, abs=1e-12)
    close(scaled[1], told * _matrix_units() / _UNITS[2], rel=1e-12, abs=1e-12)


@every("example", [e for e in ON_BODIES if _cranked(e.load)], ids=_name)
def test_a_crank_gives_the_power_that_its_load_passes_on(example: Example):
    """To a body at rest: torque times speed goes through the nozzle and into the shell; or it moves the foot."""
    load, s, w = example.load, at_rest(strips(3)), water("surface")
    force = eqx.filter_jit(lambda load: load.force(jnp.asarray(0.3), s, _state(load), w))
    taken = -force(load)[1].torque * 9.0
    if isinstance(load, ld.Jet):
        # the share of its part that is there
        under = eqx.tree_at(lambda w: w.density, w, jax.jit(wetted)(jnp.asarray(0.3), s, w)[0] * w.density)
        now = eqx.filter_jit(lambda load: load.pulse(jnp.asarray(0.3), _state(load), jnp.zeros(()), under))(load)
        close(taken, now.power + load.elastance * (jnp.max(load.volume) - now.volume) * now.outflow, rel=1e-12)
        return
    turning = ld.Leg(**{**vars(load), "speed": _n(9.0), "start": load.start + 1.2})
    force = wrench(turning, s, w)[0, 3:]
    foot = 9.0 * np.stack(jax.jit(ld.Leg.foot)(turning, turning.start)[1])
    close(taken, -jnp.sum(force[::2] * foot), rel=1e-12)


@every("example", [e for e in ON_BODIES if e.load.inertial], ids=_name)
def test_added_mass_alone_exerts_no_force_of_its_own(example: Example):
    assert not jnp.any(wrench(example.load, strips(5), water("deep")))


def test_lift_does_no_work():
    lift, s = ld.StripDrag(_n(0.0), _n(0.0), _n(-0.7)), strips(6)
    f = wrench(lift, s, water("deep"))[:, 3:]
    assert jnp.all(jnp.linalg.norm(f, axis=-1) > 0.1)
    close(jnp.sum(f * s.velocity, axis=-1), np.zeros(STATIONS), abs=1e-13)


def test_a_spring_gives_back_what_it_took():
    spring, x = ld.Spring(_n(3.0), _n(0.2)), jnp.array([0.4, -0.3, 1.0])
    close(spring.force(x, jnp.zeros(3)), -jax.grad(spring.energy)(x))
