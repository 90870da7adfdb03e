"""The firmware of the motor controller on a simulated board: built from C, run in simavr, with a motor on its pins."""

import os
import shutil
import signal
import subprocess
import time
from functools import cache
from pathlib import Path

import numpy as np

from nectosome.description.drives import MotorDescription
from nectosome.drives.motor import GearedMotor

FIRMWARE = Path(__file__).parents[2] / "firmware"
SUPPLY, INERTIA = 7.4, 1e-3  # V, kg m2: the flagellum's battery; a guess, as are the currents below
MOTOR = GearedMotor.of(
    MotorDescription(rated_voltage=6.0, no_load_speed=22.0, stall_torque=0.89, no_load_current=0.2, stall_current=4.0)
)
assert MOTOR.friction is not None
NUMBERS = {  # of the simulated motor
    "constant": MOTOR.constant,
    "resistance": MOTOR.resistance,
    "friction": MOTOR.friction.limit,
    "efficiency": MOTOR.efficiency,
    "friction_speed": MOTOR.friction_speed,
}
_PATIENCE = 200.0  # [s] of a busy machine


@cache
def lacks() -> str:
    """Which of the tools that firmware and simulation need is not on this machine; empty if none."""
    for tool in ("make", "cc", "avr-gcc"):
        if not shutil.which(tool):
            return f"there is no {tool}"
    for compiler, header in (("avr-gcc", "util/crc16.h"), ("cc", "simavr/sim_avr.h"), ("cc", "libelf.h")):
        asked = [compiler, "-E", "-mmcu=atmega328p"] if compiler == "avr-gcc" else [compiler, "-E"]
        found = subprocess.run([*asked, "-"], input=f"#include <{header}>\n", text=True, capture_output=True)
        if found.returncode:
            return f"{compiler} has no {header}"
    return ""


def build(folder: Path, target: str, defines: str = "") -> Path:
    """Make a target in a folder."""
    call = ["make", "-C", str(FIRMWARE), target, f"BUILD={folder}", f"DEFINES={defines}"]
    made = subprocess.run(call, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    return folder


class Board:
    """A board that runs until the end of `with`. Its clock goes `pace` times as fast as the machine's, or slower."""

    columns = 4  # of its log: time [s], voltage [V], speed [rad/s], angle [rad]

    def __init__(self, firmware: Path, simulation: Path, log: Path, pace: float = 2.0, **motor: float):
        given = {name: float(value) for name, value in NUMBERS.items()}
        given |= {"inertia": INERTIA, "supply": SUPPLY, "pace": pace}
        settings = [f"{name}={value!r}" for name, value in (given | motor).items()]
        self._call = [str(simulation / "simulate"), str(firmware / "motor.elf"), *settings, f"log={log}"]
        self._log = log

    def __enter__(self) -> "Board":
        self._process = subprocess.Popen(self._call, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        self.path = next(line.strip() for line in self._process.stdout if line.startswith("/dev"))
        self.wait(0.05)  # the chip has begun
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.communicate()

    def log(self) -> np.ndarray:
        """Rows of `columns`, one for each millisecond."""
        rows = self._log.read_text().rpartition("\n")[0].splitlines()
        return np.array([[float(word) for word in row.split(",")] for row in rows]).reshape(-1, self.columns)

    def wait(self, time_on_board: float) -> np.ndarray:
        """The log, when so much time has passed [s]."""
        return self.wait_until(time_on_board + (self.log()[-1, 0] if self._log.is_file() and len(self.log()) else 0.0))

    def wait_until(self, end: float) -> np.ndarray:
        """The log, when the board's clock is past a time [s]."""
        limit = time.monotonic() + _PATIENCE
        while not (self._log.is_file() and len(log := self.log()) and log[-1, 0] >= end):
            assert self._process.poll() is None
            assert time.monotonic() < limit
            time.sleep(0.02)
        return log

    def reset(self) -> None:
        """As by the button."""
        os.kill(self._process.pid, signal.SIGUSR1)

    def hang(self) -> None:
        """From now on the chip repeats one instruction."""
        os.kill(self._process.pid, signal.SIGUSR2)


class CellBoard(Board):
    """One with a load cell and a servo."""

    columns = 5  # time [s], pulse [s], angle [deg], readings that were lost, pulses that were too long

    def __init__(self, built: Path, log: Path, pace: float = 1.0, **cell: float):
        settings = [f"{name}={float(value)!r}" for name, value in (cell | {"pace": pace}).items()]
        self._call = [str(built / "simulate_cell"), str(built / "cell.elf"), *settings, f"log={log}"]
        self._log = log
