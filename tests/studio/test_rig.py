"""The rig's tab: a run ends with the tab that began it, other tabs and keys stop it, a check moves nothing."""

import os
import re
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.studio.test_markup import ROBOT, NoAnswer
from tests.studio.watched_rig import FAILS, commands, events, watched_rig
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, Visitor, beside, chromium, said, wait_until

from nectosome.io import load_dataset
from nectosome.rigs.log import JournalTail, RunLog
from nectosome.rigs.rig_file import load_rig
from nectosome.studio import session
from nectosome.studio.folder import WorkFolder
from nectosome.studio.server import Studio
from nectosome.studio.tasks import rig as rig_tab
from nectosome.studio.tasks.rig import channels_figure
from nectosome.studio.tasks.rig_request import SIMULATED_FILE, channels_html, controlled, played, rig_files
from nectosome.units import InputError


@pytest.fixture(scope="module")
def simulated():
    return load_rig(SIMULATED_FILE)


def sine(amplitude="10 kPa", frequency="0.5 Hz"):
    return {"kind": "sine", "amplitude": amplitude, "frequency": frequency}


# --- what is run


def test_signals_are_those_of_a_plan(simulated):
    """A second of growth, a sine, a second in which it falls; the other command is a step of 5 kPa."""
    run = played(
        simulated, {"left.pressure": sine(), "right.pressure": {"kind": "step", "height": "-5 kPa"}}, "4 s", "1 s"
    )
    assert run.name == "sine, step"
    t = np.arange(len(run.signals["left.pressure"])) * simulated.dt
    assert t[-1] == pytest.approx(run.seconds)
    begin = run.seconds - 1.0 - 4.0  # where it has grown
    full = (t >= begin) & (t <= begin + 4.0)
    np.testing.assert_allclose(run.signals["left.pressure"][full], 1e4 * np.sin(np.pi * (t[full] - begin)), atol=1e-6)
    np.testing.assert_allclose(run.signals["right.pressure"][full], -5e3)
    assert all(signal[0] == signal[-1] == 0 for signal in run.signals.values())


@pytest.mark.parametrize(
    ("signals", "words"),
    [
        ({}, "no command has a signal"),
        ({"left.pressure": sine("70 kPa")}, "left.pressure: .*-60000 to 60000 Pa are allowed"),
        ({"left.pressure": sine("50 kPa", "5 Hz")}, "left.pressure: .*380000 Pa/s are allowed"),
        ({"left.pressure": sine("10 mm")}, "left.pressure.amplitude: .*10 mm.* is in m"),
        ({"left.pressure": sine(frequency="0.5")}, "left.pressure.frequency: .*no unit"),
        ({"right.pressure": {"kind": "step", "height": "soft"}}, "right.pressure.height: .*soft"),
    ],
)
def test_what_is_beyond_the_limits_is_refused_before_anything_moves(simulated, signals, words):
    with pytest.raises(InputError, match=words):
        played(simulated, signals, "4 s", "1 s")


def test_a_pid_has_the_gains_that_are_given_in_the_units_of_the_page(simulated):
    """0.005 bar/mm and 0.05 bar/(mm s): 5e5 Pa/m and 5e6 Pa/(m s)."""
    options = {"command": "left.pressure", "measurement": "left.displacement", "to": None}
    options |= {"reference": "sine", "amplitude": "7 mm", "frequency": "0.3 Hz"}
    run = controlled(simulated, options, "4 s", "0.005, 0.05, 0")
    loop = run.loops["left.pressure"]
    assert loop.measurement == "left.displacement"
    np.testing.assert_allclose([loop.controller.proportional, loop.controller.integral], [5e5, 5e6], rtol=1e-12)
    np.testing.assert_allclose(loop.reference.max(), 7e-3, rtol=1e-3)
    with pytest.raises(InputError, match="beyond the limits of -60 kPa to 60 kPa"):
        controlled(simulated, options | {"amplitude": "40 mm"}, "4 s", "0.005, 0.05, 0")


def test_rig_files_are_those_with_devices(tmp_path):
    (tmp_path / "robot.yaml").write_text(ROBOT)
    (tmp_path / "tail.yaml").write_text(SIMULATED_FILE.read_text())
    assert rig_files(WorkFolder(tmp_path)) == ["tail.yaml"]


