"""What acts on one side only says where: it has gaps, and a force of its stiffness where one of them is negative."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.load_examples import EXAMPLES as SINGLE
from tests.loads.test_pairs import EXAMPLES as PAIRS
from tests.loads.test_pairs import strips

import nectosome.loads as ld
from nectosome.core import CrankState, JointLoad, Load, PairLoad, Water

_n = jnp.asarray
WATER = Water(_n(1000.0), _n(9.81), floor=_n(-0.02), walls=(_n(-0.12), _n(0.12)))
BASES = (Load, JointLoad, PairLoad)


def _elastic(load) -> list[str]:
    """Names of its stiffnesses, where it has a softness too."""
    names = [jax.tree_util.keystr(path) for path, _ in jax.tree_util.tree_flatten_with_path(load)[0]]
    soft = any(name.endswith(".softness") for name in names)
    return [name for name in names if soft and name.endswith(".stiffness")]


ONE_SIDED = [load for load in (*(e.load for e in SINGLE), *(e.load for e in PAIRS.values())) if _elastic(load)]


def stiffer(load):
    """The load with twice the stiffness."""
    return jax.tree_util.tree_map_with_path(
        lambda path, x: 2 * x if jax.tree_util.keystr(path) in _elastic(load) else x, load
    )


def at_rest(seed: int, **options):
    """Without velocities, since dampers let go of what leaves faster than the spring pushes it."""
    still = strips(seed, **options)
    return eqx.tree_at(lambda s: (s.angular_velocity, s.velocity), still, (jnp.zeros((4, 3)), jnp.zeros((4, 3))))


_forces = eqx.filter_jit(lambda load, *args: (load.force(*args), stiffer(load).force(*args)))


def acts(load, seed: int):
    """Its gaps, and its force without and with twice the stiffness."""
    if isinstance(load, JointLoad):
        x, v = _n([np.random.default_rng(seed).uniform(-2, 2)]), jnp.zeros(1)
        return load.gaps(x).gap, *_forces(load, x, v)
    # within reach of floor, walls and of each other
    r = np.random.default_rng(100 + seed)
    a = at_rest(seed)
    a = eqx.tree_at(lambda s: s.position, a, a.position + _n(r.uniform(-0.05, 0.05, 3)))
    if isinstance(load, PairLoad):
        b = at_rest(seed + 50, apart=0.03 * (seed % 5))
        return load.gaps(a, b).gap, *_forces(load, a, b)
    z = load.initial()
    z = CrankState(_n(r.uniform(0, 6)), _n(9.0), z) if getattr(load, "speed", 0) is None else z
    soft, stiff = _forces(load, jnp.zeros(()), a, z, WATER)
    return load.gaps(a, z, WATER).gap, soft[0], stiff[0]


def test_all_that_have_a_softness_are_here():
    assert {type(load) for load in ONE_SIDED} >= {ld.LowerLimit, ld.UpperLimit, ld.Leg, ld.WallContact, ld.PartContact}


@pytest.mark.parametrize("load", ONE_SIDED, ids=lambda load: type(load).__name__)
def test_it_acts_where_a_gap_is_negative_and_nowhere_else(load):
    """A gap of NaN or of another sign, or none at all, would let steps of the integration pass over it."""
    inside = []
    for seed in range(15):
        gaps, soft, stiff = acts(load, seed)
        assert gaps is not None and bool(jnp.all(jnp.isfinite(gaps)))
        same = all(np.array_equal(x, y) for x, y in zip(jax.tree.leaves(soft), jax.tree.leaves(stiff), strict=True))
        inside.append(float(jnp.min(gaps)) < 0)
        assert same == (not inside[-1])
    assert any(inside) and not all(inside)
