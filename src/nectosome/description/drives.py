"""Drives with motors: the motor of a joint or a strain, its supply, and the signal that it follows."""

import tomllib
from functools import cache
from importlib.resources import files
from operator import attrgetter
from typing import Annotated, Any, ClassVar, Generic, Literal, Self, TypeVar

from pydantic import model_validator

from nectosome.description import fields
from nectosome.description.fields import Name
from nectosome.description.mirror import Mirror, Mirrored, opposite
from nectosome.description.signals import DutySignal, VoltageSignal
from nectosome.io.schema.described import Described, OneOf, Uncertainty, increasing, wrong
from nectosome.io.schema.structure import slot
from nectosome.units import did_you_mean, format_quantity

S = TypeVar("S", bound=float)
"""A speed of a joint."""
_INCREASING = "the speeds must increase."
_SHEET = ("rated_voltage", "stall_torque", "no_load_speed")
_CONSTANTS = ("torque_constant", "resistance")
_OF_POSITION = ("derivative", "dead_band")


@cache
def servos() -> dict[str, dict[str, str]]:
    """Return the catalogue of motors with their gears: what their data sheets say, and where that stands."""
    return tomllib.loads(files("nectosome.description").joinpath("servos.toml").read_text(encoding="utf-8"))


class MotorDescription(Mirrored):
    """A DC motor with its gear, by its data sheet or by its constants, at the shaft that they are of."""

    field: ClassVar[str]
    """Field of a joint or a strain that has it."""

    model: str | None = None
    """Name of a motor in the catalogue, which gives what is not written here."""
    rated_voltage: fields.PositiveVoltage | None = None
    """Voltage at which the data sheet gives torque, speed and currents."""
    stall_torque: fields.PositiveTorque | None = None
    """Torque at rest, at the rated voltage."""
    no_load_speed: fields.PositiveAngularSpeed | None = None
    """Speed without a load, at the rated voltage."""
    stall_current: fields.PositiveCurrent | None = None
    """Current at rest, at the rated voltage. Without it that of a motor that loses nothing in its gear."""
    no_load_current: fields.NonNegativeCurrent = 0.0
    """Current without a load, at the rated voltage."""
    torque_constant: fields.PositiveTorqueConstant | None = None
    """Torque per current, and voltage per speed, of the motor alone, instead of a data sheet."""
    resistance: fields.PositiveResistance | None = None
    """Resistance of the winding, instead of a data sheet."""
    friction: fields.NonNegativeTorque = 0.0
    """Dry friction at the shaft, with the constants. It holds what is less, as a motor that is off holds its joint."""
    gear_ratio: fields.PositiveNumber = 1.0
    """Turns of that shaft for one turn of the joint, of a gear behind it."""
    efficiency: fields.PositiveShare = 1.0
    """Share of the motor's torque that this gear passes on. A load that drives it meets the share 1/(2 - efficiency) of
    itself at the motor; tooth friction would let 2 - 1/efficiency through, and lock below 0.5."""
    inertia: fields.NonNegativeInertia = 0.0
    """Moment of inertia of rotor and gears, at that shaft."""
    radius: fields.Length | None = None
    """Radius of the drum or pinion that moves a slide; for slides only."""
    current_limit: fields.PositiveCurrent | None = None
    """Largest current that the controller lets through."""
    supply: fields.PositiveVoltage | None = None
    """Voltage of a supply that does not sag."""
    battery: Name | None = None
    """Name of the battery that supplies it, instead of a supply."""

    spreads: ClassVar = {
        name: Uncertainty(low, high, "servos beside their sheets, chosen", "measure it stalled and without load")
        for name, low, high in (
            ("stall_torque", 0.8, 1.0),  # no more: a sheet must not give more than it takes
            ("no_load_speed", 0.85, 1.0),
            ("friction", 0.5, 2.0),
        )
    }

    @property
    def beside_defaults(self) -> frozenset[str]:
        """Those that the catalogue has for its model."""
        return frozenset(name for name in servos().get(self.model or "", {}) if getattr(self, name, None) is not None)

    @property
    def decided(self) -> dict[str, str]:
        """Also what goes with constants by a data sheet, and the other way round."""
        constants = {"no_load_current": "friction"}
        return super().decided | (constants if self.rated_voltage is None else {"friction": "no_load_current"})

    def of_sheet(self) -> list[str]:
        """Return the fields that stand as the catalogue has them for its model."""
        sheet = servos().get(self.model or "", {})
        read = {name: slot(type(self)).child(name, self) for name in sheet if name != "source"}
        quantities = {name: here.quantity for name, here in read.items() if here is not None and here.quantity}
        return [
            name
            for name, one in quantities.items()
            if one.read(sheet[name], units_required=True) == getattr(self, name)
        ]

    @model_validator(mode="before")
    @classmethod
    def _of_catalogue(cls, given: Any) -> Any:
        if not isinstance(given, dict) or given.get("model") is None:
            return given
        known = servos()
        if given["model"] not in known:
            near = did_you_mean(str(given["model"]), known)
            raise wrong("model", f'there is no motor "{given["model"]}" in the catalogue.{near}')
        if any(given.get(name) is not None for name in _CONSTANTS):
            raise wrong("model", "the catalogue gives a data sheet, not constants. Leave the one or the others out.")
        sheet = {name: value for name, value in known[given["model"]].items() if name != "source"}
        return {**sheet, **given}

    @model_validator(mode="after")
    def _whole(self) -> Self:
        sheet, constants = ([getattr(self, name) is not None for name in names] for names in (_SHEET, _CONSTANTS))
        if any(sheet) and any(constants):
            name = _CONSTANTS[constants.index(True)]
            raise wrong(name, "there is a data sheet as well. Give the data sheet or the constants.")
        names, has = (_CONSTANTS, constants) if any(constants) else (_SHEET, sheet)
        if not all(has):
            sheet_words, words = (", ".join(group) for group in (_SHEET, _CONSTANTS))
            more = f"{sheet_words}, or a model of the catalogue, or {words}" if names is _SHEET else words
            raise wrong(names[has.index(False)], f"is missing. A motor needs {more}.")
        if names is _SHEET and self.friction:
            raise wrong("friction", "goes with the constants; with a data sheet, give the no_load_current.")
        if names is _CONSTANTS and (self.stall_current is not None or self.no_load_current):
            name = "no_load_current" if self.no_load_current else "stall_current"
            raise wrong(name, "goes with a data sheet; with constants, give the friction.")
        if self.supply is not None and self.battery is not None:
            raise wrong("supply", "there is a battery as well. Leave one of the two out.")
        return self

    @model_validator(mode="after")
    def _obeys_energy(self) -> Self:
        if self.beyond_energy is not None:
            raise wrong(*self.beyond_energy)
        return self

    @property
    def beyond_energy(self) -> tuple[str, str] | None:
        """The field of a data sheet that would give more power than it takes, and why; None where none does."""
        if self.rated_voltage is None or self.stall_current is None:
            return None
        if self.no_load_current >= self.stall_current:
            given, most = (format_quantity(x, "current") for x in (self.no_load_current, self.stall_current))
            why = f"{given} is not less than the stall current of {most}. Check the units of both."
            return "no_load_current", why
        constant = self.rated_voltage * (1 - self.no_load_current / self.stall_current) / (self.no_load_speed or 1.0)
        most = constant * (self.stall_current - self.no_load_current)
        if (self.stall_torque or 0.0) > most * (1 + 1e-9):
            why = f"is more than {most:.4g} N m, which this current gives in a motor of this voltage and speed"
            return "stall_torque", f"{why} that loses nothing. Check the units of all four."
        return None


