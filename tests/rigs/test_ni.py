"""A card by its driver: volts of outputs and inputs, the card's watchdog, and what is missing on a machine."""

import inspect
import math
import sys
import time

import nidaqmx
import nidaqmx.errors
import nidaqmx.system.watchdog
import pytest
from nidaqmx.system.watchdog import WatchdogTask

from nectosome.rigs import RigError
from nectosome.rigs.devices.ni import Input, NationalInstruments, Output, Watchdog, Wiring, per_volt
from nectosome.units import InputError

from .ni_stand_in import Card

LEFT, RIGHT = Output("Dev1/ao0", 5.0, 2e4, "Pa"), Output("Dev1/ao1", 5.0, -2e4, "Pa")
LASER = Input("Dev1/ai0", 2.5, 8e-3, "m", 0.5, 4.5)
CELL = Input("Dev1/ai3", 2.5, 46.5, "N", 0.0, 5.0)


@pytest.fixture
def card():
    return Card()


@pytest.fixture
def rig(card):
    return NationalInstruments(
        Wiring({"pressure": (LEFT, RIGHT)}, {"displacement": LASER}, Watchdog("Dev1", 0.2)), card.module()
    )


def test_chambers_that_work_against_each_other_get_opposite_pressures(card, rig):
    """A VPPI of -1 to 1 bar over 0 to 10 V gives 0.6 bar at 8 V, -0.6 bar at 2 V."""
    rig.open()
    assert card.volts == {"Dev1/ao0": 5.0, "Dev1/ao1": 5.0}
    rig.write([0.6e5])
    assert card.volts == pytest.approx({"Dev1/ao0": 8.0, "Dev1/ao1": 2.0})
    rig.vent()
    assert card.volts == {"Dev1/ao0": 5.0, "Dev1/ao1": 5.0}


@pytest.mark.parametrize(
    ("volts", "measured"), [(2.5, 0.0), (3.0, 4e-3), (0.5, -16e-3), (4.6, math.nan), (5.5, math.nan)]
)
def test_the_laser_measures_within_its_range_only(card, rig, volts, measured):
    rig.open()
    card.volts_seen = volts
    assert rig.measure() == pytest.approx((measured,), nan_ok=True)


def test_a_sensor_that_gives_no_number_has_no_measurement(card, rig):
    rig.open()
    card.volts_seen = math.nan
    assert math.isnan(*rig.measure())


def test_a_command_beyond_the_volts_moves_no_valve_and_says_how_far_one_may_go(card, rig):
    rig.open()
    with pytest.raises(RigError, match=r"Dev1/ao0: .* 11 V.* within -100000 to 100000 Pa"):
        rig.write([1.2e5])
    assert card.volts == {"Dev1/ao0": 5.0, "Dev1/ao1": 5.0}


def test_a_command_that_the_second_valve_cannot_follow_does_not_move_the_first(card):
    weak = Output("Dev1/ao1", 5.0, -2e4, "Pa", low=4.0)
    rig = NationalInstruments(Wiring({"pressure": (LEFT, weak)}, {"displacement": LASER}), card.module())
    rig.open()
    with pytest.raises(RigError, match="Dev1/ao1"):
        rig.write([0.6e5])
    assert card.volts == {"Dev1/ao0": 5.0, "Dev1/ao1": 5.0}


@pytest.mark.parametrize(("zero", "slope"), [(5.0, 0.0), (-1.0, 2e4), (math.nan, 2e4), (5.0, math.inf)])
def test_a_valve_without_a_zero_or_a_slope_is_refused(zero, slope):
    with pytest.raises(InputError, match="Dev1/ao0"):
        Output("Dev1/ao0", zero, slope, "Pa")


@pytest.mark.parametrize(
    ("zero", "slope", "low", "high"), [(2.5, 0.0, 0.0, 5.0), (math.nan, 1.0, 0.0, 5.0), (0.0, 1.0, 5.0, 5.0)]
)
def test_a_sensor_without_a_zero_a_slope_or_a_range_is_refused(zero, slope, low, high):
    with pytest.raises(InputError, match="Dev1/ai3"):
        Input("Dev1/ai3", zero, slope, "N", low, high)


