"""Every joint: what it says of poses, twists and their rates is one motion; a step solves q1 = q + h N(q1) v."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Sine, Stack
from nectosome.core.se3 import exp_so3
from nectosome.mechanism import Fixed, Free, Planar, Prismatic, Revolute, Spherical
from nectosome.mechanism.joints import plane_frame

AXIS = jnp.array([1.0, -2.0, 2.0]) / 3
ONE, THREE = jnp.array([0.4]), jnp.array([0.3, -0.2, 0.5])
JOINTS = [
    Fixed(),
    Revolute(AXIS, ONE, ONE),
    Prismatic(AXIS, ONE, ONE),
    Planar(plane_frame(AXIS), THREE, THREE),
    Spherical(THREE, THREE),
    Free(THREE, THREE, THREE, THREE),
]
each_joint = pytest.mark.parametrize("joint", JOINTS, ids=lambda j: type(j).__name__)


def draw(joint, seed):
    rng = np.random.default_rng(seed)
    return jnp.asarray(joint.start()[0] + rng.normal(size=joint.nq)), jnp.asarray(rng.normal(size=joint.nv))


def vee(W):
    return jnp.stack([W[2, 1], W[0, 2], W[1, 0]])


@each_joint
def test_the_twist_is_the_rate_of_the_pose_and_its_axes_stay(joint):
    @jax.jit
    def compare(q, v):
        def pose(s):
            m = joint.motion(joint.advance(q, v, s))
            return m.rotation, m.position, jnp.sum(m.subspace * v[:, None], axis=0)

        one = jnp.ones(())
        (R, _, twist), (dR, dp, still) = jax.jvp(pose, (0 * one,), (one,))
        return R, twist, jnp.concatenate([vee(R.T @ dR), R.T @ dp]), still

    for seed in range(3):
        R, twist, rate, still = compare(*draw(joint, seed))
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
        np.testing.assert_allclose(twist, rate, atol=1e-14)
        np.testing.assert_allclose(still, 0, atol=1e-14)


@each_joint
@pytest.mark.parametrize("step", [0.0, 1e-3, 0.7])
def test_a_step_solves_its_implicit_equation(joint, step):
    @jax.jit
    def compare(q, v, h):
        after = joint.advance(q, v, h)
        _, rate = jax.jvp(lambda s: joint.advance(after, v, s), (jnp.zeros(()),), (jnp.ones(()),))
        return after, q + h * rate

    for seed in range(3):
        after, wanted = compare(*draw(joint, seed), jnp.asarray(step))
        np.testing.assert_allclose(after, wanted, atol=1e-14)


@pytest.mark.parametrize("joint", JOINTS[-2:], ids=["Spherical", "Free"])
def test_displacement_is_the_rotation_vector(joint):
    displacement = jax.jit(lambda q: joint.displacement(q))
    for angle in (0.0, 1e-9, 0.5, 3.0, np.pi - 1e-9, 4.0):
        w = angle * np.asarray(AXIS)
        quaternion = 1.7 * np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * np.asarray(AXIS)])
        q = np.concatenate([np.zeros(joint.nq - 4), quaternion])
        found = displacement(q)[:3]
        wanted = w if angle <= np.pi else (angle - 2 * np.pi) * np.asarray(AXIS)
        np.testing.assert_allclose(found, wanted, atol=1e-14)


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 0.6, -0.8), (0.6, 0.8, 0)])
def test_the_frame_of_a_plane_is_right_handed(axis):
    frame = np.asarray(plane_frame(jnp.asarray(axis, float)))
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(frame[:, 2], axis, atol=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1)


def test_a_hinge_turns_about_its_axis_by_the_right_hand():
    R = Revolute(jnp.array([0.0, 0.0, 1.0]), ONE, ONE).motion(jnp.array([jnp.pi / 2])).rotation
    np.testing.assert_allclose(R @ jnp.array([1.0, 0, 0]), [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(R, exp_so3(jnp.array([0.0, 0.0, jnp.pi / 2])), atol=1e-15)


@pytest.mark.parametrize("joint", JOINTS[-3:], ids=["Planar", "Spherical", "Free"])
def test_a_prescribed_turn_has_the_velocities_of_its_poses(joint):
    """Roll, pitch, yaw (and x, y, z) as signals: twist and its rate against derivatives of the poses in time."""

    r = np.random.default_rng(3)
    signal = Stack(tuple(Sine(*map(jnp.asarray, r.uniform(0.2, 1.0, 4))) for _ in range(joint.nv)))

    def pose(t):
        motion = joint.motion(joint.prescribed(*signal(t))[0])
        return motion.rotation, motion.position

    def twist(t):
        (R, _), (dR, dp) = jax.jvp(pose, (t,), (jnp.ones(()),))
        W = R.T @ dR
        return jnp.concatenate([jnp.stack([W[2, 1], W[0, 2], W[1, 0]]), R.T @ dp])

    @jax.jit
    def both(t):
        q, v, a = joint.prescribed(*signal(t))
        S = joint.motion(q).subspace
        return (v @ S, a @ S), jax.jvp(twist, (t,), (jnp.ones(()),))

    given, expected = both(jnp.asarray(0.37))
    np.testing.assert_allclose(given[0], expected[0], atol=1e-13)
    np.testing.assert_allclose(given[1], expected[1], atol=1e-12)
