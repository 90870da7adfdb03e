import numpy as np
import pytest
import xarray as xr

from nectosome.measure.signals.correlation import find_period
from nectosome.measure.signals.cycles import average_cycles, loop_area, regular_starts, split_cycles
from nectosome.measure.signals.events import crossings
from nectosome.measure.signals.metadata import processing

from .made import recording

T = np.arange(0, 10.0, 0.01)


def test_each_cycle_of_a_sine_is_the_sine_over_phase():
    x = recording(T, force=np.sin(2 * np.pi * T))
    cycles = split_cycles(x, regular_starts(x, 1.0), samples=50)
    assert cycles["force"].dims == ("cycle", "phase")
    assert cycles.attrs["cycles"] == 10
    assert np.abs(cycles["force"] - np.sin(cycles["phase"])).max() < 1e-12
    assert cycles["phase"].attrs["units"] == "rad"


def test_cycles_of_another_start_are_shifted():
    x = recording(T, force=np.sin(2 * np.pi * T))
    cycles = split_cycles(x, regular_starts(x, 1.0, start=0.25), samples=40, method="cubic")
    assert cycles.attrs["cycles"] == 9
    assert np.abs(cycles["force"] - np.cos(cycles["phase"])).max() < 1e-5


def test_a_trigger_and_a_found_period_give_the_same_mean():
    x = recording(T, force=np.sin(2 * np.pi * 1.3 * T), trigger=np.sin(2 * np.pi * 1.3 * T - 0.4))
    starts = crossings(x["trigger"], 0.0)
    by_trigger = average_cycles(split_cycles(x, starts))
    period = find_period(x["force"]).period
    by_period = average_cycles(split_cycles(x, regular_starts(x, period, start=float(starts[0]))))
    assert np.allclose(by_trigger["force"], np.sin(by_trigger["phase"] + 0.4), atol=2e-3)
    assert np.allclose(by_trigger["force"], by_period["force"], atol=5e-3)
    assert float(by_trigger["duration"]) == pytest.approx(1 / 1.3, rel=1e-4)


def test_the_mean_of_a_noisy_sine_has_the_standard_error_of_its_cycles():
    """Sine of amplitude 1, noise of 0.2, n cycles: standard deviation 0.2, standard error 0.2 / sqrt n."""
    t = np.arange(0, 100.0, 0.02)
    x = recording(t, force=np.sin(2 * np.pi * t) + 0.2 * np.random.default_rng(0).normal(size=len(t)))
    mean = average_cycles(split_cycles(x, regular_starts(x, 1.0), samples=50))
    assert float(mean["force_std"].mean()) == pytest.approx(0.2, rel=0.03)
    assert np.allclose(mean["force_se"], mean["force_std"] / 10)
    z = (mean["force"] - np.sin(mean["phase"])) / mean["force_se"]
    assert np.abs(z).max() < 4
    assert mean.attrs["cycles"] == 100


@pytest.mark.parametrize(("n", "coverage"), [(4, 0.95), (10, 0.8)])
def test_the_band_covers_the_true_mean_as_often_as_it_says(n, coverage):
    """40 seeds of 50 phases each, all independent: the share is known to sqrt(c (1 - c) / 2000)."""
    inside = []
    for seed in range(40):
        t = np.arange(0, n, 0.02)
        x = recording(t, force=np.sin(2 * np.pi * t) + np.random.default_rng(seed).normal(size=len(t)))
        mean = average_cycles(split_cycles(x, regular_starts(x, 1.0), samples=50), coverage=coverage)
        true = np.sin(mean["phase"])
        inside.append(float(((mean["force_lower"] <= true) & (true <= mean["force_upper"])).mean()))
    assert np.mean(inside) == pytest.approx(coverage, abs=4 * np.sqrt(coverage * (1 - coverage) / 2000))


def test_incomplete_and_uneven_cycles_are_left_out_and_counted():
    force = np.sin(2 * np.pi * T)
    force[350] = np.nan
    x = recording(T, force=force).isel(time=np.r_[:720, 760:1000])
    starts = np.r_[np.arange(9), 9.4, 10.4]
    cycles = split_cycles(x, starts)
    assert cycles["cycle"].values.tolist() == [0, 1, 2, 4, 5, 6]
    assert [cycles.attrs[k] for k in ("cycles", "cycles_incomplete", "cycles_uneven")] == [6, 3, 1]
    assert processing(cycles)[-1]["cycles_incomplete"] == 3
    assert cycles["start"].values.tolist() == [0, 1, 2, 4, 5, 6]


