"""Many copies of a sampled plant side by side: one compiled step for all of them."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Var
from jaxtyping import Array, Bool, Float, Int

from nectosome.core import Mechanical, State, Status
from nectosome.core.programs.remember import Bound, remembered, runs_long
from nectosome.core.se3 import dot, safe_norm
from nectosome.mechanism import Robot, from_rest

from .integrate import Settings
from .readings import values_of
from .sampled_plant import (
    FIRST_STEP,
    CommandedNumber,
    PlantStructure,
    SampledPlant,
    commanded,
    equations_of,
    motion_of,
    robot_in,
)


class Moving(NamedTuple):
    """What of a copy changes from sample to sample."""

    time: Float[Array, "n"]  # since each started [s]
    state: State  # leaves [n, ...]
    readings: Float[Array, "n r"]  # the present ones [SI]; full turns counted
    means: Float[Array, "n r"]  # over the even instants of the sample before; of a start the present ones
    speed: Float[Array, "n"]  # of the body through the water [m/s]
    step: Float[Array, "n"]  # length of the next time step [s]
    held: Float[Array, "n c"]  # numbers of each robot that commands change, in the sample before


class BatchState(NamedTuple):
    """States of n robots between two samples, as arrays on the device."""

    moving: Moving
    numbers: Float[Array, "n p"]  # of each robot, by the description and as drawn
    parts: Float[Array, "n k"]  # leaves of each robot that no command changes, one after another


class PlantBatch:
    """Copies of a plant: each starts with quantities of its own, those `drawn`, and is commanded on its own.

    A copy moves as the plant alone does, within the tolerance of the integration; its status is its own. Where copies
    go `together`, a step is computed for all at once, until the one with the most steps is done: so on an accelerator,
    unless given. On a processor this takes longer than one copy after another, in the same program.
    """

    def __init__(self, plant: SampledPlant, together: bool | None = None):
        self.plant = plant
        together = jax.default_backend() != "cpu" if together is None else together
        self._structure = _Copies(plant.structure, plant.places, plant.drawn, together)
        self._first = min(FIRST_STEP, 0.1 * plant.dt)
        self._hold = Bound(_hold, self._structure, plant.settings)

    def start(self, drawn: Float[np.ndarray, "n d"]) -> BatchState:
        """States at t = 0, with these values of the quantities drawn [SI]."""
        first, dt = jnp.asarray(self._first), jnp.asarray(self.plant.dt)
        return remembered(_start, self._structure, self.plant.numbers, jnp.asarray(drawn), first, dt)

    def merged(self, which: Bool[np.ndarray, "n"], fresh: BatchState, others: BatchState) -> BatchState:
        """The copies of `fresh` that are named, and the others."""
        return remembered(_merged, jnp.asarray(which), fresh, others)

    def hold(
        self, before: BatchState, commands: Float[np.ndarray, "n c"], still: Bool[np.ndarray, "n"] | None = None
    ) -> tuple[BatchState, Int[Array, "n"]]:
        """States after one sample more with these commands [SI], and statuses.

        Copies that are `still` stay as they are, and so does one that fails.
        """
        still = np.zeros(len(commands), bool) if still is None else still
        moving, statuses = self._hold(*before, still, np.asarray(commands, float))
        return before._replace(moving=moving), statuses

    def stations(self, at: BatchState, k: int) -> tuple[Array, Array, Array, Array]:
        """Of the stations of a copy: rotations, positions [m], places along their parts [m], half widths [m]."""
        one = jax.tree.map(lambda x: x[k], at)
        return remembered(_stations, self._structure, one.moving, one.numbers, jnp.asarray(self.plant.dt))


class _Copies(eqx.Module):
    """What all copies have in common."""

    plant: PlantStructure
    places: tuple[tuple[CommandedNumber, ...], ...] = eqx.field(static=True)
    drawn: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # where each quantity drawn stands among the numbers
    together: bool = eqx.field(static=True)

    @property
    def changing(self) -> tuple[int, ...]:
        """Where the numbers stand that commands change, and the phases that take up their jumps."""
        return tuple(k for group in self.places for at, phase, _ in group for k in (at, phase) if k is not None)


def _leaves(
    copies: _Copies, numbers: Array, before: Array, now: Array, t: Array, dt: Array
) -> tuple[list[Array], Callable[[list[Array]], tuple[Robot, Mechanical]]]:
    """Arrays of a robot in a sample and of its equations, and what makes both of such arrays.

    Of its numbers, those that commands change were `before` and are `now`.
    """
    old, new = list(numbers), list(numbers)
    for changed, values in ((old, before), (new, now)):
        for k, value in zip(copies.changing, values, strict=True):
            changed[k] = value
    robot = robot_in(copies.plant, old, new, t, dt)
    arrays, rest = eqx.partition((robot, equations_of(copies.plant, robot)), eqx.is_array)
    leaves, structure = jax.tree.flatten(arrays)
    return leaves, lambda leaves: eqx.combine(jax.tree.unflatten(structure, leaves), rest)


def _lasting(copies: _Copies, count: int) -> list[int | None]:
    """For each of the `_leaves` (of so many numbers) the first that is the same array; None where commands change it.

    A robot is made of its numbers by hundreds of small operations, which take ten times as long as its motion over some
    hundredths of a second: what they give of numbers that stay is kept.
    """
    one, changing = jax.ShapeDtypeStruct((), float), jax.ShapeDtypeStruct((len(copies.changing),), float)
    shapes = jax.ShapeDtypeStruct((count,), float), changing, changing, one, one
    program, made = jax.make_jaxpr(lambda *args: _leaves(copies, *args)[0], return_shape=True)(*shapes)
    numbers, *others = program.jaxpr.invars
    changed, lasts = set(others), {numbers}
    for operation in program.jaxpr.eqns:
        takes = {x for x in operation.invars if isinstance(x, Var)}
        if takes & changed:
            changed.update(operation.outvars)
        elif takes & lasts:
            lasts.update(operation.outvars)
    firsts, found = dict[Var, int](), list[int | None]()
    for k, (leaf, shape) in enumerate(zip(program.jaxpr.outvars, made, strict=True)):
        stays = isinstance(leaf, Var) and leaf in lasts - changed and shape.dtype == float
        found.append(firsts.setdefault(leaf, k) if stays else None)
    return found


def _start(copies: _Copies, numbers: Array, drawn: Array, first: Array, dt: Array) -> BatchState:
    plant, zero, changing = copies.plant, jnp.zeros(()), np.array(copies.changing)
    lasting = _lasting(copies, len(numbers))

    def one(values: Array) -> BatchState:
        own = numbers
        for k, group in enumerate(copies.drawn):
            own = own.at[np.array(group)].set(values[k])
        held = own[changing]
        leaves, made_of = _leaves(copies, own, held, held, zero, dt)
        robot, _ = made_of(leaves)
        state = from_rest(robot, zero, robot.initial()).state
        readings = values_of(plant.readings, robot, zero, state)
        moving = Moving(zero, state, readings, readings, _speed(robot, zero, state), first, held)
        parts = [leaf.ravel() for k, leaf in enumerate(leaves) if lasting[k] == k]
        return BatchState(moving, own, jnp.concatenate([jnp.zeros(0), *parts]))

    return jax.vmap(one)(drawn)


def _stations(copies: _Copies, x: Moving, numbers: Array, dt: Array) -> tuple[Array, Array, Array, Array]:
    leaves, made_of = _leaves(copies, numbers, x.held, x.held, x.time, dt)
    tree = made_of(leaves)[0].tree
    q, *_ = tree.complete(x.time, x.state.q, x.state.v)
    shape = tree.shape(q)
    return shape.rotation, shape.position, tree.stations.x, tree.stations.half_width


def _speed(robot: Robot, t: Array, x: State) -> Array:
    """Speed of the body's root through the water [m/s]."""
    q, v, _ = robot.tree.complete(t, x.q, x.v)
    shape = robot.tree.shape(q)
    velocity = dot(shape.rotation[0], robot.tree.twists(shape, v)[0, 3:])
    return safe_norm(velocity - robot.water.flow(t, shape.position[:1])[0][0])


