"""What every rig keeps to, whatever moves behind it."""

import math
from collections.abc import Callable

import pytest

from nectosome.rigs import Rig, RigError

from .benches import NOWHERE, RIGS, powered

FAULTY = [(name, fault) for name, kind in RIGS.items() for fault in kind.faults]


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """The SDK waits 34 ms for an answer, which a busy machine may take to let the emulator's thread run."""
    monkeypatch.setattr("dynamixel_sdk.port_handler.LATENCY_TIMER", 100)


@pytest.fixture(params=RIGS)
def bench(request):
    with RIGS[request.param].bench() as bench:
        yield bench
        bench.rig.close()


def reaches(rig: Rig, value: float, within: float, seconds: float = 1.0) -> bool:
    """Measures a value within some time."""
    limit = rig.now() + seconds
    while rig.now() < limit:
        if abs(rig.measure() - value) < within:
            return True
        rig.wait(rig.now() + 0.005)
    return False


def told(what: Callable[[], object]) -> str:
    """The message of what goes wrong; nothing where all goes well. Any other error is one of the test."""
    try:
        what()
    except RigError as error:
        return str(error)
    return ""


def test_it_opens_at_a_command_of_0(bench):
    bench.rig.open()
    assert reaches(bench.rig, 0.0, bench.within)


def test_a_command_moves_it_to_where_it_leads(bench):
    bench.rig.open()
    bench.rig.write(bench.command)
    assert reaches(bench.rig, bench.measured, bench.within)
    bench.rig.write(0.0)
    assert reaches(bench.rig, 0.0, bench.within)


def test_a_vented_rig_takes_no_more_power(bench):
    """Whatever it was doing; and again."""
    bench.rig.open()
    bench.rig.write(bench.command)
    bench.rig.vent()
    bench.rig.vent()
    assert not powered(bench.device)


def test_it_may_be_closed_twice_and_opened_again(bench):
    for _ in range(2):
        bench.rig.open()
        assert math.isfinite(bench.rig.measure())
        bench.rig.vent()
        bench.rig.close()
        bench.rig.close()


def test_vent_and_close_do_nothing_before_it_was_opened(bench):
    bench.rig.vent()
    bench.rig.close()


def test_it_says_what_was_forgotten_when_it_was_not_opened(bench):
    for what in (bench.rig.measure, lambda: bench.rig.write(0.0)):
        message = told(what)
        assert "before it was opened" in message
        assert bench.where in message


@pytest.mark.parametrize("command", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_no_number_goes_nowhere(bench, command):
    bench.rig.open()
    bench.rig.write(bench.command)
    assert reaches(bench.rig, bench.measured, bench.within)
    assert f"{command:g}" in told(lambda: bench.rig.write(command))
    bench.rig.wait(bench.rig.now() + 0.1)
    assert bench.rig.measure() == pytest.approx(bench.measured, abs=bench.within)


def test_its_clock_never_goes_back_and_waits_as_long_as_it_is_told(bench):
    times = [bench.rig.now() for _ in range(1000)]
    assert times == sorted(times)
    until = times[-1] + 0.01
    bench.rig.wait(until)
    assert until <= bench.rig.now()
    bench.rig.wait(until - 1.0)  # over: at once
    assert bench.rig.now() < until + 0.5


def test_units_are_such_as_pint_reads(bench):
    import pint

    units = pint.UnitRegistry()
    for unit in (bench.rig.command_unit, bench.rig.measured_unit):
        assert units(unit).to_base_units().magnitude == 1.0


@pytest.mark.parametrize("name", [name for name, kind in RIGS.items() if kind.absent])
def test_a_device_that_is_not_there_is_told_and_can_be_vented_and_closed(name):
    absent = RIGS[name].absent
    assert absent is not None
    rig = absent()
    message = told(rig.open)
    assert "Look" in message
    assert "Dev1" in message or NOWHERE in message
    for _ in range(2):
        rig.vent()
        rig.close()


@pytest.mark.parametrize(("name", "fault"), FAULTY)
def test_a_faulty_device_is_told_with_its_place_and_what_to_look_at(name, fault):
    """By reading and writing; venting is tried, and nothing but RigError comes out of anything."""
    with RIGS[name].bench() as bench:
        bench.rig.open()
        RIGS[name].faults[fault](bench.device)
        for what in (bench.rig.measure, lambda: bench.rig.write(bench.command)):
            message = told(what)
            assert bench.where in message
            assert "Look" in message or "Remove" in message
            assert "\n" not in message
        told(bench.rig.vent)
        told(bench.rig.close)
        told(bench.rig.close)


@pytest.mark.parametrize(("name", "fault"), FAULTY)
def test_a_device_that_is_faulty_from_the_start_does_not_open(name, fault):
    with RIGS[name].bench() as bench:
        RIGS[name].faults[fault](bench.device)
        message = told(bench.rig.open)
        assert bench.where in message
        told(bench.rig.vent)
        told(bench.rig.close)
