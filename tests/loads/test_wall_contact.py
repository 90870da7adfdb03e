"""Bodies between walls, and a crank that pushes them there."""

import re

import numpy as np
import pytest

from nectosome.description import parse_robot, with_values
from nectosome.model import build
from nectosome.solve import simulate
from nectosome.units import InputError

BOAT = """
name: boat
water: {{gravity: 0 m/s2, walls: [0 m, 1 m]}}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  joint: {{kind: prismatic, axis: x, position: 0.8 m, velocity: 0.5 m/s}}
  loads: {{hull: {{kind: wall_contact, reach: 0.1 m, stiffness: 200 N/m, damping: {damping} N s/m}}}}
"""


def test_a_wall_gives_a_body_back_its_speed():
    """Half a period pi sqrt(m/k) of a spring that is v sqrt(m/k) = 5 cm deep, from 0.2 s on; to and fro without end."""
    run = simulate(
        build(parse_robot(BOAT.format(damping=0))), 4.0, rtol=1e-9, atol=1e-11, method="explicit", samples=4001
    )
    t, x, v = np.asarray(run.value.time), np.asarray(run.value.state.q)[:, 0], np.asarray(run.value.state.v)[:, 0]
    turn = np.pi * np.sqrt(2 / 200)
    assert x.max() == pytest.approx(0.95, abs=1e-6)
    assert x.min() == pytest.approx(0.05, abs=1e-6)
    for moment, speed in ((0.1, 0.5), (0.2 + turn + 0.5, -0.5), (0.2 + 2 * turn + 1.6 + 0.5, 0.5)):
        assert np.interp(moment, t, v) == pytest.approx(speed, abs=1e-6)


def test_a_wall_with_a_damper_takes_speed_and_never_pulls():
    """Damping ratio 1/2: what comes back is slower than e^(-pi/(2 sqrt 3/2)) of it, since nothing pulls."""
    run = simulate(build(parse_robot(BOAT.format(damping=20))), 1.0, rtol=1e-8, atol=1e-10, method="explicit")
    ds = run.to_dataset()
    force = ds["load_force"].sel(load="hull", part="body", axis="x").values
    assert force.min() < -5
    assert force.max() == 0
    assert 0.1 < -ds["velocity"].sel(part="body", axis="x").values[-1] < 0.5 * np.exp(-np.pi * 0.5 / np.sqrt(3)) + 0.2


@pytest.mark.parametrize(("deep", "told"), [(0.9, False), (1.3, True)])
def test_a_wall_that_is_too_soft_to_hold_is_told(deep: float, told: bool):
    """A body goes v sqrt(m/k) into a wall without a damper; its end is 10 cm ahead of its centre."""
    stiffness = 2 * (0.5 / (deep * 0.1)) ** 2
    robot = with_values(parse_robot(BOAT.format(damping=0)), {"body.loads.hull.stiffness": stiffness})
    run = simulate(build(robot), 1.0, rtol=1e-8, atol=1e-10, method="explicit")
    found = [words for words in run.summary().cautions if words.startswith("hull: body is in a wall by 1.3 times its")]
    assert bool(found) is told
    if told:
        words = re.search(r"reach at (\S+) s\. .* raise body\.loads\.hull\.stiffness\.", found[0])
        assert words is not None
        assert float(words[1]) == pytest.approx(0.2 + np.pi / 2 * np.sqrt(2 / stiffness), abs=0.01)  # of samples


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("walls: [0 m, 1 m]", "walls: [1 m, 1 m]"), "water.walls: the second wall must stand further along x"),
        (("walls: [0 m, 1 m]", "surface: 1 m, floor: 2 m"), "water.surface: the surface must be above the floor."),
    ],
)
def test_a_tank_that_holds_no_water_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        parse_robot(BOAT.format(damping=0).replace(*change))
