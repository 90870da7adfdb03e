"""Loops against plain loops over samples, and what is drawn at random."""

from concurrent.futures import ThreadPoolExecutor

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from nectosome.controllers import ActuatorLimits, BlockLoop, block_loop, eased, perturbed, pid_of, run_batch, wave
from nectosome.controllers.block_loop import hold
from nectosome.drives import Chain, Saturation, Sensor

from .simple_loops import DT, actuator, around, dynamics, late, of

KP, KI, KD, TF = 1.5, 12.0, 0.05, 0.02
LOW, HIGH, SLEW = -0.5, 0.8, 4.0
LAW = pid_of([KP, KI, KD], TF, ActuatorLimits(*of(LOW, HIGH, SLEW)))
REFERENCE = eased(wave("sine", 1.5, DT, amplitude=0.8, frequency=1.5), 0.3, DT) + 0.2
NOISE = 0.05


def simulated(reference):
    """PID, two samples of dead time, x'' = 400 (u - x) - 36 x', all written out."""
    step = expm(DT * np.array([[0.0, 1.0, 0.0], [-400.0, -36.0, 400.0], [0.0, 0.0, 0.0]]))
    x, way, command = np.zeros(2), [0.0, 0.0], 0.0
    error, derivative, integral = reference[0], 0.0, -KP * reference[0]
    outputs, sent = [], []
    for r in reference:
        before, error = error, r - x[0]
        derivative = (TF * derivative + KD * (error - before)) / (TF + DT)
        wanted = KP * error + integral + KI * DT * error + derivative
        nearest = min(max(wanted, command - SLEW * DT), command + SLEW * DT)
        command = min(max(nearest, LOW), HIGH)
        if (wanted - command) * error <= 0:
            integral += KI * DT * error
        outputs.append(x[0])
        sent.append(command)
        way.append(command)
        x = step[:2, :2] @ x + step[:2, 2] * way.pop(0)
    return np.array(outputs), np.array(sent)


def test_a_loop_is_that_of_plain_arithmetic():
    """To 1e-12, limits of range and rate included, with a block that takes more than one step a sample, or one."""
    outputs, sent = simulated(REFERENCE)
    assert np.sum(sent == HIGH) > 2
    assert np.sum(np.abs(np.diff(sent)) > 0.999 * SLEW * DT) > 1
    for substeps in (1, 3):
        track = around(late(dynamics(), 2 * DT, 10), substeps=substeps).run(LAW, REFERENCE)
        np.testing.assert_allclose(track.output, outputs, atol=1e-12)
        np.testing.assert_allclose(track.command, sent, atol=1e-12)
        np.testing.assert_array_equal(track.measured, track.output)
        np.testing.assert_array_equal(track.reference, REFERENCE)


def test_a_command_is_held_over_all_steps():
    plant = Chain((Saturation(*of(-1.0, 1.0)), dynamics())).sampled(DT / 4)
    state, y = plant.initial(), jnp.zeros(())
    for u in (0.5, 2.0):
        state, y = hold(plant, state, *of(u), 4)
    A = expm(DT * np.array([[0.0, 1.0, 0.0], [-400.0, -36.0, 400.0], [0.0, 0.0, 0.0]]))
    x = A[:2, 2] * 0.5
    assert float(y) == pytest.approx((A[:2, :2] @ x + A[:2, 2])[0], rel=1e-12)


@pytest.fixture(scope="module")
def lanes():
    """Four loops whose actuators and seeds differ."""
    dead, *rest = actuator().blocks
    still = jax.tree.map(lambda x: jnp.broadcast_to(x, (4, *x.shape)), dead)
    drawn = [perturbed(block, 0.1, 4, k) for k, block in enumerate(rest)]
    one = jnp.ones(4)
    return BlockLoop(Chain((still, *drawn)), Sensor(NOISE * one, -9 * one, 9 * one, jnp.arange(4)), DT, 2)


def lane(loops, k):
    return jax.tree.map(lambda x: x[k], loops)


def test_lanes_are_what_single_loops_are(lanes):
    regulator = LAW.planned(REFERENCE, DT)
    found = run_batch(lanes, regulator, REFERENCE)
    for k in (0, 3):
        alone = lane(lanes, k).run_regulator(regulator, REFERENCE)
        for both, single in zip(found, alone, strict=True):
            np.testing.assert_allclose(both[k], single, rtol=1e-12, atol=1e-12)
    assert np.std(np.asarray(found.output), axis=0).max() > 0.01


