"""`control rig` where a rig cannot be opened: one sentence, exit code 2, no file, and no alarm without a command."""

import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import nidaqmx.errors
import pytest
import serial
from tests.rigs.injected import throws
from tests.rigs.motor_emulator import Microcontroller
from tests.rigs.ni_stand_in import Card
from tests.rigs.printing_board import PrintingStandIn
from tests.rigs.servo_emulator import Emulator

from nectosome.io.schema.described import kinds_of
from nectosome.rigs.device_files import DeviceDescription

from .answers import check_wrong

RIGS = Path(__file__).parents[2] / "examples" / "rigs"
FILES = {
    "ni": ("fishtail_ni.yaml", "2mm", "nidaqmx"),
    "dynamixel": ("servo_dynamixel.yaml", "10deg", "dynamixel_sdk"),
    "serial": ("motor_serial.yaml", "60rpm", "serial"),
    "serial_text": ("fin_arduino.yaml", "1N", "serial"),
}
DENIED = serial.SerialException(13, "could not open port: [Errno 13] Permission denied")


def silent(stand_in: Any) -> Any:
    stand_in.silent_from = 0.0
    return stand_in


def on_a_card(fault: Callable[[Card], object]) -> Callable[[pytest.MonkeyPatch], object]:
    """A stand-in for a card with a fault, in place of the library."""

    def made(monkeypatch: pytest.MonkeyPatch) -> object:
        card = Card()
        fault(card)
        monkeypatch.setitem(sys.modules, "nidaqmx", card.module())
        return nullcontext()

    return made


def without_driver(monkeypatch: pytest.MonkeyPatch) -> object:
    error = nidaqmx.errors.DaqNotFoundError("Could not find an installation of NI-DAQmx.")
    monkeypatch.setattr("nidaqmx.utils._select_interpreter", throws(error))
    return nullcontext()


def without_rights(monkeypatch: pytest.MonkeyPatch) -> object:
    monkeypatch.setattr("serial.Serial.open", throws(DENIED))
    return nullcontext()


FAULTS = {
    ("ni", "no driver"): (without_driver, "driver does not work on this machine"),
    ("ni", "no card"): (on_a_card(lambda card: setattr(card, "unplugged", True)), "Look in NI MAX"),
    ("ni", "no channel"): (
        on_a_card(lambda card: card.fails.add("AOChannelCollection.add_ao_voltage_chan")),
        "Look in NI MAX",
    ),
    ("ni", "in use"): (on_a_card(lambda card: card.fails.add("Task.start")), "another program"),
    ("dynamixel", "no port"): (lambda _: nullcontext(), "Look at the port's name"),
    ("dynamixel", "no rights"): (without_rights, "dialout"),
    ("dynamixel", "no answer"): (lambda _: silent(Emulator()), "Look at its power"),
    ("serial", "no port"): (lambda _: nullcontext(), "Look at the port's name"),
    ("serial", "no rights"): (without_rights, "dialout"),
    ("serial", "no answer"): (lambda _: silent(Microcontroller()), "Look at its power"),
    ("serial_text", "no port"): (lambda _: nullcontext(), "Look at the port's name"),
    ("serial_text", "no rights"): (without_rights, "dialout"),
    ("serial_text", "no lines"): (lambda _: silent(PrintingStandIn()), "Look at its power"),
}


def test_every_kind_of_device_is_here():
    """Sensors cannot be controlled; `test_contract` opens all that are not there."""
    sensors = {"imu", "serial_imu"}
    assert {*FILES} == {kind for kind, _ in FAULTS} == {*kinds_of(DeviceDescription)} - {"simulated", "robot"} - sensors


@pytest.fixture
def refused(nectosome, tmp_path):
    """Run a rig, with a log and a page, that cannot be opened; return what is said."""

    def run(kind: str, port: str = "/dev/none") -> str:
        file, reference, _ = FILES[kind]
        text = (RIGS / file).read_text()
        for name in ("/dev/ttyUSB0", "/dev/ttyACM0"):
            text = text.replace(name, port)
        (tmp_path / "rig.yaml").write_text(text)
        (tmp_path / "there.nc").write_bytes(b"measured before")
        argv = ("control", "rig", "--config", "rig.yaml", "--reference", reference, "--time", "1s")
        argv += ("--gains", "0.005,0.8,0")
        saves = (("--save", "new.nc"), ("--save", "new.csv"), ("--save", "there.nc", "--force"), ())
        check_wrong(nectosome, [(*argv, *save, "--plot", "new.html") for save in saves], tmp_path)
        return nectosome(*argv).err

    return run


@pytest.mark.parametrize(("kind", "fault"), FAULTS)
def test_a_rig_that_cannot_be_opened_is_no_alarm(refused, monkeypatch, kind, fault):
    device, words = FAULTS[kind, fault]
    with device(monkeypatch) as opened:
        said = refused(kind, getattr(opened, "path", "/dev/none"))
    assert words in said and said.endswith("No command was sent.\n")
    assert "HAND" not in said and "vented" not in said


@pytest.mark.parametrize("kind", FILES)
def test_a_package_that_is_missing_is_named_with_its_extra(refused, monkeypatch, kind):
    package = FILES[kind][2]
    for name in [name for name in sys.modules if name.split(".")[0] == package]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, package, None)
    said = f"the package {package} is missing: pip install 'nectosome[rig]'. No command was sent.\n"
    assert refused(kind) == said


def test_a_command_that_was_sent_is_an_alarm_while_the_rig_opens_too(nectosome, tmp_path, monkeypatch):
    """The valves have got their command of 0 when the input fails, and then the whole card."""
    card = Card()
    monkeypatch.setitem(sys.modules, "nidaqmx", card.module())
    fails = card.may_fail

    def unplugged_at_the_input(call: str) -> None:
        card.unplugged |= call == "AIChannelCollection.add_ai_voltage_chan"
        fails(call)

    monkeypatch.setattr(card, "may_fail", unplugged_at_the_input)
    options = ("--reference", "2mm", "--time", "1s", "--gains", "0.005,0.8,0", "--save", "run.nc")
    answer = nectosome("control", "rig", "--config", str(RIGS / "fishtail_ni.yaml"), *options)
    assert answer.code == 1
    assert "TAKE ITS POWER OUT BY HAND" in answer.err
    assert (tmp_path / "run.nc").exists()
