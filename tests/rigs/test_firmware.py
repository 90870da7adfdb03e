"""The firmware of the motor controller, compiled, on a simulated chip with a simulated motor, by its serial line.

Times are those of the board's clock: a busy machine makes a test longer, not different.
"""

import ctypes
import math
from dataclasses import replace
from functools import partial

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.controllers import VariableGainPI
from nectosome.controllers.pid import ActuatorLimits
from nectosome.rigs import RigError
from nectosome.rigs.devices import serial_line
from nectosome.rigs.devices.serial_line import framed
from nectosome.rigs.devices.serial_motor import MotorLink, SerialMotor

from .board import INERTIA, MOTOR, NUMBERS, SUPPLY, Board, build, lacks

pytestmark = pytest.mark.skipif(bool(lacks()), reason=f"firmware is not tested: {lacks()}")

DT, LEAD, MILLISECOND = 0.02, 0.004, 0.001  # s; sample, and how long before its pulse
KP, KI, BOOST, LOW = 0.011, 0.45, 2.0, 2.0  # of firmware/settings.h
LAW = VariableGainPI(*map(jnp.asarray, (KP, KI, BOOST, LOW)), ActuatorLimits(*map(jnp.asarray, (-1.0, 1.0, math.inf))))
PULSE = 1e-3  # of the voltage: half a microsecond of 500
COUNT = 2 * math.pi / 2248.86  # of the encoder [rad]


def factor(speed: float) -> float:
    return 1 + BOOST * math.exp(-abs(speed) / LOW)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("firmware")
    build(folder, "simulation")
    return build(folder, "firmware")


@pytest.fixture
def board(built, tmp_path):
    return partial(Board, built, built, tmp_path / "log.csv")


@pytest.fixture
def link():
    """Rigs on boards, closed at the end."""
    rigs = []

    def connect(board: Board, watchdog: float = 60.0) -> SerialMotor:
        rigs.append(SerialMotor(MotorLink(board.path, timeout=5.0, start=60.0, watchdog=watchdog)))
        rigs[-1].open()
        return rigs[-1]

    yield connect
    for rig in rigs:
        rig.close()


def jump(log: np.ndarray) -> int:
    """Row of the first voltage that is not 0."""
    return int(np.flatnonzero(log[:, 1])[0])


def moved(log: np.ndarray) -> np.ndarray:
    """Speeds from the first pulse of a step from rest on, each millisecond: the log's rows are up to one later."""
    path = log[jump(log) :, 2]
    late = path[0] / (path[1] - path[0])
    rows = np.arange(len(path))
    return np.interp(rows - late, rows, path, left=0.0)


def fields(kind: type, names: str) -> list[tuple[str, type]]:
    return [(name, kind) for name in names.split()]


class Law(ctypes.Structure):
    _fields_ = fields(ctypes.c_float, "proportional integral boost low most reference factor error gain sum command")


def test_the_law_is_that_of_nectosome_in_single_precision(built):
    """400 samples with references that jump, of both signs, a third of them at a limit."""
    plant = ctypes.CDLL(str(built / "plant.so"))
    plant.law_step.restype = ctypes.c_float
    law = Law(KP, KI, BOOST, LOW, 1.0)
    rng = np.random.default_rng(3)
    reference = np.repeat(rng.uniform(-20, 20, 20), 20)
    measured = reference + rng.normal(0, 8.0, 400)
    regulator = LAW.planned(reference, DT)
    state = regulator.initial(0.1, measured[0])
    plant.law_refer(ctypes.byref(law), ctypes.c_float(reference[0]))
    plant.law_start(ctypes.byref(law), ctypes.c_float(0.1), ctypes.c_float(measured[0]))
    ours, its = [], []
    for r, y in zip(reference, measured, strict=True):
        plant.law_refer(ctypes.byref(law), ctypes.c_float(r))
        its.append(plant.law_step(ctypes.byref(law), ctypes.c_float(y), ctypes.c_float(DT)))
        state, u = regulator.step(state, jnp.asarray(y))
        ours.append(float(u))
    assert 0.02 < np.mean(np.abs(ours) == 1.0) < 0.8
    np.testing.assert_allclose(its, ours, atol=2e-5)


class Plant(ctypes.Structure):
    _fields_ = fields(
        ctypes.c_double, "constant resistance friction efficiency friction_speed inertia drag cogging teeth"
    )


