r"""Stability of a steady motion: eigenvalues of the equations linearised about it.

With displacements $\delta$ along the velocities, $\dot\delta = \delta v - [v, \delta]$ for a joint that rotates freely,
and $M \dot{\delta v} = -R_\delta \delta - R_v \delta v$; directions of symmetry are left out.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Complex, Float

from nectosome.core import State
from nectosome.core.linear_algebra import inverse
from nectosome.core.remember import remembered
from nectosome.core.se3 import bracket, cross
from nectosome.mechanism import Free, Robot, Spherical

from .equations import Equations, Point
from .symmetry import Symmetry


def modes(robot: Robot, symmetry: Symmetry, x: State) -> Complex[np.ndarray, "k"]:
    """Eigenvalues [1/s] of the motion linearised about the steady state x, the largest real part first."""
    A = np.asarray(remembered(_linearised, robot, symmetry, x))
    n = x.v.size
    keep = np.setdiff1d(np.arange(A.shape[0]), [i for i in symmetry.drift if i < n])
    values = np.linalg.eigvals(A[np.ix_(keep, keep)]).astype(complex)
    if symmetry.spin:  # the heading is a symmetry, too, but not a coordinate
        values = np.delete(values, np.argmin(np.abs(values)))
    return values[np.argsort(-np.real(values), kind="stable")]


def _linearised(robot: Robot, symmetry: Symmetry, x: State) -> Float[Array, "m m"]:
    """Matrix of the linear motion in (displacements, velocities, load states)."""
    n, zero, one = x.v.shape[0], jnp.zeros(()), jnp.ones(())
    z, unravel = ravel_pytree(x.z)

    def moved(change: Array) -> State:
        return State(robot.advance(x.q, change[:n], one), x.v + change[n : 2 * n], unravel(z + change[2 * n :]))

    def kinematics(change: Array) -> Array:
        displaced, v = change[:n], change[n : 2 * n]
        for start, joint in _rotating_joints(robot):
            here = slice(start, start + joint.nv)
            turn = cross if joint.nv == 3 else bracket
            v = v.at[here].add(-turn(x.v[here], displaced[here]))
        return v

    def forces(change: Array) -> Array:
        return robot.residual(zero, moved(change), jnp.zeros(n))

    def states(change: Array) -> Array:
        return ravel_pytree(robot.state_rates(zero, moved(change)))[0]

    at = jnp.zeros(2 * n + z.shape[0])
    M = Equations(robot, symmetry).mass(Point(x.q, x.v, x.z))
    rows = (jax.jacfwd(kinematics)(at), -inverse(M) @ jax.jacfwd(forces)(at), jax.jacfwd(states)(at))
    return jnp.concatenate(rows)


def _rotating_joints(robot: Robot) -> list[tuple[int, Free | Spherical]]:
    """Unknown joints with velocities in a rotating frame, and the index of their first velocity."""
    out, start = [], 0
    for part in robot.tree.parts:
        free = part.joint.nv if part.prescribed is None else 0
        if free and isinstance(part.joint, Free | Spherical):
            out.append((start, part.joint))
        start += free + part.free_strains.size
    return out