def test_several_inputs_are_read_at_once_each_by_its_own_slope(card):
    """By one call of the driver, in one task. 46.5 N/V from 2.5 V: 23.25 N at 3 V, and nothing beyond 5 V."""
    backwards = Input("Dev1/ai7", 0.0, -1e5, "Pa")
    rig = NationalInstruments(
        Wiring(inputs={"thrust": CELL, "displacement": LASER, "pressure": backwards}), card.module()
    )
    card.volts_seen, card.inputs = 3.0, {"Dev1/ai3": 3.0, "Dev1/ai7": 0.25}
    rig.open()
    assert list(rig.measurements.items()) == [("thrust", "N"), ("displacement", "m"), ("pressure", "Pa")]
    card.called.clear()
    assert rig.measure() == pytest.approx((23.25, 4e-3, -2.5e4), rel=1e-12)
    assert card.called == ["Task.read"]
    card.inputs["Dev1/ai3"] = 5.01
    assert rig.measure() == pytest.approx((math.nan, 4e-3, -2.5e4), nan_ok=True)
    assert len(card.tasks) == 1
    rig.close()


def test_commands_go_to_their_own_outputs(card):
    lamp = Output("Dev1/ao2", 0.0, 0.1, "A", high=5.0)
    rig = NationalInstruments(Wiring({"pressure": (LEFT, RIGHT), "lamp": (lamp,)}), card.module())
    rig.open()
    assert (rig.commands, rig.measurements) == ({"pressure": "Pa", "lamp": "A"}, {})
    rig.write([0.6e5, 0.2])
    assert card.volts == pytest.approx({"Dev1/ao0": 8.0, "Dev1/ao1": 2.0, "Dev1/ao2": 2.0})
    with pytest.raises(RigError, match=r"Dev1/ao2: a command of 0\.6 A would be 6 V"):
        rig.write([0.2e5, 0.6])
    assert card.volts == pytest.approx({"Dev1/ao0": 8.0, "Dev1/ao1": 2.0, "Dev1/ao2": 2.0})
    rig.vent()
    assert card.volts == {"Dev1/ao0": 5.0, "Dev1/ao1": 5.0, "Dev1/ao2": 0.0}
    rig.close()


def test_to_measure_only_needs_no_task_of_an_output_and_no_watchdog(card, rig):
    rig.connect()
    assert len(card.tasks) == 1
    assert (card.volts, card.watchdog) == ({}, None)
    rig.vent()
    assert card.volts == {}


@pytest.mark.parametrize(
    ("text", "slope", "unit"),
    [
        ("0.2 bar/V", 2e4, "Pa"),
        ("46.5 N/V", 46.5, "N"),
        ("-8 mm/V", -8e-3, "m"),
        ("2 mm/mV", 2.0, "m"),
        ("0.05 N m/V", 0.05, "N m"),
        ("90 deg/V", math.pi / 2, "rad"),
        ("9.80665 m/s2/V", 9.80665, "m/s2"),
    ],
)
def test_the_unit_of_a_channel_follows_from_its_slope(text, slope, unit):
    assert per_volt(text) == (pytest.approx(slope, rel=1e-12), unit)


@pytest.mark.parametrize("text", ["46.5 N", "46.5", "46.5 N/A", "2 wombats/V", "V", "10 degC/V", "2 mV/V V"])
def test_a_slope_that_is_not_per_volt_is_refused(text):
    with pytest.raises(InputError, match=r"Something per volt is expected, as in \"0\.2 bar/V\""):
        per_volt(text)


@pytest.mark.parametrize(
    ("wiring", "words"),
    [
        ({}, "neither outputs nor inputs"),
        ({"outputs": {"pressure": ()}}, r"outputs\.pressure: there are none"),
        (
            {"outputs": {"a": (LEFT, Output("Dev1/ao1", 0.0, 1.0, "A"))}},
            r"outputs\.a\.1\.slope: .*A of Dev1/ao1, and Pa",
        ),
        ({"outputs": {"a": (LEFT,), "b": (LEFT,)}}, "Dev1/ao0 is used twice"),
        ({"inputs": {"a": LASER}, "watchdog": Watchdog("Dev1", 1.0)}, "watchdog: there are no outputs"),
    ],
)
def test_a_wiring_that_makes_no_sense_is_refused(wiring, words):
    with pytest.raises(InputError, match=words):
        Wiring(**wiring)


def test_without_commands_the_watchdog_takes_the_valves_to_0_and_the_next_command_says_so(card, rig):
    rig.open()
    for _ in range(4):  # longer than the watchdog waits
        rig.write([0.6e5])
        time.sleep(0.06)
    assert not card.watchdog.expired
    time.sleep(0.21)
    assert card.watchdog.expired
    assert card.volts == {"Dev1/ao0": 5.0, "Dev1/ao1": 5.0}
    with pytest.raises(RigError, match=r"watchdog of Dev1: .* none came for 0\.2 s"):
        rig.write([0.6e5])
    rig.vent()  # says nothing: the valves stand at 0


