"""Recordings as experiments: synthetic ones whose means, peaks and scatter are known."""

import json

import numpy as np
import pytest
from tests.synthetic_campaign import FREQUENCIES, PLAN, A, grid, mean, peak, recording, write_campaign

from nectosome.identification import experiments_of, observe, table_of
from nectosome.measure import load_campaign
from nectosome.units import InputError

THRUST = -grid()["force"].sel(axis="y", drop=True)
THREE = [(A[0], 0.4), (A[2], 1.0), (A[4], 1.3)]


def three(**how):
    return [recording(a, f, name=f"run_{k}.csv", **how) for k, (a, f) in enumerate(THREE)]


def rows(recordings, **how):
    return observe(recordings, THRUST, "force", "Cn", **how)


def test_a_campaign_gives_means_and_peaks_of_settled_cycles(tmp_path):
    """All that is read has 9 digits; a sine of 40 samples a cycle has one at its top."""
    observed = observe(load_campaign(write_campaign(tmp_path, scatter=0)).recordings(), THRUST, "force", "Cn")
    assert len(observed) == len(PLAN)
    for (i, j), row in zip(PLAN, observed, strict=True):
        a, f = A[i], FREQUENCIES[j]
        assert row.conditions == pytest.approx({"A": a, "f": f})
        assert (row.mean, row.peak) == pytest.approx((mean(a, f), peak(a, f)), rel=1e-7)
        assert row.seconds == pytest.approx(row.repeats * 199 / (40 * f), rel=1e-7)
        assert row.notes == ("the first cycle of recordings with three or more is left out, as start-up",)
    assert [row.repeats for row in observed[:4]] == [3, 2, 2, 3]


def test_the_scatter_of_repeats_is_pooled_as_a_share_of_the_mean():
    """Two repeats 2 d apart have a variance of 2 d^2, three at -d, 0, d one of d^2: pooled over 1 + 2 degrees.

    Three degrees of freedom widen it by Student's t, 3.182 at 95 %, to the normal distribution's 1.96.
    The least constant that is tried, a thousandth of the largest mean, takes part: 1 in 1000.
    """
    (a, f), (b, g), (c, h) = THREE
    repeats = [recording(a, f, scale=s) for s in (0.98, 1.02)] + [recording(b, g, scale=s) for s in (0.97, 1, 1.03)]
    observed = rows([*repeats, recording(c, h)])
    sigma = np.sqrt((2 * 0.02**2 + 2 * 0.03**2) / 3) * 3.18245 / 1.95996
    for row, n in zip(observed, (2, 3, 1), strict=True):
        assert row.repeats == n
        assert row.error == pytest.approx(sigma * row.mean / np.sqrt(n), rel=1e-3)
        assert row.peak_error == pytest.approx(sigma * row.peak / np.sqrt(n), rel=1e-3)


