"""A simulated rig: a block between command and measurement, in virtual or in real time."""

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike

from nectosome.core import Block, Line, Stepper
from nectosome.drives import Sensor

from .rig import Rig, RigError

Step = Callable[..., tuple[Any, Array]]  # step(module, state, *inputs) -> (state, output)


class CompiledStep:
    """A module and its state, which advances with each call; compiled at once, for such `inputs`.

    `filter_jit` would flatten and unflatten both at every call, which takes three times as long as the call itself.
    Modules of one structure share a program.
    """

    def __init__(self, step: Step, module: Any, state: Any, *inputs: ArrayLike):
        moving, still = eqx.partition(module, lambda x: isinstance(x, jax.Array | np.ndarray))
        arrays, structure = jax.tree.flatten(moving)
        words, frame = jax.tree.flatten(still)
        self._arrays = [jnp.asarray(x) for x in arrays]
        self._program = _program(step, structure, frame, tuple(words), jax.tree.structure(state))
        self.start(state)
        for _ in range(2):  # the state after a step may have other types than the initial one
            self(*inputs)
        self.start(state)

    def start(self, state: Any) -> None:
        """Set the state."""
        self._state = jax.tree.leaves(state)

    def __call__(self, *inputs: ArrayLike) -> Array:
        """Take one step and return its output."""
        self._state, output = self._program(self._arrays, self._state, *inputs)
        return output


@lru_cache(maxsize=64)
def _program(step: Step, structure: Any, frame: Any, words: tuple[Any, ...], of_state: Any) -> Callable[..., Any]:
    def run(arrays: list[Array], state: list[Array], *inputs: ArrayLike) -> tuple[list[Array], Array]:
        module = eqx.combine(jax.tree.unflatten(structure, arrays), jax.tree.unflatten(frame, words))
        after, output = step(module, jax.tree.unflatten(of_state, state), *inputs)
        return jax.tree.leaves(after), output

    return jax.jit(run)


class SimulatedRig(Rig):
    """A block from one command to one measurement, at rest when it is opened; commands are held between steps of `dt`.

    It is an actuator unless other names and units are given: `pressure` [Pa] to `displacement` [m].

    A command acts `delay` [s] after it was written, in whole steps. In virtual time the clock is that of the model and
    advances only in `wait`: as fast as the machine allows, and no sample is late. In real time the model follows the
    clock of the machine.

    - outputs: the true output at each measurement since it was opened, without noise and range of the sensor.
    """

    def __init__(
        self,
        plant: Block,
        sensor: Sensor | None = None,
        *,
        command: tuple[str, str] = ("pressure", "Pa"),
        measurement: tuple[str, str] = ("displacement", "m"),
        dt: float = 1e-3,
        delay: float = 0.0,
        pace: Literal["virtual", "real"] = "virtual",
        name: str = "simulated rig",
    ):
        self.name, self.commands, self.measurements = name, dict([command]), dict([measurement])
        self.dt, self.pace = dt, pace
        self.outputs: list[float] = []
        self._plant, self._sensor = plant, sensor
        self._reading: CompiledStep | None = None
        self._delay = round(delay / dt)  # steps
        self._pending: deque[tuple[int, float]] = deque()  # from which step on, and which command
        self._opened = self._connected = False
        self._started = time.perf_counter()
        self._steps = 0  # since then

    def open(self) -> None:
        """Start at rest; all compilation happens here."""
        self.connect()
        self._opened = True

    def connect(self) -> None:
        """Start at rest, where it stays: nothing is written."""
        stepper = _sampled(self._plant, np.asarray(self.dt))
        self._model = CompiledStep(
            _advance, stepper, (stepper.initial(), jnp.zeros(())), np.asarray(0.0), np.asarray(0)
        )
        self._command = 0.0
        self._pending.clear()
        self._advance(0)
        if self._sensor is not None and self._reading is None:  # its noise goes on, so that repeated runs differ
            self._reading = CompiledStep(_measure, self._sensor, self._sensor.initial(), self._output)
        self.outputs = []
        self._started = time.perf_counter() - self._steps * self.dt
        self._connected = True

    @property
    def true(self) -> float:
        """The present output, without noise and range of the sensor."""
        self._needs(self._connected, "measured")
        self._go(self._step_now())
        return self._output.item()

    def measure(self) -> tuple[float, ...]:
        """The present output, measured by the sensor."""
        self.outputs.append(self.true)
        return (self.outputs[-1] if self._reading is None else self._reading(self._output).item(),)

    def write(self, commands: Sequence[float]) -> None:
        """Send the command, which acts after the delay."""
        self._needs(self._opened, "written")
        (command,) = commands
        if not math.isfinite(command):
            raise RigError(f"{self.name}: a command of {command:g} {next(iter(self.commands.values()))} is none.")
        self._pending.append((self._step_now() + self._delay, float(command)))

    def vent(self) -> None:
        """A command of 0, at once; pending commands are dropped."""
        if self._opened:
            self._go(self._step_now())
            self._pending.clear()
            self._command = 0.0

    def close(self) -> None:
        """Stop the simulation; its clock continues."""
        self._opened = self._connected = False

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
        """Number of the present step."""
        return self._steps if self.pace == "virtual" else int((time.perf_counter() - self._started) / self.dt)

    def _go(self, until: int) -> None:
        """Advance to a step, with each pending command in turn; the state of a closed rig does not change."""
        while self._steps < until:
            while self._pending and self._pending[0][0] <= self._steps:
                self._command = self._pending.popleft()[1]
            target = min(until, self._pending[0][0]) if self._pending else until
            if self._connected:
                self._advance(target - self._steps)
            self._steps = target

    def _advance(self, count: int) -> None:
        # both are traced: one program for all of them
        self._output = self._model(np.asarray(self._command, dtype=float), np.asarray(count))

    def _needs(self, opened: bool, what: str) -> None:
        if not opened:
            raise RigError(f"{self.name}: {what} before it was opened.")


@eqx.filter_jit
def _sampled(plant: Block, dt: ArrayLike) -> Stepper:
    return plant.sampled(dt)


def _advance(
    stepper: Stepper, begin: tuple[Any, Array], command: ArrayLike, count: ArrayLike
) -> tuple[tuple[Any, Array], Array]:
    """State and output after some steps; one program for any number of them."""
    u = jnp.asarray(command)

    def once(_: Array, now: tuple[Any, Array]) -> tuple[Any, Array]:
        state, line = stepper.step(now[0], Line(u, u))
        return state, line.end

    after = jax.lax.fori_loop(0, count, once, begin)
    return after, after[1]


def _measure(sensor: Sensor, state: Any, output: Array) -> tuple[Any, Array]:
    state, line = sensor.step(state, Line(output, output))
    return state, line.end
