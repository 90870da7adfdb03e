"""Contacts that are too soft to hold: how deep parts are in what should keep them out."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.core.programs.remember import remembered
from nectosome.mechanism import Robot

_DEEP = 1.0  # [radius of the thinner part]


def soft_contacts(robot: Any, time: Float[Array, "n"], states: State) -> list[str]:
    """A sentence for each contact that let a part in deeper than its own size there (`overlap` of loads)."""
    if not isinstance(robot, Robot) or not _names(robot):
        return []
    return deep_contacts(robot, np.asarray(time), np.asarray(remembered(_depths, robot, time, states)))


def deep_contacts(robot: Robot, time: Float[np.ndarray, "n"], depths: Float[np.ndarray, "n contacts"]) -> list[str]:
    """The same of the depths of contacts at n times."""
    found = list[str]()
    for (depth, what, path), each in zip(_names(robot), np.nan_to_num(depths).T, strict=True):
        k = int(np.argmax(each))
        if each[k] > _DEEP:
            when = f" at {float(time[k]):.4g} s" if len(each) > 1 else ""
            how = depth.format(f"{each[k]:.2g}")
            found.append(f"{how}{when}. The contact is too soft to hold {what}: raise {path}.stiffness.")
    return found


def contact_depths(robot: Robot, t: Float[Array, ""], x: State) -> Float[Array, "contacts"]:
    """How deep a part is in each of its contacts, of the size that the load's `overlap` names."""
    tree, loads = robot.tree, robot.load_groups
    q, v, _ = tree.complete(t, x.q, x.v)
    shape = tree.shape(q)
    strips = robot.in_world(shape, tree.twists(shape, v))
    held = [(g, z) for g, z in zip(loads.on_bodies, loads.seen(tree, q, v, x.z), strict=True) if g.holds]
    on_bodies = [g.overlaps(tree, strips, z, robot.water) for g, z in held]
    pairs = [g.overlaps(tree, strips) for g in loads.pairs if g.holds]
    return jnp.concatenate([jnp.zeros(0), *on_bodies, *pairs])


def _depths(robot: Robot, time: Float[Array, "n"], states: State) -> Float[Array, "n contacts"]:
    return jax.lax.map(lambda tx: contact_depths(robot, *tx), (time, states))


def _names(robot: Robot) -> list[tuple[str, str, str]]:
    """Of each contact the words of a depth, what it should hold, and its path, in the order of `contact_depths`."""
    loads, names, said = robot.load_groups, robot.tree.names, list[tuple[str, str, str]]()
    for g in (g for g in loads.on_bodies if g.holds):
        each = ((own, names[i]) for own, i in zip(g.names, g.parts, strict=True))
        said += [(f"{own}: {part} {g.load.deep}", "it", f"{part}.loads.{own}") for own, part in each]
    for g in (g for g in loads.pairs if g.holds):
        each = ((own, f"{names[a]} and {names[b]}") for own, (a, b) in zip(g.names, g.parts, strict=True))
        depth = "are in one another by {} times the radius of the thinner one"
        said += [(f"{own}: {both} {depth}", "them apart", f"pairs.{own}") for own, both in each]
    return said
