"""Means of columns by conditions: of signals whose mean, amplitude, phase and loop are known in closed form."""

import json

import numpy as np
import pytest
import xarray as xr
from scipy.stats import t as student

from nectosome.measure.condition_means import condition_means
from nectosome.units import InputError

F, FORCE, WAY, LEAD = 0.8, 0.4, 0.03, np.radians(40)


def run(angle=0.5, mean=0.1, noise=0.0, seed=0, frequency=F, cycles=6.0, window=None, name="run.csv"):
    """A force that leads a way by 40 deg, and a third harmonic, after half a second at rest."""
    rng, t = np.random.default_rng(seed), np.arange(0, 0.5 + cycles / F, 0.005)
    phase, moves = 2 * np.pi * F * (t - 0.5), t >= 0.5
    force = (mean + FORCE * np.cos(phase + LEAD) + 0.1 * np.cos(3 * phase)) * moves + noise * rng.normal(size=t.size)
    coords = {"time": ("time", t, {"units": "s"}), "A": ((), angle, {"units": "rad"})}
    coords |= {"f": ((), frequency, {"units": "Hz"})} if frequency else {}
    attrs = {"provenance": json.dumps({"file": name}), "window": json.dumps(window or f"0.5..{0.5 + cycles / F} s")}
    data = {"force": ("time", force, {"units": "N"}), "way": ("time", WAY * np.cos(phase) * moves, {"units": "m"})}
    return xr.Dataset(data, coords, attrs)


def test_mean_amplitude_phase_loop_and_power_have_closed_forms():
    """The loop of two harmonics of one frequency is -pi F X sin(lead), the work of the force in a cycle."""
    found = condition_means([run()], "force", "way").isel(condition=0)
    work = np.pi * FORCE * WAY * np.sin(LEAD)
    assert float(found["mean"]) == pytest.approx(0.1, abs=1e-5)
    assert float(found["amplitude"]) == pytest.approx(FORCE, rel=1e-4)
    assert float(found["phase"]) == pytest.approx(LEAD, abs=1e-4)
    assert float(found["loop_area"]) == pytest.approx(work, rel=1e-3)
    assert float(found["power"]) == pytest.approx(F * work, rel=1e-3)
    assert [found[name].attrs["units"] for name in ("mean", "phase", "loop_area", "power")] == ["N", "rad", "J", "W"]
    assert int(found["runs"]) == 1 and int(found["cycles"]) == 5  # the first is left out
    assert np.isnan(found["mean_by_repeats"])


def test_noise_is_in_the_error_by_cycles_and_what_differs_between_runs_in_that_by_repeats():
    """Noise of 10 mN, 250 samples a cycle, five cycles of each of four runs; runs at -d, 0, 0, d of two conditions."""
    d, noise = 0.01, 0.01
    runs = [
        run(angle, 0.1 + shift, noise, seed=7 * k + 100 * angle)
        for angle in (1, 2)
        for k, shift in enumerate((-d, 0, 0, d))
    ]
    found = condition_means(runs, "force")
    by_cycles, by_repeats = found["mean_by_cycles"].values, found["mean_by_repeats"].values
    assert by_cycles == pytest.approx(noise / np.sqrt(4 * 5 * 250), rel=0.5)
    assert by_repeats == pytest.approx(np.sqrt(2 * d**2 / 3 + noise**2 / 1250) / 2, rel=0.05)
    half = 0.5 * (found["mean_high"] - found["mean_low"]).values
    assert half == pytest.approx(student.ppf(0.975, 6) * by_repeats, rel=1e-9)
    assert found["runs"].values.tolist() == [4, 4]
    assert found["A"].values.tolist() == [1, 2]


def test_phases_of_repeats_on_both_sides_of_half_a_turn_are_one_direction():
    turned = [run(name=f"{k}.csv") for k in range(2)]
    for one, lag in zip(turned, (0.05, -0.05), strict=True):
        t = one["time"].values
        one["way"] = ("time", np.cos(2 * np.pi * F * (t - 0.5) + LEAD + np.pi + lag), {"units": "m"})
    found = condition_means(turned, "force", "way")
    assert np.abs(found["phase"].values) == pytest.approx(np.pi, abs=1e-3)
    assert found["phase_by_repeats"].values == pytest.approx(0.05, rel=1e-2)


def test_a_recording_without_cycles_has_its_mean_by_samples():
    rng, t = np.random.default_rng(5), np.arange(0, 10, 0.01)
    still = xr.Dataset(
        {"force": ("time", 2 + 0.1 * rng.normal(size=t.size), {"units": "N"})},
        {"time": ("time", t, {"units": "s"})},
        {"provenance": json.dumps({"file": "still.csv"})},
    )
    found = condition_means([still], "force").isel(condition=0)
    assert float(found["mean_by_cycles"]) == pytest.approx(0.1 / np.sqrt(t.size), rel=0.3)
    assert float(found["mean_low"]) < 2 < float(found["mean_high"])
    assert "amplitude" not in found


def test_a_repeat_that_is_far_off_is_left_out_and_named():
    means = (0.1, 0.101, 0.099, 0.3)
    found = condition_means([run(a, x, name=f"{a}{k}.csv") for a in (1, 2) for k, x in enumerate(means)], "force")
    assert found["runs"].values.tolist() == [3, 3]
    assert "13.csv: left out, far from the other repeats" in found.attrs["notes"]
    few = condition_means([run(1, x) for x in (0.1, 0.1001, 0.11)], "force")
    assert int(few["runs"][0]) == 3  # two that are near each other by chance leave nothing out


@pytest.mark.parametrize(
    ("recordings", "columns", "why"),
    [
        ([run()], ("forse",), 'run.csv: has no column called "forse". Did you mean "force"?'),
        ([run(), run(frequency=None, name="b.csv")], ("force",), "b.csv: has the conditions A"),
        ([run(frequency=None)], ("force", "way"), "has no condition f, the frequency of its cycles"),
        ([run(cycles=0.5)], ("force",), "less than a cycle"),
        ([], ("force",), "there are no recordings"),
        ([run().assign_coords(phase=0.5)], ("force", "way"), "give the condition phase another name"),
    ],
)
def test_what_gives_no_table_is_told(recordings, columns, why):
    with pytest.raises(InputError) as error:
        condition_means(recordings, *columns)
    assert why in str(error.value)
