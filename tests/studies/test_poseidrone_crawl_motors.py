"""PoseiDRONE's cranks: what they take at a given speed, and the crawl on motors."""

import numpy as np
import pytest

from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate
from nectosome_studies.poseidrone import crawl_motors
from nectosome_studies.poseidrone.crawl_motors import LAST, PER_TURN, SPEED
from nectosome_studies.poseidrone.figures_crawl import motor_panels
from nectosome_studies.study import printed


@pytest.fixture(scope="module")
def robot():
    return describe("poseidrone_crawl")


@pytest.fixture(scope="module")
def found():
    return crawl_motors.compared()


@pytest.fixture(scope="module")
def strong(robot, found):
    """The crawl on motors a thousand times as strong, and as heavy."""
    return crawl_motors.crawl(crawl_motors.on_cranks(robot, 1e3 * crawl_motors.largest_torque(found["crawl_cranks"])))


@pytest.mark.slow
def test_on_strong_motors_it_crawls_as_with_ideal_cranks(found, strong):
    """Speed to 1e-4, a tenth of what the assumed motors change; cranks to 0.6 mrad/s."""
    ideal, motors = found["crawl_cranks"].attrs["speed"], found["crawl_motors"].attrs["speed"]
    assert strong.attrs["speed"] == pytest.approx(ideal, rel=1e-4)
    assert abs(motors / ideal - 1) > 1e-3
    np.testing.assert_allclose(strong["rate"], SPEED, atol=6e-4)


@pytest.mark.slow
def test_cranks_slow_down_as_motor_and_loop_have_it(found, strong):
    """The linear response of motor and PI loop to the torque of the ideal cranks, harmonic by harmonic, to 2 %.

    The rate e that lacks obeys (tau/w0) e' + e/w0 + (e + z/T)/f = torque/stall with z' = e.
    """
    torque = found["crawl_cranks"]["torque"].sel(leg="rear").values[:-1]
    stall, w0 = 3e3 * torque.max(), 2 * SPEED
    s = 2j * np.pi * np.fft.rfftfreq(torque.size, 2 * np.pi / SPEED / PER_TURN)[1:]
    lacks = np.fft.rfft(torque / stall)
    lacks[1:] /= 0.02 * s / w0 + 1 / w0 + (1 + 1 / (0.3 * s)) / 2.0
    lacks[0] = 0.0  # the integral's
    expected = np.fft.irfft(lacks, torque.size)
    rate = SPEED - strong["rate"].sel(leg="rear").values
    assert rate.max() == pytest.approx(expected.max(), rel=0.02)
    assert rate.min() == pytest.approx(expected.min(), rel=0.02)


def test_torque_is_the_force_on_the_foot_times_its_path_per_radian(robot):
    """Virtual work, with the derivative by differences of the foot's place; a leg stands for two. To 1e-7 N m."""
    data = simulate(build(crawl_motors.on_cranks(robot)), 1.5, samples=301).to_dataset()
    tilt, leg = data["q"].values[:, 2], robot.body.loads["rear"]
    force = data["load_force"].sel(part="body", load="rear").values
    # the body turns about -y
    ahead = np.cos(tilt) * force[:, 0] + np.sin(tilt) * force[:, 2]
    up = np.cos(tilt) * force[:, 2] - np.sin(tilt) * force[:, 0]

    def foot(angle):
        pin = leg.crank * np.array([np.cos(angle), np.sin(angle)])
        along = np.array(leg.bearing)[:, None] - pin
        return pin + leg.length * along / np.linalg.norm(along, axis=0)

    angle, small = leg.start + SPEED * data["time"].values, 1e-5
    path = (foot(angle + small) - foot(angle - small)) / (2 * small)
    torque = -(ahead * path[0] + up * path[1])
    assert torque.max() > 0.05
    reaction = data["reaction"].sel(prescribed="rear_crank.angle").values
    np.testing.assert_allclose(reaction, torque, atol=1e-7)


def test_rows_of_the_scorecard(found):
    """All of them; means of whole turns, from what the crawls are."""
    rows = crawl_motors.numbers(found)
    starts = ("poseidrone/crawl/crank/", "poseidrone/crawl/motor/")
    assert set(rows) == {row for row in printed("poseidrone") if row.startswith(starts)}
    ideal, motors = found["crawl_cranks"], found["crawl_motors"]
    assert ideal.sizes["time"] == LAST * PER_TURN + 1
    assert ideal["time"][-1] - ideal["time"][0] == pytest.approx(LAST * 2 * np.pi / SPEED)
    both = 2 * SPEED * ideal["torque"].integrate("time").sum() / (LAST * 2 * np.pi / SPEED)
    assert rows["poseidrone/crawl/crank/mean-power"] == pytest.approx(float(both), rel=1e-6)
    most = SPEED * rows["poseidrone/crawl/crank/largest-torque"]
    assert rows["poseidrone/crawl/crank/largest-power"] == pytest.approx(most, rel=1e-12)
    mechanical = 2 * float((motors["torque"] * motors["rate"]).mean("time").sum())
    assert rows["poseidrone/crawl/motor/mean-power"] > 1.2 * mechanical


def test_its_figure_is_drawn(found):
    (panel,) = motor_panels(found)
    assert len(panel.figure.data) == 5
    assert "assumptions" in panel.caption
