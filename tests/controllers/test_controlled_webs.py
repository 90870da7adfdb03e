"""A controller on a robot with a web: the waves along its fin set its speed."""

import numpy as np
import pytest
from tests.small_robots import FIN

from nectosome.controllers import control
from nectosome.core import Status
from nectosome.description import parse_robot


@pytest.mark.slow
def test_the_number_of_waves_sets_the_speed():
    """Forward, and backward by waves the other way."""
    given = {"settings": "waves=0.01", "command": "waves=-0.25..0.25", "measure": "velocity.x", "mean": True}
    for reference in (30.0, -30.0):
        found = control(parse_robot(FIN), **given, gains="0.02,0.008,0", time="4s", reference=f"{reference} mm/s")
        assert found.status == Status.SOLVED
        assert found.record.output[-1] == pytest.approx(1e-3 * reference, rel=0.05)
        assert np.sign(found.record.command[-1]) == np.sign(reference)
