"""Starts of recordings and late clocks as unknowns, against a hinge whose motion is known in closed form."""

import re

import numpy as np
import pytest
from tests.small_robots import DRIVEN, M0, F, I

from nectosome.core.programs import remember
from nectosome.description import parse_robot
from nectosome.description.variables import read_variable
from nectosome.identification import identify
from nectosome.identification.recordings import recordings_of
from nectosome.identification.robot.misfit import RobotMisfit
from nectosome.identification.robot.trials import read_compared, robot_trials
from nectosome.model import build
from nectosome.units import InputError

K, C, NOISE = 0.75, 0.034, 2e-3  # N m/rad, N m s/rad, rad
TIME = np.linspace(0.0, 4.0, 201)
W = 2 * np.pi * F
NAMED = {"vary": {"k": "0.3..1.2N m/rad log", "c": (0.01, 0.1)}, "compare": {"encoder": "body.angle"}, "starts": 1}
FREE = {"body.joint.position": "-20..20deg", "body.joint.velocity": "-2..2rad/s"}
STARTS = ((0.1, -0.5), (-0.05, 0.8))


def angle(time=TIME, q=0.0, v=0.0, k=K):
    """I q'' + c q' + k q = M0 sin(W t + 0.4) from q and v; before the start it stands."""
    after = np.maximum(time, 0.0)
    forced = M0 * np.exp(0.4j) / (k - I * W**2 + 1j * W * C)
    root = np.sqrt(C**2 / (4 * I**2) - k / I + 0j)
    poles = np.array([-C / (2 * I) + root, -C / (2 * I) - root])
    free = np.linalg.solve([[1, 1], poles], [q - forced.imag, v - (1j * W * forced).imag])
    return (forced * np.exp(1j * W * after)).imag + (free @ np.exp(np.outer(poles, after))).real


def noisy(values, seed):
    return values + NOISE * np.random.default_rng(seed).normal(size=values.shape)


def late(seconds, seed, time=TIME):
    return {"time": time, "encoder": noisy(angle(time - seconds), seed)}


def ends(found):
    return dict(zip(found.to_dataset()["parameter"].values, found.identifiability.intervals(), strict=True))


@pytest.fixture(scope="module")
def hinge():
    return parse_robot(DRIVEN)


def problem_of(hinge, recordings, **how):
    compared = [read_compared("encoder", "body.angle", build(hinge))]
    trials = robot_trials(recordings_of(recordings, {"encoder": "rad"}), hinge, compared, {}, **how)
    variables = [read_variable(name, span, hinge) for name, span in NAMED["vary"].items()]
    return RobotMisfit(trials, variables, compared)


@pytest.mark.parametrize("shift", [0.12, -0.07])
def test_the_derivative_by_a_shift_is_minus_the_rate(hinge, shift):
    """To 2e-3 of the largest rate, which cubics between the steps have; to rounding it is that of what is computed."""
    problem, h = problem_of(hinge, [late(shift, 0)], shift="-0.2..0.2s"), 1e-5
    misfit, used = problem.misfit(np.ones(1)), np.flatnonzero(TIME > 0.2)
    expected = (angle(TIME - shift - h) - angle(TIME - shift + h))[used] / (2 * h)
    by_shift = misfit.jacobian(np.array([K, C, shift]))[:, 2]
    np.testing.assert_allclose(by_shift, expected, atol=2e-3 * np.abs(expected).max())
    apart = np.diff(misfit.residuals(np.array([[K, C, shift - 1e-4], [K, C, shift + 1e-4]])), axis=0)[0] / 2e-4
    np.testing.assert_allclose(by_shift, apart, atol=1e-6 * np.abs(expected).max())


def test_derivatives_by_starts_are_those_of_the_closed_form(hinge):
    recordings = [{"time": TIME, "encoder": angle(TIME, *start)} for start in STARTS]
    problem = problem_of(hinge, recordings, start=FREE)
    assert problem.box.names[4:] == tuple(f"{path} of recording 2" for path in FREE)
    J = problem.misfit(np.ones(1)).jacobian(np.array([K, C, *STARTS[0], *STARTS[1]]))[:, 2:]
    unit = [angle(TIME, *one) - angle(TIME) for one in ((1.0, 0.0), (0.0, 1.0))]  # linear in the start
    np.testing.assert_allclose(J[:201, :2].T, unit, atol=5e-5)
    np.testing.assert_allclose(J[201:, 2:].T, unit, atol=5e-5)
    assert not J[:201, 2:].any() and not J[201:, :2].any()


