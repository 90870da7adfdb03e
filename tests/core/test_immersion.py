"""What is under water of boxes, cylinders and ellipsoids at any attitude, against integrals over their volumes."""

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from nectosome.core import Stations, Strips, Water, displaced, reach_up, wetted, wetting
from nectosome.core.se3 import exp_so3

HALF = np.array([0.3, 0.2, 0.1])  # along x, y, z [m]
SURFACE = 0.4  # [m]
SHAPES = {"box": 0.0, "cylinder": 2.0, "ellipsoid": 3.0}
LEVEL = jnp.asarray(SURFACE)
WATER = Water(jnp.asarray(1000.0), jnp.asarray(9.81), LEVEL)
every = pytest.mark.parametrize("shape", SHAPES)


def strips(shape: str, R, height, half=HALF) -> Strips:
    """One body with its station at a height over the surface."""
    one = jnp.ones(1)
    own = Stations.along(0 * one, one, jnp.asarray(half[1:])[None], one, jnp.eye(6)[None], SHAPES[shape])
    still = jnp.zeros((1, 3))
    place = jnp.array([[0.7, -0.2, 0.0]]).at[0, 2].set(SURFACE + height)
    s = Strips(**vars(own), rotation=jnp.asarray(R)[None], position=place, angular_velocity=still, velocity=still)
    return Strips(**{**vars(s), "half_length": jnp.asarray(half[:1])})


@jax.jit
def _uplift(s: Strips):
    """Wrench of the water at rest over its weight with all of the body under it."""
    share, slope = displaced(jnp.zeros(()), s, WATER)
    up = s.rotation[0, 2]
    return jnp.concatenate([jnp.cross(up, slope[0]), share[0] * up])


_reach_up = jax.jit(reach_up)


@partial(jax.jit, static_argnums=0)
def _slopes(shape: str, R, height):
    """Derivatives of the uplift by turns and a rise."""
    return jax.jacfwd(lambda x: _uplift(strips(shape, R @ exp_so3(x[:3]), height + x[3])))(jnp.zeros(4))


@jax.jit
def _share(s: Strips):
    return wetted(jnp.zeros(()), s, WATER)[0]


def random_rotation(seed: int) -> np.ndarray:
    return Rotation.random(rng=np.random.default_rng(seed)).as_matrix()


def mean_over(shape: str, f: Callable[[np.ndarray], np.ndarray], n: int = 60) -> np.ndarray:
    """Mean of f over the volume of a body, by Gauss points in its own coordinates."""
    s, w = np.polynomial.legendre.leggauss(n)
    if shape == "box":
        x, y, z = np.meshgrid(s, s, s, indexing="ij")
        weight = w[:, None, None] * w[:, None] * w
    elif shape == "cylinder":
        r, a = 0.5 * (s + 1), np.pi * (s + 1)
        x, radius, angle = np.meshgrid(s, r, a, indexing="ij")
        y, z = radius * np.cos(angle), radius * np.sin(angle)
        weight = w[:, None, None] * (w * r)[:, None] * w
    else:
        r, a = 0.5 * (s + 1), np.pi * (s + 1)
        radius, height, angle = np.meshgrid(r, s, a, indexing="ij")
        across = radius * np.sqrt(1 - height**2)
        x, y, z = radius * height, across * np.cos(angle), across * np.sin(angle)
        weight = (w * r**2)[:, None, None] * w[:, None] * w
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3) * HALF
    weight = weight.ravel() / weight.sum()
    return weight @ f(points)


@every
@pytest.mark.parametrize("seed", range(6))
def test_share_and_centre_of_the_displaced_water_are_integrals_over_the_body(shape: str, seed: int):
    """At random attitudes and heights; the quadrature misses the cut by up to 1e-3."""
    R, height = random_rotation(seed), np.random.default_rng(seed).uniform(-0.08, 0.08)

    def wet(x: np.ndarray) -> np.ndarray:
        inside = (height + x @ R[2] < 0).astype(float)
        return np.concatenate([inside[:, None], inside[:, None] * x], axis=1)

    share, *first = mean_over(shape, wet)
    s = strips(shape, R, height)
    assert 0.05 < share < 0.95
    assert float(_share(s)) == pytest.approx(share, abs=2e-3)
    found = np.asarray(_uplift(s))
    np.testing.assert_allclose(found[3:], float(_share(s)) * R[2], rtol=1e-12)
    np.testing.assert_allclose(found[:3], np.cross(first, R[2]), atol=5e-4)


def segment(d: float) -> float:
    return 0.0 if d < -1 else 1.0 if d > 1 else 0.5 + (d * np.sqrt(1 - d * d) + np.arcsin(d)) / np.pi


