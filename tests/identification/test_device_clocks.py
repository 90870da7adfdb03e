"""Devices of a bench whose clocks are late and run fast, on a hinge whose motion is known in closed form."""

import re

import numpy as np
import pytest
from tests.small_robots import DRIVEN, M0, F, I

from nectosome.description import parse_robot
from nectosome.description.variables import Variable, read_variable
from nectosome.identification import identify
from nectosome.identification.recordings import recordings_of
from nectosome.identification.robot.misfit import RobotMisfit
from nectosome.identification.robot.trial_clocks import TrialClock, is_within, robot_times, time_derivatives
from nectosome.identification.robot.trials import read_compared, robot_trials
from nectosome.model import build
from nectosome.units import InputError

K, C = 0.75, 0.034  # N m/rad, N m s/rad
W = 2 * np.pi * F
TIME = np.linspace(0.0, 10.0, 501)
NOISE = {"camera": 2e-3, "gyro": 0.02}  # rad, rad/s
CAMERA, GYRO = (0.021, -0.001), (-0.012, 0.0)  # late [s], fast: 29.97 frames/s taken for 30
FREE = {
    "camera": {"columns": ["camera"], "shift": "-50..50 ms", "drift": "-0.5..0.5 %"},
    "cell": {"columns": ["gyro"], "shift": "-50..50 ms"},
}
NAMED = {
    "vary": {"k": "0.3..1.2N m/rad log", "c": (0.01, 0.1)},
    "compare": {"camera": "body.angle", "gyro": "body.angle.rate"},
    "starts": 1,
}


def motion(time):
    """Angle and rate by I q'' + c q' + k q = M0 sin(W t + 0.4) from rest; before the start it stands."""
    after = np.maximum(time, 0.0)
    forced = M0 * np.exp(0.4j) / (K - I * W**2 + 1j * W * C)
    root = np.sqrt(C**2 / (4 * I**2) - K / I + 0j)
    poles = np.array([-C / (2 * I) + root, -C / (2 * I) - root])
    free = np.linalg.solve([[1, 1], poles], [-forced.imag, -(1j * W * forced).imag])
    modes = np.exp(np.outer(poles, after))
    rate = (1j * W * forced * np.exp(1j * W * after)).imag + ((free * poles) @ modes).real
    return (forced * np.exp(1j * W * after)).imag + (free @ modes).real, rate


def bench(seed, camera=CAMERA, gyro=GYRO):
    """What a camera and a gyro stamp with the same times: each clock reads (1 + drift) T + shift."""
    random = np.random.default_rng(seed)
    clean = [motion((TIME - shift) / (1 + drift))[k] for k, (shift, drift) in enumerate((camera, gyro))]
    noisy = {name: y + NOISE[name] * random.normal(size=y.size) for name, y in zip(NOISE, clean, strict=True)}
    return {"time": TIME} | noisy


def ends(found):
    return dict(zip(found.to_dataset()["parameter"].values, found.identifiability.intervals(), strict=True))


@pytest.fixture(scope="module")
def hinge():
    return parse_robot(DRIVEN)


def test_each_clock_of_a_bench_is_found_with_the_parameters(hinge):
    """Of 6 draws 95 % intervals of 5 unknowns miss in more than 5 of 30 with a probability of 0.003."""
    truth = {"k": K, "c": C, "camera.shift of recording 1": 0.021, "camera.drift of recording 1": -0.001}
    truth |= {"cell.shift of recording 1": -0.012}
    missed = 0
    for seed in range(6):
        found = identify(hinge, [bench(seed) | {"clocks": FREE}], **NAMED)
        known = ends(found)
        assert [*known] == [*truth] and found.warnings == ()
        missed += sum(not known[name].low < x < known[name].high for name, x in truth.items())
        assert found.theta[3] == pytest.approx(-0.001, abs=3e-4)
    assert missed <= 5


def test_without_clocks_the_warnings_name_each_device_and_what_to_write(hinge):
    """The stiffness would be off by many of its standard errors; a word for each device, none for right ones."""
    found = identify(hinge, [bench(0)], **NAMED)
    late, fast = found.warnings[-2:]
    (early,) = re.findall(r"gyro of recording 1 early by (\S+) ms", late)
    assert float(early) == pytest.approx(12, abs=1.5)
    (slow,) = re.findall(r"camera of recording 1 slow by (\S+) % \(95 %", fast)
    assert float(slow) == pytest.approx(0.1, abs=0.03)
    assert "gyro" not in fast
    assert re.search(r"clocks: \{gyro: \{shift: -\S+ s\}\} in the campaign and clock: gyro beside its column", late)
    assert re.search(r"clocks: \{camera: \{drift: -\S+ %\}\} in the campaign and clock: camera beside", fast)


def test_a_named_clock_is_told_by_its_name(hinge):
    clocks = {"cell": {"columns": ["gyro"]}, "eye": {"columns": ["camera"]}}
    (late,) = identify(hinge, [bench(0, camera=(0.0, 0.0)) | {"clocks": clocks}], **NAMED).warnings[-1:]
    assert "cell of recording 1 early by" in late and "eye of" not in late
    assert "s under clocks.cell in the campaign" in late


def test_right_clocks_are_not_told_wrong(hinge):
    right = {"camera": (0.0, 0.0), "gyro": (0.0, 0.0)}
    told = [identify(hinge, [bench(seed, **right)], **NAMED).warnings for seed in range(8)]
    assert not any("clock" in words for warnings in told for words in warnings)


