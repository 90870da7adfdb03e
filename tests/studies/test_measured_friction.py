"""Friction of actuators that others measured: found again where it is known, and better than none on runs held out."""

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.drives import respond
from nectosome_studies.measure.friction import RANGES, TESTS, compare, friction, friction_test, predicted, runs_of
from nectosome_studies.study import printed

EACH = pytest.mark.parametrize("name", TESTS)
TRUTH = {
    "dahl": np.array([6.0, 2.5e4, 149.0, -20.0, 0.0]),
    "dahl-pressure": np.array([4.0, 4e4, 0.0, 0.0, 5e-4]),
}


def made(runs, theta, noise):
    """Runs along the measured paths, with the pull of a model."""
    rng = np.random.default_rng(0)
    pulls = [np.asarray(respond(friction(jnp.asarray(theta)), run.drawn, 1.0)) for run in runs]
    return [run._replace(force=F + noise * rng.normal(size=len(F))) for run, F in zip(runs, pulls, strict=True)]


@EACH
def test_runs_begin_where_the_log_has_no_gap(name):
    """Ten of as many samples each; the first counts from after the gap on, and no laser jumps are left."""
    runs = runs_of(friction_test(name))
    assert [len(run.force) for run in runs] == [440] * 10
    assert runs[0].begin == {"circle": 175, "kdn": 60}[name]
    assert {run.begin for run in runs[1:]} == {40}
    for run in runs[1:]:
        out = run.drawn[60:260, 0]
        assert np.diff(out).min() > -0.1e-3
        assert np.ptp(run.drawn[run.begin :, 0]) == pytest.approx(39e-3, abs=1.5e-3)
    assert max(run.force[run.begin :].max() for run in runs) < 158  # the jump of 170 N at the first start is left out


@EACH
@pytest.mark.parametrize("model", TRUTH)
def test_known_friction_is_found_along_the_measured_paths(name, model):
    """Within four standard errors of the runs' scatter, 95 % of Student's t with 4 degrees being 2.776 of them."""
    truth = TRUTH[model]
    runs = made(runs_of(friction_test(name)), truth, 0.2)
    fit, free = compare(runs).fits[model], truth != 0
    assert np.all(np.abs(fit.theta - truth)[free] < 4 / 2.776 * fit.half[free])
    np.testing.assert_allclose(fit.theta[:2], truth[:2], rtol=0.02)
    np.testing.assert_array_equal(fit.theta[~free], 0.0)
    pulls = np.concatenate([run.force[run.begin :] for run in runs[1::2]])
    assert fit.held_out == pytest.approx(100 * 0.2 / np.ptp(pulls), rel=0.05)
    assert abs(fit.correlation) < 0.1  # white noise


@EACH
def test_friction_predicts_runs_held_out(name):
    """A tenth of the error without friction, less again with the pressure; half the difference of ways is its limit."""
    test = friction_test(name)
    found = compare(runs_of(test))
    dahl, pressure = found.fits["dahl"], found.fits["dahl-pressure"]
    assert dahl.held_out < 0.12 * found.curve
    assert dahl.held_out < 1.15 * dahl.train
    assert found.repeat < dahl.held_out
    assert pressure.held_out < dahl.held_out
    assert dahl.theta[0] == pytest.approx(test.friction.mean(), rel=0.05)
    assert 0.7 < pressure.theta[0] / dahl.theta[0] < 0.8
    assert np.all(dahl.half[:4] > 0)


@EACH
def test_neighbouring_residuals_correlate(name):
    """Were they white, the limit would seem known three times as well as the runs agree."""
    runs = runs_of(friction_test(name))
    fit = compare(runs).fits["dahl"]
    assert fit.correlation > 0.8
    count = sum(len(run.force) - run.begin for run in runs[::2])
    left = np.concatenate([predicted(fit.theta, run) - run.force[run.begin :] for run in runs[::2]])
    white = 1.96 * left.std() / np.sqrt(count)  # about: each sample tells the limit with slope 1 or -1
    assert fit.half[0] > 3 * white


@EACH
def test_a_late_log_of_the_distance_would_change_the_stiffness(name):
    """By more than half for 50 ms, while the limit stays: so says the note."""
    test = friction_test(name)
    time, x = test.recording["time"].values, test.recording["distance"].values
    late = test.recording.assign(distance=("time", np.interp(time + 0.05, time, x)))
    before, after = (compare(runs_of(one)).fits["dahl"] for one in (test, test._replace(recording=late)))
    assert after.theta[1] < 0.5 * before.theta[1]
    assert after.theta[0] == pytest.approx(before.theta[0], rel=0.02)
    assert after.held_out < before.held_out


def test_notes_tell_what_is_computed():
    """Intervals and stiffnesses that `printed.toml` writes out."""
    book = printed("measure")
    for key in TESTS:
        found = compare(runs_of(friction_test(key)))
        for model in TRUTH:
            value, half = found.fits[model].theta[0], found.fits[model].half[0]
            assert f"{value:.2f} +- {half:.2f} N" in book[f"measure/pneumatic/{key}/{model}/limit"]["note"]
        k = RANGES.names.index("stiffness")
        value, half = 1e-3 * found.fits["dahl"].theta[k], 1e-3 * found.fits["dahl"].half[k]
        told = f"{value:.1f} +- {half:.1f} N/mm" if half < 10 else f"{value:.0f} +- {half:.0f} N/mm"
        assert told in book[f"measure/pneumatic/{key}/dahl/stiffness"]["note"]