def test_channels_are_told_with_their_limits_and_readings(simulated):
    words = re.sub("<[^>]*>", " ", channels_html(simulated, (0.004, float("nan"))))
    for told in ("left.pressure", "-60 to 60 kPa", "380 kPa/s", "-35 to 35 mm", "4 mm", "no reading", "20 ms"):
        assert told in words
    assert "right.displacement is out of its range" in words


def test_a_journal_is_read_as_it_grows(tmp_path):
    tail = JournalTail(tmp_path / "run.csv", most=3)
    tail.read()
    assert not tail.rows
    log = RunLog(tmp_path / "run.nc", {"rig": "tail"}, {"time": "s", "angle": "rad"})
    for k in range(5):
        log.append(float(k), 0.1 * k)
        end = time.monotonic() + 20
        while not (tail.rows and tail.rows[-1][0] == k):
            assert time.monotonic() < end
            tail.read()
            time.sleep(0.002)
    assert [*tail.rows] == [[float(k), 0.1 * k] for k in (2, 3, 4)]
    assert tail.units == {"time": "s", "angle": "rad"}
    with (tmp_path / "run.csv").open("a") as file:
        file.write("5.0,")  # a line that is being written
    tail.read()
    assert tail.rows[-1][0] == 4.0
    log.end({})
    tail.read()
    assert tail.rows[-1][0] == 4.0


def test_peaks_of_a_channel_are_drawn():
    """One sample in 10000 that is off is seen, and gaps stay gaps where nothing is known."""
    rows = np.zeros((10_000, 4))
    rows[:, 0] = np.arange(10_000) * 0.01
    rows[7654, 1] = 0.5
    figure, _ = channels_figure({"time": "s", "cell.thrust": "N", "cell.thrust.command": "N", "late": "s"}, rows)
    thrust, command = figure.data
    assert (thrust.name, command.name) == ("cell.thrust", "cell.thrust.command")
    assert max(thrust.y) == pytest.approx(500) and len(thrust.y) < 600  # mN
    assert thrust.x[int(np.argmax(thrust.y))] == pytest.approx(76.54)


# --- the tab, without a browser


