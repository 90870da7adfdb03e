"""Rigs that misbehave when they are told to, a small controller, and setups that experiments are made of."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from nectosome.controllers import Controller, Regulator
from nectosome.drives import Sensor, second_order
from nectosome.rigs import CommandLimits, Experiment, Limits, Loop, MeasurementLimits, Rig, SimulatedRig, Tracked

Hook = Callable[..., Any]  # hook(n, call, *arguments): n calls were made before


class PI(Controller):
    """The smallest controller that follows a reference."""

    proportional: Array
    integral: Array

    def planned(self, reference: np.ndarray, dt: float) -> Regulator:
        return PIRegulator(jnp.asarray(reference), self.proportional, self.integral * dt)


class PIState(NamedTuple):
    k: Array
    sum: Array


class PIRegulator(Regulator):
    reference: Array
    proportional: Array
    integral: Array

    def initial(self, command=0.0, measured=0.0) -> PIState:
        error = self.reference[0] - measured
        return PIState(jnp.zeros((), dtype=int), jnp.asarray(command) - self.proportional * error)

    def step(self, state: PIState, measured: Array) -> tuple[PIState, Array]:
        error = self.reference[jnp.minimum(state.k, self.reference.shape[0] - 1)] - measured
        total = state.sum + self.integral * error
        return PIState(state.k + 1, total), self.proportional * error + total


def pi(proportional: float = 2.8e6, integral: float = 8.4e7) -> PI:
    return PI(jnp.asarray(proportional), jnp.asarray(integral))


class Event(NamedTuple):
    what: str
    value: float  # of the first command
    time: float  # of the rig's own clock


class Faulty(Rig):
    """Any rig, with hooks around its methods; it keeps what the device sees, in a file too if there is one."""

    def __init__(self, inner: Rig, hooks: dict[str, Hook] | None = None, file: Path | None = None):
        self.inner, self.hooks = inner, hooks or {}
        self.name, self.commands, self.measurements = inner.name, inner.commands, inner.measurements
        self.seen: list[Event] = []
        self.calls: dict[str, int] = {}
        self.file = file.open("a", buffering=1) if file else None

    def open(self) -> None:
        self._through("open")

    def connect(self) -> None:
        self._through("connect")

    def measure(self) -> tuple[float, ...]:
        return self._through("measure")

    def write(self, commands: Sequence[float]) -> None:
        self._through("write", commands)

    def vent(self) -> None:
        self._through("vent")

    def close(self) -> None:
        self._through("close")

    def now(self) -> float:
        return self._through("now")

    def wait(self, until: float) -> None:
        self._through("wait", until)

    def _through(self, method: str, *arguments: Any) -> Any:
        if method in ("open", "write", "vent", "close"):
            event = Event(method, arguments[0][0] if arguments else 0.0, self.inner.now())
            self.seen.append(event)
            if self.file:
                self.file.write(f"{method} {event.value!r} {time.time()!r}\n")
        n = self.calls.get(method, 0)
        self.calls[method] = n + 1
        call = getattr(self.inner, method)
        return self.hooks[method](n, call, *arguments) if method in self.hooks else call(*arguments)


@dataclass
class Setup:
    """What an experiment is made of; `rig` makes a new one.

    In real time others use this machine too: a call may be seen `jitter` [s] after its time.
    """

    rig: Callable[[], Rig]
    controller: Controller
    reference: np.ndarray
    dt: float
    limits: Limits = field(default_factory=lambda: LIMITS)
    jitter: float = 0.0

    def experiment(self, rig: Rig | None = None, **changed: Any) -> Experiment:
        law = tracked(
            rig or self.rig(), changed.pop("controller", self.controller), changed.pop("reference", self.reference)
        )
        return Experiment(law[0], law[1], **({"limits": self.limits, "dt": self.dt, "name": "sine"} | changed))


def tracked(rig: Rig, controller: Controller, reference: np.ndarray, dt: float = 0.01) -> tuple[Rig, Tracked]:
    """A rig of one command and one measurement under a controller."""
    (command,), (measurement,) = rig.commands, rig.measurements
    return rig, Tracked(rig, {command: Loop(measurement, controller, reference)}, dt)


GAIN, FREQUENCY = 2e-7, 30.0  # [m/Pa], [rad/s]: 6e4 Pa bend it by 12 mm
SLEW = 4e5  # [Pa/s]
LIMITS = Limits(
    {"pressure": CommandLimits(-6e4, 6e4, SLEW)},
    {"displacement": MeasurementLimits(-0.015, 0.015, error=3e-3, error_time=0.2)},
    saturated_time=0.3, frozen_time=0.1,
)  # fmt: skip
DT, COUNT = 0.01, 120


def changed(limits: Limits, **numbers: float) -> Limits:
    """Limits of one command and one measurement with other numbers, wherever these stand."""
    ((command, of),), ((measurement, bounds),) = limits.commands.items(), limits.measurements.items()
    own = [{name: x for name, x in numbers.items() if hasattr(one, name)} for one in (of, bounds)]
    rest = {name: x for name, x in numbers.items() if name not in own[0] | own[1]}
    return replace(
        limits, commands={command: replace(of, **own[0])}, measurements={measurement: replace(bounds, **own[1])}, **rest
    )


def sine(count: int = COUNT, dt: float = DT) -> np.ndarray:
    """8 mm at 0.5 Hz."""
    return 8e-3 * np.sin(np.pi * np.arange(count) * dt)


def plant():
    return second_order(jnp.asarray(GAIN), jnp.asarray(FREQUENCY), jnp.asarray(1.0))


def sensor(noise: float = 2e-5) -> Sensor:
    return Sensor(jnp.asarray(noise), jnp.asarray(-0.02), jnp.asarray(0.02))


def simulated(**options: Any) -> SimulatedRig:
    return SimulatedRig(plant(), sensor(), dt=2e-3, **options)


RIGS = {"simulated": Setup(simulated, pi(), sine(), DT)}
