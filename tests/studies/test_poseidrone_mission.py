"""The mission of Fig. 6, whole: steps, speed, figure."""

import numpy as np
import pytest

from nectosome.robots import describe
from nectosome.solve import simulate
from nectosome_studies.poseidrone import mission
from nectosome_studies.poseidrone.figures_mission import panels


@pytest.mark.slow
def test_events_are_the_same_at_half_the_step_and_it_crawls_as_fast_as_the_crawler():
    """To 0.01 s over 77 s; the speed is that of the crawler alone over ten turns of its cranks, after 35 s."""
    coarse, fine = (mission.part(quick, lambda what, done: None) for quick in (True, False))
    for a, b in zip(
        coarse.data["mission"]["event_time"].values, fine.data["mission"]["event_time"].values, strict=True
    ):
        assert a == pytest.approx(b, abs=0.01)
    alone = simulate("poseidrone_crawl", 40.0, samples=4001, rtol=1e-6, atol=1e-9).to_dataset()
    lasts = 10 * 2 * np.pi / describe("poseidrone_crawl").body.loads["front"].speed
    gone = np.interp([40.0 - lasts, 40.0], alone["time"], alone["position"].values[:, 0, 0])
    assert fine.numbers["poseidrone/mission/crawl-speed"] == pytest.approx(np.diff(gone)[0] / lasts, rel=5e-5)
    assert list(fine.data["mission"]["event"].values[:3]) == ["low_wall", "touchdown", "5 s"]
    assert np.ptp(fine.data["mission"]["position"].sel(axis="x").values) == pytest.approx(0.95, abs=0.02)
    assert len(panels(fine.data)) == 3