def test_intervals_of_a_shift_hold_the_truth_as_often_as_they_say(hinge):
    """Of 25 draws of noise 95 % intervals miss in more than 9 of 75 with a probability of 0.006."""
    missed = 0
    for seed in range(25):
        found = identify(hinge, [late(0.12, seed)], **NAMED, shift="-0.2..0.2s")
        missed += sum(not one.low < x < one.high for one, x in zip(ends(found).values(), (K, C, 0.12), strict=True))
        assert found.theta[2] == pytest.approx(0.12, abs=3e-3)
    assert missed <= 9


def test_intervals_of_starts_hold_the_truth_as_often_as_they_say(hinge):
    """Of 12 draws 95 % intervals miss in more than 9 of 72 with a probability of 0.004."""
    truth, missed = (K, C, *np.array(STARTS).ravel()), 0
    for seed in range(12):
        values = noisy(np.array([angle(TIME, *start) for start in STARTS]), seed)
        found = identify(hinge, [{"time": TIME, "encoder": y} for y in values], **NAMED, start=FREE)
        missed += sum(not one.low < x < one.high for one, x in zip(ends(found).values(), truth, strict=True))
        np.testing.assert_allclose(found.theta, truth, atol=0.02, rtol=0.02)
    assert missed <= 9


def test_one_program_serves_all_shifts_and_starts(hinge, monkeypatch):
    told, told_now = [], remember._told
    identify(hinge, [late(0.1, 0)], **NAMED, shift="-0.2..0.2s", start=FREE)
    monkeypatch.setattr(remember, "_told", lambda name: told.append(name) or told_now(name))
    identify(hinge, [late(-0.05, 0)], **NAMED, shift="-0.3..0.1s", start=FREE)
    assert "_computed" not in told and "_jacobian" not in told


def test_a_shift_is_one_of_all_or_a_recordings_own_or_known(hinge):
    shared = identify(hinge, [late(0.1, 0), late(0.1, 1)], **NAMED, shift=(-0.2, 0.2))
    assert [*ends(shared)] == ["k", "c", "shift"]
    assert shared.theta[2] == pytest.approx(0.1, abs=2e-3)
    own = identify(hinge, [late(0.1, 0) | {"shift": "-0.2..0.2s"}, late(-0.05, 1)], **NAMED, shift="-50ms")
    assert [*ends(own)] == ["k", "c", "shift of recording 1"]
    assert own.theta[2] == pytest.approx(0.1, abs=2e-3)
    np.testing.assert_allclose(own.theta[:2], [K, C], rtol=0.02)


def test_inputs_and_readings_of_one_file_have_two_clocks(hinge):
    dense = np.linspace(0.0, 4.0, 801)
    torque = M0 * np.sin(W * dense + 0.4)
    recording = late(0.12, 0, dense) | {"pull": (torque, "N m")}
    found = identify(hinge, [recording], **NAMED, drive={"pull": "body.joint.torque"}, shift="-0.1..0.2s")
    np.testing.assert_allclose(found.theta, [K, C, 0.12], rtol=0.02)
    (trial,) = found.trials
    known = np.flatnonzero(np.isfinite(trial.measured[0]))
    assert (dense[known[0] - 1], dense[known[-1] + 1]) == pytest.approx((0.2, 3.905))


def test_starts_are_unknown_known_or_the_first_reading_and_told(hinge):
    given = {
        "unknown": {"body.joint.position": "-20..20deg", "body.joint.velocity": "-2..2rad/s"},
        "given": {"body.joint.position": "0.1 rad", "body.joint.velocity": "-0.5 rad/s"},
        "first reading": {"body.joint.position": "reading", "body.joint.velocity": "-0.5 rad/s"},
    }
    for how, start in given.items():
        recording = {"time": TIME, "encoder": angle(TIME, *STARTS[0]), "start": start}
        found = identify(hinge, [recording], **NAMED)
        np.testing.assert_allclose(found.theta[:2], [K, C], rtol=1e-3)
        data = found.to_dataset()
        assert f"body.joint.position {how}" in str(data["start"].values[0])
        assert data.sizes["parameter"] == (4 if how == "unknown" else 2)
    plain = identify(hinge, [{"time": TIME, "encoder": angle()}], **NAMED).to_dataset()
    assert plain["start"].values.tolist() == ["as described"]


