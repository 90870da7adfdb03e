"""PoseiDRONE's crawling: gaits faster than the paper's, spread of searches, Table 4 as errors of statistics."""

import numpy as np
import pytest
import xarray as xr

from nectosome.description import get_value
from nectosome.robots import describe
from nectosome_studies.poseidrone import crawl


def made_up(speed):
    """Gaits on the study's own grid, of given speeds [m/s]."""
    coords = {"density": list(crawl.DENSITIES), "distance": list(crawl.DISTANCES), "angle": np.radians(crawl.ANGLES)}
    return xr.Dataset({"speed": (tuple(coords), speed)}, coords)


def test_gaits_that_fall_are_not_counted():
    """Of 125 five fall; of the other 120 the paper's is slower than 30."""
    speed = np.full((5, 5, 5), 0.02)
    speed[crawl.DENSITIES.index(1238.0), crawl.DISTANCES.index(0.09), crawl.ANGLES.index(12.6)] = 0.04
    speed[0], speed[1, 0], speed[4, 4] = 0.05, 0.05, np.nan
    assert crawl.faster(made_up(speed)) == pytest.approx(25.0)


def test_the_spread_is_that_of_the_parameter_that_differs_most():
    assert crawl.spread(np.array([[0.1, 0.5], [0.2, 0.9], [0.15, 0.6]])) == pytest.approx(40.0)
    assert crawl.spread(np.array([[0.1, 0.5]])) is None


@pytest.mark.slow
def test_table_3_against_itself_has_no_error_and_more_drag_takes_it_less_far():
    """At both densities: along x over the last 5 s, as Table 4 is read."""
    of = crawl.fit()
    own = np.array([float(get_value(describe("poseidrone_crawl"), name)) for name in of.ranges.names])
    assert set(crawl._alike(of, own).values()) == {0.0}
    heavier = own * np.where(np.array(of.ranges.names) == "drag_area", 2.0, 1.0)
    found = crawl._alike(of, heavier)
    assert len(found) == 6
    assert max(found[f"poseidrone/crawl/statistics/{which}/max"] for which in ("train", "test")) < -1
