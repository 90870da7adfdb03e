"""A controller and a block in a loop, as they would run on a rig: sampled, with noise."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Block, Line, Stepper
from nectosome.drives import Sensor

from .contract import Controller, Regulator


class Track(NamedTuple):
    """What a loop did, at the times of the samples."""

    reference: Float[Array, "*lanes n"]
    output: Float[Array, "*lanes n"]  # what was, without noise
    measured: Float[Array, "*lanes n"]
    command: Float[Array, "*lanes n"]


class BlockLoop(eqx.Module):
    """A block under a controller, from rest; `sensor` reads its output.

    Commands are held from sample to sample, over `substeps` steps of the block: what limits rates sees them so. A
    command acts in the sample after its measurement if the block begins with a `DeadTime` of a sample. Lanes of a
    block, or of a sensor, run side by side.
    """

    plant: Block
    sensor: Sensor
    dt: float = eqx.field(static=True)  # between samples [s]
    substeps: int = eqx.field(static=True, default=5)

    def run(self, controller: Controller, reference: Float[np.ndarray, "n"]) -> Track:
        """The controller along a reference."""
        return self.follow(controller.planned(reference, self.dt), reference)

    def follow(self, regulator: Regulator, reference: Float[ArrayLike, "n"]) -> Track:
        """The same with what the controller has planned."""
        output, measured, command = _run(self, regulator, jnp.shape(reference)[0])
        return Track(jnp.broadcast_to(jnp.asarray(reference), output.shape), output, measured, command)


@eqx.filter_jit
def _run(loop: BlockLoop, regulator: Regulator, count: int) -> tuple[Array, Array, Array]:
    plant = loop.plant.sampled(loop.dt / loop.substeps)

    def sample(carry, _):
        own, state, reading, output = carry
        reading, line = loop.sensor.step(reading, Line(output, output))
        own, command = regulator.step(own, line.end)
        state, after = held(plant, state, command, loop.substeps)
        return (own, state, reading, after), (output, line.end, command)

    begin = (regulator.initial(), plant.initial(), loop.sensor.initial(), jnp.zeros(()))
    return jax.lax.scan(sample, begin, None, count)[1]


@eqx.filter_jit
def run_batch(lanes: BlockLoop, regulator: Regulator, reference: Float[ArrayLike, "n"], own: bool = False) -> Track:
    """Loops with a leading axis, each under the same regulator, or under its `own` lane of it.

    One after the other: a controller that has more to do now and then does not make all of them do it.
    """
    moving, still = eqx.partition((lanes, regulator) if own else lanes, eqx.is_array)

    def one(part: Any) -> Track:
        whole = eqx.combine(part, still)
        loop, law = whole if own else (whole, regulator)
        return loop.follow(law, reference)

    return jax.lax.map(one, moving)


def held(plant: Stepper, state: Any, command: Float[Array, ""], count: int) -> tuple[Any, Float[Array, ""]]:
    """State and output after some steps under one command."""
    output = jnp.zeros(())
    for _ in range(count):
        state, line = plant.step(state, Line(command, command))
        output = line.end
    return state, output


def perturbed(block: Block, share: float, count: int, seed: int = 0) -> Block:
    """Lanes of a block whose every number differs from its own by up to a share of it, evenly drawn.

    Whole numbers, as seeds are, stay the same in all lanes.
    """
    rng = np.random.default_rng(seed)

    def drawn(x: Array) -> Array:
        spread = rng.uniform(-share, share, (count, *x.shape)) if eqx.is_inexact_array(x) else np.zeros((), dtype=int)
        return jnp.broadcast_to(x + x * spread, (count, *x.shape))

    return jax.tree.map(drawn, block)