class Shaft(ctypes.Structure):
    _fields_ = (("angle", ctypes.c_double), ("speed", ctypes.c_double))


def test_the_simulated_motor_is_that_of_nectosome(built):
    plant = ctypes.CDLL(str(built / "plant.so"))
    plant.motor_torque.restype = ctypes.c_double
    lossy = replace(MOTOR, efficiency=MOTOR.efficiency * 0.8)
    motor = Plant(*(float(value) for value in (NUMBERS | {"efficiency": lossy.efficiency}).values()))
    for volts in (-7.4, -0.3, 0.0, 2.0, 7.4):
        for speed in (-25.0, -0.1, 0.0, 0.02, 3.0, 25.0):
            sign = speed / np.hypot(speed, float(MOTOR.friction_speed))  # the board's motor does not hold
            least, most = (lossy.at_voltage(*map(jnp.asarray, (0.0, volts, speed, w)))[1] for w in (1.0, -1.0))
            ours = 0.5 * float((1 + sign) * least + (1 - sign) * most)
            its = plant.motor_torque(ctypes.byref(motor), ctypes.c_double(volts), ctypes.c_double(speed))
            assert its == pytest.approx(ours, rel=1e-12, abs=1e-15)


def test_the_simulated_shaft_runs_up_as_an_exponential(built):
    """Without friction v = U/K (1 - exp(-t/tau)), tau = J R / K^2; steps of 20 us, midpoint: 1e-7."""
    plant = ctypes.CDLL(str(built / "plant.so"))
    plant.motor_turned.restype = Shaft
    motor = Plant(0.27, 1.8, 0.0, 1.0, 0.2, 1e-3)
    shaft, tau = Shaft(), 1e-3 * 1.8 / 0.27**2
    for _ in range(2000):
        shaft = plant.motor_turned(ctypes.byref(motor), shaft, ctypes.c_double(5.0), ctypes.c_double(2e-5))
    assert shaft.speed == pytest.approx(5.0 / 0.27 * -math.expm1(-0.04 / tau), rel=1e-6)
    assert shaft.angle == pytest.approx(5.0 / 0.27 * (0.04 + tau * math.expm1(-0.04 / tau)), rel=1e-6)


def predicted(reference: np.ndarray, drag: float = 0.0) -> np.ndarray:
    """Speed [rad/s] each millisecond from the first pulse on, from rest: the law of nectosome, no edges of an encoder.

    The voltage of a sample comes `LEAD` after it; the measured speed is the mean since the sample before.
    """
    K, R, T_f, eta, slow = map(float, NUMBERS.values())
    regulator = LAW.planned(np.concatenate([[0.0], reference]), DT)
    state = regulator.initial()
    state, _ = regulator.step(state, jnp.asarray(0.0))
    angle = v = volts = last = 0.0
    fine = MILLISECOND / 50
    path = []
    for _ in reference:
        state, share = regulator.step(state, jnp.asarray((angle - last) / DT))
        last = angle
        for k in range(round(DT / fine)):
            if k == round(LEAD / fine):
                volts = SUPPLY * float(share)
            if k % 50 == 0:
                path.append(v)
            M = K * (volts - K * v) / R
            torque = M - v / math.hypot(v, slow) * (T_f + (1 - eta) * abs(M)) - drag * v
            angle, v = angle + fine * v, v + fine * torque / INERTIA
    return np.array(path[round(LEAD / MILLISECOND) :])


@pytest.mark.parametrize("speed", [5.0, 10.0, -20.0])
def test_a_step_is_followed_as_the_law_of_nectosome_predicts(board, link, speed):
    """On its path within 1 % and what one and a half counts in a sample move it by; in the end within 0.2 %."""
    with board(drag=0.005) as motor:
        rig = link(motor)
        rig.write([speed])
        log = motor.wait(1.6)
        rig.measure()
    path, ours = moved(log), predicted(np.full(70, speed), 0.005)
    K, R = float(MOTOR.constant), float(MOTOR.resistance)
    moves = factor(speed) * (KP + KI * DT) * SUPPLY / K * -math.expm1(-DT * K**2 / (R * INERTIA))  # by a speed of 1
    np.testing.assert_allclose(path[: len(ours)], ours, atol=0.01 * abs(speed) + 1.5 * moves * COUNT / DT)
    assert np.mean(path[1000:1500]) == pytest.approx(speed, rel=2e-3)
    assert rig.told.state == "on"
    assert rig.told.speed == pytest.approx(speed, rel=0.01)
    assert rig.told.speed + rig.told.error == pytest.approx(speed, abs=1e-4)