@runs_long
def _hold(
    copies: _Copies, settings: Settings, moving: Moving, numbers: Array, parts: Array, still: Array, commands: Array
) -> tuple[Moving, Array]:
    plant, dt = copies.plant, jnp.asarray(settings.longest)
    turning = jnp.array([reading.turns for reading in plant.readings])
    lasting = _lasting(copies, numbers.shape[1])

    def one(before: Moving, numbers: Array, parts: Array, still: Array, commands: Array) -> tuple[Moving, Array]:
        held = dict(zip(copies.changing, before.held, strict=True))
        changes = commanded(copies.places, held, commands, before.time)
        now = jnp.stack([changes[k] for k in copies.changing])
        leaves, made_of = _leaves(copies, numbers, before.held, now, before.time, dt)
        kept, end = dict[int, Array](), 0
        for k, leaf in enumerate(leaves):
            if lasting[k] == k:
                end, begin = end + leaf.size, end
                kept[k] = parts[begin:end].reshape(leaf.shape)
        robot, equations = made_of([leaf if k is None else kept[k] for k, leaf in zip(lasting, leaves, strict=True)])
        found = motion_of(plant, robot, equations, before.time, before.step, before.state, settings)
        readings = jnp.concatenate([before.readings[None], found.readings])
        readings = jnp.where(turning, jnp.unwrap(readings, axis=0), readings)[1:]
        last = jax.tree.map(lambda x: x[-1], found.states)
        time = before.time + dt
        means, speed = jnp.mean(readings, axis=0), _speed(robot, time, last)
        after = Moving(time, last, readings[-1], means, speed, found.step, now)
        failed = (found.status != int(Status.SOLVED)) & ~still
        after = jax.tree.map(lambda a, b: jnp.where(still | failed, a, b), before, after)
        return after, jnp.where(still, int(Status.SOLVED), found.status)

    every = (moving, numbers, parts, still, commands)
    return jax.vmap(one)(*every) if copies.together else jax.lax.map(lambda of_one: one(*of_one), every)


def _merged(which: Array, fresh: BatchState, others: BatchState) -> BatchState:
    def choose(a: Array, b: Array) -> Array:
        return jnp.where(which.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return jax.tree.map(choose, fresh, others)