@pytest.fixture
def seen(tmp_path):
    return tmp_path / "seen.txt"


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Opens a studio whose simulated rig is watched, and fails when it is told to."""
    monkeypatch.setattr(session, "AnswerSolver", NoAnswer)
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("NAME", "arm"))
    studios = []

    def opened(fault="") -> Studio:
        monkeypatch.setattr(rig_tab, "load_rig", partial(watched_rig, tmp_path / "seen.txt", fault))
        studios.append(Studio(str(tmp_path / "robot.yaml"), tmp_path, "127.0.0.1", 19_100))
        return studios[-1]

    yield opened
    for studio in studios:
        studio.close()
        studio.wait_for_rig()


def until(condition):
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def ready(page) -> None:
    page.wait(lambda: "left.displacement" in page.text)


def begin(page, seen) -> None:
    """Begin a run of a minute, and wait until the device has had some commands."""
    ready(page)
    page.write("Time", "60 s")
    page.press("Start")
    page.wait(lambda: len(events(seen)) > 30)


def is_safe(seen) -> bool:
    return events(seen)[-2:] == ["vent", "close"] and commands(seen)[-1] == 0


def test_a_check_reads_and_moves_nothing(place, seen):
    with Visitor(place()) as page:
        ready(page)
        page.press("Check: measure, move nothing")
        page.wait(lambda: "every channel was read" in page.text)
    assert set(events(seen)) == {"close"}


@pytest.mark.usefixtures("in_a_thread")
def test_a_run_ends_with_the_tab_that_began_it(place, seen, tmp_path):
    with Visitor(place()) as page:
        begin(page, seen)
        page.wait(lambda: not page.control("STOP")["props"]["disabled"])
    until(lambda: is_safe(seen))
    until((tmp_path / "rig_1.nc").exists)
    assert load_dataset(tmp_path / "rig_1.nc").attrs["status"] == "interrupted"


def test_another_tab_sees_it_stops_it_and_begins_none(place, seen, tmp_path):
    studio = place()
    with Visitor(studio) as page, Visitor(studio) as other:
        begin(page, seen)
        other.wait(lambda: "It was started on another page" in other.text)
        other.press("Start")
        other.wait(lambda: "is in use in this studio" in other.text)
        assert events(seen).count("open") == 1
        assert other.control("Stop the rig (space)")["props"]["disabled"]  # its keys type
        other.press("STOP")
        until(lambda: is_safe(seen))
        for each in (page, other):
            each.wait(lambda each=each: "interrupted: it was cancelled." in each.text)
        page.wait(lambda: "saved rig_1.nc" in page.text and page.control("STOP")["props"]["disabled"])
        page.wait(lambda: page.control("Log")["props"].get("value") == "rig_2")
    assert (tmp_path / "rig_1.nc").exists()


@pytest.mark.usefixtures("in_a_thread")
def test_a_key_stops_it(place, seen):
    with Visitor(place()) as page:
        begin(page, seen)
        page.trigger("Stop the rig (escape)")
        until(lambda: is_safe(seen))
        page.wait(lambda: "interrupted: it was cancelled." in page.text)


@pytest.mark.usefixtures("in_a_thread")
def test_a_pulled_cable_is_told_on_the_page(place, seen):
    with Visitor(place("pulled")) as page:
        ready(page)
        page.press("Start")
        page.wait(lambda: FAILS in page.text)
        assert "failed: tail: the cable was pulled." in page.text
    assert is_safe(seen)


def test_another_rig_of_the_folder_is_taken_and_a_bad_one_told(place, tmp_path):
    (tmp_path / "good.yaml").write_text(SIMULATED_FILE.read_text().replace("left", "port"))
    (tmp_path / "bad.yaml").write_text("dt: 5 ms\ndevices: {tail: {kind: nothing}}\n")
    with Visitor(place()) as page:
        ready(page)
        page.write("Rig", "good.yaml")
        page.wait(lambda: "port.displacement" in page.text)
        page.write("Rig", "bad.yaml")
        page.wait(lambda: "bad.yaml, line 2" in page.text)
        page.press("Start")
        page.wait(lambda: "no rig is chosen" in page.text)


@pytest.mark.slow
def test_a_studio_that_is_told_to_end_takes_the_power_out_first(tmp_path):
    """SIGTERM to the command: it ends when the log of its rig is there, and says so with its exit code."""
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("NAME", "arm"))
    command = [sys.executable, "-m", "nectosome", "studio", "robot.yaml", "--no-browser", "--port", "19200"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    studio = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True)
    try:
        address = re.search(r"http\S+/", studio.stdout.readline())[0]
        with Visitor(SimpleNamespace(address=address)) as page:
            ready(page)
            page.write("Time", "60 s")
            page.press("Start")
            page.wait(lambda: "left.pressure" in (text := journal(tmp_path)) and text.count("\n") > 40)
            studio.send_signal(signal.SIGTERM)
            assert studio.wait(60) == 0
    finally:
        studio.kill()
        studio.stdout.close()
    assert not (tmp_path / "rig_1.csv").exists()
    assert load_dataset(tmp_path / "rig_1.nc").attrs["status"] == "interrupted"


def journal(folder: Path) -> str:
    path = folder / "rig_1.csv"
    return path.read_text() if path.exists() else ""


# --- in a browser


@pytest.mark.usefixtures("in_a_thread")
@NEEDS_CHROMIUM
def test_space_stops_it_even_while_the_user_types(place, seen, tmp_path):
    studio = place()
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(PATIENCE)
        page.goto(studio.address)
        page.get_by_role("tab", name="Rig", exact=True).click()
        beside(page, "Time").fill("60 s")
        page.get_by_role("tab", name="Files").click()
        name = beside(page, "Name")
        name.click()
        page.keyboard.press("End")
        page.keyboard.press("Space")
        assert name.input_value() == "robot "  # a blank is a blank while nothing runs
        page.keyboard.press("Backspace")
        page.get_by_role("button", name="Start", exact=True).click()
        until(lambda: len(events(seen)) > 30)
        page.get_by_text("The rig runs").first.wait_for()
        name.click()
        page.keyboard.press("Space")
        until(lambda: is_safe(seen))
        said(page, "saved rig_1.nc")
        assert name.input_value() == "robot"
        wait_until(page, "document.querySelectorAll('.main-svg').length > 0")
        assert load_dataset(tmp_path / "rig_1.nc").attrs["status"] == "interrupted"