def test_lanes_may_have_regulators_of_their_own(lanes):
    gains = jnp.linspace(0.5, 1.0, 4)
    laws = [eqx.tree_at(lambda one: one.integral, LAW, LAW.integral * g).planned(REFERENCE, DT) for g in gains]
    own = jax.tree.map(lambda *x: jnp.stack(x), *laws)
    found = run_batch(lanes, own, REFERENCE, own=True)
    for k in (1, 2):
        alone = lane(lanes, k).run_regulator(laws[k], REFERENCE)
        np.testing.assert_allclose(found.command[k], alone.command, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("own", [False, True])
def test_an_executor_runs_lanes_as_this_process_does(lanes, monkeypatch, own):
    monkeypatch.setattr(block_loop, "_LOT", 3)
    law = LAW.planned(REFERENCE, DT)
    laws = jax.tree.map(lambda x: jnp.broadcast_to(x, (4, *jnp.shape(x))), law) if own else law
    here = run_batch(lanes, laws, REFERENCE, own)
    with ThreadPoolExecutor(2) as executor:
        there = run_batch(lanes, laws, REFERENCE, own, executor)
    for one, other in zip(here, there, strict=True):
        np.testing.assert_array_equal(one, other)


def test_lanes_side_by_side_are_as_one_by_one(lanes, monkeypatch):
    """As on an accelerator: 3 of the lanes in a batch, then the last."""
    law = LAW.planned(REFERENCE[:200], DT)
    alone = run_batch(lanes, law, REFERENCE[:200])
    monkeypatch.setattr(block_loop, "side_by_side", lambda on_cpu, count: 3)
    together = run_batch(lanes, law, REFERENCE[:200])
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_noise_is_that_of_the_sensor_and_of_its_seed(lanes):
    """Normal, white, of the standard deviation asked for; none is in the output itself; lanes have their own."""
    reference = np.zeros(5000)
    loop = eqx.tree_at(lambda one: one.sensor.seed, lane(lanes, 0), jnp.asarray(7))
    track = loop.run_regulator(LAW.planned(reference, DT), reference)
    noise = np.asarray(track.measured - track.output)
    n = len(noise)
    assert np.std(noise) == pytest.approx(NOISE, rel=4 / np.sqrt(2 * n))
    assert abs(np.mean(noise)) < 4 * NOISE / np.sqrt(n)
    assert abs(np.mean(noise[1:] * noise[:-1])) < 4 * NOISE**2 / np.sqrt(n)
    assert np.mean(np.abs(noise) < NOISE) == pytest.approx(0.6827, abs=4 * 0.466 / np.sqrt(n))
    short = run_batch(lanes, LAW.planned(REFERENCE, DT), REFERENCE)
    each = np.asarray(short.measured - short.output)
    assert np.abs(np.corrcoef(each) - np.eye(4)).max() < 5 / np.sqrt(len(REFERENCE))
    again = run_batch(lanes, LAW.planned(REFERENCE, DT), REFERENCE)
    np.testing.assert_array_equal(again.measured, short.measured)


def test_a_sensor_reads_the_end_of_its_range_beyond_it():
    loop = BlockLoop(dynamics(), Sensor(*of(0.0, -0.1, 0.3)), DT, 2)
    track = loop.run(LAW, REFERENCE)
    assert np.max(track.output) > 0.4
    np.testing.assert_array_equal(track.measured, np.clip(track.output, -0.1, 0.3))


@pytest.mark.parametrize("share", [0.05, 0.5])
def test_uncertain_runs_are_within_the_share_and_the_same_for_the_same_seed(share):
    """Each number on its own, evenly."""
    block = actuator()
    found, again, other = (perturbed(block, share, 400, seed) for seed in (3, 3, 4))
    factors = []
    for one, drawn, same, different in zip(*(jax.tree.leaves(x) for x in (block, found, again, other)), strict=True):
        assert drawn.shape == (400, *one.shape)
        np.testing.assert_array_equal(drawn, same)
        assert not np.array_equal(drawn, different)
        factors.append((np.asarray(drawn) / np.asarray(one)).reshape(400, -1))
    each = (np.concatenate(factors, axis=1) - 1) / share
    assert np.abs(each).max() <= 1 + 1e-12
    assert np.abs(each).max() > 0.99
    assert np.std(each) == pytest.approx(1 / np.sqrt(3), rel=0.05)
    assert np.abs(np.corrcoef(each.T) - np.eye(each.shape[1])).max() < 5 / np.sqrt(400)


def test_no_share_leaves_all_as_it_is():
    for one, drawn in zip(*(jax.tree.leaves(x) for x in (actuator(), perturbed(actuator(), 0.0, 3))), strict=True):
        np.testing.assert_array_equal(drawn, np.broadcast_to(one, drawn.shape))


def test_seeds_are_not_scattered():
    sensor = Sensor(*(jnp.asarray(x) for x in (0.1, -1.0, 1.0)), jnp.asarray(7))
    lanes = perturbed(sensor, 0.05, 3)
    assert lanes.seed.tolist() == [7, 7, 7]
    assert len(set(lanes.noise.tolist())) == 3