def test_a_recording_late_as_a_whole_is_told_as_one(hinge):
    (late,) = identify(hinge, [bench(0, (0.02, 0.0), (0.02, 0.0))], **NAMED).warnings[-1:]
    assert re.search(r"wrong: recording 1 late by (19|20)\.\d+ ms", late) and "--shift=-" in late


def test_a_clock_is_one_of_all_recordings_where_the_campaign_says_it_and_columns_may_be_absent(hinge, tmp_path):
    for seed, names in ((1, ("camera", "gyro")), (2, ("camera",))):
        run = bench(seed, camera=(0.021, 0.0))
        rows = np.stack([TIME, *(run[name] for name in names)], axis=1)
        heads = ["time (s)", "camera (rad)", "gyro (rad/s)"][: rows.shape[1]]
        np.savetxt(tmp_path / f"run{seed}.csv", rows, delimiter=",", header=",".join(heads), comments="")
    (tmp_path / "campaign.yaml").write_text("""
clocks: {eye: {shift: -50..50 ms}}
columns: {camera: {unit: rad, clock: eye}}
recordings:
  - {file: run1.csv, columns: {camera: {unit: rad, clock: eye}, gyro: {unit: rad/s, clock: cell}},
     clocks: {eye: {shift: -50..50 ms}, cell: {shift: -12 ms}}}
  - {file: run2.csv}
""")
    found = identify(hinge, tmp_path / "campaign.yaml", **NAMED)
    known = ends(found)
    assert [*known] == ["k", "c", "eye.shift of run1", "eye.shift"]
    for name in ("eye.shift of run1", "eye.shift"):
        assert known[name].low < 0.021 < known[name].high
    assert found.trials[1].notes == ("has no gyro",)
    assert known["k"].low < K < known["k"].high


def test_derivatives_by_clocks_are_those_of_the_closed_form(hinge):
    """To 2e-3 of the largest, which cubics between steps have; finite differences of what is computed to 1e-5."""
    compared = [read_compared(*pair, build(hinge)) for pair in NAMED["compare"].items()]
    free = FREE | {"cell": FREE["cell"] | {"drift": "-0.5..0.5 %"}}
    own = {"clocks": free, "shift": "-20..20 ms", "drift": "-0.1..0.1 %"}
    units = {one.column: one.reading.unit for one in compared}
    trials = robot_trials(recordings_of([bench(0) | own], units), hinge, compared, {})
    variables = [read_variable(name, span, hinge) for name, span in NAMED["vary"].items()]
    misfit = RobotMisfit(trials, variables, compared).misfit(np.ones(2))
    theta = np.array([*CAMERA, *GYRO, 0.003, 2e-4])
    J, h = misfit.jacobian(np.array([K, C, *theta]))[:, 2:], np.array([1e-5, 1e-6] * 3)
    used = np.isfinite(trials[0].measured)

    def closed(x):
        times = [(TIME - shift) / (1 + drift) for shift, drift in (x[:2], x[2:4])]
        both = [motion((t - x[4]) / (1 + x[5]))[k] for k, t in enumerate(times)]
        return np.concatenate([y[there] for y, there in zip(both, used, strict=True)])

    for k, step in enumerate(np.diag(h)):
        by = (closed(theta + step) - closed(theta - step)) / (2 * h[k])
        np.testing.assert_allclose(J[:, k], by, atol=2e-3 * np.abs(by).max())


def test_times_of_a_chain_of_clocks_and_what_of_them_is_known():
    """t = (1 + d) T + s, one behind the other: T = ((t - 0.02)/0.999 - 0.1)/1.001 of one column, without the first of
    the other."""
    clocks = (
        TrialClock("a", (0,), 0.02, -0.001),
        TrialClock("", (0, 1), Variable("x", -0.1, 0.1, False, "time"), 1e-3),
    )
    time = np.broadcast_to(np.linspace(0.0, 2.0, 9), (2, 9))
    found = robot_times(clocks, time, {"x": 0.1})
    np.testing.assert_allclose(found[0], ((time[0] - 0.02) / 0.999 - 0.1) / 1.001, rtol=1e-14)
    np.testing.assert_allclose(found[1], (time[1] - 0.1) / 1.001, rtol=1e-14)
    np.testing.assert_allclose(time_derivatives(clocks, time, {"x": 0.1}, "x"), np.full((2, 9), -1 / 1.001), rtol=1e-14)
    known = is_within(clocks, time, driven=True)
    assert known[0].tolist() == [False, *[True] * 7, False] and known[1].tolist() == [False, *[True] * 7, False]


@pytest.mark.parametrize(
    ("clocks", "said"),
    [
        ({"camera": {"columns": ["camera"], "shift": "1..2 m"}}, "shift: "),
        ({"camera": {"columns": ["camera"], "rate": "30 Hz"}}, "clocks.camera.rate: is no field of a clock here"),
        ({"camera": {"columns": ["camera"], "drift": "5..-5 %"}}, "drift: "),
    ],
)
def test_what_is_wrong_with_a_clock_is_said(hinge, clocks, said):
    with pytest.raises(InputError) as told:
        identify(hinge, [bench(0) | {"clocks": clocks}], **NAMED)
    assert said in str(told.value)