def test_a_campaign_says_starts_and_shifts_of_each_recording(hinge, tmp_path):
    for name, values in (("late", angle(TIME - 0.1)), ("moving", angle(TIME, *STARTS[0])), ("plain", angle())):
        rows = "\n".join(f"{t:.6f},{x:.9f}" for t, x in zip(TIME, values, strict=True))
        (tmp_path / f"{name}.csv").write_text(f"time (s),encoder (rad)\n{rows}\n")
    (tmp_path / "campaign.yaml").write_text("""
recordings:
  - {file: late.csv, shift: -0.2..0.2 s}
  - {file: moving.csv, start: {body.joint.position: reading, body.joint.velocity: -2..2 rad/s}}
  - {file: plain.csv}
""")
    found = identify(hinge, tmp_path / "campaign.yaml", **NAMED)
    values = dict(zip(ends(found), found.theta, strict=True))
    expected = {"k": K, "c": C, "body.joint.velocity of moving": STARTS[0][1], "shift of late": 0.1}
    assert values == pytest.approx(expected, rel=2e-3)
    told = found.to_dataset()["start"].values.tolist()
    assert told == ["as described", "body.joint.position first reading, body.joint.velocity unknown", "as described"]


def test_a_recording_that_is_predicted_has_its_own_start_found(hinge):
    """Without it the prediction would be off by the free oscillation, 0.1 rad."""
    recordings = [{"time": TIME, "encoder": noisy(angle(TIME, *start), k)} for k, start in enumerate(STARTS)]
    found = identify(hinge, recordings, **NAMED, start=FREE, test=["recording 2"])
    assert [*ends(found)] == ["k", "c", *(f"{path} of recording 1" for path in FREE)]
    (_, predicted) = found.test[0]
    assert np.sqrt(np.mean((predicted[0] - angle(TIME, *STARTS[1])) ** 2)) < NOISE / 2
    assert found.warnings == ()


Q0 = np.sin(0.4)  # of a torque's amplitude at the start


def test_a_robot_that_was_at_rest_starts_in_equilibrium_and_its_derivatives_are_those_of_the_closed_form(hinge):
    """Before the start the torque was M sin(0.4): q = M sin(0.4)/k, which follows k and the M that it had before."""
    before, held = {"before.body.joint.torque.amplitude": "0.1..0.5N m"}, 0.3
    problem = problem_of(hinge, [{"time": TIME, "encoder": angle()}], start=before)
    theta, misfit = np.array([K, C, held]), problem.misfit(np.ones(1))
    np.testing.assert_allclose(problem.computed(theta)[0][0], angle(q=held * Q0 / K), atol=5e-5)
    unit, h = angle(q=1.0) - angle(), 1e-5
    by_k = (angle(q=held * Q0 / (K + h), k=K + h) - angle(q=held * Q0 / (K - h), k=K - h)) / (2 * h)
    J = misfit.jacobian(theta)
    np.testing.assert_allclose(J[:, 2], unit * Q0 / K, atol=5e-5)
    np.testing.assert_allclose(J[:, 0], by_k, atol=5e-4 * np.abs(by_k).max())


def test_what_a_robot_was_before_it_was_let_go_is_unknown_known_or_as_described(hinge):
    amplitude, velocity = "before.body.joint.torque.amplitude", {"body.joint.velocity": "-0.5 rad/s"}
    given = (
        ({amplitude: "0.1..0.5N m"}, 0.3, 0.0, f"in equilibrium, {amplitude} unknown"),
        ({amplitude: "0.2 N m"}, 0.2, 0.0, f"in equilibrium, {amplitude} given"),
        ({"before": "equilibrium"} | velocity, M0, -0.5, "in equilibrium, body.joint.velocity given"),
    )
    recordings = [
        {"time": TIME, "encoder": noisy(angle(q=held * Q0 / K, v=v), seed), "start": start}
        for seed, (start, held, v, _) in enumerate(given)
    ]
    found = identify(hinge, recordings, **NAMED)
    assert found.to_dataset()["start"].values.tolist() == [how for *_, how in given]
    assert [*ends(found)] == ["k", "c", f"{amplitude} of recording 1"]
    np.testing.assert_allclose(found.theta, [K, C, 0.3], rtol=0.01)
    assert all(one.low < x < one.high for one, x in zip(ends(found).values(), (K, C, 0.3), strict=True))
    assert found.warnings == ()


def test_a_robot_that_was_in_no_equilibrium_is_told(hinge):
    loose = parse_robot(DRIVEN.replace("stiffness: 0.8 N m/rad", "stiffness: 0 N m/rad"))
    vary = {"c": (0.01, 0.1)}
    with pytest.raises(InputError) as told:
        identify(loose, [late(0.0, 0) | {"start": {"before": "equilibrium"}}], **NAMED | {"vary": vary})
    assert "before its start" in str(told.value) and "nothing holds body.angle" in str(told.value)