class FreeMotor(MotorDescription):
    """A motor that follows no motion of its joint, which moves as it can. Each class below it is a kind of motor."""

    field = "motor"
    kind: Any  # its name in a file, a literal of each class


class MotorDrive(FreeMotor):
    """A motor that is given a voltage: its torque falls with its speed, and the joint moves as it can."""

    kind: Literal["voltage"] = "voltage"
    voltage: VoltageSignal | None = None
    """Voltage over time, at most that of the supply where there is one."""
    duty_cycle: DutySignal | None = None
    """Duty cycle of pulse-width modulation over time, from -1 to 1: share of the supply's voltage."""
    dead_band: fields.DeadBand = 0.0
    """Duty cycle, either way, up to which the controller gives no voltage; it sets in over the next hundredth."""
    mirror = Mirror(voltage=opposite, duty_cycle=opposite)

    @model_validator(mode="after")
    def _has_a_voltage(self) -> Self:
        if self.voltage is None and self.duty_cycle is None:
            raise wrong("voltage", "is missing. Give the voltage over time, or the duty cycle of a supply or battery.")
        if self.voltage is not None and self.duty_cycle is not None:
            raise wrong("duty_cycle", "there is a voltage as well. Leave one of the two out.")
        if self.duty_cycle is not None and min(self.duty_cycle.least(), opposite(self.duty_cycle).least()) < -1:
            raise wrong("duty_cycle", "goes beyond -1 or 1, the full voltage of the supply backward and forward.")
        if self.duty_cycle is None and self.dead_band:
            raise wrong("dead_band", "is that of a duty cycle, and there is a voltage. Leave it out.")
        if self.duty_cycle is not None and self.supply is None and self.battery is None:
            raise wrong("supply", "is missing. The duty cycle is a share of its voltage: give a supply or a battery.")
        return self


