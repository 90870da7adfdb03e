"""A motor behind a microcontroller: its lines, its watchdog, and what a bad line does."""

import math
import os
import sys
import threading
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.rigs import RigError
from nectosome.rigs.devices.serial_line import framed, unframed
from nectosome.rigs.devices.serial_motor import MotorLink, SerialMotor
from nectosome.units import InputError

from .motor_emulator import Microcontroller, OverRadio


@pytest.fixture
def motor():
    with Microcontroller() as motor:
        yield motor


@pytest.fixture
def rig(motor):
    rig = SerialMotor(MotorLink(motor.path, timeout=0.2, start=0.5, watchdog=5.0))
    yield rig
    rig.close()


def test_the_checksum_is_that_of_xmodem():
    """The check value of the catalogue of CRCs: 31C3 for 123456789."""
    assert framed("123456789") == b"123456789*31C3\n"


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126)), st.data())
def test_a_line_comes_back_and_one_with_a_changed_byte_does_not(text, data):
    line = framed(text)
    assert unframed(line) == text
    place = data.draw(st.integers(0, len(line) - 2))
    other = data.draw(st.integers(0, 255).filter(lambda x: x != line[place]))
    assert unframed(line[:place] + bytes([other]) + line[place + 1 :]) != text


@given(st.binary())
def test_noise_is_no_line_and_no_error(noise):
    assert unframed(noise) is None or b"*" in noise


def test_it_asks_as_the_protocol_says(motor, rig):
    rig.open()
    rig.write([12.5])
    rig.measure()
    rig.vent()
    assert motor.asked == ["H", "0", "W 5", "S 0.0000", "S 12.5000", "R", "0"]


@pytest.mark.parametrize("speed", [0.2, 5.0, -5.0])
def test_the_controller_holds_the_speed_against_friction(motor, rig, speed):
    rig.open()
    rig.write([speed])
    time.sleep(0.6)
    assert np.mean([rig.measure() for _ in range(20)]) == pytest.approx(speed, rel=0.02)


def test_a_controller_that_does_not_know_its_speed_gives_nan(motor, rig):
    rig.open()
    motor.blind = True
    assert math.isnan(*rig.measure())
    rig.write([1.0])


def test_a_frozen_motor_measures_the_same_speed(motor, rig):
    rig.open()
    motor.frozen = True
    rig.write([5.0])
    time.sleep(0.05)
    assert rig.measure() == (0.0,)


def test_without_questions_the_controller_vents_and_says_so(motor):
    rig = SerialMotor(MotorLink(motor.path, timeout=0.2, start=0.5, watchdog=0.2))
    rig.open()
    rig.write([5.0])
    time.sleep(0.3)
    assert not motor.driven
    with pytest.raises(RigError, match=r"stopped by itself, since no question came for 0\.2 s"):
        rig.write([5.0])
    rig.vent()  # forgets it
    rig.write([1.0])
    assert motor.driven
    rig.close()


def test_it_waits_for_a_controller_that_opening_the_port_has_reset(motor, rig, monkeypatch):
    """A boot loader talks first, in a language of its own."""
    heard, began = motor.heard, time.monotonic()
    monkeypatch.setattr(
        motor, "heard", lambda data: heard(data) if time.monotonic() - began > 0.25 else b"\x06\x85!\r\n"
    )
    rig.open()
    assert rig.measure() == (0.0,)


def test_lines_that_come_too_late_are_not_taken_for_answers(motor, rig):
    rig.open()
    motor.late = 0.25
    with pytest.raises(RigError, match=r"no answer to 'R' in 0\.2 s"):
        rig.measure()
    motor.late = 0.0
    rig.vent()  # whose answer comes after that of the reading
    assert not motor.driven


def test_an_answer_that_came_after_all_is_not_that_of_the_next_question(motor, rig):
    rig.open()
    motor.late = 0.25
    with pytest.raises(RigError, match="no answer"):
        rig.measure()
    time.sleep(0.15)
    motor.late, motor.frozen, motor.speed = 0.0, True, 3.0
    assert rig.measure() == (3.0,)