@pytest.mark.parametrize("shift", [0.01, 0.12, -0.05])
def test_a_late_clock_is_told_with_an_interval_and_what_frees_it(hinge, shift):
    """Without a word the stiffness would be 0.55 N m/rad for 0.12 s."""
    for seed in range(3):
        found = identify(hinge, [late(shift, seed)], **NAMED)
        (told,) = [words for words in found.warnings if "clock" in words]
        side, size, low, high = re.search(r"1 (\w+) by (.+) ms \(95 %: (.+) ms to (.+) ms\)", told).groups()
        assert side == ("late" if shift > 0 else "early")
        assert float(size) == pytest.approx(1e3 * abs(shift), abs=2.0)
        assert float(low) < float(size) < float(high) < float(low) + 5
        assert "shift: -" in told and "--shift=-" in told
        span = told.split("--shift=")[1].removesuffix(" of all")
        free = identify(hinge, [late(shift, seed)], **NAMED, shift=span)
        assert free.theta[2] == pytest.approx(shift, abs=3e-3) and free.warnings == ()


@pytest.mark.parametrize(("rate", "way"), [(0.001, "fast"), (-0.001, "slow"), (0.01, "fast")])
@pytest.mark.parametrize("free", [{}, {"shift": "-0.1..0.1s"}])
def test_a_clock_that_runs_fast_or_slow_is_told_by_how_much(hinge, rate, way, free):
    """A thousandth, as of a camera's 29.97 frames/s taken for 30: 4 ms in the whole recording, 20 s of 1000 samples."""
    time = np.linspace(0.0, 20.0, 1001)
    recording = {"time": time, "encoder": noisy(angle((1 - rate) * time), 0)}
    (told,) = [words for words in identify(hinge, [recording], **NAMED, **free).warnings if "clock" in words]
    side, size, low, high = re.search(r"1 (\w+) by (\S+) % \(95 %: (\S+) to (\S+) %\)", told).groups()
    assert side == way
    assert float(size) == pytest.approx(100 * abs(rate), rel=0.1)
    assert float(low) <= float(size) <= float(high)
    assert "time: {rate: 29.97 Hz}" in told


def test_the_recording_whose_clock_is_late_is_named(hinge):
    found = identify(hinge, [late(0.0, 0), late(0.06, 1), late(0.0, 2)], **NAMED)
    (told,) = [words for words in found.warnings if "clock" in words]
    assert "recording 2 late by" in told and "recording 1" not in told and "recording 3" not in told


def test_a_right_clock_is_not_told_late(hinge):
    """Of 60 draws of noise more than one would be told with a probability of 0.002, of 20 one with one of 0.02."""
    told = [identify(hinge, [late(0.0, seed)], **NAMED).warnings for seed in range(20)]
    assert not any("clock" in words for warnings in told for words in warnings)


@pytest.mark.parametrize(
    "lacking",
    [
        0.01 * np.sin(2 * np.pi * 0.4 * TIME),
        0.01 * TIME,
        np.full(TIME.size, 0.02),
        0.2 * angle(),
        angle(k=0.9) - angle(),
    ],
    ids=["another motion", "drift", "offset", "gain", "nothing"],
)
def test_what_is_wrong_otherwise_is_no_late_clock(hinge, lacking):
    recording = {"time": TIME, "encoder": noisy(angle() + lacking, 1)}
    assert not any("clock" in words for words in identify(hinge, [recording], **NAMED).warnings)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"start": {"k": "0.1..1N m/rad"}}, 'start: "k" is no start of a joint or of a rod'),
        ({"start": {"before": "rest"}}, 'start: "rest" is nothing that it could be before its start'),
        ({"start": {"before.body.joint.position": "1deg"}}, "how the robot starts, which the equilibrium before says"),
        ({"start": {"before.c": "1..2N"}}, 'c: "1 N" is a force'),
        (
            {"start": {"before": "equilibrium", "body.joint.position": "1deg"}},
            "body.joint.position is given, and so is what the robot was before",
        ),
        (
            {"start": {"before.k": "0.5 N m/rad"}},
            "body.joint.stiffness is in vary too",
        ),
        ({"start": {"body.joint.positon": "1deg"}}, "there is no quantity called"),
        ({"start": {"body.joint.position": "1..2N"}}, "body.joint.position"),
        ({"start": {"body.joint.velocity": "reading"}}, "Compare body.angle.rate or body.position.rate in a column"),
        ({"start": {"body.joint.position": "reading"}, "shift": "10ms"}, "no first reading tells it"),
        ({"shift": "1..2m"}, "shift: "),
        ({"shift": "-5..5s"}, "encoder: has 0 values to compare"),
        (
            {"start": {"body.joint.position": "1..2deg"}, "vary": {"body.joint.position": "1..2deg"}},
            "body.joint.position is in vary too",
        ),
    ],
)
def test_what_is_asked_wrongly_is_told(hinge, how, said):
    with pytest.raises(InputError) as told:
        identify(hinge, [late(0.0, 0)], **NAMED | how)
    assert said in str(told.value)
