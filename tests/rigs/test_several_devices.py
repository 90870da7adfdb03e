"""Several devices as one rig, in open and in closed loops."""

import json

import numpy as np
import pytest

from nectosome.controllers import Controller
from nectosome.io import load_dataset
from nectosome.rigs import (
    CommandLimits,
    Devices,
    Experiment,
    Limits,
    Loop,
    MeasurementLimits,
    Pair,
    Played,
    Rig,
    RigError,
    SimulatedRig,
    Tracked,
)
from nectosome.units import InputError

from .faulty import DT, SLEW, Faulty, pi, plant, sensor, sine

COUNT = 100


def tail(noise: float = 2e-5, faults=None) -> Faulty:
    return Faulty(SimulatedRig(plant(), sensor(noise), dt=2e-3), faults)


class Servo(Rig):
    """Goes where it is told, unless it is blocked: command and measurement have one name."""

    name, commands, measurements = "servo", {"angle": "rad"}, {"angle": "rad"}
    angle, blocked, clock, powered = 0.0, False, 0.0, False

    def open(self):
        self.angle, self.powered = 0.0, True

    def connect(self):
        pass

    def measure(self):
        return (self.angle + 1e-9 * np.random.default_rng(int(1e6 * self.clock)).normal(),)

    def write(self, commands):
        if not self.blocked:
            (self.angle,) = commands

    def vent(self):
        self.powered = False

    def close(self):
        pass

    def now(self):
        return self.clock

    def wait(self, until):
        self.clock = max(self.clock, until)


def limits(*names: str, **others) -> Limits:
    measured = MeasurementLimits(-0.015, 0.015, error=3e-3, error_time=0.2)
    return Limits(
        {f"{name}.pressure": CommandLimits(-6e4, 6e4, SLEW) for name in names},
        {f"{name}.displacement": measured for name in names},
        **others,
    )


def test_channels_have_the_names_of_their_devices():
    rig = Devices({"left": tail(), "right": tail(), "servo": Servo()})
    assert [*rig.commands] == ["left.pressure", "right.pressure", "servo.angle"]
    assert rig.measurements == {"left.displacement": "m", "right.displacement": "m", "servo.angle": "rad"}
    rig.open()
    rig.write((1e4, -2e4, 0.3))
    rig.wait(1.0)
    left, right, angle = rig.measure()
    assert (left, right, angle) == pytest.approx((2e-3, -4e-3, 0.3), abs=2e-4)  # 2e-7 m/Pa, with noise


def test_each_loop_of_a_rig_does_what_it_does_alone(tmp_path):
    """Two tails with two controllers, two references: to the last bit, without noise."""

    def alone(controller: Controller, reference: np.ndarray, name: str):
        rig = Devices({"one": tail(0.0)})
        law = Tracked(rig, {"one.pressure": Loop("one.displacement", controller, reference)}, DT)
        return Experiment(rig, law, limits("one"), DT).run(tmp_path / name).data

    laws = {"left": (pi(), sine(COUNT)), "right": (pi(2e6, 6e7), -0.5 * sine(COUNT))}
    rig = Devices({name: tail(0.0) for name in laws})
    loops = {f"{name}.pressure": Loop(f"{name}.displacement", *law) for name, law in laws.items()}
    run = Experiment(rig, Tracked(rig, loops, DT), limits(*laws), DT).run(tmp_path / "both.nc")
    assert run.status == "finished", run.reason
    assert json.loads(run.data.attrs["loops"]) == {f"{x}.pressure": f"{x}.displacement" for x in laws}
    for name, law in laws.items():
        one = alone(*law, f"{name}.nc")
        for column in ("displacement", "pressure.command", "displacement.reference"):
            assert np.array_equal(run.data[f"{name}.{column}"], one[f"one.{column}"])


def test_signals_are_played_to_their_commands_and_the_others_stay_0(tmp_path):
    """Every channel is in the log, guarded or not; what is written is what was played."""
    rig = Devices({"left": tail(), "right": tail(), "servo": Servo()})
    wanted = {"left.pressure": 2e4 * np.sin(np.arange(COUNT) * DT), "servo.angle": np.linspace(0.0, 0.4, COUNT)}
    allowed = Limits(limits("left", "right").commands | {"servo.angle": CommandLimits(-1.0, 1.0, 2.0)}, {})
    run = Experiment(rig, Played(rig, wanted), allowed, DT, "ramp").run(tmp_path / "run.nc")
    assert run.status == "finished"
    logged = load_dataset(run.path)
    assert [*logged] == [
        "left.displacement", "right.displacement", "servo.angle",
        "left.pressure.command", "right.pressure.command", "servo.angle.command", "late",
    ]  # fmt: skip
    assert logged["servo.angle.command"].attrs["units"] == "rad"
    for name, signal in wanted.items():
        assert np.allclose(logged[f"{name}.command"], signal, rtol=0, atol=1e-12 * np.abs(signal).max())
    assert not logged["right.pressure.command"].values.any()
    assert np.allclose(logged["servo.angle"][1:], wanted["servo.angle"][:-1], rtol=0, atol=1e-8)
    assert logged.attrs["clamped"] == logged.attrs["slowed"] == 0