def test_a_step_is_followed_as_the_closed_form_of_its_loop_says(board, link):
    """At pulses n the share of the step that is reached, 1 - a p^n - b q^n, within 1 %; friction is off.

    With the motor's time constant dt / ln(1 + K_i dt / K_p) the law's zero is its pole, and the loop an integrator:
    w[n+1] = w[n] + g (1 - y[n]), g = k K_i dt U/K. The encoder's mean lies half a sample and the lead behind the pulse,
    so y = w[n] - (1/2 + lead/dt) (w[n] - w[n-1]); p, q are the roots of z^2 - (1 - 0.3 g) z + 0.7 g.
    """
    constant, resistance = float(MOTOR.constant), float(MOTOR.resistance)
    time_constant = DT / math.log(1 + KI * DT / KP)
    speed = 12.0
    with board(friction=0.0, efficiency=1.0, inertia=time_constant * constant**2 / resistance) as motor:
        link(motor).write([speed])
        log = motor.wait(0.8)
    g = factor(speed) * KI * DT * SUPPLY / constant
    behind = 0.5 + LEAD / DT
    p, q = np.roots([1.0, -(1 - (1 - behind) * g), behind * g])
    a = (1 - g - q) / (p - q)  # w[0] = 0, w[1] = g
    form = 1 - a * p ** np.arange(20) - (1 - a) * q ** np.arange(20)
    path = moved(log)[:: round(DT / MILLISECOND)][:20] / speed
    np.testing.assert_allclose(path, form, atol=0.01)


@pytest.mark.parametrize("speed", [0.5, 3.0, 15.0])
def test_the_gain_grows_at_low_speed(board, link, speed):
    """The first voltage after a step from rest is (K_p + K_i dt) k r of the supply's."""
    with board() as motor:
        link(motor).write([speed])
        log = motor.wait(0.1)
    share = log[jump(log), 1] / SUPPLY
    assert share == pytest.approx(factor(speed) * (KP + KI * DT) * speed, abs=PULSE)


def test_the_variable_gain_turns_more_steadily_over_cogs(built, board, link, tmp_path):
    """At 0.5 rad/s, 12 cogs of 0.02 N m, of which two pass: the spread of the speed is under 0.7 of that of BOOST=0."""
    fixed = tmp_path / "fixed"
    fixed.mkdir()
    build(fixed, "firmware", "-DBOOST=0.0f")
    spread = {}
    for name, folder in (("fixed", fixed), ("variable", built)):
        with Board(folder, built, tmp_path / f"{name}.csv", pace=4.0, cogging=0.02, teeth=12) as motor:
            rig = link(motor)
            rig.write([0.5])
            log = motor.wait(5.0)
        spread[name] = np.std(log[-2094:, 2]) / 0.5
        assert np.mean(log[-2094:, 2]) == pytest.approx(0.5, rel=0.1)
    assert spread["variable"] < 0.7 * spread["fixed"]


def test_a_motor_at_its_limit_does_not_wind_up(board, link):
    """Two seconds beyond what the voltage allows; then the first sample of a lower speed is off the limit."""
    with board() as motor:
        rig = link(motor)
        rig.write([60.0])
        motor.wait(2.0)
        rig.measure()
        assert rig.told.share == 1.0
        rig.write([10.0])
        log = motor.wait(1.5)
    begins, leaves = jump(log), int(np.flatnonzero(log[:, 1] == log[:, 1].max())[-1]) + 1
    assert log[leaves - 1, 1] == pytest.approx(SUPPLY)
    assert log[leaves, 1] < 0.5 * SUPPLY
    ours = predicted(np.repeat([60.0, 10.0], [round((leaves - begins) * MILLISECOND / DT), 60]))
    path = moved(log)
    np.testing.assert_allclose(path[: len(ours)], ours[: len(path)], atol=0.3)


