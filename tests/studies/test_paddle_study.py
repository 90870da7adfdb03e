"""The paddle's study: what a load cell tells, and the whole of it on coarse grids."""

import numpy as np
import pytest
import xarray as xr

from nectosome_studies import STUDIES
from nectosome_studies.paddle import thrust


def test_gain_over_loss_counts_no_sample_twice():
    """3 + 1 N against 0.5 + 1.5 N; the last sample is the first again."""
    force = np.array([[3.0, 9.0], [1.0, 9.0], [-0.5, 9.0], [-1.5, 9.0], [3.0, 9.0]])
    run = xr.Dataset(
        {"reaction": (("time", "prescribed"), force[:, ::-1])}, coords={"prescribed": ["body.x", "body.y"]}
    )
    assert thrust.gain_over_loss(run) == pytest.approx(2.0)


@pytest.mark.slow
def test_the_load_cell_says_on_the_mean_what_the_water_does():
    """Over a cycle the momentum of a held paddle comes back: mean reaction and mean force of the water agree."""
    run = thrust.cycle(1, 0.6)
    swept = thrust.over_strokes([1], [np.radians(75)], [0.6])
    cell = float(run["reaction"].sel(prescribed="body.y")[:-1].mean())
    assert float(swept["thrust"].squeeze()) == pytest.approx(cell, rel=5e-3)


@pytest.mark.slow
def test_hinges_whose_motion_forgets_its_start_are_stable_in_a_grid():
    """Their derivative of a batch, by steps over stops that are just short enough, has multipliers of 4."""
    assert np.isfinite(thrust.over_hinges([3e-3], [0.075, 0.09])["thrust"]).all()


@pytest.mark.slow
def test_the_quick_study_fills_every_row():
    done = STUDIES["paddle"].run(True, lambda what, share: None)
    rows = {row["id"]: row for row in done.rows}
    unknown = {row["id"] for row in done.rows if row["ours"] is None}
    assert unknown == {f"paddle/table3/{how}" for how in ("cn", "svd", "cn-svd")}
    assert rows["paddle/eq16/k"]["ours"] == pytest.approx(rows["paddle/eq16/k"]["printed"], rel=0.01)
    assert abs(rows["paddle/rigid/thrust"]["ours"]) < 1e-9
    assert rows["paddle/fig9/order-share"]["ours"] == 1.0
    assert rows["paddle/rotation/falling/rotation"]["ours"] > 0.6 * rows["paddle/rotation/falling/start"]["ours"]
    assert rows["paddle/rotation/falling/affine"]["ours"] < 2
    thrusts = [rows[f"paddle/fig9/n{n}/75deg/1.1Hz/thrust"]["ours"] for n in range(1, 6)]
    gains = np.diff([0, *thrusts])
    assert np.all(gains > 0) and np.all(np.diff(gains) < 0)  # each joint adds less than the one before
    hinges = done.data["hinges"]
    assert float(hinges["thrust"].max()) == float(hinges["thrust"].where(hinges["front_power"]).max())