def test_a_line_that_breaks_while_the_controller_starts_is_not_waited_for(motor):
    motor.silent_from = 0.0
    rig = SerialMotor(MotorLink(motor.path, start=30.0))
    began = time.monotonic()
    threading.Timer(0.1, motor.pull).start()
    with pytest.raises(RigError, match="the line does not work"):
        rig.open()
    assert time.monotonic() - began < 10.0
    rig.close()


def test_a_garbled_answer_is_shown(motor, rig):
    rig.open()
    motor.garbled = True
    with pytest.raises(RigError, match=r"no answer to 'R' in 0\.2 s, but b'1 \d+ V .*baud rate \(115200 expected\)"):
        rig.measure()


def test_a_question_that_was_garbled_on_its_way_is_told(motor, rig, monkeypatch):
    rig.open()
    heard = motor.heard
    monkeypatch.setattr(motor, "heard", lambda data: heard(data.replace(b"R*", b"Q*")))
    with pytest.raises(RigError, match="'R' arrived damaged"):
        rig.measure()


def test_a_controller_of_another_version_is_told_and_not_waited_for(motor):
    motor.version = 2
    rig = SerialMotor(MotorLink(motor.path, timeout=5.0, start=600.0))
    with pytest.raises(RigError, match=r"speaks version 2 of the protocol, this program version 1\. Flash"):
        rig.open()
    assert not rig.commanded
    rig.close()


def test_an_answer_to_another_question_is_not_taken(motor, rig, monkeypatch):
    """A radio may deliver an old answer just after a question."""
    rig.open()
    heard, motor.frozen, motor.speed = motor.heard, True, 3.0
    monkeypatch.setattr(motor, "heard", lambda data: framed("1 200 V 0 7.0 0.0 0.0 on 0") + heard(data))
    assert rig.measure() == (3.0,)


def test_a_lost_question_and_a_lost_answer_are_asked_again_with_the_same_number(motor, rig, monkeypatch):
    rig = SerialMotor(MotorLink(motor.path, timeout=0.1, attempts=3, start=0.5))
    rig.open()
    heard, given = motor.heard, []
    fates = iter((lambda data: b"", lambda data: heard(data)[:0], heard))
    monkeypatch.setattr(motor, "heard", lambda data: (given.append(data), next(fates)(data))[1])
    rig.write([2.0])
    assert len(given) == 3
    assert len(set(given)) == 1
    assert motor.asked[-2:] == ["S 2.0000", "S 2.0000"]
    assert (rig.line.port.lost, rig.line.port.late) == (2, 0)
    rig.close()


def test_a_question_is_asked_no_longer_than_the_file_says(motor):
    """With numbers that tell what a line has lost."""
    rig = SerialMotor(MotorLink(motor.path, timeout=0.1, attempts=4, start=0.5))
    rig.open()
    motor.silent_from = 0.0
    began = time.perf_counter()
    with pytest.raises(RigError, match=r"in 0\.1 s at 4 attempts.*Of 5 questions 4 got no answer in time; 0 answers"):
        rig.write([1.0])
    assert 0.4 <= time.perf_counter() - began < 0.7
    rig.close()


def test_noise_without_end_is_not_listened_to_for_ever(motor, monkeypatch):
    """Bytes that come faster than the time limit, and never a line feed."""
    rig = SerialMotor(MotorLink(motor.path, timeout=0.2, start=0.5))
    rig.open()
    advance = motor.advance
    monkeypatch.setattr(motor, "heard", lambda data: b"")
    monkeypatch.setattr(motor, "advance", lambda: (advance(), os.write(motor._end, b"\xff" * 50)))
    began = time.perf_counter()
    with pytest.raises(RigError, match="no answer to 'R' in 0"):
        rig.measure()
    assert time.perf_counter() - began < 0.5
    rig.close()


