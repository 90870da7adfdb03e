"""A design of a robot with a web: the number of waves along its fin, and the thickness of the sheet."""

import numpy as np
import pytest
from tests.small_robots import FIN

from nectosome.description import parse_robot
from nectosome.designs import plans
from nectosome.designs.problem import Problem

ROBOT = parse_robot(FIN)


@pytest.mark.slow
def test_the_gradient_of_speed_by_waves_and_thickness_is_that_of_differences(monkeypatch):
    monkeypatch.setattr(plans, "_RTOL", 1e-9)
    problem = Problem().changed(
        ROBOT, vary={"waves": "0.2..0.9", "thickness": "0.3..1mm"}, maximise="speed", forward="x"
    )
    evaluate, u, way = problem.task(ROBOT).prepare(), np.array([0.4, 0.3]), np.array([1.0, -0.7])
    found = evaluate(u, True, None)
    after, before = (evaluate(u + h * way, True, found.memory).objective for h in (1e-3, -1e-3))
    assert found.objective < -0.03  # m/s
    assert found.gradient @ way == pytest.approx((after - before) / 2e-3, rel=1e-3)
