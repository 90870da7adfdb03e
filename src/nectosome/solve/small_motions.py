r"""Stability of a steady motion: eigenvalues of the equations linearised about it.

With displacements $\delta$ along the velocities, $\dot\delta = \delta v - [v, \delta]$ for a joint that rotates freely,
and $M \dot{\delta v} = -R_\delta \delta - R_v \delta v$; directions of symmetry are left out.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Complex, Float, Int

from nectosome.core import State
from nectosome.core.linear_algebra import inverse
from nectosome.core.programs.remember import remembered
from nectosome.core.se3 import bracket, cross
from nectosome.mechanism import Free, Joint, Robot, Spherical

from .equilibrium import Equations, Point
from .symmetry import Symmetry, near

NEUTRAL = 1e-7  # of the largest eigenvalue: a growth as small is rounding


def eigenvalues(robot: Robot, symmetry: Symmetry, x: State) -> Complex[np.ndarray, "k"]:
    """Eigenvalues [1/s] about the steady state x, those that grow fastest first, without that of a free heading."""
    values = np.linalg.eigvals(matrix(robot, symmetry, x)[0]).astype(complex)
    if symmetry.spin:  # the heading is free too, but no coordinate of its own
        values = np.delete(values, np.argmin(np.abs(values)))
    return values[np.argsort(-np.real(values), kind="stable")]


def is_stable(robot: Robot, symmetry: Symmetry, x: State) -> Bool[Array, ""]:
    """Whether no eigenvalue about the steady state x grows, traced, without derivatives."""
    free = [*symmetry.drift]
    A = jnp.delete(jnp.delete(linearised(robot, symmetry, x), np.array(free, int), 0), np.array(free, int), 1)
    values = jnp.linalg.eigvals(A)
    heading = (jnp.arange(values.size) == jnp.argmin(jnp.abs(values))) & symmetry.spin
    growth = jnp.where(heading, 0.0, jnp.real(values))
    return jnp.max(growth, initial=0.0) <= NEUTRAL * jnp.max(jnp.abs(values), initial=0.0)


def matrix(robot: Robot, symmetry: Symmetry, x: State) -> tuple[Float[np.ndarray, "k k"], Int[np.ndarray, "k"]]:
    """Matrix of the linear motion without drift, and its indices among displacements, velocities and load states."""
    return without_drift(np.asarray(remembered(linearised, robot, symmetry, x)), symmetry, x.v.size)


def without_drift(
    A: Float[np.ndarray, "m m"], symmetry: Symmetry, n: int
) -> tuple[Float[np.ndarray, "k k"], Int[np.ndarray, "k"]]:
    """The same of a known matrix, with n velocities."""
    keep = np.setdiff1d(np.arange(A.shape[0]), [i for i in symmetry.drift if i < n])
    return A[np.ix_(keep, keep)], keep


def linearised(robot: Robot, symmetry: Symmetry, x: State) -> Float[Array, "m m"]:
    """Matrix of the linear motion in (displacements, velocities, load states)."""
    n, zero = x.v.shape[0], jnp.zeros(())

    def kinematics(change: Array) -> Array:
        displaced, v = change[:n], change[n : 2 * n]
        for start, joint in _rotating_joints(robot):
            here = slice(start, start + joint.nv)
            turn = cross if joint.nv == 3 else bracket
            v = v.at[here].add(-turn(x.v[here], displaced[here]))
        return v

    def forces(change: Array) -> Array:
        return robot.residual(zero, near(robot, x, change), jnp.zeros(n))

    def states(change: Array) -> Array:
        return ravel_pytree(robot.state_rates(zero, near(robot, x, change)))[0]

    at = jnp.zeros(ravel_pytree((x.v, x.v, x.z))[0].size)
    M = Equations(robot, symmetry).mass(Point(x.q, x.v, x.z))
    rows = (jax.jacfwd(kinematics)(at), -inverse(M) @ jax.jacfwd(forces)(at), jax.jacfwd(states)(at))
    return jnp.concatenate(rows)


def _rotating_joints(robot: Robot) -> list[tuple[int, type[Joint]]]:
    """Unknown joints with velocities in a rotating frame, and the index of their first velocity."""
    out, start = [], 0
    for part in robot.tree.structure:
        free = 0 if part.prescribed else part.joint.nv
        if free and issubclass(part.joint, Free | Spherical):
            out.append((start, part.joint))
        start += free + part.own - len(part.prescribed_strains)
    return out
