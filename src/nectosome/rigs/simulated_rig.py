"""A rig that is a model: a block between command and measurement, in virtual or in real time."""

import math
import time
from collections import deque
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike

from nectosome.core import Block, Line, Stepper
from nectosome.drives import Sensor

from .compiled_step import CompiledStep
from .rig import Rig, RigError


class SimulatedRig(Rig):
    """A block, from command to what is measured, at rest when it is opened; commands are held between steps of `dt`.

    A command acts `delay` [s] after it was written, in whole steps. In virtual time the clock is that of the model,
    which goes on only in `wait`: as fast as the machine allows, and no sample is late. In real time the clock is the
    machine's, and the model follows it.

    - truths: what was there at each reading, without the sensor's noise and range, since it was opened.
    """

    def __init__(
        self,
        plant: Block,
        sensor: Sensor | None = None,
        *,
        command_unit: str = "Pa",
        measured_unit: str = "m",
        dt: float = 1e-3,
        delay: float = 0.0,
        pace: Literal["virtual", "real"] = "virtual",
        name: str = "simulated rig",
    ):
        self.name, self.command_unit, self.measured_unit = name, command_unit, measured_unit
        self.dt, self.pace = dt, pace
        self.truths: list[float] = []
        self._plant, self._sensor = plant, sensor
        self._reading: CompiledStep | None = None
        self._delay = round(delay / dt)  # steps
        self._pending: deque[tuple[int, float]] = deque()  # from which step on, and which command
        self._opened = False
        self._begun = time.perf_counter()
        self._steps = 0  # since then

    def open(self) -> None:
        """Begin at rest; what has to be compiled is compiled here."""
        stepper = _sampled(self._plant, np.asarray(self.dt))
        self._model = CompiledStep(_advance, stepper, (stepper.initial(), jnp.zeros(())))
        self._command = 0.0
        self._pending.clear()
        for _ in range(2):  # steps of no time; what they return may be of other types than what a stepper begins with
            self._advance(0)
        if self._sensor is not None:
            self._reading = CompiledStep(_measure, self._sensor, self._sensor.initial())
            for _ in range(2):
                self._reading(self._output)
            self._reading.start(self._sensor.initial())
        self.truths = []
        self._begun = time.perf_counter() - self._steps * self.dt
        self._opened = True

    @property
    def true(self) -> float:
        """What is there now."""
        self._needs_open("asked")
        self._go(self._step_now())
        return self._output.item()

    def read(self) -> float:
        """What the sensor makes of what is there."""
        self._needs_open("read")
        self.truths.append(self.true)
        return self.truths[-1] if self._reading is None else self._reading(self._output).item()

    def write(self, command: float) -> None:
        """A command that acts after the delay."""
        self._needs_open("written")
        if not math.isfinite(command):
            raise RigError(f"{self.name}: a command of {command:g} {self.command_unit} is none.")
        self._pending.append((self._step_now() + self._delay, float(command)))

    def vent(self) -> None:
        """A command of 0, at once and for ever."""
        if self._opened:
            self._go(self._step_now())
            self._pending.clear()
            self._command = 0.0

    def close(self) -> None:
        """Let go of it."""
        self._opened = False

    def now(self) -> float:
        """Time of the model, or of the machine."""
        return self._steps * self.dt if self.pace == "virtual" else time.perf_counter()

    def wait(self, until: float) -> None:
        """Step the model, or let it follow the machine's clock when it is read."""
        if self.pace == "real":
            super().wait(until)
        else:
            self._go(math.ceil(until / self.dt - 1e-6))

    def _step_now(self) -> int:
        """The step that the clock has come to."""
        return self._steps if self.pace == "virtual" else int((time.perf_counter() - self._begun) / self.dt)

    def _go(self, until: int) -> None:
        """On to a step, with each command from where it acts; a model that is not open rests."""
        while self._steps < until:
            while self._pending and self._pending[0][0] <= self._steps:
                self._command = self._pending.popleft()[1]
            target = min(until, self._pending[0][0]) if self._pending else until
            if self._opened:
                self._advance(target - self._steps)
            self._steps = target

    def _advance(self, count: int) -> None:
        # both are traced: one program for all of them
        self._output = self._model(np.asarray(self._command, dtype=float), np.asarray(count))

    def _needs_open(self, what: str) -> None:
        if not self._opened:
            raise RigError(f"{self.name}: {what} before it was opened.")


@eqx.filter_jit
def _sampled(plant: Block, dt: ArrayLike) -> Stepper:
    return plant.sampled(dt)


def _advance(
    stepper: Stepper, begin: tuple[Any, Array], command: ArrayLike, count: ArrayLike
) -> tuple[tuple[Any, Array], Array]:
    """State and output some steps on; one program for any number of them."""
    held = jnp.asarray(command)

    def once(_: Array, now: tuple[Any, Array]) -> tuple[Any, Array]:
        state, line = stepper.step(now[0], Line(held, held))
        return state, line.end

    after = jax.lax.fori_loop(0, count, once, begin)
    return after, after[1]


def _measure(sensor: Sensor, state: Any, output: Array) -> tuple[Any, Array]:
    state, line = sensor.step(state, Line(output, output))
    return state, line.end
