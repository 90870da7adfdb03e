"""Lines of text that a board prints are measurements, and commands are lines of text: none is invented or repeated."""

import io
import math
import re
import sys
import time

import numpy as np
import pytest

from nectosome.cli import main
from nectosome.io import load_dataset
from nectosome.rigs import Experiment, Played, RigError
from nectosome.rigs.devices.serial_text import PrintedNumber, PrintingBoard, SerialText
from nectosome.rigs.devices.text_scale import TextScale, command_text
from nectosome.rigs.rig_file import load_rig
from nectosome.units import InputError

from .printing_board import MIDDLE, REST, PrintingStandIn

RIG = """\
dt: 25 ms
devices:
  bench: # an Arduino
    kind: serial_text
    port: PORT
    separator: ","
    clock: 1
    timeout: 0.8 s
    start: 2 s
    inputs:
      force: {column: 2, zero: 80000 counts, slope: 2 uN/count, low: -8388607 counts, high: 8388606 counts} # 5 kg
    outputs:
      fin: {write: "A{:.1f}", unit: deg, zero: 90 deg, low: 0 deg, high: 180 deg}
commands:
  bench.fin: {low: -90 deg, high: 90 deg, slew: 2000 deg/s}
measurements:
  bench.force: {least: -5 N, most: 5 N}
"""
ON_FORCE = ("--config", "rig.yaml", "--channel", "bench.force", "--time", "0.5s", "--apply")


@pytest.fixture
def board():
    with PrintingStandIn() as board:
        yield board


@pytest.fixture
def quiet(board):
    """It prints only what is `said`."""
    board.quiet = True
    return board


