"""A robot under a controller in the studio: the rig keeps the clock, follows as the loop alone does, and lets go."""

import threading
import time

import numpy as np
import pytest
from tests.small_robots import SLIDE
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, answered, beside, chromium, nothing_left, said, wait_until

from nectosome.controllers import ActuatorLimits, RobotLoop, pid_of
from nectosome.core import Status
from nectosome.description import parse_robot
from nectosome.designs import shipped_problem
from nectosome.io import load_dataset
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import SampledPlant, reading_of
from nectosome.studio.answers import AnswerSolver
from nectosome.studio.server import Studio
from nectosome.studio.tasks.control import first_measured, most_of, prepare_loop
from nectosome.studio.tasks.live_rig import LiveRig
from nectosome.view.saved import check_drawable, saved_run

DT, GAINS, WANTED = 0.05, (20.0, 30.0, 10.0), 0.1  # s; N/m, N/(m s), N s/m; m


@pytest.fixture(scope="module")
def slide():
    return SampledPlant(parse_robot(SLIDE), "push", "body.position", DT)


@pytest.fixture(scope="module")
def pid():
    return pid_of(GAINS, 0.05, ActuatorLimits(-2.0, 2.0))


def until(seconds: float, clock=time.perf_counter):
    """Progress that ends it by the clock."""
    end = clock() + seconds
    return lambda what, share: clock() < end


def test_it_goes_on_as_the_clock_does_and_as_the_loop_alone_would(slide, pid):
    LiveRig(RobotLoop(slide), pid, WANTED).step(WANTED)  # compiled
    rig, shown = LiveRig(RobotLoop(slide), pid, WANTED), []
    began = time.perf_counter()
    assert (
        rig.run_by_clock(lambda k: WANTED, lambda frame, path: shown.append(path[-1, 0]), until(1.5)) == Status.SOLVED
    )
    taken = time.perf_counter() - began
    n = len(rig.reference)
    assert (n - 1) * DT <= taken  # never ahead of the clock
    alone = RobotLoop(slide).run(pid, np.full(n, WANTED))
    np.testing.assert_allclose(rig.record.output, alone.output, atol=1e-12)
    np.testing.assert_allclose(rig.record.command, alone.command, atol=1e-12)
    assert shown == sorted(shown) and len(shown) > 5  # it moves towards the reference, and is seen


def test_what_it_did_is_a_run_like_any(slide, pid):
    rig = LiveRig(RobotLoop(slide), pid, WANTED)
    for k in range(80):
        assert rig.step(WANTED if k < 40 else -WANTED) == Status.SOLVED
    run = rig.to_dataset(Status.SOLVED)
    saved_run(run, "kept")
    check_drawable(run, "kept")
    assert run.sizes["time"] == run.sizes["sample"] == 80
    moved = np.diff(run["position"].values[:-1, 0, 0])  # the place after a sample is what is measured at the next one
    np.testing.assert_allclose(moved, np.diff(run["output"].values[1:]), atol=1e-12)
    assert set(run["reference"].values) == {WANTED, -WANTED}
    assert float(run["power_balance"].max()) < 1e-12


def test_a_slow_machine_is_told_and_the_clock_is_put_back(slide, pid):
    rig = LiveRig(RobotLoop(slide), pid, WANTED)
    rig.run_by_clock(lambda k: WANTED, lambda frame, path: time.sleep(0.4), until(2.0))
    assert rig.clock.time < 0.5 * rig.clock.taken
    assert "this machine is too slow" in str(rig.clock)


@NEEDS_CHROMIUM
def test_a_robot_reaches_its_reference_on_the_page(tmp_path, capfd):
    (tmp_path / "slide.yaml").write_text(SLIDE)
    studio = Studio(str(tmp_path / "slide.yaml"), tmp_path, "127.0.0.1", 18_600)

    def passed(seconds: float) -> None:
        """Wait for so much more time of the robot, whose clock stands on the page."""
        clock = "+document.querySelector('#studio-work').innerText.match(/([0-9.]+) s,/)[1]"
        wait_until(page, f"{clock} > {page.evaluate(clock) + seconds}")

    try:
        with chromium() as browser:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.set_default_timeout(PATIENCE)
            page.goto(studio.address)
            answered(page, 1)
            page.get_by_role("tab", name="Control").click()
            page.get_by_role("button", name="Start", exact=True).click()
            said(page, "has no two ends")
            beside(page, "Range").fill("-2..2 N")
            beside(page, "Gains").fill("20, 30, 10")
            page.get_by_role("button", name="Start", exact=True).click()
            wait_until(page, "document.querySelector('#studio-work')?.innerText.includes('pictures')")
            page.get_by_role("tab", name="View").click()  # it answers meanwhile
            page.get_by_text("Go along").click()
            page.get_by_role("tab", name="Files").click()
            passed(3.0)
            wanted = page.get_by_role("slider").first
            wanted.focus()
            wanted.press("Home")
            passed(5.0)
            page.get_by_role("button", name="Stop", exact=True).click()
            page.wait_for_selector("#studio-control")
            said(page, "controlled for")
            page.locator("input:visible").last.fill("held")
            page.get_by_role("button", name="Save run").click()
            said(page, "saved held.nc")
            run = load_dataset(tmp_path / "held.nc")
            first, last = run["reference"].values[[0, -1]]
            assert (first, last) == pytest.approx((0.1, -0.2))  # the slider goes from the start to twice as far
            assert abs(run["output"].values[-1] - last) < 0.05 * abs(last - first)
            page.get_by_role("button", name="Start", exact=True).click()
            wait_until(page, "document.querySelector('#studio-work')?.innerText.includes('pictures')")
            assert any(t.name == "studio-work" for t in threading.enumerate())
            page.close()
            assert nothing_left()
            assert "Traceback" not in capfd.readouterr().err
    finally:
        studio.close()


@pytest.mark.parametrize(
    ("robot", "measured"),
    [
        ("flagellum", "velocity.x"),
        ("paddle", "force.y"),
        ("fish", "heading"),
        ("turtle", "heading"),
        ("beetle", "heading"),
    ],
)
def test_what_is_measured_at_first_is_what_the_robot_can_change(robot, measured):
    description, problem = describe(robot), shipped_problem(robot)
    assert first_measured(description, problem.forward if problem else "") == measured


def test_of_what_sits_on_a_spring_its_place_is_measured_at_first():
    assert first_measured(parse_robot(SLIDE), "") == "body.position"
    assert first_measured(parse_robot(SLIDE.replace("stiffness: 5 N/m, ", "")), "") == "velocity.x"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "command"),
    [("flagellum", "omega=3..22 rad/s"), ("paddle", "A=30..75 deg"), ("poseidrone_jet", "omega=6..20 rad/s")],
)
def test_what_is_suggested_can_be_reached(robot, command):
    """With what stands on the page at first, gains are found on the model."""
    description, problem = describe(robot), shipped_problem(robot)
    model, measured = build(description), first_measured(description, problem.forward if problem else "")
    suggested = most_of(AnswerSolver()(description).run, reading_of(model, measured))
    options = {"command": command, "measure": measured, "mean": True, "reference": suggested}
    loop = prepare_loop(description, options, lambda what, share: True)
    assert loop is not None
    gains = [float(x) for x in loop.gains_text.split(",")]
    assert min(gains) * max(gains) >= 0 and any(gains)