def test_a_question_that_comes_after_the_next_one_is_not_obeyed(motor, rig):
    """1 to 127 numbers before the last one; but to vent and to greet are always obeyed."""
    rig.open()
    rig.write([2.0])
    last = rig.line.port.asked
    for back, answer in ((1, "E old"), (127, "E old"), (128, "V "), (256, "V ")):
        rig.line.port.asked = last + 255  # so that numbers stay above 0
        rig.write([3.0])
        rig.line.port.asked -= back + 1
        if answer == "E old":
            with pytest.raises(RigError, match="refused: old"):
                rig.write([4.0])
            assert motor.set_speed == 3.0
        else:
            rig.write([4.0])
            assert motor.set_speed == 4.0
    rig.line.port.asked -= 5
    rig.vent()
    assert not motor.driven


def test_over_a_radio_link_every_answer_is_that_of_its_question_or_there_is_none():
    """A fifth of lines is lost and a third late, in both directions; answers tell the speed that was set last.

    A speed that was set is not changed by questions that arrive later than the next ones.
    """
    with OverRadio(lost=0.2, delayed=0.3, longest=0.12) as motor:
        motor.frozen = True
        rig = SerialMotor(MotorLink(motor.path, timeout=0.03, attempts=4, start=5.0, watchdog=60.0))
        opened(rig)
        right = 0
        for k in range(1, 81):
            began = time.perf_counter()
            try:
                rig.write([k / 8])
                assert rig.told.error == k / 8
                rig.measure()
                assert rig.told.error == k / 8
                right += 1
            except RigError as error:
                assert "no answer" in str(error)
            assert time.perf_counter() - began < 2 * 4 * 0.03 + 0.2
        assert right > 40
        assert rig.line.port.lost > 30
        assert rig.line.port.late > 5
        rig.close()


def opened(rig: SerialMotor) -> None:
    """Any of its first questions may get lost at all attempts."""
    for _ in range(10):
        try:
            return rig.open()
        except RigError:
            rig.close()
    raise AssertionError("never opened")


def test_what_the_controller_tells_is_kept(motor, rig):
    rig.open()
    rig.write([0.0])
    motor.frozen, motor.speed, motor.damaged, motor.samples = True, 3.0, 7, 1000
    rig.measure()
    told = rig.told
    assert (told.speed, told.error, told.state, told.damaged) == (3.0, -3.0, "on", 7)
    assert rig.sample_time == 0.005
    assert 1000 <= told.sample < 9000


def test_an_answer_that_is_no_speed_is_told(motor, rig, monkeypatch):
    rig.open()
    monkeypatch.setattr(motor, "heard", lambda data: framed(f"1 {data.split()[1].decode()} V fast"))
    with pytest.raises(RigError, match="'fast' is no answer"):
        rig.measure()


def test_venting_is_tried_again(motor, rig, monkeypatch):
    rig.open()
    rig.write([5.0])
    garble, motor.garbled = motor.garble, True
    answers = iter((garble, garble, lambda answer: answer))
    monkeypatch.setattr(motor, "garble", lambda answer: next(answers)(answer))
    rig.vent()
    assert not motor.driven


def test_a_motor_that_cannot_be_vented_is_told(motor, rig):
    rig.open()
    motor.pull()
    with pytest.raises(RigError, match="switch off its power"):
        rig.vent()


def test_two_programs_do_not_drive_one_motor(motor, rig):
    rig.open()
    with pytest.raises(RigError, match="another program"):
        SerialMotor(MotorLink(motor.path)).open()


@pytest.mark.parametrize("wrong", [{"timeout": 0.0}, {"start": -1.0}, {"watchdog": math.nan}, {"attempts": 0}])
def test_settings_that_make_no_sense_are_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        MotorLink("/dev/ttyACM0", **wrong)


def test_a_machine_without_pyserial_is_told_which_extra_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(RigError, match=r"serial is missing: pip install 'nectosome\[rig\]'"):
        SerialMotor(MotorLink("/dev/ttyACM0")).open()
