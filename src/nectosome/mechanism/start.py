r"""A start from rest: drives that are at speed at once give an impulse.

Before the start the prescribed coordinates p rest; the unknown ones u move as the robot file says. The drives then
bring p to the velocities of their motions, and u follows, so that the generalised momentum along u stays what it was.
With the mass matrix M of the whole, the robot's own matter and the water that it carries (Lamb 1932, art. 118-121),

$$ \Delta v_u = -M_{uu}^{-1} M_{up}\, v_p, \qquad \hat\tau = M_{pu}\, \Delta v_u + M_{pp}\, v_p $$

with the impulse of the drives $\hat\tau$ [N m s, N s], and its energy $\tfrac12 \hat\tau \cdot v_p$. Drag, springs
and weight have no part in it, since their forces are finite.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.core.linear_algebra import inverse
from nectosome.core.rows import rows

from .carried import times
from .robot import Robot


class ImpulsiveStart(NamedTuple):
    """How a robot begins."""

    state: State  # after the impulse
    impulse: Float[Array, "prescribed"]  # of the drives [N m s, N s]
    energy: Float[Array, ""]  # of the impulse [J]


def from_rest(robot: Robot, t: Float[Array, ""], x: State) -> ImpulsiveStart:
    """Start at time t from the state x, whose velocities are those before the impulse."""
    tree = robot.tree
    u, p = tree.free_v, tree.prescribed_v
    q, v, _ = tree.complete(t, x.q, x.v)
    jump = rows(v, p)
    if not p.size:
        return ImpulsiveStart(x, jump, jnp.zeros(()))
    shape = tree.shape(q)
    J = tree.jacobian(shape, jnp.eye(v.shape[0]))
    inertia = robot.inertia + robot.carried(t, shape, tree.twists(shape, v), q, v, x.z)
    M = jnp.einsum("vni,wni->vw", J, times(inertia, J))
    if robot.rotors is not None:
        M = M + jnp.diag(robot.rotors)
    change = -inverse(M[np.ix_(u, u)]) @ M[np.ix_(u, p)] @ jump
    impulse = M[np.ix_(p, u)] @ change + M[np.ix_(p, p)] @ jump
    return ImpulsiveStart(State(x.q, x.v + change, x.z), impulse, 0.5 * jnp.sum(impulse * jump))
