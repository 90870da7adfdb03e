import numpy as np
import pytest
import xarray as xr

from nectosome.measure.signals.cycles import regular_starts, split_cycles
from nectosome.measure.signals.loops import loop_area

from .made import recording

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