AnyMotor = Annotated[FreeMotor, OneOf(default="voltage")]


def check_drive(moved: Any, noun: str, slides: bool = False) -> None:
    """Raise the error of a field of a joint or a strain whose motion, servo and motor do not fit together."""
    servo, motor, motion = (getattr(moved, name, None) for name in ("servo", "motor", "motion"))
    if servo is not None and motion is None:
        raise wrong("motion", "is missing. Say which motion the servo is to follow.")
    if servo is not None and motor is not None:
        raise wrong("servo", "there is a motor as well. Leave one of the two out.")
    if motor is not None and motion is not None:
        raise wrong("motion", f"a {noun} with a motor is moved by its voltage. Leave one of the two out.")
    drive = servo or motor
    if drive is not None and (drive.radius is not None) != slides:
        why = "is missing. Give the radius of the drum or pinion." if slides else "is for slides. Leave it out."
        raise wrong(f"{drive.field}.radius", why)


class _ScheduledGain(Described, Generic[S]):
    """What factors on the gains of a velocity loop share."""

    at: S
    """Speed, whichever way; between two of them the factor changes evenly, outside it stays."""
    factor: fields.PositiveNumber
    """Factor on both gains."""


class AngularGain(_ScheduledGain[fields.PositiveAngularSpeed]):
    """A factor on the gains of a velocity loop at an angular speed."""


class LinearGain(_ScheduledGain[fields.PositiveSpeed]):
    """A factor on the gains of a velocity loop at a speed."""


class _VelocityLoop(Described, Generic[S]):
    """What velocity loops share."""

    full_voltage_at: S
    """Error of the speed from which on the motor gets all of the voltage."""
    integral_time: fields.PositiveTime | None = None
    """Time in which the integral of an error counts as much as the error; without it there is no integral."""


class AngularVelocityLoop(_VelocityLoop[fields.PositiveAngularSpeed]):
    """A velocity loop (PI) of a hinge: it follows the rate of the motion, and forgets where it should be."""

    schedule: Annotated[tuple[AngularGain, ...], increasing(_INCREASING, attrgetter("at"))] = ()
    """Factors on both gains at increasing speeds, as where more is needed against dry friction at low speed."""


