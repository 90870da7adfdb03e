"""A simulated actuator of a rig file: a saved model, or the numbers of a linear one, in any units."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal
from zlib import crc32

import jax.numpy as jnp
import numpy as np
from pydantic import PlainValidator, WithJsonSchema

from nectosome.description.fields import Name, PositiveNumber
from nectosome.drives import Sensor
from nectosome.io.schema.described import unfit
from nectosome.io.schema.quantity import Quantity
from nectosome.units import InputError, shorten, split_unit, unit_to_si

from ..actuator_bench import actuator_loop
from ..device_files import AnyQuantity, FileFields, Word, device_model, same_unit
from ..guards import CommandLimits, MeasurementLimits
from ..simulated_rig import SimulatedRig

if TYPE_CHECKING:
    from nectosome.identification.hysteresis.fit import Identified


def gain_of(text: str) -> tuple[float, str, str]:
    """Gain in SI, and the SI units of command and measurement: (4.6e-7, "Pa", "m") of "46 mm/bar".

    Raises ValueError, a sentence for people, where it is no number above 0 with a unit per unit.
    """
    number, unit = split_unit(text)
    above, slash, below = unit.rpartition("/")
    if not slash:
        raise ValueError(f'"{shorten(text)}" is no measurement per command. Write it as in "46 mm/bar" or "20 deg/V".')
    (factor, measured), (per, command) = unit_to_si(above.strip()), unit_to_si(below.strip(" ()"))
    if not number > 0:
        raise ValueError(f'"{shorten(text)}" is out of range: it must be more than 0.')
    return number * factor / per, command, measured


def _gain(value: Any) -> str:
    try:
        gain_of(str(value))
    except ValueError as error:
        raise unfit(str(error)) from None
    return str(value)


_Gain = Annotated[str, PlainValidator(_gain), WithJsonSchema({"type": "string", "examples": ["46 mm/bar", "20 deg/V"]})]


@dataclass(frozen=True)
class Simulation:
    """A simulated actuator: a saved model, or the numbers of a linear one."""

    model: Word | None = None
    """A model saved by `nectosome identify hysteresis --save`, relative to this file, instead of gain and frequency."""
    gain: _Gain | None = None
    """Measurement per command of a linear model, which says their units."""
    frequency: Annotated[float, Quantity("angular_speed", minimum=0, exclusive=True)] | None = None  # [rad/s]
    """Natural frequency of a linear model."""
    damping: PositiveNumber = 1.0
    """Damping ratio of a linear model."""
    noise: AnyQuantity | None = None
    """Standard deviation of the sensor; that of the model where it is left out."""
    command: Name = "pressure"
    """Name of its command."""
    measurement: Name = "displacement"
    """Name of its measurement."""
    real_time: bool = False
    """Whether a run takes as long as on a real rig."""


class SimulatedActuator(SimulatedRig):
    """An identified actuator with its valve, which keeps to the limits of the command.

    Its sensor sees beyond the limits of the measurement, so that guards find what leaves them, and has a noise of its
    own by the `seed`.
    """

    described_by = device_model("simulated", Simulation)

    def __init__(
        self,
        model: "Identified",
        dt: float,
        noise: float | None = None,
        *,
        command: str = "pressure",
        measurement: str = "displacement",
        pace: Literal["virtual", "real"] = "virtual",
        seed: int = 0,
    ):
        names = (command, model.units[0]), (measurement, model.units[1])
        super().__init__(model.block(), command=names[0], measurement=names[1], pace=pace)
        self.model, self._own_noise, self._seed, self._sample = model, noise, seed, dt

    @classmethod
    def from_description(cls, given: Any, file: FileFields, dt: float) -> "SimulatedActuator":
        """Of its own limits, it knows by `take_limits`."""
        model = _model(given, file)
        noise = None
        if given.noise is not None:
            try:
                noise = same_unit(given.noise, model.units[1])
            except ValueError as error:
                raise file.wrong(str(error), "noise") from None
            if noise < 0:
                raise file.wrong(f'"{given.noise}" is out of range: it must be at least 0.', "noise")
        names = {"command": given.command, "measurement": given.measurement}
        pace, seed = "real" if given.real_time else "virtual", crc32(str(file.at).encode())
        return cls(model, dt, noise, **names, pace=pace, seed=seed)

    def take_limits(self, commands: Mapping[str, CommandLimits], measurements: Mapping[str, MeasurementLimits]) -> None:
        """Raises InputError without those of the measurement, by which its noise is known."""
        (command,), (measurement,) = self.commands, self.measurements
        if measurement not in measurements:
            message = "is missing: a simulated actuator needs least and most of it."
            raise InputError(message, field=f"measurements.{measurement}")
        loop = actuator_loop(self.model, commands[command], measurements[measurement], self._sample, self._own_noise)
        self.dt, self._plant = self._sample / loop.substeps, loop.plant
        self._sensor = Sensor(loop.sensor.noise, jnp.asarray(-jnp.inf), jnp.asarray(jnp.inf), jnp.asarray(self._seed))


def _model(given: Any, file: FileFields) -> "Identified":
    """The model: saved, or linear, without hysteresis."""
    from nectosome.identification.hysteresis.files import saved_model
    from nectosome.identification.hysteresis.fit import Identified
    from nectosome.io import load_dataset

    linear = {name: getattr(given, name) for name in ("gain", "frequency")}
    if given.model is None:
        for name, value in linear.items():
            if value is None:
                raise file.wrong("is missing: give model, or gain and frequency.", name)
        gain, *units = gain_of(given.gain)
        theta = {"frequency": given.frequency, "damping": given.damping}
        return Identified(theta, {}, np.ones(1), np.full(2, gain), 0.0, 2, (), (units[0], units[1]))
    for name, value in linear.items():
        if value is not None:
            raise file.wrong("belongs to a linear model: leave it or model out.", name)
    try:
        return saved_model(load_dataset(file.folder / given.model), given.model)
    except InputError as error:
        raise file.wrong(str(error), "model") from None
