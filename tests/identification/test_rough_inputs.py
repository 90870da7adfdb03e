"""Columns that drive a robot with noise or in steps of an encoder: what is smoothed, what is said, what is refused."""

import jax
import numpy as np
import pytest

from nectosome.core.signals import signal_of
from nectosome.description import Samples, get_value, parse_robot, with_recordings
from nectosome.identification.recordings import recordings_of
from nectosome.identification.robot.trials import SLOW, read_compared, robot_trials
from nectosome.measure import load_campaign
from nectosome.model import build
from nectosome.solve import simulate
from nectosome.units import InputError

ROBOT = parse_robot("""
name: pendulum
body: {kind: rigid, shape: point, mass: 1 kg}
limbs:
  arm:
    kind: rigid
    shape: cylinder
    length: 100 mm
    radius: 5 mm
    mass: 100 g
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 25 deg, frequency: 1 Hz}}
  tip:
    on: arm
    kind: rigid
    shape: cylinder
    length: 60 mm
    radius: 4 mm
    mass: 30 g
    joint: {kind: revolute, axis: z, stiffness: 50 mN m/rad, damping: 0.5 mN m s/rad}
""")
PATH = "limbs.arm.joint.motion"
TIME = np.arange(0.0, 4.0, 0.0125)
RAMP = np.clip(TIME, 0.0, 1.0)
ANGLE = np.radians(25) * RAMP**2 * (3 - 2 * RAMP) * np.sin(2.2 * np.pi * TIME)
TICKS = 2 * np.pi / 4096 * np.round(ANGLE * 4096 / (2 * np.pi))
NOISY = ANGLE + np.radians(0.1) * np.random.default_rng(0).normal(size=TIME.size)


def driven(values, **drives):
    """The trial of a recording with this angle, and its notes."""
    arrays = {"time": TIME, "angle": (values, "rad"), "tip": (ANGLE, "rad"), "drives": drives}
    compared = [read_compared("tip", "tip.angle", build(ROBOT))]
    (trial,) = robot_trials(recordings_of([arrays]), ROBOT, compared, {"angle": PATH})
    return trial, " ".join(trial.notes)


def steps(values, **drives):
    """Steps of the robot that is driven by this angle."""
    run = simulate(build(driven(values, **drives)[0].description), 4.0, method="implicit", rtol=1e-5, atol=1e-7)
    assert run.steps.value is not None
    return run.steps.value.t.size


def cubic_steps(values):
    """Steps where the samples themselves are joined by a cubic spline."""
    described = with_recordings(ROBOT, {PATH: Samples(TIME.tolist(), values.tolist(), "rad")})
    return simulate(build(described), 4.0, method="implicit", rtol=1e-5, atol=1e-7).steps.value.t.size


def test_ticks_and_noise_cost_about_as_many_steps_as_what_is_smooth():
    """Ticks are smoothed within them by themselves, noise where the campaign says the cut-off."""
    smooth, ticks, noisy, cubic = steps(ANGLE), steps(TICKS), steps(NOISY, angle={"smooth": "6 Hz"}), cubic_steps(ANGLE)
    assert ticks < 1.5 * smooth
    assert smooth < 0.6 * cubic
    assert noisy < min(cubic, 2 * smooth)
    assert steps(NOISY) > 2 * cubic


def test_a_smooth_angle_has_the_accelerations_of_its_motion():
    """Between samples, after the ramp: those of a sine in closed form, where a cubic spline is off by 3e-4."""
    w, between = 2.2 * np.pi, TIME[120:-40] + 0.4 * (TIME[1] - TIME[0])
    exact = -np.radians(25) * w**2 * np.sin(w * between)

    def off(described):
        signal = signal_of(described.limbs["arm"].joint.motion)
        return np.abs(jax.vmap(lambda t: signal(t)[2])(between) - exact).max() / np.abs(exact).max()

    cubic = with_recordings(ROBOT, {PATH: Samples(TIME.tolist(), ANGLE.tolist(), "rad")})
    assert off(driven(ANGLE)[0].description) < 2.5e-5 < 2e-4 < off(cubic)


def test_what_is_rough_is_said_with_a_cut_off():
    assert driven(ANGLE)[1] == ""
    trial, said = driven(TICKS)
    assert "read in steps of 0.08789 deg" in said and "smoothed at" in said and SLOW not in said
    smooth = np.array([get_value(trial.description, f"{PATH}.values.{4 * k}") for k in range(TIME.size)])
    assert np.abs(smooth - ANGLE).max() < 2 * np.pi / 4096
    said = driven(NOISY)[1]
    assert "noise of 0.09898 deg makes 87 %" in said and SLOW in said
    cutoff = said.partition("{smooth: ")[2].partition("}")[0]
    assert driven(NOISY, angle={"smooth": cutoff})[1] == (
        f"angle: smoothed at {cutoff}, which takes off 0.0034 % of its variance"
    )


def test_a_cut_off_that_takes_signal_is_said_and_one_that_takes_most_is_refused():
    said = driven(NOISY, angle={"smooth": "1.2 Hz"})[1]
    assert "of its variance: signal is lost, not noise alone. Take" in said
    other = said.rpartition("Take ")[2].partition(" or more")[0]
    assert "signal" not in driven(NOISY, angle={"smooth": other})[1]
    with pytest.raises(InputError, match="signal is lost") as refused:
        driven(NOISY, angle={"smooth": "0.7 Hz"})
    assert (refused.value.field, refused.value.file) == ("drives.angle.smooth", "recording 1")


@pytest.mark.parametrize(
    ("drives", "field", "why"),
    [
        ({"angle": {"smooth": "60 Hz"}}, "drives.angle.smooth", "allow 0.5 to 40 Hz"),
        ({"angle": {"smooth": "0.1 Hz"}}, "drives.angle.smooth", "allow 0.5 to 40 Hz"),
        ({"angle": {"smooth": "6 m"}}, "drives.angle.smooth", "is a length"),
        ({"angle": {"soft": "6 Hz"}}, "drives.angle.soft", "no field of a drive"),
        ({"tip": {"smooth": "6 Hz"}}, "drives.tip", "drives nothing here"),
    ],
)
def test_mistakes_are_said_with_their_field(drives, field, why):
    with pytest.raises(InputError, match=why) as refused:
        driven(ANGLE, **drives)
    assert refused.value.field == field


def test_a_campaign_says_the_cut_off_of_a_drive(tmp_path):
    rows = "\n".join(f"{t},{a},{b}" for t, a, b in zip(TIME, NOISY, ANGLE, strict=True))
    (tmp_path / "run.csv").write_text(f"time (s),angle (rad),tip (rad)\n{rows}\n")
    sheet = "drives: {angle: {smooth: %s}}\nrecordings: [{file: run.csv}]\n"
    (tmp_path / "campaign.yaml").write_text(sheet % "6 Hz")
    compared = [read_compared("tip", "tip.angle", build(ROBOT))]
    (trial,) = robot_trials(recordings_of(tmp_path / "campaign.yaml"), ROBOT, compared, {"angle": PATH})
    assert "angle: smoothed at 6 Hz" in " ".join(trial.notes)
    (tmp_path / "campaign.yaml").write_text(sheet % "6 m")
    with pytest.raises(InputError, match="is not a rate"):
        load_campaign(tmp_path / "campaign.yaml")
