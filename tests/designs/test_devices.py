"""Batches on devices other than this processor: programs without host calls, one transfer in and out, the same numbers.

No accelerator is needed: programs are lowered for CUDA, and batches are made as wide as they would be there.
"""

import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.controllers.simple_loops import DT, UNLIMITED, actuator, quiet
from tests.small_robots import BALL, DRIVEN, SLIDE

from nectosome.controllers import BlockLoop, block_loop, perturbed, pid_of, wave
from nectosome.core.side_by_side import MOST, side_by_side
from nectosome.description import parse_robot
from nectosome.description.variables import read_variable
from nectosome.designs import MotionDesign, batches, sweep
from nectosome.designs.axes import axis_of
from nectosome.designs.batches import batches_of
from nectosome.designs.plans import judge
from nectosome.drives import Chain
from nectosome.identification.gait import walks
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import PlantBatch, SampledPlant, plant_batch

AREA = "body.loads.drag.drag_area.2"
CALL = re.compile(r"custom_call @(\w+)")
SVD = {"cusolver_gesvdj_ffi"}  # of the device, once a cycle: a gap along velocities
LU = {
    "cusolver_getrf_ffi",
    "cu_lu_pivots_to_permutation",
}  # on the device: for the exponential of a matrix, once a loop
SHORT = re.compile(r"tensor<([1-9]\d*x)+f32>")  # numbers of 32 bits, but for arrays without any


def steady():
    robot = parse_robot(BALL)
    batch = batches_of(robot, (axis_of(AREA, [1e-3, 2e-3, 3e-3], robot),), 33, 1e-5)
    return lambda numbers: batches._steady(batch.kind, numbers), (jnp.asarray(batch.numbers),)


def cycles():
    robot = parse_robot(DRIVEN)
    batch = batches_of(robot, (axis_of("c", [0.2, 0.25], robot),), 33, 1e-5)
    times = jnp.asarray(np.linspace(0.0, batch.periods, 33, axis=1))
    return lambda n, t, r: batches._periodic(batch.kind, n, t, r), (
        jnp.asarray(batch.numbers),
        times,
        jnp.asarray(1e-5),
    )


def crawls():
    some = walks.Walks(describe("poseidrone_crawl"), ["k"], seconds=0.1, window=0.1)
    return lambda n, rows: walks._batch(some._template, some._how, n, rows), (some._numbers, jnp.full((2, 1), 205.8))


def designs():
    robot = parse_robot(BALL)
    plan, numbers = MotionDesign(robot, (read_variable(AREA, "0.001..0.003 m2", robot),)).plan()
    rest, warm = build(robot).initial(), jnp.asarray(False)

    def many(u, state):
        return jax.vmap(lambda u: judge(plan, numbers, u, state, warm)[0].quantities)(u)

    return many, (jnp.linspace(0.1, 0.9, 3)[:, None], rest)


def loops():
    blocks = [perturbed(block, 0.1, 3) for block in actuator().blocks[1:]]
    lanes = jax.tree.map(lambda x: jnp.broadcast_to(x, (3, *x.shape)), quiet())
    varied, shared = eqx.partition((BlockLoop(Chain(tuple(blocks)), lanes, DT), None), eqx.is_array)
    reference = wave("sine", 0.3, DT, amplitude=0.8, frequency=1.5)
    law = pid_of([1.5, 12.0, 0.05], 0.02, UNLIMITED).planned(reference, DT)
    return lambda some, r: block_loop._run_each(some, shared, law, r, 3), (varied, jnp.asarray(reference))


def copies():
    plant = SampledPlant(parse_robot(SLIDE), "push", "body.position", 0.2, 2)
    batch, still = PlantBatch(plant, together=True), jnp.zeros(3, dtype=bool)
    state = batch.start(np.zeros((3, 0)))
    return lambda some, push: plant_batch._hold(batch._structure, plant.settings, *some, still, push), (
        state,
        jnp.ones((3, 1)),
    )


@pytest.mark.parametrize(
    ("batch", "libraries"),
    [
        *((f, set()) for f in (steady, designs, copies)),
        (cycles, SVD),
        pytest.param(crawls, set(), marks=pytest.mark.slow),
        (loops, LU),
    ],
)
def test_a_batch_is_a_program_of_the_device_alone(batch, libraries):
    """Nothing calls back to Python or to a library of the processor, and all numbers have 64 bits."""
    f, args = batch()
    text = lowered_for_cuda(f, *args)
    assert set(CALL.findall(text)) == libraries
    assert not SHORT.search(text)


def test_what_a_library_does_and_what_is_rounded_would_be_seen():
    def asks(x):
        return jax.lax.linalg.eigh(x), x.astype(jnp.float32)

    text = lowered_for_cuda(asks, jnp.eye(2))
    assert CALL.findall(text)
    assert SHORT.search(text)


def lowered_for_cuda(f, *args):
    return jax.jit(f).trace(*args).lower(lowering_platforms=("cuda",)).as_text()


@pytest.mark.parametrize("batch", [steady, cycles, pytest.param(crawls, marks=pytest.mark.slow), copies, loops])
def test_a_batch_moves_its_numbers_once(batch):
    """With the numbers on the device nothing more is sent, and nothing comes back before it is asked for."""
    f, args = batch()
    program = jax.jit(f).lower(*args).compile()
    with jax.transfer_guard("disallow"):
        program(*args)
        with pytest.raises(Exception, match="Disallowed host-to-device"):
            program(*jax.tree.map(np.asarray, args))


def test_robots_side_by_side_are_as_one_by_one(monkeypatch):
    """Newton's method of a lane does not know of the others, which may be done before it."""
    robot, area = parse_robot(BALL), [1e-3, 2e-3, 3e-3]
    alone = sweep(robot, {AREA: area}, workers=1)
    monkeypatch.setattr(batches, "side_by_side", lambda on_cpu, count: 4)
    together = sweep(robot, {AREA: area}, workers=1)
    np.testing.assert_allclose(together["speed"], alone["speed"], rtol=1e-12)
    np.testing.assert_array_equal(together["status"], alone["status"])


def test_how_many_go_side_by_side(monkeypatch):
    assert side_by_side(28, 500) == 28  # on this processor
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    assert [side_by_side(28, count) for count in (1, 3, 512, 513, 5000)] == [1, 4, 512, 1024, MOST]
