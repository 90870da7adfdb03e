"""Gaits: features by closed form, eq. 13, walks side by side, and fits whose parameters are known (synthetic)."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from tests.afar import Afar

from nectosome.description import get_value
from nectosome.description.variables import read_variable
from nectosome.identification import identifiability
from nectosome.identification.gait.files import load_gait_fit
from nectosome.identification.gait.fit import GaitFit, GaitTrial, gait_optimiser
from nectosome.identification.gait.walks import Walks, discrepancy, gait_of
from nectosome.model import build
from nectosome.robots import describe
from nectosome.search import minimise
from nectosome.solve import simulate
from nectosome.units import InputError
from nectosome_studies.poseidrone import crawl

TARGET = np.array(crawl.TARGET)
TRUE = np.array([205.8, 6.65])  # k, m_a


@pytest.fixture(scope="module")
def fit():
    """Two unknowns, and two trials whose features are those of walks of 3 s with known parameters."""
    robot = describe("poseidrone_crawl")
    variables = tuple(read_variable(name, crawl.BOX[name], robot) for name in ("k", "m_a"))
    changes = [{"volume": crawl.MASS / rho} for rho in (1238.0, 1178.0)]
    blank = tuple(GaitTrial((1.0, 1.0, 1.0, 1.0), change) for change in changes)
    walked = GaitFit(robot, variables, blank, seconds=3.0, window=1.5).walked(TRUE[None])
    trials = tuple(GaitTrial(tuple(one.gait[0].tolist()), change) for one, change in zip(walked, changes, strict=True))
    return GaitFit(robot, variables, trials, seconds=3.0, window=1.5)


def test_features_of_a_sine_are_its_own():
    """Half a millisecond off the crossings, at most: 9 turns and a bit in 5 s."""
    t = np.arange(0, 5.0005, 1e-3)
    found = gait_of(
        jnp.asarray(0.04 * t), jnp.asarray(0.127 + 3.5e-3 * np.sin(2 * np.pi * 1.98 * t)), jnp.asarray(1e-3)
    )
    np.testing.assert_allclose(found, [7e-3, 1.98, 0.04, 0.127], rtol=2e-3)


def test_what_does_not_come_back_to_its_mean_has_no_frequency():
    t = np.linspace(0, 1, 101)
    assert gait_of(jnp.asarray(t), jnp.asarray(t), jnp.asarray(0.01)).frequency == 0


def test_the_printed_discrepancy_is_that_of_the_printed_features():
    """2.012e-8 is printed; the digits of the features leave 3 %."""
    found = discrepancy(np.array(crawl.FOUND), TARGET, np.array(np.inf), 25.0)
    assert found == pytest.approx(2.012e-8, rel=0.03)


def test_a_robot_that_falls_sooner_is_worse():
    """ceil(100 + 5 (25 - t))."""
    fell = np.array([np.inf, 24.9, 3.33])
    found = discrepancy(np.stack([TARGET, TARGET, np.full(4, np.nan)]), TARGET, fell, 25.0)
    np.testing.assert_array_equal(found, [0.0, 101.0, 209.0])


def test_walks_side_by_side_are_those_of_simulate(fit):
    """Heave and lean over the window, against an adaptive method of another order: to 10 um and 0.01 deg."""
    (one, _) = fit.walked(TRUE[None])
    times = np.linspace(0.0, 3.0, 301)
    run = simulate(
        build(describe("poseidrone_crawl")), 3.0, samples=times.tolist(), method="explicit", rtol=1e-7, atol=1e-9
    )
    q = np.asarray(run.value.state.q)[150:]
    np.testing.assert_allclose(one.series[0, :, 1], q[:, 1], atol=1e-5)
    np.testing.assert_allclose(one.series[0, :, 2], q[:, 2], atol=2e-4)
    assert one.duty[0, 1] > 0.3


def test_lanes_do_not_know_of_each_other(fit):
    """Nine rows, one more than go side by side: each is what it is alone."""
    rows = np.column_stack([np.linspace(100, 300, 9), np.linspace(4, 7, 9)])
    together = fit.walked(rows)[0].gait
    np.testing.assert_array_equal(together[[3, 8]], np.concatenate([fit.walked(rows[[k]])[0].gait for k in (3, 8)]))


def test_walks_of_workers_are_those_of_threads_here(fit):
    """Nine rows in two trials: three batches, sent as pickles."""
    rows = np.column_stack([np.linspace(100, 300, 9), np.linspace(4, 7, 9)])
    with Afar() as executor:
        there = replace(fit, executor=executor).walked(rows)
    assert executor.calls == 3
    for ours, theirs in zip(fit.walked(rows), there, strict=True):
        for x, y in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(x, y)


def test_a_search_finds_the_parameters_that_made_the_gaits(fit):
    """Two gaits, two unknowns: to 1 % within 200 walks of each."""
    found = minimise(fit.task(), gait_optimiser(evaluations=200), seed=1, target=1e-5)
    assert found.value <= 1e-5
    best = fit.ranges.values(found.best.u)
    np.testing.assert_allclose(best, TRUE, rtol=0.01)
    told = identifiability(fit.misfit, best)
    assert told.identifiable.all()


def test_two_trials_are_two_objectives_too(fit):
    rows = np.array([[100.0, 5.0], TRUE])
    np.testing.assert_allclose(fit.by_trial(rows).sum(axis=1), fit.task().objective(rows))
    assert np.all(fit.by_trial(rows)[1] < 1e-20)


def test_a_robot_that_leans_over_falls():
    """Buoyancy below the centre of mass: it turns over within the second."""
    walks = Walks(describe("poseidrone_crawl"), ["limbs.module.offset.2"], seconds=3.0, window=1.5)
    found = walks(np.array([[-0.3], [0.0878325]]))
    assert 0.1 < found.fell[0] < 2.0
    assert np.isinf(found.fell[1])


def test_what_cannot_walk_is_refused():
    with pytest.raises(InputError, match="has no legs"):
        Walks(describe("flagellum"), ["water.density"])
    with pytest.raises(InputError, match="must be so many of them"):
        Walks(describe("poseidrone_crawl"), ["k"], seconds=2.0, window=0.7)
    robot = describe("poseidrone_crawl")
    variables = (read_variable("k", crawl.BOX["k"], robot),)
    with pytest.raises(InputError, match="varies, and cannot be given too"):
        GaitFit(robot, variables, (GaitTrial(crawl.TARGET, {"k": 100.0}),)).walked(np.array([[100.0]]))


def test_the_file_that_ships_is_the_papers_fit():
    shipped, own = load_gait_fit("examples/crawl_features.yaml"), crawl.fit()
    assert shipped.ranges.names == own.ranges.names
    np.testing.assert_allclose(shipped.ranges.bounds, own.ranges.bounds, rtol=1e-4)
    np.testing.assert_allclose(shipped.trials[0].target, own.trials[0].target, rtol=1e-12)


def test_the_robot_that_ships_has_the_papers_buoyancy():
    """0.755 kg at 1238 kg/m3, 0.09 m from the centre of mass, 12.6 deg ahead of straight above."""
    robot = describe("poseidrone_crawl")
    for path, value in crawl.module(*crawl.OWN).items():
        assert float(get_value(robot, path)) == pytest.approx(value, rel=1e-5)


@pytest.mark.slow
def test_steps_of_a_millisecond_leave_the_gait_as_it_is():
    """25 s with the values of Table 3: eq. 13 between steps of 1 ms and of a twentieth is at most 1e-6."""
    robot, row = describe("poseidrone_crawl"), np.array([[205.8]])
    coarse, fine = (Walks(robot, ["k"], step=step)(row) for step in (1e-3, 5e-5))
    assert discrepancy(fine.gait[0], coarse.gait[0], fine.fell[0], 25.0) <= 1e-6
