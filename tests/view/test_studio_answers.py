"""What the studio answers for a robot: the motion it keeps, or what it does at first where it keeps none."""

import numpy as np
import pytest

from nectosome.io import InputError, parse_robot
from nectosome.view.studio.answers import Solver

G = 9.80665  # m/s2, as the water has it by default
BALL = """
name: ball
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 0 m3
  joint: {{kind: prismatic, axis: z{spring}}}
"""


def test_what_falls_is_seen_falling():
    """Half of g t^2 down, g t/2 on the mean; nothing else is told, as it is no cycle."""
    answer = Solver()(parse_robot(BALL.format(spring="")))
    run, t = answer.run, answer.run["time"].values
    assert t[-1] == 5.0
    np.testing.assert_allclose(run["position"].values[:, 0, 2], -0.5 * G * t**2, rtol=1e-6, atol=1e-9)
    assert answer.kind == "the first 5 s"
    assert answer.numbers == {"speed": pytest.approx(0.5 * G * 5, rel=1e-6)}
    assert answer.warning.startswith("no equilibrium found.")
    assert answer.period == 0


def test_what_hangs_on_a_spring_is_at_rest():
    answer = Solver()(parse_robot(BALL.format(spring=", stiffness: 20 N/m, damping: 1 N s/m")))
    assert (answer.kind, answer.warning, answer.numbers) == ("at rest", "", {})
    np.testing.assert_allclose(answer.run["position"].values[:, 0, 2], -2 * G / 20, rtol=1e-6)


def test_what_cannot_move_is_refused():
    still = BALL.format(spring="").replace("  joint: {kind: prismatic, axis: z}\n", "")
    with pytest.raises(InputError, match="free to move"):
        Solver()(parse_robot(still))