def test_a_servo_that_is_blocked_is_found_though_nothing_is_controlled(tmp_path):
    """Its command is the reference of its angle."""
    servo = Servo()
    servo.blocked = True
    rig = Devices({"servo": servo})
    bounds = Limits({"servo.angle": CommandLimits(-1, 1, 2.0)}, {"servo.angle": MeasurementLimits(-2, 2, error=0.1)})
    run = Experiment(rig, Played(rig, {"servo.angle": np.linspace(0.0, 1.0, 200)}), bounds, DT).run(tmp_path / "a.nc")
    assert run.status == "aborted"
    assert "the error of servo.angle" in run.reason and "may be blocked" in run.reason
    assert run.data.sizes["time"] == pytest.approx(20 + 50, abs=3)  # 0.1 rad at 0.5 rad/s, and half a second
    assert not servo.powered


def test_a_command_may_be_played_at_the_end_of_its_range(tmp_path):
    """For longer than a controller may leave it there."""
    rig = Devices({"tail": tail()})
    allowed = limits("tail", saturated_time=0.1)
    allowed = Limits(allowed.commands, {"tail.displacement": MeasurementLimits(-0.015, 0.015)}, saturated_time=0.1)
    step = np.minimum(np.arange(COUNT) * DT * SLEW, 6e4)
    run = Experiment(rig, Played(rig, {"tail.pressure": step}), allowed, DT).run(tmp_path / "run.nc")
    assert run.status == "finished"
    assert run.data["tail.displacement"][-1] == pytest.approx(0.012, abs=1e-4)


@pytest.mark.parametrize("method", ["vent", "close"])
@pytest.mark.parametrize("error", [RigError("left: no answer."), ValueError("a bug")])
def test_no_fault_of_one_leaves_the_others_with_power(method, error):
    def fails(*_):
        raise error

    left, right = tail(faults={method: fails}), tail()
    rig = Devices({"left": left, "right": right})
    rig.open()
    with pytest.raises(type(error), match=str(error)):
        getattr(rig, method)()
    assert right.seen[-1].what == method


def test_all_faults_are_told_at_once():
    def fails(n, call):
        raise RigError("no answer.")

    rig = Devices({name: tail(faults={"vent": fails}) for name in ("left", "right")})
    with pytest.raises(RigError, match=r"no answer\. no answer\."):
        rig.vent()


def test_what_comes_after_a_device_that_does_not_open_is_not_opened():
    def fails(n, call):
        raise RigError("left: not there.")

    right = tail()
    with pytest.raises(RigError, match="not there"):
        Devices({"left": tail(faults={"open": fails}), "right": right}).open()
    assert not right.seen


@pytest.mark.parametrize(
    ("allowed", "words"),
    [
        (limits("left"), r"commands.right.pressure: is missing"),
        (limits("left", "right", "middle"), r"commands.middle.pressure: there is no command of this name"),
        (
            Limits(limits("left", "right").commands, {"left.displacment": MeasurementLimits(-1, 1)}),
            r"measurements.left.displacment: .*left.displacement",
        ),
        (
            Limits(limits("left", "right").commands, {"left.displacement": MeasurementLimits(-1, 1, follows="x")}),
            r'left.displacement.follows: "x" is no command of this rig',
        ),
        (
            Limits(limits("left", "right").commands, {"left.displacement": MeasurementLimits(-1, 1)}),
            r"left.displacement.error: is missing",
        ),
    ],
)
def test_limits_that_do_not_fit_the_rig_are_refused(allowed, words):
    rig = Devices({"left": tail(), "right": tail()})
    law = Tracked(rig, {"left.pressure": Loop("left.displacement", pi(), sine(5))}, DT)
    with pytest.raises(InputError, match=words):
        Experiment(rig, law, allowed, DT)


@pytest.mark.parametrize(
    ("signals", "words"),
    [
        ({"left.presure": np.zeros(3)}, '"left.presure" is no command of this rig: left.pressure, right.pressure'),
        ({"left.pressure": np.zeros(3), "right.pressure": np.zeros(4)}, "one length"),
        ({}, "one length"),
        ({"left.pressure": np.zeros(0)}, "one length"),
        ({"left.pressure": np.array([0.0, np.nan])}, "left.pressure: has samples"),
    ],
)
def test_signals_that_cannot_be_played_are_refused(signals, words):
    with pytest.raises(InputError, match=words):
        Played(Devices({"left": tail(), "right": tail()}), signals)


def test_a_command_is_asked_for_where_there_are_several():
    rig = Devices({"left": tail(), "right": tail()})
    assert Pair.of(rig, "left.pressure", "right.displacement") == ("left.pressure", "right.displacement")
    with pytest.raises(InputError, match=r"several commands: left\.pressure, right\.pressure"):
        Pair.of(rig)
    with pytest.raises(InputError, match=r"did you mean|left\.pressure"):
        Pair.of(rig, "left.presure", "left.displacement")
    with pytest.raises(InputError, match="measurement"):
        Pair.of(rig, "left.pressure")


def test_only_the_command_that_it_follows_makes_a_reading_frozen(tmp_path):
    """A sensor of the left tail stays the same while only the right one moves: that is what it should do."""
    still = tail(faults={"measure": lambda n, call: (0.001,)})
    follows = {"right": "left.pressure", "left": "left.pressure", "none": "none"}
    for moves, status in (("right", "finished"), ("left", "aborted"), ("none", "finished")):
        rig = Devices({"left": still, "right": tail()})
        allowed = Limits(
            limits("left", "right").commands,
            {"left.displacement": MeasurementLimits(-1, 1, follows=follows[moves])},
            frozen_time=0.1,
        )
        name = "left" if moves == "none" else moves
        law = Played(rig, {f"{name}.pressure": 3e4 * np.sin(2 * np.pi * np.arange(COUNT) * DT)})
        assert Experiment(rig, law, allowed, DT).run(tmp_path / f"{moves}.nc").status == status