def test_scatter_that_is_the_same_everywhere_is_found_as_such():
    """Three repeats at -d, 0, d of all conditions: d / sqrt(3), though means differ 15 times (0.5 % by the last r).

    Wider by Student's t of six degrees of freedom, 2.447 at 95 %.
    """
    runs = [*three(), *three(), *three()]
    for k, run in enumerate(runs):
        run["force"] += (-0.05, 0.0, 0.05)[k // 3]
    for row in rows(runs):
        assert row.repeats == 3
        assert row.error == pytest.approx(0.05 / np.sqrt(3) * 2.44691 / 1.95996, rel=0.006)


def test_a_repeat_far_from_the_others_is_left_out():
    runs = [recording(*THREE[2], scale=s, name=f"run_{s}.csv") for s in (1.0, 1.01, 0.99, 1.3)]
    runs += [recording(a, f, scale=s) for a, f in THREE[:2] for s in (1.0, 1.02, 0.99)]
    row, *others = rows(runs)
    assert row.repeats == 3
    assert row.mean == pytest.approx(mean(*THREE[2]), rel=1e-9)
    assert "run_1.3.csv: left out, far from the other repeats" in row.notes
    assert [other.repeats for other in others] == [3, 3]


def test_of_two_repeats_none_is_left_out():
    runs = [recording(*THREE[0], scale=s) for s in (1.0, 1.5)]
    assert rows([*runs, *three()[1:], *three()[1:]])[0].repeats == 2


def test_cycles_with_missing_values_are_left_out():
    broken = three()
    broken[1]["force"][90:100] = np.nan  # in the third of five cycles
    broken[1]["force"][130] *= 1e6
    broken[1]["force"][130:132] = np.nan
    row = rows(broken)[1]
    assert row.mean == pytest.approx(mean(*THREE[1]), rel=1e-9)
    assert "run_1.csv: 2 of 5 cycles left out, which are not wholly there" in row.notes


def test_a_low_pass_takes_ripple_from_the_peaks():
    """A ripple of a tenth at 15 times the frequency; a low pass at 4 f leaves 0.4 % of it."""
    rippled = three()
    for run in rippled:
        f = float(run["f"])
        run["force"] += 0.1 * peak(float(run["A"]), f) * np.cos(2 * np.pi * 15 * f * run["time"])
    for plain, row in zip(rows(three()), rows(rippled, lowpass=4.0), strict=True):
        assert row.mean == pytest.approx(plain.mean, rel=1e-9)
    a, f = THREE[1]
    raw, smooth = (rows(rippled, lowpass=x)[1].peak / peak(a, f) - 1 for x in (None, 4.0))
    assert raw > 0.05
    assert abs(smooth) < 0.01


def test_without_a_frequency_the_mean_is_over_all():
    thrust, runs = -grid(("A", "Cn"))["force"].sel(axis="y", drop=True), []
    for a in A[:3]:
        run = recording(a, 1.0, cycles=4.0).drop_vars("f")
        run["force"][:40] = run["force"][40:80].values  # settled from the beginning
        run["force"][7] = np.nan
        runs.append(run)
    row, *_ = observe(runs, thrust, "force", "Cn")
    assert row.mean == pytest.approx(mean(A[0], 1.0), rel=0.01)
    assert row.peak == pytest.approx(peak(A[0], 1.0), rel=1e-9)
    assert row.error > 0
    assert np.isnan(row.peak_error)
    assert row.notes == ("run.csv: 1 missing values left out",)
    table = table_of(thrust, "Cn", 1.0)
    assert experiments_of(observe(runs, thrust, "force", "Cn"), table, table).estimate is None


def test_without_repeats_the_scatter_of_cycles_counts():
    """Nine settled cycles up and down by a share d: s = d mean sqrt(n / (n - 1)) about, over sqrt(n)."""
    runs = three(cycles=10.0)
    for run in runs:
        run["force"] *= 1 + 0.05 * np.random.default_rng(0).choice([-1, 1], 10).repeat(40)
    for row in rows(runs):
        assert 0.3 < row.error / (0.05 * row.mean / 3) < 3
        assert row.peak_error > 0


def test_peaks_tell_the_parameter():
    """Peaks of 3 Cn A f^2 with Cn = 0.8, half of the recordings a thousandth larger; dCn = Cn dF/F."""
    tables = (table_of(THRUST, "Cn"), table_of(grid()["force_peak"].sel(axis="y", drop=True), "Cn"))
    experiments = experiments_of(rows(three() + three(scale=1.001)), *tables)
    assert experiments.estimate is not None
    assert experiments.estimate.apart
    np.testing.assert_allclose(experiments.estimate.values, 0.8 * 1.0005, rtol=1e-9)
    relative = [row.peak_error / row.peak for row in rows(three() + three(scale=1.001))]
    np.testing.assert_allclose(experiments.estimate.errors / experiments.estimate.values, relative, rtol=1e-6)
    assert experiments_of(rows(three()), tables[0]).estimate is None


@pytest.mark.parametrize(
    ("runs", "words"),
    [
        (three(units=("", "Hz", "N")), "run_0.csv, A: is in no unit, what is simulated in rad"),
        (three(units=("rad", "rad/s", "N")), "run_0.csv, f: is in rad/s, what is simulated in Hz"),
        (three(units=("rad", "Hz", "m")), "run_0.csv, force: is in m, what is simulated in N"),
        ([run.drop_vars("f") for run in three()], "run_0.csv, f: is a dimension of the simulated grid, and no"),
        ([run.assign_coords(v=0.1) for run in three()], "run_0.csv, v: is no dimension of the simulated grid"),
        (
            [*three(), recording(1.2, 0.4)],
            "run.csv, A: 68.7549 deg is outside of the simulated grid, which goes from 20 deg to 60 deg",
        ),
        ([*three(), recording(A[0], 0.7, cycles=0.9)], "run.csv, force: lasts 1.25 s, less than a cycle of 1.429 s"),
        (three(cycles=1.0), "run_0.csv: holds a single cycle, and no conditions were measured twice"),
        ([*three(), *three()[:2]][3:], "2 different conditions were measured, too few: at least 3"),
        ([run.isel(time=slice(None, None, 8)) for run in three()], "run_0.csv, force: has 5 samples a cycle"),
        ([run.where(run["time"] < 0) for run in three()], "run_0.csv, force: has 0 samples with a value"),
        ([run.rename(force="F") for run in three()], 'run_0.csv: has no column called "force"'),
        ([run.rename(time="row") for run in three()], "run_0.csv: has no time"),
    ],
)
def test_what_does_not_fit_is_told_with_its_file(runs, words):
    with pytest.raises(InputError) as error:
        rows(runs)
    assert words in str(error.value)


def test_a_low_pass_that_cannot_be_is_told_with_its_file():
    with pytest.raises(InputError, match=r"run_0.csv, force: lowpass: cutoff is 100 Hz"):
        rows(three(), lowpass=100.0)


def in_a_longer_run(one):
    """The same after 2 s at rest, and before 3 s at rest; its window says where it is."""
    t = one["time"].values
    step = t[1] - t[0]
    before, after = np.arange(0.0, 2.0, step), np.arange(step, 3.0, step)
    time = np.concatenate([before, before[-1] + step + t, before[-1] + step + t[-1] + after])
    force = np.concatenate([0 * before, one["force"].values, 0 * after])
    whole = one.drop_vars("force").drop_vars("time").assign_coords(time=("time", time, {"units": "s"}))
    whole = whole.assign(force=("time", force, one["force"].attrs))
    window = f"{before[-1] + step:.9g}..{before[-1] + step + t[-1]:.9g} s"
    return whole.assign_attrs(window=json.dumps(window))


def test_only_what_is_within_its_window_counts():
    plain, longer = rows(three()), rows([in_a_longer_run(one) for one in three()])
    for one, other in zip(plain, longer, strict=True):
        assert (other.mean, other.peak, other.error) == pytest.approx((one.mean, one.peak, one.error), rel=1e-9)


@pytest.mark.parametrize(
    ("window", "words"),
    [("2", "is no window. Write two times"), ("1..2 m", "window"), ("900..901 s", "has no readings, which go from 0")],
)
def test_a_window_that_is_none_is_told(window, words):
    wrong = [one.assign_attrs(window=json.dumps(window)) for one in three()]
    with pytest.raises(InputError, match=words) as told:
        rows(wrong)
    assert told.value.field == "window"
