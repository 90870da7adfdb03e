"""What every rig keeps to, whatever moves behind it."""

import math
from collections.abc import Callable

import pytest

from nectosome.io.discovery import classes_below
from nectosome.rigs import Devices, Rig, RigError
from nectosome.units import unit_to_si

from .benches import DRIVEN, NOWHERE, RIGS, Bench, ever_powered, powered

FAULTY = [(name, fault) for name, kind in RIGS.items() for fault in kind.faults]


@pytest.fixture(params=RIGS)
def bench(request):
    with RIGS[request.param].bench() as bench:
        yield bench
        bench.rig.close()


@pytest.fixture(params=DRIVEN)
def driven(request):
    """Those with commands."""
    with RIGS[request.param].bench() as bench:
        yield bench
        bench.rig.close()


def near(bench: Bench, values: tuple[float, ...]) -> bool:
    triples = zip(bench.rig.measure(), values, bench.within, strict=True)
    return all(abs(measured - value) < within for measured, value, within in triples)


def reaches(bench: Bench, values: tuple[float, ...], seconds: float = 1.0) -> bool:
    """Measures values within some time."""
    limit = bench.rig.now() + seconds
    while bench.rig.now() < limit:
        if near(bench, values):
            return True
        bench.rig.wait(bench.rig.now() + 0.005)
    return False


def told(what: Callable[[], object]) -> str:
    """The message of what goes wrong; nothing where all goes well. Any other error is one of the test."""
    try:
        what()
    except RigError as error:
        return str(error)
    return ""


def test_each_device_of_rig_files_has_an_example():
    tried = set[type]()
    for kind in RIGS.values():
        with kind.bench() as one:
            tried |= {type(rig) for rig in (one.rig.devices.values() if isinstance(one.rig, Devices) else [one.rig])}
    assert {cls for cls in classes_below(Rig) if "described_by" in cls.__dict__} <= tried


def test_it_opens_at_commands_of_0(bench):
    bench.rig.open()
    assert reaches(bench, bench.rest)


def test_commands_move_it_to_where_they_lead(driven):
    driven.rig.open()
    driven.rig.write(driven.commands)
    assert driven.rig.commanded
    assert reaches(driven, driven.measured)
    driven.rig.write([0.0] * len(driven.commands))
    assert reaches(driven, driven.rest)


@pytest.mark.parametrize("driven", ["ni, several", "dynamixel, two"], indirect=True)
def test_each_command_has_its_own_place(driven):
    """With one command after the other there is another measurement."""
    driven.rig.open()
    for k, command in enumerate(driven.commands):
        driven.rig.write([command if j == k else 0.0 for j in range(len(driven.commands))])
        driven.rig.wait(driven.rig.now() + 0.3)
    assert not near(driven, driven.measured)
    driven.rig.write(driven.commands)
    assert reaches(driven, driven.measured)


def test_it_measures_without_moving_anything_when_it_is_only_connected(bench):
    bench.rig.connect()
    before = [bench.rig.measure() for _ in range(3)][-1]
    assert len(before) == len(bench.rig.measurements)
    assert all(map(math.isfinite, before))
    bench.rig.wait(bench.rig.now() + 0.1)
    assert near(bench, before)
    if bench.commands:
        assert "before it was opened" in told(lambda: bench.rig.write([0.0] * len(bench.commands)))
    assert not ever_powered(bench.device)
    bench.rig.close()
    bench.rig.open()
    assert reaches(bench, bench.rest)


def test_a_vented_rig_takes_no_more_power(driven):
    """Whatever it was doing; and again."""
    driven.rig.open()
    driven.rig.write(driven.commands)
    driven.rig.vent()
    driven.rig.vent()
    assert not powered(driven.device)


def test_it_may_be_closed_twice_and_opened_again(bench):
    for _ in range(2):
        bench.rig.open()
        assert all(map(math.isfinite, bench.rig.measure()))
        bench.rig.vent()
        bench.rig.close()
        bench.rig.close()


def test_vent_and_close_do_nothing_before_it_was_opened(bench):
    bench.rig.vent()
    bench.rig.close()


def test_it_says_what_was_forgotten_when_it_was_not_opened(bench):
    steps = [bench.rig.measure]
    if bench.commands:
        steps.append(lambda: bench.rig.write([0.0] * len(bench.commands)))
    for what in steps:
        message = told(what)
        assert "before it was opened" in message
        assert bench.where in message


@pytest.mark.parametrize("command", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_no_number_goes_nowhere_and_no_other_with_it(driven, command):
    driven.rig.open()
    driven.rig.write(driven.commands)
    assert reaches(driven, driven.measured)
    for k in range(len(driven.commands)):
        wrong = [command if j == k else 0.0 for j in range(len(driven.commands))]
        assert f"{command:g}" in told(lambda wrong=wrong: driven.rig.write(wrong))
    driven.rig.wait(driven.rig.now() + 0.1)
    assert near(driven, driven.measured)


def test_its_clock_never_goes_back_and_waits_as_long_as_it_is_told(bench):
    times = [bench.rig.now() for _ in range(1000)]
    assert times == sorted(times)
    until = times[-1] + 0.01
    bench.rig.wait(until)
    assert until <= bench.rig.now()
    bench.rig.wait(until - 1.0)  # over: at once
    assert bench.rig.now() < until + 0.5


def test_units_are_those_of_si(bench):
    for unit in (*bench.rig.commands.values(), *bench.rig.measurements.values()):
        assert unit_to_si(unit) == (1.0, unit)


@pytest.mark.parametrize("name", [name for name, kind in RIGS.items() if kind.absent])
def test_a_device_that_is_not_there_is_told_and_can_be_vented_and_closed(name):
    absent = RIGS[name].absent
    assert absent is not None
    rig = absent()
    message = told(rig.open)
    assert "Look" in message
    assert any(where in message for where in ("Dev1", NOWHERE, "/dev/i2c-7"))
    for _ in range(2):
        rig.vent()
        rig.close()


@pytest.mark.parametrize(("name", "fault"), FAULTY)
def test_a_faulty_device_is_told_with_its_place_and_what_to_look_at(name, fault):
    """By reading, and by writing where this has an answer; nothing but RigError comes out of anything."""
    with RIGS[name].bench() as bench:
        bench.rig.open()
        RIGS[name].faults[fault](bench.device)
        steps = [bench.rig.measure]
        if RIGS[name].answers_commands:
            steps.append(lambda: bench.rig.write(bench.commands))
        for what in steps:
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