def test_outputs_that_the_watchdog_of_a_killed_run_has_locked_open_again(card, rig):
    rig.open()
    rig.write([0.6e5])
    time.sleep(0.21)
    assert card.watchdog.expired
    again = NationalInstruments(rig.wiring, card.module())
    again.open()
    again.write([0.2e5])
    assert card.volts["Dev1/ao0"] == pytest.approx(6.0)


def test_venting_tries_every_valve_and_tells_of_all_that_fail(card, rig, monkeypatch):
    rig.open()
    rig.write([0.6e5])
    left = card.tasks[1]
    monkeypatch.setattr(left, "write", lambda volts: (_ for _ in ()).throw(nidaqmx.errors.DaqError("broken", -1)))
    with pytest.raises(RigError, match=r"^Dev1/ao0: broken"):
        rig.vent()
    assert card.volts == pytest.approx({"Dev1/ao0": 8.0, "Dev1/ao1": 5.0})
    card.unplugged = True
    with pytest.raises(RigError, match=r"Dev1/ao0: .*Dev1/ao1: "):
        rig.vent()


def test_all_tasks_are_closed_even_if_one_of_them_cannot(card, rig, monkeypatch):
    """Each once: the library warns of tasks that are closed twice, and of those that never are."""
    rig.open()
    first = card.tasks[0]
    monkeypatch.setattr(first, "close", lambda: (_ for _ in ()).throw(nidaqmx.errors.DaqError("broken", -1)))
    with pytest.raises(RigError, match="broken"):
        rig.close()
    rig.close()
    assert [task.closed for task in card.tasks] == [False, True, True, True]


@pytest.mark.parametrize("call", ["Task.start", "AIChannelCollection.add_ai_voltage_chan", "WatchdogTask.start"])
def test_what_fails_while_it_opens_leaves_nothing_open(card, rig, call):
    card.fails.add(call)
    with pytest.raises(RigError, match=r"Dev1.*Look in NI MAX"):
        rig.open()
    rig.vent()
    rig.close()
    assert all(task.closed for task in card.tasks)


def test_a_device_that_has_no_watchdog_is_told_so(card, rig):
    card.fails.add("WatchdogTask.start")
    with pytest.raises(RigError, match="leave the watchdog out"):
        rig.open()


def test_a_machine_without_the_library_is_told_which_extra_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "nidaqmx", None)
    with pytest.raises(RigError, match=r"nidaqmx is missing: pip install 'nectosome\[rig\]'"):
        NationalInstruments(Wiring({"pressure": (LEFT,)}, {"displacement": LASER})).open()


@pytest.mark.parametrize("error", [nidaqmx.errors.DaqNotFoundError, nidaqmx.errors.DaqNotSupportedError])
@pytest.mark.parametrize("watchdog", [None, Watchdog("Dev1", 1.0)])
def test_a_machine_without_the_driver_is_told_where_it_comes_from(monkeypatch, error, watchdog):
    """The library itself, whose tasks raise this where there is no driver."""

    def missing(*_):
        raise error("Could not find an installation of NI-DAQmx.")

    monkeypatch.setattr("nidaqmx.utils._select_interpreter", missing)
    rig = NationalInstruments(Wiring({"pressure": (LEFT,)}, {"displacement": LASER}, watchdog))
    with pytest.raises(RigError, match=r"Dev1.*driver .*installdriver"):
        rig.open()
    rig.vent()
    rig.close()


def test_the_stand_in_refuses_calls_that_the_library_would_refuse(card):
    task = card.module().Task()
    for wrong in (
        lambda: task.read(samples=1),
        lambda: task.write(),
        lambda: task.ao_channels.add_ao_voltage_chan("Dev1/ao0", minimum=0.0),
        lambda: task.ai_channels.add_ai_voltage_chan(),
        lambda: card.module().system.watchdog.WatchdogTask("Dev1", seconds=1.0),
    ):
        with pytest.raises(TypeError):
            wrong()


def test_the_library_has_the_properties_that_the_rig_uses():
    """Of what is no call, and so not compared by the stand-in."""
    assert all(isinstance(inspect.getattr_static(nidaqmx.Task, x), property) for x in ("ao_channels", "ai_channels"))
    assert isinstance(inspect.getattr_static(WatchdogTask, "expired"), property)
    assert nidaqmx.system.watchdog.WatchdogTask is WatchdogTask
