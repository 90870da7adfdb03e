r"""A motor whose speed loop runs on a microcontroller, over a serial line: a cable, or a radio link.

It speaks the serial protocol (`serial_line`, docs/reference/serial-protocol.md):

| question | does | answer |
|---|---|---|
| `H` | nothing | `H dt`: time between samples of the speed loop [s] |
| `S 12.5` | sets the speed [rad/s] | `V` as below |
| `R` | nothing | `V sample speed error share state damaged` |
| `W 0.5` | sets the controller's own watchdog [s]: without a question for so long it vents | `W 0.5` |
| `0` | vents: no voltage, speed 0, forgets that it has vented or was reset by itself | `0` |

What is refused is answered `E` and why. `firmware/` has such a controller; the law of its speed loop is
`nectosome.controllers.VariableGainPI`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from nectosome.description.fields import PositiveTime
from nectosome.units import InputError, count

from ..device_files import FileFields, device_model, outlasts
from ..rig import Rig, RigError, retried
from .serial_line import RefusedError, SerialLine, SerialLink


@dataclass(frozen=True)
class MotorLink(SerialLink):
    """A motor on a serial line: where its controller is and how long it is waited for."""

    watchdog: PositiveTime = 0.5  # [s]
    """Time without a question after which the controller vents by itself; several times dt."""

    def __post_init__(self):
        super().__post_init__()
        if not self.watchdog > 0:
            raise InputError(f"{self.watchdog:g} s; a time above 0 s expected.", field="watchdog")


class MotorState(NamedTuple):
    """What the controller has told of its last sample."""

    sample: int
    """Samples since its reset."""
    speed: float
    """As measured [rad/s]; NaN where it is not known."""
    error: float
    """What the speed that was set is more [rad/s]."""
    share: float
    """Share of the voltage, -1 to 1."""
    state: str
    """`on`, `off` (vented), or vented by itself: `watchdog`, `reset`."""
    damaged: int
    """Questions with a wrong checksum since its reset."""


class SerialMotor(Rig):
    """Speed [rad/s] in, speed [rad/s] out. The port of its `line` counts what a radio link has lost."""

    name = "serial motor"
    described_by = device_model("serial", MotorLink)

    @classmethod
    def from_description(cls, given: Any, file: FileFields, dt: float) -> "SerialMotor":
        """Raises InputError for a watchdog that acts between two samples, or while a question is asked again."""
        outlasts(file, given.watchdog, dt, "watchdog")
        longest = given.attempts * given.timeout
        if given.watchdog <= longest:
            raise file.wrong(
                f"{given.watchdog:g} s, and a question may take {longest:g} s ({count(given.attempts, 'attempt')} of "
                f"{given.timeout:g} s): the controller would stop by itself while it is asked again. Take more than "
                f"{longest:g} s, or a shorter timeout.",
                "watchdog",
            )
        return cls(file.create(MotorLink, given))

    def __init__(self, controller: MotorLink):
        self.controller = controller
        self.commands = self.measurements = {"speed": "rad/s"}
        self.line = SerialLine(controller, "motor")
        self.told: MotorState | None = None
        self.sample_time = math.nan  # of the controller [s]
        self.commanded = self._opened = False

    def open(self) -> None:
        """Wait until the controller runs, ask for its version, set its watchdog, and a speed of 0."""
        self.connect()
        self._ask("0")
        self._ask(f"W {self.controller.watchdog:g}")
        self._opened = True
        self.write([0.0])

    def connect(self) -> None:
        """Wait until the controller runs, and ask for its version; opening a port resets some, which stops them."""
        told = self.line.open()
        try:
            (self.sample_time,) = map(float, told)
        except ValueError as error:
            raise self._nonsense(told) from error

    def measure(self) -> tuple[float, ...]:
        """The speed; NaN where the controller does not know."""
        return (self._state(self._ask("R")),)

    def write(self, commands: Sequence[float]) -> None:
        """The speed to hold."""
        (command,) = commands
        if not self._opened:
            raise RigError(f"{self.line.where}: written before it was opened.")
        if not math.isfinite(command):
            raise RigError(f"{self.line.where}: a command of {command:g} rad/s is no speed.")
        self.commanded = True
        self._state(self._ask(f"S {command:.4f}"))

    def vent(self) -> None:
        """No voltage, tried three times."""
        if self.line.is_open:
            retried(partial(self._ask, "0"), "It should stop by its own watchdog; else switch off its power.")

    def close(self) -> None:
        """Release the port."""
        self._opened = False
        self.line.close()

    def _ask(self, question: str) -> list[str]:
        """The words of the answer to a question, without its letter."""
        try:
            return self.line.ask(question, {"S": "V", "R": "V"}.get(question[0], question[0]))
        except RefusedError as error:
            stopped = {
                "watchdog": f"no question came for {self.controller.watchdog:g} s. Look at what holds up the loop.",
                "reset": "it was reset. Look at its supply: a motor that starts may pull it down.",
            }
            if error.why not in stopped:
                raise
            raise RigError(f"{self.line.where}: it has stopped by itself, since {stopped[error.why]}") from error

    def _state(self, words: list[str]) -> float:
        """Keep what was told; the speed in it."""
        try:
            sample, speed, error, share, state, damaged = words
            self.told = MotorState(int(sample), float(speed), float(error), float(share), state, int(damaged))
        except ValueError as wrong:
            raise self._nonsense(words) from wrong
        return self.told.speed

    def _nonsense(self, words: list[str]) -> RigError:
        said = " ".join(words)
        return RigError(f"{self.line.where}: {said!r} is no answer. Look at the program of the controller.")
