"""A controller and a block in a closed loop, as they would run on a rig: sampled, with noise."""

from concurrent.futures import Executor
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Block, Line, Status, Stepper
from nectosome.core.side_by_side import side_by_side
from nectosome.drives import Sensor
from nectosome.search.executors.spread import spread

from .contract import Controller, Progress, Regulator, Stop

_LOT = 64  # loops that a call of an executor runs


class BlockLoopRecord(NamedTuple):
    """Signals of a closed loop at the sampling times, in SI units of the block."""

    reference: Float[Array, "*batch n"]
    output: Float[Array, "*batch n"]  # true, without noise
    measured: Float[Array, "*batch n"]
    command: Float[Array, "*batch n"]

    @property
    def status(self) -> Status:
        """Whether all of it is finite."""
        return Status.SOLVED if np.isfinite(self.output).all() else Status.NOT_FINITE


class BlockLoop(eqx.Module):
    """A block under a controller, from rest; `sensor` measures its output.

    A command is held from sample to sample, over `substeps` steps of the block, so that a rate limit of the block acts
    within a sample. A command acts in the sample after its measurement if the block begins with a `DeadTime` of one
    sample. A block or a sensor with a leading axis is a batch of loops (see `run_batch`).
    """

    plant: Block
    sensor: Sensor
    dt: float = eqx.field(static=True)  # between samples [s]
    substeps: int = eqx.field(static=True, default=5)

    def quiet(self) -> "BlockLoop":
        """The same without noise of the sensor."""
        return eqx.tree_at(lambda loop: loop.sensor.noise, self, jnp.zeros(()))

    def run(
        self,
        controller: Controller,
        reference: Float[np.ndarray, "n"],
        *,
        progress: Progress | None = None,
        stop: Stop | None = None,
    ) -> BlockLoopRecord:
        """Closed-loop run along a reference: one compiled call, to its end."""
        return self.run_regulator(controller.planned(reference, self.dt), reference)

    def run_regulator(self, regulator: Regulator, reference: Float[ArrayLike, "n"]) -> BlockLoopRecord:
        """Closed-loop run of a regulator that was planned for this reference."""
        output, measured, command = _run(self, regulator, jnp.shape(reference)[0])
        return BlockLoopRecord(jnp.broadcast_to(jnp.asarray(reference), output.shape), output, measured, command)


@eqx.filter_jit
def _run(loop: BlockLoop, regulator: Regulator, count: int) -> tuple[Array, Array, Array]:
    plant = loop.plant.sampled(loop.dt / loop.substeps)

    def sample(carry, _):
        regulator_state, state, sensor_state, output = carry
        sensor_state, line = loop.sensor.step(sensor_state, Line(output, output))
        regulator_state, command = regulator.step(regulator_state, line.end)
        state, after = hold(plant, state, command, loop.substeps)
        return (regulator_state, state, sensor_state, after), (output, line.end, command)

    start = (regulator.initial(), plant.initial(), loop.sensor.initial(), jnp.zeros(()))
    return jax.lax.scan(sample, start, None, count)[1]


def run_batch(
    loops: BlockLoop,
    regulator: Regulator,
    reference: Float[ArrayLike, "n"],
    own: bool = False,
    executor: Executor | None = None,
) -> BlockLoopRecord:
    """Closed-loop runs of a batch of loops, each under the same regulator, or each under its `own` of a batch of them.

    On a processor they run one after the other: side by side each sample would take as long as that of the slowest
    loop. Other devices run up to 1024 side by side.

    - executor: any of `concurrent.futures`; each of its calls runs 64 loops.
    """
    batched, shared = eqx.partition((loops, regulator if own else None), eqx.is_array)
    count = jax.tree.leaves(batched)[0].shape[0]
    if executor is None:
        return _run_each(batched, shared, regulator, reference, min(side_by_side(1, count), count))

    def call(first: int) -> tuple[Any, ...]:
        some = jax.tree.map(lambda x: np.asarray(x)[first : first + _LOT], batched)
        lot, laws = eqx.combine(some, shared)
        return first, run_batch, (lot, laws if own else regulator, reference, own)

    records = dict(spread(executor, map(call, range(0, count, _LOT)), lambda: True))
    return jax.tree.map(lambda *lots: jnp.concatenate(lots), *(records[first] for first in sorted(records)))


@eqx.filter_jit
def _run_each(
    batched: Any, shared: Any, regulator: Regulator, reference: Float[ArrayLike, "n"], width: int
) -> BlockLoopRecord:
    """Runs of loops, each with a regulator of its own or None, of which `width` are computed side by side."""

    def one(part: Any) -> BlockLoopRecord:
        loop, law = eqx.combine(part, shared)
        return loop.run_regulator(regulator if law is None else law, reference)

    return jax.lax.map(one, batched, batch_size=width if width > 1 else None)


def hold(plant: Stepper, state: Any, command: Float[Array, ""], count: int) -> tuple[Any, Float[Array, ""]]:
    """State and output of a block after `count` steps under one command."""
    output = jnp.zeros(())
    for _ in range(count):
        state, line = plant.step(state, Line(command, command))
        output = line.end
    return state, output


def perturbed(block: Block, share: float, count: int, seed: int = 0) -> Block:
    """A batch of `count` perturbed plants (Monte Carlo): each number differs by up to `share` of it, drawn uniformly.

    Integers, such as seeds, are the same in the whole batch.
    """
    rng = np.random.default_rng(seed)

    def drawn(x: Array) -> Array:
        spread = rng.uniform(-share, share, (count, *x.shape)) if eqx.is_inexact_array(x) else np.zeros((), dtype=int)
        return jnp.broadcast_to(x + x * spread, (count, *x.shape))

    return jax.tree.map(drawn, block)
