"""Contacts that are too soft to hold: two parts that go into one another, of which forces say nothing."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.core.programs.remember import remembered
from nectosome.mechanism import Robot

_DEEP = 1.0  # [radius of the thinner part]


def soft_contacts(robot: Any, time: Float[Array, "n"], states: State) -> Sequence[str]:
    """A sentence for each contact whose parts were deeper in one another than the radius of the thinner one."""
    groups = robot.load_groups.pairs if isinstance(robot, Robot) else ()
    touching = [g for g in groups if g.one_sided]
    if not touching:
        return []
    deep = np.asarray(remembered(_overlaps, robot, time, states))
    pairs = [(name, parts) for g in touching for name, parts in zip(g.names, g.parts, strict=True)]
    found, names = [], robot.tree.names
    for (name, (a, b)), depths in zip(pairs, np.nan_to_num(deep).T, strict=True):
        k = int(np.argmax(depths))
        if depths[k] > _DEEP:
            when = f" at {float(time[k]):.4g} s" if len(depths) > 1 else ""
            depth = f"{depths[k]:.2g} times the radius of the thinner one"
            found.append(
                f"{name}: {names[a]} and {names[b]} are in one another by {depth}{when}. The contact is too soft to "
                f"hold them apart: raise pairs.{name}.stiffness."
            )
    return found


def _overlaps(robot: Robot, time: Float[Array, "n"], states: State) -> Float[Array, "n pairs"]:
    touching = [g for g in robot.load_groups.pairs if g.one_sided]

    def at(tx: tuple[Array, State]) -> Array:
        t, x = tx
        q, v, _ = robot.tree.complete(t, x.q, x.v)
        shape = robot.tree.shape(q)
        strips = robot.in_world(shape, robot.tree.twists(shape, v))
        return jnp.concatenate([g.overlaps(robot.tree, strips) for g in touching])

    return jax.lax.map(at, (time, states))