def test_standard_errors_of_samples_come_along_and_end_in_the_scatter():
    x = recording(T, force=np.sin(2 * np.pi * T), force_se=np.full(1000, 0.1))
    cycles = split_cycles(x, regular_starts(x, 1.0))
    assert np.allclose(cycles["force_se"], 0.1)
    assert np.allclose(average_cycles(cycles)["force_se"], 0.0, atol=1e-12)


def test_other_dimensions_and_units_stay():
    x = recording(T, force=np.sin(2 * np.pi * T)).assign(
        position=(("axis", "time"), np.stack([T, T**2]), {"units": "m"}),
    )
    cycles = split_cycles(x, regular_starts(x, 1.0))
    assert cycles["position"].dims == ("axis", "cycle", "phase")
    mean = average_cycles(cycles)
    assert mean["position"].dims == ("axis", "phase")
    assert mean["position_se"].attrs["units"] == "m"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda x: split_cycles(x, np.array([0.0])), "two or more increasing starts"),
        (lambda x: split_cycles(x, np.array([20.0, 21.0])), "no cycle of 1 is usable: 1 are not wholly recorded"),
        (lambda x: regular_starts(x, -1.0), "period is -1 s"),
        (lambda x: average_cycles(split_cycles(x, np.array([1.0, 2.0]))), "dimension cycle has 1 members"),
        (lambda x: average_cycles(split_cycles(x, np.arange(5.0)), coverage=95.0), "coverage is 95"),
    ],
)
def test_what_makes_no_cycles_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call(recording(T, force=np.sin(T)))


N = 60
PHASE = 2 * np.pi * np.arange(N) / N
POLYGON = np.sin(2 * np.pi / N) / (2 * np.pi / N)


def over_phase(values, units):
    return xr.DataArray(values, {"phase": PHASE}, "phase", attrs={"units": units})


def test_an_ellipse_has_pi_a_b_positive_counterclockwise():
    x, y = over_phase(3 * np.cos(PHASE) + 100, "N"), over_phase(0.2 * np.sin(PHASE) - 50, "m")
    found = loop_area(x, y)["area"]
    assert float(found) == pytest.approx(np.pi * 3 * 0.2 * POLYGON, rel=1e-12)
    assert float(loop_area(y, x)["area"]) == pytest.approx(-float(found))
    assert found.attrs["units"] == "N m"


def test_a_spring_does_no_work_and_a_damper_takes_pi_c_w_a_squared():
    """F = k x + c v, x = A sin wt: work on it in a cycle pi c w A^2."""
    k, c, w, a = 50.0, 2.0, 3.0, 0.1
    t = np.arange(0, 5 * 2 * np.pi / w, 2 * np.pi / w / N)
    x = recording(t, force=k * a * np.sin(w * t) + c * a * w * np.cos(w * t), x=a * np.sin(w * t))
    cycles = split_cycles(x, regular_starts(x, 2 * np.pi / w), samples=N)
    found = loop_area(cycles["force"], cycles["x"])
    assert found["area"].dims == ("cycle",)
    assert float(found["area_mean"]) == pytest.approx(np.pi * c * w * a**2 * POLYGON, rel=1e-6)


def test_mean_and_spread_are_over_the_cycles():
    size = xr.DataArray([1.0, 2.0, 3.0], dims="cycle")
    found = loop_area(size * over_phase(np.cos(PHASE), "N"), size * over_phase(np.sin(PHASE), "m"))
    areas = np.pi * POLYGON * np.array([1, 4, 9])
    assert found["area"].values == pytest.approx(areas)
    assert float(found["area_mean"]) == pytest.approx(areas.mean())
    assert float(found["area_std"]) == pytest.approx(areas.std(ddof=1))
    assert float(found["area_mean_se"]) == pytest.approx(areas.std(ddof=1) / np.sqrt(3))


def test_what_makes_no_loop_is_refused():
    x = over_phase(np.cos(PHASE), "N")
    with pytest.raises(ValueError, match="same dimensions"):
        loop_area(x, x[:10])
    with pytest.raises(ValueError, match="NaN has no area"):
        loop_area(x, x.where(x > 0))