@pytest.mark.parametrize("tilt", [0.0, 1e-9, 1e-5, 1e-3, 0.02, 0.3, 1.2, np.pi / 2 - 1e-4, np.pi / 2])
@pytest.mark.parametrize("height", [-0.09, -0.02, 0.013, 0.08])
def test_share_of_a_cylinder_is_the_mean_of_its_segments(tilt: float, height: float):
    """From level to upright, to 1e-9: the share is the same whichever formula gives it."""
    R = Rotation.from_euler("y", -tilt).as_matrix()
    half_height = HALF[2] * np.cos(tilt)

    def section(x: float) -> float:
        deep = -(height + R[2, 0] * x)
        return segment(deep / half_height) if half_height > 1e-12 else float(deep > 0)

    ends = -HALF[0], HALF[0]
    rises = R[2, 0] if R[2, 0] else 1.0
    edges = [x for x in (np.array([-1, 0, 1]) * half_height - height) / rises if ends[0] < x < ends[1]]
    mean = quad(section, *ends, points=edges or None, epsabs=1e-13, limit=400)[0] / (2 * HALF[0])
    assert float(_share(strips("cylinder", R, height))) == pytest.approx(mean, abs=1e-9)


@pytest.mark.parametrize(
    "angles", [(0, 0), (1e-9, 0), (1e-6, 1e-7), (1e-3, 1e-8), (0.01, 0.02), (0.4, 1e-3), (0.9, 0.6)]
)
@pytest.mark.parametrize("height", [-0.09, -0.02, 0.013, 0.08])
def test_share_of_a_box_is_the_mean_of_its_columns(angles: tuple[float, float], height: float):
    """Two of three spreads by quadrature, the third in closed form, to 1e-9; down to angles that all but vanish."""
    R = Rotation.from_euler("xy", angles).as_matrix()
    p, q, r = np.abs(R[2] * HALF)
    r, q, p = sorted((p, q, r))

    def column(d: float) -> float:
        return np.clip(0.5 + 0.5 * d / p, 0, 1)

    def slab(d: float) -> float:
        kinks = [x for x in (p - d, -p - d) if -q < x < q]
        return quad(lambda y: column(d + y), -q, q, points=kinks or None, epsabs=1e-12)[0] / (2 * q) if q else column(d)

    depth = -height
    kinks = [x for s in (1, -1) for t in (1, -1) if -r < (x := s * p + t * q - depth) < r]
    mean = quad(lambda z: slab(depth + z), -r, r, points=kinks or None, epsabs=1e-12)[0] / (2 * r) if r else slab(depth)
    assert float(_share(strips("box", R, height))) == pytest.approx(mean, abs=1e-9)


@every
def test_force_and_moment_are_minus_the_gradient_of_an_energy(shape: str):
    """Work of the force from over the surface down to a pose, by central differences in it, against the moment."""
    points, weights = np.polynomial.legendre.leggauss(400)

    @jax.jit
    def energy(R, height, turned):
        Q = R @ exp_so3(turned)
        left = reach_up(strips(shape, Q, height))[0] - height  # to where all of it is out
        z = height + 0.5 * left * (points + 1)
        return 0.5 * left * weights @ jax.vmap(lambda z: _uplift(strips(shape, Q, z))[3:] @ Q[2])(z)

    for seed in range(8):
        R, height, step = random_rotation(seed), np.random.default_rng(seed).uniform(-0.2, 0.2), 1e-3
        slopes = [(energy(R, height, step * e) - energy(R, height, -step * e)) / (2 * step) for e in jnp.eye(3)]
        np.testing.assert_allclose(_uplift(strips(shape, R, height))[:3], -np.array(slopes), atol=2e-6)


@every
@pytest.mark.parametrize("seed", [*range(4), None])
def test_stiffness_and_rate_are_those_of_finite_differences(shape: str, seed: int | None):
    """At random attitudes and plainly level; the moments' own slopes too, which the metacentre stands on."""
    R = np.eye(3) if seed is None else random_rotation(seed)
    height = 0.03

    def at(x):
        return _uplift(strips(shape, jnp.asarray(R) @ exp_so3(x[:3]), height + x[3]))

    slopes, step = _slopes(shape, R, height), 1e-4
    differences = np.stack([(at(step * e) - at(-step * e)) / (2 * step) for e in jnp.eye(4)], axis=1)
    np.testing.assert_allclose(slopes, differences, atol=2e-6)

    twist = np.random.default_rng(1).normal(size=6)
    share, rate = jax.jit(wetting)(0.0, strips(shape, R, height), jnp.asarray(twist)[None], WATER)

    def later(t: float) -> float:
        Q = jnp.asarray(R) @ exp_so3(jnp.asarray(t * twist[:3]))
        return float(_share(strips(shape, Q, height + t * (R[2] @ twist[3:]))))

    assert float(share[0]) == pytest.approx(later(0.0), rel=1e-12)
    assert float(rate[0]) == pytest.approx((later(1e-5) - later(-1e-5)) / 2e-5, rel=1e-6)


@every
def test_all_of_it_is_under_water_from_where_its_top_meets_the_surface(shape: str):
    for seed in range(6):
        R = random_rotation(seed)
        top = float(_reach_up(strips(shape, R, 0.0))[0])
        assert float(_share(strips(shape, R, -top - 1e-9))) == pytest.approx(1.0, abs=1e-12)
        assert float(_share(strips(shape, R, -top + 0.02))) < 1.0 - 1e-6
        assert float(_share(strips(shape, R, 40.0))) == 0.0
        assert float(_share(strips(shape, R, -40.0))) == 1.0
