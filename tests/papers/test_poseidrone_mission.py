"""The mission of Fig. 6, whole: steps, speed, figure."""

import numpy as np
import pytest

from nectosome.papers.poseidrone import mission
from nectosome.papers.poseidrone.figures_mission import panels


@pytest.mark.slow
def test_events_are_the_same_at_half_the_step_and_it_crawls_as_fast_as_the_crawler():
    """To 0.01 s over 77 s; 0.04114 m/s, which the crawler alone keeps after 25 s."""
    coarse, fine = (mission.part(quick, lambda what, done: None) for quick in (True, False))
    for a, b in zip(
        coarse.data["mission"]["event_time"].values, fine.data["mission"]["event_time"].values, strict=True
    ):
        assert a == pytest.approx(b, abs=0.01)
    assert fine.numbers["poseidrone/mission/crawl-speed"] == pytest.approx(0.041144, abs=2e-6)
    assert list(fine.data["mission"]["event"].values[:3]) == ["low_wall", "touchdown", "5 s"]
    assert np.ptp(fine.data["mission"]["position"].sel(axis="x").values) == pytest.approx(0.95, abs=0.02)
    assert len(panels(fine.data)) == 2
