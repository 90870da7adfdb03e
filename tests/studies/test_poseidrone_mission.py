"""The mission of Fig. 6, whole: steps, speed, figure."""

import numpy as np
import pytest

from nectosome.description.mission import load_mission
from nectosome.robots import describe, mission_of
from nectosome.solve import run_mission, simulate
from nectosome_studies.poseidrone import mission
from nectosome_studies.poseidrone.figures_mission import panels


@pytest.mark.slow
def test_events_are_those_of_finer_steps_and_it_crawls_as_fast_as_the_crawler():
    """To 1 ms over 77 s; the speed is that of the crawler alone over ten turns of its cranks, after 35 s."""
    own = mission.part(False, lambda what, done: None)
    path, robot = mission_of("poseidrone"), describe("poseidrone")
    finer = run_mission(load_mission(path, robot), step=2e-3, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(own.data["mission"]["event_time"], [p.time for p in finer.passed], atol=1e-3)
    alone = simulate("poseidrone_crawl", 40.0, samples=4001, rtol=1e-6, atol=1e-9).to_dataset()
    lasts = 10 * 2 * np.pi / describe("poseidrone_crawl").body.loads["front"].speed
    gone = np.interp([40.0 - lasts, 40.0], alone["time"], alone["position"].values[:, 0, 0])
    assert own.numbers["poseidrone/mission/crawl-speed"] == pytest.approx(np.diff(gone)[0] / lasts, rel=5e-5)
    assert list(own.data["mission"]["event"].values[:3]) == ["low_wall", "touchdown", "5 s"]
    assert np.ptp(own.data["mission"]["position"].sel(axis="x").values) == pytest.approx(0.95, abs=0.02)
    assert len(panels(own.data)) == 3