def test_a_damaged_question_is_answered_counted_and_not_obeyed(board, link, monkeypatch):
    with board() as motor:
        rig = link(motor)
        rig.write([5.0])
        before = rig.told.damaged
        with monkeypatch.context() as patch:
            patch.setattr(serial_line, "framed", lambda text: framed(text).replace(b"9.", b"8."))
            with pytest.raises(RigError, match=r"'S 9\.0000' arrived damaged"):
                rig.write([9.0])
        rig.measure()
        assert rig.told.damaged == before + 1
        assert rig.told.speed + rig.told.error == pytest.approx(5.0, abs=1e-3)


def test_lines_without_sense_are_refused_and_the_motor_stays_as_it_is(board, link):
    with board() as motor:
        rig = link(motor)
        rig.write([5.0])
        for question, why in (
            ("S nan", "value"),
            ("S 101", "value"),
            ("S", "value"),
            ("W 1e9", "value"),
            ("Q 1", "unknown"),
        ):
            with pytest.raises(RigError, match=f"'{question}' was refused: {why}"):
                rig._ask(question)
        with pytest.raises(RigError, match="arrived damaged"):
            rig._ask("S " + "1" * 60)
        rig.measure()
        assert rig.told.state == "on"
        assert rig.told.speed + rig.told.error == pytest.approx(5.0, abs=1e-3)


def test_a_question_that_comes_after_the_next_one_is_not_obeyed(board, link):
    """1 to 127 numbers before the last one; but to vent is always obeyed."""
    with board() as motor:
        rig = link(motor)
        rig.line.port.asked = 300
        rig.write([5.0])
        for back in (1, 127):
            rig.line.port.asked = 301 - back - 1
            with pytest.raises(RigError, match=r"'S 9\.0000' was refused: old"):
                rig.write([9.0])
        rig.line.port.asked = 300  # the number of the last one: a question that is asked again
        rig.write([5.0])
        rig.measure()
        assert rig.told.speed + rig.told.error == pytest.approx(5.0, abs=1e-3)
        rig.line.port.asked = 301 - 10
        rig.vent()
        rig.measure()
        assert rig.told.state == "off"
        rig.line.port.asked -= 129  # 128 before
        rig.write([7.0])
        assert rig.told.speed + rig.told.error == pytest.approx(7.0, abs=1e-3)


def test_another_version_is_told_in_a_sentence(board, link, monkeypatch):
    monkeypatch.setattr(serial_line, "VERSION", 2)
    with board() as motor, pytest.raises(RigError, match="speaks version 1 of the protocol, this program version 2"):
        link(motor)


def test_a_silent_host_is_noticed_by_the_firmware_which_stops_the_motor(board, link):
    """From the last question on, 1 s, and at most a sample to see it and one to the next pulse."""
    with board(pace=0.25) as motor:
        rig = link(motor, watchdog=1.0)
        rig.write([10.0])
        asked = rig.told.sample * rig.sample_time - LEAD
        log = motor.wait_until(asked + 1.5)
        stopped = log[np.flatnonzero(log[:, 1])[-1], 0]
        assert 1.0 <= stopped - asked + MILLISECOND <= 1.0 + 2 * DT
        assert abs(log[-1, 2]) < 0.5
        with pytest.raises(RigError, match=r"stopped by itself, since no question came for 1 s"):
            rig.write([10.0])
        rig.vent()
        rig.write([1.0])
        assert rig.told.state == "on"


def again(step, *arguments):
    """A question during a reset may be lost."""
    for _ in range(5):
        try:
            return step(*arguments)
        except RigError as error:
            last = error
    raise last


@pytest.mark.parametrize("what", ["reset", "hang"])
def test_a_reset_comes_back_without_voltage_and_waits_for_the_host(board, link, what):
    """A chip that hangs is reset by its own watchdog, after 120 ms, while the last pulse is repeated."""
    with board() as motor:
        rig = link(motor)
        rig.write([10.0])
        assert motor.wait(0.5)[-1, 1] > 0.0
        getattr(motor, what)()
        since = motor.log()[-1, 0]  # or before
        log = motor.wait_until(since + 1.0)
        assert log[np.flatnonzero(log[:, 1])[-1], 0] < since + 0.2
        assert abs(log[-1, 2]) < 0.1
        again(rig.measure)
        assert rig.told.state == "reset"
        assert rig.told.share == 0.0
        with pytest.raises(RigError, match="stopped by itself, since it was reset"):
            rig.write([10.0])
        rig.vent()
        rig.write([1.0])
        assert rig.told.state == "on"
