"""SE(3) against matrix exponentials, at no, small, middling and large angles."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from nectosome.core import safe_norm, se3

exp, tangent = jax.jit(se3.exp_se3), jax.jit(se3.tangent)
moved = jax.jit(lambda twist, x: jax.jvp(se3.exp_se3, (twist,), (x,)))
curved = jax.jit(lambda twist, x: jax.jvp(lambda y: jax.jvp(se3.exp_se3, (y,), (x,))[1], (twist,), (x,))[1])

to_spatial, to_body, bracket, coadjoint, from_quaternion, from_rpy, rpy_quaternion = map(
    jax.jit,
    (
        se3.to_spatial,
        se3.to_body,
        se3.bracket,
        se3.coadjoint,
        se3.rotation_from_quaternion,
        se3.rotation_from_rpy,
        se3.quaternion_from_rpy,
    ),
)

# around the switch from series to closed form at 1 rad, and a full turn
SIZES = (0.0, 1e-300, 1e-12, 1e-6, 1e-3, 0.3, 1 - 1e-12, 1.0, 1 + 1e-12, 1.5, 3.0, np.pi, 5.0, 2 * np.pi, 9.0)
vectors = st.tuples(*[st.floats(-2, 2)] * 3).map(np.array)
directions = vectors.filter(lambda x: np.linalg.norm(x) > 0.1).map(lambda x: x / np.linalg.norm(x))
twists = st.builds(lambda d, n, rho: np.concatenate([n * d, rho]), directions, st.sampled_from(SIZES), vectors)
any_twist = st.builds(lambda a, b: np.concatenate([a, b]), vectors, vectors)


def hat(twist):
    w, v = twist[:3], twist[3:]
    return np.block([[np.cross(np.eye(3), w), v[:, None]], [np.zeros((1, 4))]])


def ad(twist):
    w, v = hat(twist)[:3, :3], hat(np.concatenate([twist[3:], np.zeros(3)]))[:3, :3]
    return np.block([[w, np.zeros((3, 3))], [v, w]])


def matrix(pose):
    R, p = pose
    return np.block([[np.asarray(R), np.asarray(p)[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])


@given(twists)
def test_exp_is_the_matrix_exponential(twist):
    np.testing.assert_allclose(matrix(exp(twist)), expm(hat(twist)), atol=2e-13)


@given(twists, any_twist)
def test_tangent_is_the_series_in_ad(twist, x):
    """sum ad^k/(k+1)! is the upper right block of exp [[ad, 1], [0, 0]]."""
    phi = expm(np.block([[ad(twist), np.eye(6)], [np.zeros((6, 12))]]))[:6, 6:]
    np.testing.assert_allclose(tangent(twist, x), phi @ x, atol=1e-11)


@given(twists, any_twist)
def test_tangent_is_the_derivative_of_exp(twist, x):
    """dg g^-1 = T dOmega, for the derivative JAX takes as for a difference quotient."""
    pose, rate = moved(twist, x)
    dg = np.block([[np.asarray(rate[0]), np.asarray(rate[1])[:, None]], [np.zeros((1, 4))]])
    wanted = hat(np.asarray(tangent(twist, x)))
    np.testing.assert_allclose(dg @ np.linalg.inv(matrix(pose)), wanted, atol=1e-11)
    h = 1e-5
    quotient = (matrix(exp(twist + h * x)) - matrix(exp(twist - h * x))) / (2 * h)
    np.testing.assert_allclose(quotient @ np.linalg.inv(matrix(pose)), wanted, atol=1e-7)


def test_derivatives_at_zero_are_the_generators():
    zero, x = np.zeros(6), np.array([0.3, -0.2, 0.5, 1.0, 2.0, -1.0])
    _, (dR, dp) = moved(zero, x)
    np.testing.assert_allclose(dR, hat(x)[:3, :3], atol=1e-16)
    np.testing.assert_allclose(dp, x[3:], atol=1e-16)
    ddR, ddp = curved(zero, x)
    np.testing.assert_allclose(ddR, (hat(x) @ hat(x))[:3, :3], atol=1e-15)
    np.testing.assert_allclose(ddp, (hat(x) @ hat(x))[:3, 3], atol=1e-15)


@given(twists, any_twist)
def test_adjoints_are_conjugation_and_undo_each_other(twist, x):
    R, p = exp(twist)
    g = matrix((R, p))
    spatial = to_spatial(R, p, x)
    np.testing.assert_allclose(hat(np.asarray(spatial)), g @ hat(x) @ np.linalg.inv(g), atol=1e-11)
    np.testing.assert_allclose(to_body(R, p, spatial), x, atol=1e-11)


@given(any_twist, any_twist, any_twist)
def test_bracket_and_its_transpose(a, b, momentum):
    np.testing.assert_allclose(bracket(a, b), ad(a) @ b, atol=1e-13)
    np.testing.assert_allclose(coadjoint(a, momentum), -ad(a).T @ momentum, atol=1e-13)


@given(directions, st.sampled_from(SIZES), st.floats(0.01, 100))
def test_rotation_of_a_quaternion_of_any_length(axis, angle, size):
    q = size * np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])
    R = from_quaternion(q)
    np.testing.assert_allclose(R, Rotation.from_rotvec(angle * axis).as_matrix(), atol=1e-14)


@given(vectors)
def test_roll_pitch_yaw(angles):
    wanted = Rotation.from_euler("xyz", angles).as_matrix()
    np.testing.assert_allclose(from_rpy(angles), wanted, atol=1e-14)
    quaternion = rpy_quaternion(angles)
    assert float(jnp.sum(quaternion**2)) == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(from_quaternion(quaternion), wanted, atol=1e-14)


def test_length_has_a_derivative_everywhere():
    x = jnp.array([[0.0, 0.0, 0.0], [3.0, 0.0, 4.0]])
    np.testing.assert_allclose(safe_norm(x), [0, 5])
    np.testing.assert_allclose(jax.vmap(jax.grad(safe_norm))(x), [[0, 0, 0], [0.6, 0, 0.8]])
