"""Many copies of a sampled plant side by side: one compiled step for all of them."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered, runs_long
from nectosome.mechanism import from_rest
from nectosome.model import instantiate

from .integrate import Settings
from .readings import values_of
from .sampled_plant import FIRST_STEP, CommandedNumber, PlantStructure, SampledPlant, commanded, held_motion


class BatchState(NamedTuple):
    """States of n robots between two samples, as arrays on the device."""

    time: Float[Array, "n"]  # since each started [s]
    state: State  # leaves [n, ...]
    readings: Float[Array, "n r"]  # the present ones [SI]; full turns counted
    means: Float[Array, "n r"]  # over the even instants of the sample before; of a start the present ones
    step: Float[Array, "n"]  # length of the next time step [s]
    numbers: Float[Array, "n p"]  # of each robot, as they were held in the sample before


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

    def start(self, drawn: Float[np.ndarray, "n d"]) -> BatchState:
        """States at t = 0, with these values of the quantities drawn [SI]."""
        first = jnp.asarray(self._first)
        return remembered(_start, self._structure, self.plant.numbers, jnp.asarray(drawn), first)

    def hold(
        self,
        before: BatchState,
        fresh: BatchState,
        renew: Bool[np.ndarray, "n"],
        commands: Float[np.ndarray, "n c"],
    ) -> tuple[BatchState, Int[Array, "n"]]:
        """States after one sample more with these commands [SI], and statuses.

        Copies to `renew` are those of `fresh` afterwards, at t = 0. One that fails stays as it was.
        """
        given = jnp.asarray(renew), jnp.asarray(commands)
        return remembered(_hold, self._structure, before, fresh, *given, self.plant.settings)


class _Copies(eqx.Module):
    """What all copies have in common."""

    plant: PlantStructure
    places: tuple[tuple[CommandedNumber, ...], ...] = eqx.field(static=True)
    drawn: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # where each quantity drawn stands among the numbers
    together: bool = eqx.field(static=True)


def _start(copies: _Copies, numbers: Array, drawn: Array, first: Array) -> BatchState:
    plant, zero = copies.plant, jnp.zeros(())

    def one(values: Array) -> BatchState:
        own = numbers
        for k, group in enumerate(copies.drawn):
            own = own.at[np.array(group)].set(values[k])
        robot = instantiate(plant.template, own)
        state = from_rest(robot, zero, robot.initial()).state
        readings = values_of(plant.readings, robot, zero, state)
        return BatchState(zero, state, readings, readings, first, own)

    return jax.vmap(one)(drawn)


@runs_long
def _hold(
    copies: _Copies, before: BatchState, fresh: BatchState, renew: Array, commands: Array, settings: Settings
) -> tuple[BatchState, Array]:
    plant = copies.plant
    turning = jnp.array([reading.turns for reading in plant.readings])

    def one(before: BatchState, fresh: BatchState, renew: Array, commands: Array) -> tuple[BatchState, Array]:
        # a copy that failed would go on to fail, slowly: it is renewed first
        before = _where(renew, fresh, before)
        changes = commanded(copies.places, before.numbers, commands, before.time)
        numbers = before.numbers.at[np.array([*changes])].set(jnp.stack([*changes.values()]))
        found = held_motion(plant, before.numbers, numbers, before.time, before.step, before.state, settings)
        readings = jnp.concatenate([before.readings[None], found.readings])
        readings = jnp.where(turning, jnp.unwrap(readings, axis=0), readings)[1:]
        last = jax.tree.map(lambda x: x[-1], found.states)
        time = before.time + settings.longest
        after = BatchState(time, last, readings[-1], jnp.mean(readings, axis=0), found.step, numbers)
        failed = (found.status != int(Status.SOLVED)) & ~renew
        return _where(renew | failed, before, after), jnp.where(renew, int(Status.SOLVED), found.status)

    every = (before, fresh, renew, commands)
    return jax.vmap(one)(*every) if copies.together else jax.lax.map(lambda of_one: one(*of_one), every)


def _where(mask: Array, a: BatchState, b: BatchState) -> BatchState:
    return jax.tree.map(lambda a, b: jnp.where(mask, a, b), a, b)
