"""`measure --means` on a synthetic campaign: the table as text, JSON, data and page, beside a grid; what it refuses."""

import json

import numpy as np
import pytest
from tests.synthetic_campaign import FREQUENCIES, PLAN, A, grid, mean, write_campaign, write_grid

from nectosome.io import load_dataset, save_dataset

from .answers import check_wrong

TABLE = ("measure", "--campaign", "lab/campaign.yaml", "--means", "force")


@pytest.fixture
def lab(tmp_path):
    save_dataset(grid(over=("A", "f")), tmp_path / "grid.nc")
    write_grid(tmp_path / "parameter.nc")
    return write_campaign(tmp_path / "lab")


def test_means_stand_at_their_conditions_with_both_errors_and_what_is_simulated(nectosome, lab, tmp_path):
    """A scatter of 2 % between runs, none between cycles: the true means are within their intervals."""
    answer = nectosome(*TABLE, "--sim", "grid.nc", "--quantity=-force.y", "--save", "m.csv", "--plot", "m.html")
    assert (answer.code, answer.err) == (0, "")
    for words in ("20 deg, 0.4 Hz", "whole cycles", "+- by repeats", "95 % from", "simulated", "amplitude"):
        assert words in answer.out
    assert max(map(len, answer.out.splitlines())) <= 80
    head = (tmp_path / "m.csv").read_text().splitlines()[0]
    assert head.startswith("condition,A (rad),f (Hz),mean (N),mean_by_cycles (N),mean_by_repeats (N)")
    page = (tmp_path / "m.html").read_text()
    assert "Mean of force" in page and "Lines: simulated at the same conditions" in page
    answer = nectosome(*TABLE, "--sim", "grid.nc", "--quantity=-force.y", "--save", "m.nc")
    found = load_dataset(tmp_path / "m.nc")
    truth = np.array([mean(A[i], FREQUENCIES[j]) for i, j in PLAN])
    held = (found["mean_low"].values <= truth) & (truth <= found["mean_high"].values)
    assert held.mean() >= 0.8
    assert found["mean_by_cycles"].values.max() < 1e-6 < found["mean_by_repeats"].values.min()
    simulated = np.array([A[i] * FREQUENCIES[j] ** 2 for i, j in PLAN])
    assert found["simulated"].values == pytest.approx(simulated, rel=1e-6)


def test_the_table_is_told_as_json(nectosome, lab):
    told = json.loads(nectosome(*TABLE, "--json").out)
    assert told["tables"]["mean"]["A=0.34906585,f=0.4"]["value"]["unit"] == "N"
    assert told["tables"]["counts"]["A=0.34906585,f=0.4"]["runs"]["value"] == 3


def test_without_repeats_it_is_told_what_no_interval_holds(nectosome, tmp_path):
    write_campaign(tmp_path / "lab", plan=[(0, 0)])
    campaign = tmp_path / "lab" / "campaign.yaml"
    once = (line for line in campaign.read_text().splitlines() if not line.split(",")[0].endswith(("_1.csv", "_2.csv")))
    campaign.write_text("\n".join(once) + "\n")
    answer = nectosome(*TABLE)
    assert answer.code == 0
    assert "no conditions were measured twice" in answer.out + answer.err


def test_what_does_not_fit_is_refused(nectosome, lab, tmp_path):
    cases = [
        ("measure", "lab/run_0_0_0.csv", "--means", "force"),
        (*TABLE[:3], "--against", "force"),
        (*TABLE[:3], "--sim", "grid.nc"),
        (*TABLE, "--quantity", "force.y"),
        (*TABLE[:4], "forse"),
        (*TABLE, "--against", "tip"),
        (*TABLE, "--sim", "parameter.nc", "--quantity=-force.y"),
        (*TABLE, "--sim", "nowhere.nc"),
        (*TABLE, "--sim", "grid.nc", "--quantity", "power"),
        (*TABLE, "--sim", "grid.nc", "--quantity", "force.z"),
        (*TABLE, "--save", "m.txt"),
    ]
    check_wrong(nectosome, cases, tmp_path)
