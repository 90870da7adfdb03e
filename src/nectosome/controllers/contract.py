"""The contract of controllers and of the plants that they act on, and the controllers that have a name."""

from abc import abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Status
from nectosome.core.described import number
from nectosome.io.discovery import classes_below, load_modules
from nectosome.units import InputError, did_you_mean, shorten

from .gains import PIDGains
from .hysteretic_model import SMOOTHING, HystereticModel

Progress = Callable[[float], bool | None]
Stop = Callable[[Float[np.ndarray, "k"], Float[np.ndarray, "k"]], bool]


class Regulator(eqx.Module):
    """A controller for one reference and one time between samples."""

    @abstractmethod
    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> Any:
        """State before the first sample: bumpless transfer from a held command and a measurement."""

    @abstractmethod
    def step(self, state: Any, measured: Float[Array, ""]) -> tuple[Any, Float[Array, ""]]:
        """State after a sample, and the command computed from its measurement."""


class ActuatorLimits(eqx.Module):
    """Saturation and slew rate of the command, as the controller knows them."""

    low: Float[Array, ""] = eqx.field(converter=number)
    high: Float[Array, ""] = eqx.field(converter=number)
    slew: Float[Array, ""] = eqx.field(converter=number, default=np.inf)  # largest rate [1/s of its unit]

    def limit(self, command: Array, previous: Array, dt: float) -> Array:
        """The nearest admissible command, dt [s] after the previous one."""
        most = self.slew * dt
        return jnp.clip(jnp.clip(command, previous - most, previous + most), self.low, self.high)


class Pace(NamedTuple):
    """How far controllers with a model smooth and look ahead."""

    smoothing: float  # of references [s]
    learning: float  # of the errors that are learned from [s]
    horizon: int  # samples
    weight: float  # of inputs of the dynamics against outputs, squared
    wander: float  # steps of the disturbance by the noise of measurements [input by output]


ACTUATOR = Pace(SMOOTHING, 0.15, 30, 0.1, 0.4)
"""Of a pneumatic actuator at 200 Hz, whose dynamics have a gain of 1."""


class LoopData(NamedTuple):
    """What a controller with a name is made of."""

    gains: PIDGains  # [SI]
    limits: ActuatorLimits
    dt: float  # between samples [s]
    model: HystereticModel | None = None
    noise: float = 0.0  # of measurements [SI]
    pace: Pace = ACTUATOR
    beat: float = 0.0  # period of the drives [s], 0 without


class Controller(eqx.Module):
    """Computes commands from measurements; `tests/controllers/test_controllers.py` holds every controller to it.

    A command depends on no later measurement. Structure is static, numbers are traced. Commands and files know a class
    with a `name`, which `from_loop` makes.
    """

    name: ClassVar[str] = ""
    needs_model: ClassVar[bool] = False
    scheduled: ClassVar[bool] = False  # its gains are rows by the frequency of the reference
    learns: ClassVar[bool] = False  # from run to run

    @classmethod
    def from_loop(cls, loop: LoopData) -> "Controller":
        """The controller of a loop; `loop.model` is there if `needs_model`, gains have rows if `scheduled`."""
        raise NotImplementedError(f"{cls.__name__} has no name.")

    @abstractmethod
    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Regulator for a reference known in advance, in samples dt [s] apart; its last value holds after its end."""

    def after(self, record: Any, dt: float) -> "Controller":
        """The controller of the next run; `record` has reference, measured and command of the last one."""
        return self


def controllers() -> dict[str, type[Controller]]:
    """Classes of controllers by name, those of this room first."""
    load_modules("nectosome.controllers")
    return {cls.name: cls for cls in classes_below(Controller) if cls.__dict__.get("name")}


def controller_named(name: str) -> type[Controller]:
    """The class of this name. Raises InputError for an unknown one."""
    known = controllers()
    if name not in known:
        message = f'"{shorten(name)}" is not known: {", ".join(known)}.{did_you_mean(name, known)}'
        raise InputError(message, field="controller")
    return known[name]


class PlantRecord(Protocol):
    """Signals of a closed loop at its samples."""

    @property
    def output(self) -> Any:
        """The true output, without noise."""

    @property
    def measured(self) -> Any:
        """What the controller gets."""

    @property
    def command(self) -> Any:
        """What it sends, held until the next sample."""

    @property
    def status(self) -> Status:
        """How the run ended."""
        ...


class Plant(Protocol):
    """A block or a robot with its sensor, which runs under any controller."""

    @property
    def dt(self) -> float:
        """Time between samples [s]."""
        ...

    def quiet(self) -> Self:
        """The same without noise."""
        ...

    def run(
        self,
        controller: Controller,
        reference: Float[np.ndarray, "n"],
        *,
        progress: Progress | None = None,
        stop: Stop | None = None,
    ) -> PlantRecord:
        """Closed-loop run along a reference, known in advance.

        What is simulated sample by sample calls `progress(share)`, is cancelled where that returns False, and may end
        where `stop(measured, commands)` is true.
        """
        ...