@pytest.fixture
def file(board, tmp_path, monkeypatch):
    """The rig file of the board, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.yaml").write_text(RIG.replace("PORT", board.path))
    return tmp_path / "rig.yaml"


@pytest.fixture
def opened(board):
    """Boards that are opened, closed at the end: settings, and a first line where it prints none by itself."""
    rigs = []

    def connect(first: bytes = b"", **settings) -> SerialText:
        settings = {"timeout": 0.6, "start": 2.0, "separator": ",", "inputs": number_of(2)} | settings
        rigs.append(SerialText(PrintingBoard(board.path, **settings)))
        own = board.printed
        if first:
            board.printed = lambda: first + own()  # until it is connected
        rigs[-1].connect()
        if first:
            board.printed = own
            time.sleep(0.05)
            rigs[-1]._port.reset_input_buffer()
        return rigs[-1]

    yield connect
    for rig in rigs:
        rig.close()


def number_of(column: int) -> dict[str, PrintedNumber]:
    return {"x": PrintedNumber(column, TextScale(1.0, ""))}


def say(board: PrintingStandIn, *texts: str) -> None:
    """Print them at once, and wait until they are there."""
    board.said.append("".join(texts).encode())
    board.catch_up()


def test_counts_are_a_force_by_zero_and_slope(board, file):
    """12500 counts above the zero, of 2 uN each, are 25 mN."""
    board.load = 12_500
    rig = load_rig(file).rig
    assert (rig.commands, rig.measurements) == ({"bench.fin": "rad"}, {"bench.force": "N"})
    rig.connect()
    assert rig.measure() == (pytest.approx(0.025, rel=1e-12),)
    rig.close()


@pytest.mark.parametrize(
    ("column", "printed", "expected"),
    [
        ("{column: 3, unit: deg}", "1 F: 30 x", math.pi / 6),
        ("{column: 3, unit: deg, zero: 10 deg}", "1 F: 40 x", math.pi / 6),
        ("{column: 3, unit: mm, zero: 2 mm, low: 0 mm, high: 50 mm}", "1  F:\t50.0 x", 0.048),
        ("{column: 3, unit: mm, high: 50 mm}", "1 F: 50.1 x", math.nan),
        ("{column: 3, unit: °C}", "1 F: 20 x", 293.15),
        ("{column: 3, unit: °C, zero: 0.5 K}", "1 F: 20 x", 292.65),
        ('{column: 3, unit: "1"}', "1 F: -2.5e3 x", -2500.0),
        ("{column: 3, slope: -3 mN/count, zero: 100 counts}", "1 F: 50 x", 0.15),
        ("{column: 3, slope: 1 mN/count, low: -8388607 counts}", "1 F: -8388608 x", math.nan),
        ("{column: 3, slope: 1 mN/count, high: 8388606 counts}", "1 F: 8388607 x", math.nan),
        ("{column: 3, unit: N}", "1 F: nan x", math.nan),
        ("{column: 3, unit: N}", "1 F: ovf x", math.nan),
        ("{column: 3, unit: N}", "1 F: inf x", math.nan),
    ],
)
def test_a_number_is_a_quantity_in_its_unit_within_its_range(tmp_path, column, printed, expected):
    """By hand; beyond low and high a sensor sees nothing. Other words of the line are for nobody."""
    path = tmp_path / "rig.yaml"
    path.write_text(f"dt: 1 s\ndevices: {{b: {{kind: serial_text, port: p, columns: 4, inputs: {{x: {column}}}}}}}\n")
    device = load_rig(path).rig.devices["b"]
    assert isinstance(device, SerialText)
    numbers = device._numbers(printed)
    assert numbers is not None
    measured = device.board.inputs["x"].scale.quantity(numbers["x"])
    assert measured == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_what_a_board_says_when_it_starts_is_skipped(board, opened):
    """It is reset when its port is opened: the end of an old line, a boot text, an empty line, then numbers."""
    board.quiet = True
    board.said.append(b"630,812")
    rig = SerialText(PrintingBoard(board.path, number_of(2), separator=",", start=2.0, clock=1))
    starts = time.monotonic() + 0.4

    def boots() -> bytes:
        if board.quiet and time.monotonic() > starts:
            board.quiet = False
            board.restart()
            return b"ets Jan  8 2013\r\nHX711 ready, 80 Hz\r\n\r\n"
        return own()

    board.printed, own = boots, board.printed
    rig.connect()
    assert not board.quiet
    assert rig.measure() == (REST,)
    assert rig.remarks() == []
    rig.close()


def test_cut_lines_are_skipped_counted_and_told(board, opened):
    rig = opened()
    for text in ("8630,\n", "464\n", "1,2,3\n", "1,8x\n", "1,8_0\n", "\xff\xfe\n"):
        say(board, text)
        assert rig.measure() == (REST,)
    assert rig.skipped == 6
    (told,) = rig.remarks()
    assert re.search(rf"{board.path}: 6 of \d+ lines skipped, the last one '.*ufffd'\. Look at the cable", told)


def test_a_run_keeps_what_was_skipped_in_its_log_and_ends_at_the_safe_angle(board, file, tmp_path):
    """20 deg up to the end: the text is in degrees from 0 to 180, and the last one is that of a command of 0."""
    loaded = load_rig(file)
    signal = np.radians(np.minimum(np.arange(20) * 5.0, 20.0))
    board.said.append(b"1,2,3\n")
    experiment = Experiment(
        loaded.rig, Played(loaded.rig, {"bench.fin": signal}), loaded.limits, loaded.dt, attributes={"run": "one"}
    )
    cut = iter([b"1,2,3\n"])
    board.printed, own = lambda: (next(cut, b"") if board.driven else b"") + own(), board.printed
    run = experiment.run(tmp_path / "run.nc")
    assert run.status == "finished", run.reason
    assert re.search(r"1 of \d+ lines skipped, the last one '1,2,3'", load_dataset(run.path).attrs["remarks"])
    board.catch_up()
    assert {"A95.0", "A110.0"} <= {*board.got}
    assert board.got[0] == board.got[-1] == "A90.0"
    assert not board.driven
    assert run.data["bench.force"][-1] == pytest.approx(20e3 * 2e-6)


@pytest.mark.parametrize("ends", ["silent", "restarted"])
def test_a_run_that_fails_ends_at_the_safe_angle(board, file, tmp_path, ends):
    loaded = load_rig(file)
    law = Played(loaded.rig, {"bench.fin": np.full(200, 0.2)})

    def fails(share: float) -> None:
        if share > 0.1:
            board.quiet = ends == "silent"
            if ends == "restarted":
                board.restart()

    run = Experiment(loaded.rig, law, loaded.limits, loaded.dt).run(tmp_path / "run.nc", fails)
    assert run.status == "failed"
    assert {"silent": "no new line", "restarted": "it has restarted"}[ends] in run.reason
    board.catch_up()
    assert (board.angle, board.got[-1]) == (MIDDLE, "A90.0")


def test_silence_is_an_error_in_the_time_that_is_given(board, opened):
    rig = opened(timeout=0.4)
    time.sleep(0.05)
    board.quiet = True
    time.sleep(0.05)
    rig.measure()
    begin = time.monotonic()
    with pytest.raises(RigError, match=r"no new line with 2 columns in 0\.4 s\. Look at its power, the cable"):
        rig.measure()
    assert 0.4 <= time.monotonic() - begin < 1.2


@pytest.mark.parametrize(
    ("said", "settings", "words"),
    [
        (b"\x86\xf8\x80\x8a\n\x86\xf8", {}, r"but '\\ufffd.*Look at the baud rate \(115200 expected\) and the cable"),
        (b"8630,81234,17\n", {}, r"but '8630,81234,17', which has 3 columns. Look at separator and columns in the rig"),
        (b"8630 81234\n", {}, "which has 1 column. Look at separator"),
        (b"force,N\n", {}, "which has a word that is no number"),
        (b"8630,81234\n", {"separator": None, "inputs": number_of(1)}, "which has a word that is no number"),
    ],
)
def test_what_comes_instead_is_told_with_what_to_look_at(quiet, opened, said, settings, words):
    quiet.printed = lambda: said
    with pytest.raises(RigError, match=f"{quiet.path}: no new line with .* in 0.3 s, .*{words}") as told:
        opened(start=0.3, **settings)
    assert "\n" not in str(told.value)


def test_the_newest_line_counts_and_none_is_read_twice(quiet, opened):
    rig = opened(b"0,0\n")
    say(quiet, "1,100\n2,200\n3,300\n4,4")
    assert rig.measure() == (300.0,)
    say(quiet, "00\n")
    assert rig.measure() == (400.0,)
    with pytest.raises(RigError, match="no new line"):
        rig.measure()


def test_lines_that_wait_since_before_a_pause_are_old(quiet, opened):
    """The host was busy for longer than the timeout: the board may be silent since."""
    rig = opened(b"0,0\n", timeout=0.1)
    say(quiet, "1,100\n")
    time.sleep(0.1)
    with pytest.raises(RigError, match="no new line"):
        rig.measure()


def test_lines_that_fill_the_buffer_are_old(quiet, opened):
    """A terminal keeps 4096 bytes, the first ones: the newest of these is not the newest of the board."""
    rig = opened(b"0,0\n")
    quiet.said.append(b"1,100\n" * 800)
    time.sleep(0.1)
    quiet.quiet = False
    assert rig.measure() == (REST,)


def test_a_slow_board_is_waited_for(quiet, opened):
    """25 readings a second, asked for without a pause: each sample is another line."""
    quiet.interval, quiet.quiet = 0.04, False
    rig = opened(inputs=number_of(1), columns=2)
    begin = time.monotonic()
    times = [rig.measure()[0] for _ in range(6)]
    assert (np.diff(times) > 0).all()
    assert time.monotonic() - begin > 5 * 0.04 - 0.01


def test_a_clock_that_goes_back_is_a_restart(quiet, opened):
    rig = opened(b"8000,0\n", clock=1)
    say(quiet, "8630,1\n")
    assert rig.measure() == (1.0,)
    say(quiet, "12,2\n24,3\n")
    with pytest.raises(
        RigError, match=r"it has restarted, since its clock went back from 8630 to 12\. Look at its sup"
    ):
        rig.measure()


def test_a_restart_that_prints_one_line_only_is_told_too(quiet, opened):
    rig = opened(b"8000,0\n", clock=1)
    say(quiet, "12,2\n")
    with pytest.raises(RigError, match=r"no new line .*, but '12,2', which has an earlier clock\. Look .* restarted"):
        rig.measure()


def test_a_line_without_its_beginning_is_no_restart_and_no_measurement(quiet, opened):
    rig = opened(b"8000,0\n", clock=1)
    say(quiet, "8630,1\n", "42,5\n")
    assert rig.measure() == (1.0,)
    say(quiet, "8655,2\n", "67,7\n")
    assert rig.measure() == (2.0,)
    say(quiet, "8680,3\n")
    assert rig.measure() == (3.0,)
    assert rig.skipped == 2


def test_a_clock_of_32_bits_may_begin_again(quiet, opened):
    """That of micros() does each 71.6 minutes."""
    rig = opened(b"4294960000,0\n", clock=1)
    say(quiet, "4294967290,1\n", "5204,2\n")
    assert rig.measure() == (2.0,)
    assert rig.skipped == 0


@pytest.mark.parametrize(
    ("output", "command", "sent"),
    [
        ('{write: "A{:.2f}", unit: deg}', math.radians(30), "A30.00\n"),
        ('{write: "A{:.2f}\\n", unit: deg}', math.radians(-30), "A-30.00\n"),
        ('{write: "A{:.0f}\\r\\n", unit: deg, zero: 90 deg}', math.radians(30), "A120\r\n"),
        ('{write: "P {:.0f} us", slope: 0.1 deg/count, zero: 1500 counts}', math.radians(-45), "P 1050 us\n"),
        ('{write: "L{:06.1f}", slope: -1 deg/count, zero: 90 counts}', math.radians(45), "L0045.0\n"),
        ('{write: "{:+.3f}", unit: bar}', 25e3, "+0.250\n"),
        ('{write: "T{:.1f}{{}}", unit: "1"}', 0.25, "T0.2{}\n"),
        ('{write: "A{:.0f}", unit: deg, zero: 90 deg, low: 0 deg, high: 180 deg}', math.pi / 2, "A180\n"),
    ],
)
def test_a_command_is_sent_as_text_in_the_unit_that_is_written(tmp_path, output, command, sent):
    path = tmp_path / "rig.yaml"
    unit = re.search("deg|bar", output)
    ends = f"low: -2 {unit[0]}, high: 2 {unit[0]}, slew: 1 {unit[0]}/s" if unit else "low: -2, high: 2, slew: 1 1/s"
    path.write_text(
        f"dt: 1 s\ndevices: {{b: {{kind: serial_text, port: p, inputs: {{x: {{column: 1, unit: N}}}}, outputs: "
        f"{{u: {output}}}}}}}\ncommands: {{b.u: {{{ends}}}}}\n"
    )
    device = load_rig(path).rig.devices["b"]
    assert isinstance(device, SerialText)
    assert device.board.outputs["u"].text(command).decode() == sent


def test_a_command_beyond_what_the_device_takes_is_not_sent(board, file):
    """Nor is any other one: from 0 to 180 deg around 90 deg are -90 to 90 deg."""
    rig = load_rig(file).rig
    rig.open()
    with pytest.raises(RigError, match=r"fin: a command of 91\.6732 deg would be sent as 181\.673, .* 0 to 180"):
        rig.write([1.6])
    rig.vent()
    rig.close()
    board.catch_up()
    assert {*board.got} == {"A90.0"}
    file.write_text(file.read_text().replace("high: 90 deg", "high: 91 deg"))
    with pytest.raises(InputError, match="would be sent as 181") as told:
        load_rig(file)
    assert (told.value.field, told.value.line) == ("commands.bench.fin.high", 15)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("A", "has 0 places in braces. One place"),
        ("A{:.1f}B{:.1f}", "has 2 places"),
        ("A{", "One place"),
        ("A{}", "only decimals"),
        ("A{:d}", "only decimals"),
        ("A{:g}", "only decimals"),
        ("A{angle:.1f}", "only decimals"),
        ("A{0:.1f}", "only decimals"),
        ("A{!r:.1f}", "only decimals"),
        ("A{:{}.1f}", "only decimals"),
        ("A{:.1f}\\n", "double quotes"),
        ("A{:.1f}\u00b0", "beyond ASCII"),
    ],
)
def test_a_text_without_a_place_for_a_number_is_refused(file, text, words):
    with pytest.raises(InputError, match=re.escape(words)):
        command_text(text)
    file.write_text(file.read_text().replace('"A{:.1f}"', f"'{text}'"), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(words)) as told:
        load_rig(file)
    assert (told.value.file, told.value.line) == (str(file), 13)
    assert told.value.field == "devices.bench.outputs.fin.write"


WRONG = {
    "no input": ("force: {column: 2, zero: 80000 counts, slope: 2 uN/count, low: -8388607 counts, high: "
                 "8388606 counts} # 5 kg", "{}", "devices.bench.inputs", "there are none"),
    "no column": ("column: 2, ", "", "devices.bench.inputs.force.column", "missing"),
    "column 0": ("column: 2", "column: 0", "devices.bench.inputs.force.column", "1"),
    "neither unit nor slope": ("slope: 2 uN/count, ", "", "devices.bench.inputs.force.slope", 'unit, as in "deg", or'),
    "both": ("slope: 2 uN/count", "slope: 2 uN/count, unit: N", "devices.bench.inputs.force.slope", "either a unit"),
    "a slope of 0": ("2 uN/count", "0 uN/count", "devices.bench.inputs.force.slope", "beside 0"),
    "per volt": ("2 uN/count", "2 uN/V", "devices.bench.inputs.force.slope", "is not per count.*4.7 uN/count"),
    "a zero in volts": ("80000 counts", "2 V", "devices.bench.inputs.force.zero", "count is needed"),
    "a zero without unit": ("80000 counts", "80000", "devices.bench.inputs.force.zero", "has no unit.*count"),
    "an empty range": ("low: -8388607 counts", "low: 8388607 counts", "devices.bench.inputs.force.low", "empty"),
    "no such unit": ("unit: deg", "unit: dg", "devices.bench.outputs.fin.unit", "no unit called dg"),
    "a safe state out of range": ("low: 0 deg", "low: 100 deg", "devices.bench.outputs.fin.zero", "sent as 90.*100"),
    "too few columns": ("clock: 1", "columns: 1", "devices.bench.inputs.force.column", "2, and a line has 1 column"),
    "a clock beyond": ("clock: 1", "columns: 2\n    clock: 3", "devices.bench.clock", "3, and a line has 2 columns"),
    "no separator": ('","', '""', "devices.bench.separator", "empty"),
    "no time": ("0.8 s", "0 s", "devices.bench.timeout", "more than 0 s"),
    "a slew of another unit": ("2000 deg/s", "2000 N/s", "commands.bench.fin.slew", "rad/s is needed"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_mistake_is_told_with_line_field_and_what_is_allowed(tmp_path, name):
    old, new, field, words = WRONG[name]
    assert RIG.count(old) == 1
    path = tmp_path / "rig.yaml"
    path.write_text(RIG.replace(old, new))
    with pytest.raises(InputError, match=words) as told:
        load_rig(path)
    assert (told.value.file, told.value.field) == (str(path), field)
    assert told.value.line is not None


def test_a_tare_writes_the_counts_at_rest(board, file):
    """Of 24 bits none is lost: 7654321 counts."""
    board.load = 7_654_321 - REST
    file.write_text(file.read_text().replace("least: -5 N, most: 5 N", "least: -50 N, most: 50 N"))
    before = file.read_text()
    assert main(["rig", "tare", *ON_FORCE]) == 0
    assert file.read_text() == before.replace("zero: 80000 counts", "zero: 7654321 count")
    assert board.got == []


def test_a_tare_of_a_printed_quantity_is_in_its_unit(board, file):
    """1500 mN at rest; a zero that is not there yet is written."""
    file.write_text(re.sub(r"\{column: 2.*\} # 5 kg", "{column: 2, unit: mN}", RIG.replace("PORT", board.path)))
    board.load = 1_500 - REST
    assert main(["rig", "tare", *ON_FORCE]) == 0
    assert "force: {zero: 1.5 N, column: 2, unit: mN}" in file.read_text()


def test_a_calibration_finds_slope_and_zero_by_known_loads(board, file, monkeypatch):
    """1000 counts more at rest, and 20000 counts per newton: 50 uN/count."""

    class Hanging(io.StringIO):
        loads = iter((0, 1, 2, 0))

        def readline(self, *_):
            board.load = 1_000 + 20_000 * next(self.loads)
            return "\n"

    monkeypatch.setattr(sys, "stdin", Hanging())
    assert main(["rig", "calibrate", *ON_FORCE, "--known", "0 N, 1 N, 2 N, 0 N"]) == 0
    found = re.search(r"zero: (\S+) count, slope: (\S+) N/count, low: -8388607 counts", file.read_text())
    assert found is not None
    assert (float(found[1]), float(found[2])) == (pytest.approx(81_000), pytest.approx(50e-6))
    assert "# 5 kg" in file.read_text()