class LinearVelocityLoop(_VelocityLoop[fields.PositiveSpeed]):
    """A velocity loop (PI) of a slide: it follows the rate of the motion, and forgets where it should be."""

    schedule: Annotated[tuple[LinearGain, ...], increasing(_INCREASING, attrgetter("at"))] = ()
    """Factors on both gains at increasing speeds, as where more is needed against dry friction at low speed."""


class ServoDrive(MotorDescription):
    """A motor with a position loop that follows the motion of its joint as well as it can, or with a velocity loop."""

    field = "servo"

    derivative: fields.Duration = 0.0
    """Time by which the rate of the error counts, added to the error, of a position loop."""
    torque_limit: fields.PositiveTorque | None = None
    """Largest torque at the joint, which the controller keeps by the current."""
    update_rate: fields.PositiveFrequency | None = None
    """Updates of its loop per second, which holds its share of the voltage between; without it, it is continuous."""
    decided_by = dict.fromkeys(_OF_POSITION, "velocity_loop")

    @model_validator(mode="after")
    def _has_a_supply(self) -> Self:
        if self.supply is None and self.battery is None:
            raise wrong("supply", "is missing. Give the voltage of a supply, or the name of a battery.")
        full, loop = getattr(self, "full_voltage_at"), getattr(self, "velocity_loop")  # noqa: B009
        if (full is None) == (loop is None):
            why = "there is a velocity loop as well. Leave one of the two out."
            if loop is None:
                why = "is missing. Say at which error the motor gets all of the voltage, or give a velocity_loop."
            raise wrong("full_voltage_at", why)
        given = next((name for name in _OF_POSITION if getattr(self, name)), None)
        if loop is not None and given is not None:
            raise wrong(given, "is of a position loop. Leave it out.")
        return self


class AngularServo(ServoDrive):
    """A servo of a hinge."""

    full_voltage_at: fields.PositiveAngle | None = None
    """Error of the angle from which on the motor gets all of the voltage."""
    velocity_loop: AngularVelocityLoop | None = None
    """A loop that follows the rate of the motion, instead of its angle."""
    dead_band: fields.NonNegativeAngle = 0.0
    """Error below which the motor gets no voltage."""


class LinearServo(ServoDrive):
    """A servo of a slide."""

    full_voltage_at: fields.Length | None = None
    """Error of the displacement from which on the motor gets all of the voltage."""
    velocity_loop: LinearVelocityLoop | None = None
    """A loop that follows the rate of the motion, instead of its displacement."""
    dead_band: fields.NonNegativeLength = 0.0
    """Error below which the motor gets no voltage."""


class BatteryDescription(Described):
    """A battery of one or several drives: its voltage sags with the current."""

    voltage: fields.PositiveVoltage
    """Voltage without a current."""
    resistance: fields.Resistance = 0.0
    """Resistance inside, with that of the cables."""
    capacity: fields.Charge | None = None
    """Charge that it can give; range and endurance follow from it."""
    energy: fields.Energy | None = None
    """Energy that it can give at that voltage, instead of the capacity."""
    idle_power: fields.PowerUsed = 0.0
    """Power of the electronics that is always used (hotel load)."""
    regenerative: bool = False
    """Whether braking motors charge it; else what they give becomes heat."""

    @property
    def stored(self) -> float | None:
        """Return the energy that its charge is worth at the voltage without a current [J]; None where not known."""
        return self.energy if self.capacity is None else self.capacity * self.voltage

    @model_validator(mode="after")
    def _gives_what_it_must(self) -> Self:
        if self.capacity is not None and self.energy is not None:
            raise wrong("energy", "there is a capacity as well. Leave one of the two out.")
        if 4 * self.resistance * self.idle_power >= self.voltage**2:
            most = self.voltage**2 / (4 * self.resistance)
            raise wrong("idle_power", f"is more than {most:.4g} W, the most that a battery of this resistance gives.")
        return self
