"""The sampling loop of an experiment, from its first sample to its last, and the ramp to a command of 0."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.controllers import Regulator

from .compiled_step import CompiledStep
from .guards import Guards, slewed
from .log import RunLog
from .rig import Rig

Progress = Callable[[float], bool | None]


class AbortError(Exception):
    """A guard ends the experiment."""


class CancelledError(Exception):
    """The caller's progress function ends the experiment."""


class ControlLaw:
    """A regulator compiled before the first sample: compilation within a sample would make it late."""

    def __init__(self, regulator: Regulator):
        self._regulator = regulator
        self._steps = CompiledStep(_step, regulator, _initial(regulator, np.asarray(0.0)), np.asarray(0.0))

    def begin(self, measured: float) -> None:
        """Start from a command of 0."""
        self._steps.start(_initial(self._regulator, np.asarray(measured)))

    def command(self, measured: float) -> float:
        """The command for a measurement."""
        return self._steps(np.asarray(measured)).item()


@eqx.filter_jit
def _initial(regulator: Regulator, measured: ArrayLike) -> Any:
    return regulator.initial(jnp.zeros(()), measured)


def _step(regulator: Regulator, state: Any, measured: ArrayLike) -> tuple[Any, Array]:
    return regulator.step(state, jnp.asarray(measured))


@dataclass
class SamplingLoop:
    """The samples of one run, and the ramp back to 0; `check`, called between them, raises to end them."""

    rig: Rig
    law: ControlLaw
    reference: Float[np.ndarray, "n"]
    guards: Guards
    log: RunLog
    check: Callable[[], None]
    progress: Progress | None = None
    _command: float = field(default=0.0, init=False)  # the last one that the rig has taken
    _written: float = field(default=0.0, init=False)  # its time
    _begun: bool = field(default=False, init=False)

    def samples(self) -> None:
        """Open the rig and take all samples, at multiples of dt."""
        self.rig.open()
        start = self.rig.now()
        self._written = start - self.guards.dt  # the command was 0 before
        count = len(self.reference)
        pulse = max(count // 100, 1)
        for k, reference in enumerate(self.reference.tolist()):
            self.check()
            self.rig.wait(start + k * self.guards.dt)
            time = self.rig.now() - start
            self._sample(time, reference, time - k * self.guards.dt)
            if self.progress is not None and k % pulse == 0 and self.progress((k + 1) / count) is False:
                raise CancelledError

    def _sample(self, time: float, reference: float, late: float) -> None:
        measured = self.rig.measure()
        why = self.guards.sample(late, reference, measured, self._command)
        if not why:
            if not self._begun:
                self.law.begin(measured)
                self._begun = True
            command = self.law.command(measured)
            why = self.guards.not_finite(command)
            if not why:
                self._write(command)
        try:
            self.log.append(time, reference, measured, self._command, late)
        finally:
            if why:
                raise AbortError(f"at {time:.3f} s {why}")

    def _write(self, unlimited: float) -> None:
        now = self.rig.now()
        command = self.guards.allowed(unlimited, self._command, now - self._written)
        self.rig.write(command)
        self._command, self._written = command, now

    def ramp(self) -> None:
        """Ramp to a command of 0 at the slew limit.

        It begins with the last command that the rig has taken; a command whose writing failed may be in effect or not.
        """
        commands = [self._command] if self._command else []
        while commands and commands[-1]:
            commands.append(slewed(0.0, commands[-1], self.guards.limits.slew * self.guards.dt))
        for command in commands:
            self.check()
            self.rig.wait(self.rig.now() + self.guards.dt)
            self.rig.write(command)
