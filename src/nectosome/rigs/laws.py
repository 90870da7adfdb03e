"""What gives a rig its commands: signals that are played, or controllers that follow references."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.controllers import Controller, Regulator
from nectosome.units import InputError, shorten

from .rig import Rig
from .simulated_rig import CompiledStep

Signal = Float[np.ndarray, "n"]


class Law(ABC):
    """Computes the commands of a rig, sample by sample, from its measurements."""

    count: int
    """Number of samples."""
    references: Mapping[str, Signal]
    """What measurements shall follow, by their names."""
    controlled: Collection[str] = ()
    """The command that makes each of them follow it."""
    about: str
    """What it is, for the log."""

    @abstractmethod
    def prepare(self) -> None:
        """Compile what is needed: within a sample that would make it late."""

    @abstractmethod
    def begin(self, measured: Sequence[float]) -> None:
        """Start from commands of 0 and the first measurements."""

    @abstractmethod
    def commands(self, sample: int, measured: Sequence[float]) -> tuple[float, ...]:
        """The commands for a sample, of all commands of the rig."""


class Played(Law):
    """Signals in open loop, by the names of commands, all of one length; a command without a signal stays 0."""

    def __init__(self, rig: Rig, signals: Mapping[str, Signal]):
        lengths = {len(signal) for signal in signals.values()}
        _check_names(signals, rig.commands, "signals", "command")
        if len(lengths) != 1 or 0 in lengths:
            raise InputError("signals of one length, at least one sample, expected.", field="signals")
        for name, signal in signals.items():
            if not np.isfinite(signal).all():
                raise InputError("has samples that are NaN or infinite.", field=f"signals.{name}")
        (self.count,) = lengths
        rows = [signals[name] if name in signals else np.zeros(self.count) for name in rig.commands]
        self._rows: list[tuple[float, ...]] = [*zip(*(row.tolist() for row in rows), strict=True)]
        self.references = {}
        self.about = f"played: {', '.join(signals)}"

    def prepare(self) -> None:
        """Nothing is compiled."""

    def begin(self, measured: Sequence[float]) -> None:
        """Nothing depends on measurements."""

    def commands(self, sample: int, measured: Sequence[float]) -> tuple[float, ...]:
        """The sample of each signal."""
        return self._rows[sample]


@dataclass(frozen=True)
class Loop:
    """A controller that makes a measurement follow a reference, given at its samples."""

    measurement: str
    controller: Controller
    reference: Signal


class Tracked(Law):
    """Controllers in closed loop, by the command that each computes; a command without one stays 0."""

    def __init__(self, rig: Rig, loops: Mapping[str, Loop], dt: float):
        _check_names(loops, rig.commands, "loops", "command")
        _check_names({loop.measurement: loop for loop in loops.values()}, rig.measurements, "loops", "measurement")
        if len({loop.measurement for loop in loops.values()}) < len(loops):
            raise InputError("a measurement follows two references.", field="loops")
        lengths = {np.shape(loop.reference) for loop in loops.values()}
        if len(lengths) != 1 or len(next(iter(lengths))) != 1 or lengths == {(0,)}:
            raise InputError("a row of samples expected, as many for each loop.", field="reference")
        self.count = next(iter(lengths))[0]
        self.references = {loop.measurement: np.asarray(loop.reference) for loop in loops.values()}
        self.controlled = tuple(loops)
        about = [eqx.tree_pformat(loop.controller, short_arrays=False) for loop in loops.values()]
        self.about = "\n".join(about)
        self._loops, self._dt = loops, dt
        self._rest = (0.0,) * len(rig.commands)
        commands, measurements = [*rig.commands], [*rig.measurements]
        self._places = [(commands.index(to), measurements.index(loop.measurement)) for to, loop in loops.items()]
        self._steps = list[ControllerSteps]()

    def prepare(self) -> None:
        """Compile the step of each controller."""
        every = self._loops.values()
        self._steps = [ControllerSteps(loop.controller.planned(loop.reference, self._dt)) for loop in every]

    def begin(self, measured: Sequence[float]) -> None:
        """Start each controller from a command of 0."""
        for steps, (_, measurement) in zip(self._steps, self._places, strict=True):
            steps.begin(measured[measurement])

    def commands(self, sample: int, measured: Sequence[float]) -> tuple[float, ...]:
        """The command of each controller."""
        every = [*self._rest]
        for steps, (command, measurement) in zip(self._steps, self._places, strict=True):
            every[command] = steps.command(measured[measurement])
        return tuple(every)


class ControllerSteps:
    """A regulator and its state, compiled before the first sample."""

    def __init__(self, regulator: Regulator):
        self._regulator = regulator
        self._compiled = CompiledStep(_step, regulator, _initial(regulator, np.asarray(0.0)), np.asarray(0.0))

    def begin(self, measured: float) -> None:
        """Start from a command of 0."""
        self._compiled.start(_initial(self._regulator, np.asarray(measured)))

    def command(self, measured: float) -> float:
        """The command for a measurement."""
        return self._compiled(np.asarray(measured)).item()


def _check_names(given: Mapping[str, Any], known: Mapping[str, str], field: str, kind: str) -> None:
    for name in given:
        if name not in known:
            raise InputError(f'"{shorten(name)}" is no {kind} of this rig: {", ".join(known) or "none"}.', field=field)


@eqx.filter_jit
def _initial(regulator: Regulator, measured: ArrayLike) -> Any:
    return regulator.initial(jnp.zeros(()), measured)


def _step(regulator: Regulator, state: Any, measured: ArrayLike) -> tuple[Any, Array]:
    return regulator.step(state, jnp.asarray(measured))
