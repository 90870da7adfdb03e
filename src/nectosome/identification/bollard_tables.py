r"""Thrusters by the tables of their makers: command, speed, current and thrust on a stand, in water at rest.

The coefficients are those of `loads.propeller` at no inflow, a motor as in `drives.motor` is at its speed: with the
duty cycle d, the supply U, the motor's constant K and resistance R, and the battery's current I,

$$ T = a\, \rho D^4 n |n|, \quad Q = a' \rho D^5 n |n|, \quad |d|\, U = K \omega + R\, Q/K, \quad I = |d|\, Q/K $$

a comes from thrust and speed alone. The others are those with which speed and current follow from command and supply.
A table has no torque, so that a', K and R share their errors: together they give the table, apart they are rough.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.measure import read
from nectosome.units import InputError, read_positive

from .fits.curves import CurveFit, fit
from .fits.identifiability import Interval

if TYPE_CHECKING:
    import xarray as xr

DENSITY = 1000.0  # of the water of makers' tanks [kg/m3]
_NEUTRAL, _FULL = 1.5e-3, 4e-4  # pulse of an electronic speed controller that stops, and what more is full speed [s]
_USUAL = 0.05, 1.0  # thrust coefficients at rest
_LEAST = 4  # rows that turn one way
_COLUMNS = {  # words in the names of columns, and the units that their values may have
    "command": (("pwm", "throttle", "duty", "command"), ("s", "", "1")),
    "speed": (("rpm", "speed"), ("", "1", "rad/s", "1/s")),
    "current": (("current",), ("A",)),
    "supply": (("voltage",), ("V",)),
    "thrust": (("force", "thrust"), ("N",)),
}
UNITS = {"torque_constant": "N m/A", "resistance": "ohm"}
"""Units of what is found; the rest has none."""


class BollardTable(NamedTuple):
    """Rows of one table, each a steady state on a stand."""

    name: str
    duty: Float[np.ndarray, "n"]  # d [-]
    speed: Float[np.ndarray, "n"]  # omega, with the sign of d [rad/s]
    current: Float[np.ndarray, "n"]  # I, of the battery [A]
    supply: Float[np.ndarray, "n"]  # U [V]
    thrust: Float[np.ndarray, "n"]  # [N]

    @property
    def turns(self) -> Float[np.ndarray, "n"]:
        """Mask of the rows that turn."""
        return self.speed != 0

    def first_turning(self) -> tuple[float, float]:
        """Largest duty cycle of the rows at rest, and smallest of those that turn, either way."""
        first = float(np.abs(self.duty[self.turns]).min(initial=1.0))
        rest = np.abs(self.duty[~self.turns])
        return float(rest[rest < first].max(initial=0.0)), first


class ThrusterFit(NamedTuple):
    """What tables of a thruster tell of its propeller and motor."""

    diameter: float  # [m]
    tables: tuple[BollardTable, ...]
    values: Mapping[str, float]  # by fields of a thruster and of a motor
    intervals: Mapping[str, Interval]  # 95 %; of the dead band the range between rows at rest and rows that turn
    warnings: tuple[str, ...]

    def predicted(self, table: BollardTable) -> dict[str, Float[np.ndarray, "n"]]:
        """Speed [rad/s], current [A] and thrust [N] of the rows of a table, from its commands and supply."""
        v = self.values
        back = np.sign(table.duty) < 0
        torque, thrust = (
            np.where(back, v.get(f"backward_{name}", v[name]), v[name]) * DENSITY for name in ("torque", "thrust")
        )
        duty = np.where(np.abs(table.duty) > v["dead_band"], table.duty, 0.0)
        load = torque * self.diameter**5 / (4 * np.pi**2)
        speed, current = _state(duty, table.supply, load, v["torque_constant"], v["resistance"])
        push = thrust * self.diameter**4 * speed * np.abs(speed) / (4 * np.pi**2)
        return {"speed": speed, "current": current, "thrust": push}

    def to_dataset(self) -> "xr.Dataset":
        """What was found, and the tables beside what it gives.

        - over `parameter` (fields of a thruster and of a motor; `unit`): `value`, and its interval `low` to `high`.
        - over `recording` (a table): `e_speed`, `e_current`, `e_thrust`, root mean squares of the error of rows
          [percent of the largest measured value].
        - over `sample`, table by table (`of` is its place): `duty`, `supply`, and `speed`, `current`, `thrust`, each
          with `measured_` and `computed_` before it.
        """
        import xarray as xr

        names, computed = [*self.values], [self.predicted(table) for table in self.tables]
        units = {"speed": "rad/s", "current": "A", "thrust": "N"}
        places = {"duty": ("1", [t.duty for t in self.tables]), "supply": ("V", [t.supply for t in self.tables])}
        samples = {name: ("sample", np.concatenate(x), {"units": unit}) for name, (unit, x) in places.items()}
        errors = {}
        for name, unit in units.items():
            pairs = [(getattr(t, name), c[name]) for t, c in zip(self.tables, computed, strict=True)]
            for which, values in zip(("measured", "computed"), zip(*pairs, strict=True), strict=True):
                samples[f"{which}_{name}"] = ("sample", np.concatenate(values), {"units": unit})
            off = [100 * float(np.sqrt(np.mean((c - m) ** 2)) / np.abs(m).max()) for m, c in pairs]
            errors[f"e_{name}"] = ("recording", off, {"units": "percent"})
        ends = [(one.low, one.high) for one in (self.intervals[name] for name in names)]
        found = {"value": [*self.values.values()], "low": [x for x, _ in ends], "high": [x for _, x in ends]}
        return xr.Dataset(
            samples | errors | {name: ("parameter", x) for name, x in found.items()},
            {
                "parameter": names,
                "unit": ("parameter", [UNITS.get(name, "") for name in names]),
                "recording": [table.name for table in self.tables],
                "of": ("sample", np.repeat(np.arange(len(self.tables)), [t.duty.size for t in self.tables])),
            },
            {"diameter": self.diameter, "warnings": json.dumps(self.warnings)},
        )


def identify_thruster(
    tables: Sequence[str | Path], diameter: str | float, *, config: str | Path | None = None
) -> ThrusterFit:
    """Find the coefficients of a thruster, its motor and its dead band from tables, such as of 12 and of 16 V.

    - tables: files whose rows have command, speed, current, voltage and thrust, with units in their headings. A
      command in seconds is the pulse of a servo, 1.1 to 1.9 ms with 1.5 ms at rest; else it is a duty cycle. A speed
      without a unit is in rpm.
    - diameter: of the propeller, [m] unless it has a unit.
    - config: a sheet that names columns, where their names do not tell.

    Raises InputError for tables that lack a column, or with too few rows that turn.
    """
    if not tables:
        raise InputError("is empty: name at least one table.", field="tables")
    for k, path in enumerate(map(Path, tables)):
        if path in map(Path, tables[:k]):
            raise InputError("is named twice: its rows would count twice. Name it once.", file=str(path))
    size = read_positive(diameter, "length", "diameter")
    known = tuple(read_table(path, config) for path in tables)
    duty, speed, current, supply, thrust = (
        np.concatenate([getattr(table, name) for table in known]) for name in BollardTable._fields[1:]
    )
    turns = speed != 0
    ahead, back = turns & (duty > 0), turns & (duty < 0)
    if ahead.sum() < _LEAST:
        raise InputError(f"{ahead.sum()} rows turn ahead, and {_LEAST} at least are needed.", file=str(tables[0]))
    both = back.sum() >= _LEAST
    values, intervals, warnings = {}, {}, []

    def take(found: CurveFit) -> None:
        values.update(found.values)
        intervals.update(found.intervals)
        warnings.extend(words for words in found.warnings if "correlated" not in words)

    push = DENSITY * size**4 / (4 * np.pi**2)
    for rows, field in ((ahead, "thrust"), *([(back, "backward_thrust")] if both else [])):
        x, y = speed[rows] * np.abs(speed[rows]), thrust[rows]
        take(fit(lambda x, **a: push * sum(a.values()) * x, x, y, {field: (0.0, 10.0)}, starts=1))
    if not _USUAL[0] <= values["thrust"] <= _USUAL[1]:
        usual = f"propellers have {_USUAL[0]:g} to {_USUAL[1]:g}"
        warnings.append(f"a thrust coefficient of {values['thrust']:.3g}: {usual}. Check the diameter and the units")
    used = ahead | back if both else ahead
    most = np.abs(speed[used]).max(), current[used].max()
    load = DENSITY * size**5 / (4 * np.pi**2)

    def rows_of(
        x: np.ndarray, torque: float, torque_constant: float, resistance: float, backward_torque: float | None = None
    ) -> np.ndarray:
        each = load * np.where(x > 0, torque, torque if backward_torque is None else backward_torque)
        one, other = _state(x, supply[used], each, torque_constant, resistance)
        return np.concatenate([one / most[0], other / most[1]])

    steady = np.concatenate([speed[used] / most[0], current[used] / most[1]])
    fastest = float(np.max(np.abs(duty * supply / np.where(turns, speed, np.inf))))
    spans = {"torque": "0.001..1 log", "torque_constant": f"{1e-3 * fastest}..{fastest} log"}
    spans |= {"resistance": "1e-3..1e3 log"} | ({"backward_torque": "0.001..1 log"} if both else {})
    take(fit(rows_of, duty[used], steady, spans, starts=4))
    rest, first = np.transpose([table.first_turning() for table in known])
    low, high = sorted((float(rest.max()), float(first.min())))  # tables of several voltages may contradict each other
    values["dead_band"], intervals["dead_band"] = 0.5 * (low + high), Interval(low, high, True, True)
    return ThrusterFit(size, known, values, intervals, tuple(dict.fromkeys(warnings)))


def _state(
    duty: Float[np.ndarray, "n"], supply: Float[np.ndarray, "n"], load: Float[np.ndarray, "n"], K: float, R: float
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    r"""Speed [rad/s] and current of the battery [A] where the torque is that of a load $\omega^2$."""
    c = R * load / K
    speed = 2 * np.abs(duty) * supply / (K + np.sqrt(K**2 + 4 * c * np.abs(duty) * supply))
    return np.sign(duty) * speed, np.abs(duty) * load * speed**2 / K


def read_table(path: str | Path, config: str | Path | None = None) -> BollardTable:
    """Read a table. Raises InputError that names file and column of what is missing or has another unit."""
    data, columns = read(path, config), dict[str, np.ndarray]()
    for what, (words, units) in _COLUMNS.items():
        fitting = [
            name for name in map(str, data.data_vars) if name == what or any(word in name.lower() for word in words)
        ]
        if len(fitting) != 1:
            there = ", ".join(map(str, data.data_vars))
            why = "is in several columns" if fitting else "is in no column"
            how = f"Name one in a sheet (--config), as in columns: {{{what}: {{column: ...}}}}."
            raise InputError(f"{why}; there are {there}. {how}", file=str(path), field=what)
        unit = str(data[fitting[0]].attrs.get("units", ""))
        if unit not in units:
            given = f"is in {unit}" if unit else "has no unit"
            raise InputError(f"{given}; {' or '.join(filter(None, units))} is needed.", file=str(path), field=what)
        columns[what] = data[fitting[0]].values.astype(float)
        if what == "speed" and unit in ("", "1"):
            columns[what] = columns[what] * (2 * np.pi / 60)
        if what == "command" and unit == "s":
            columns[what] = (columns[what] - _NEUTRAL) / _FULL
    rows = np.column_stack([*columns.values()])
    rows = rows[np.isfinite(rows).all(axis=1)]
    command, speed, current, supply, thrust = rows.T
    if np.abs(command).max(initial=0.0) > 1.001:
        why = f"reaches {np.abs(command).max():.3g}: a duty cycle is from -1 to 1, a pulse from 1.1 to 1.9 ms."
        raise InputError(why, file=str(path), field="command")
    table = BollardTable(Path(path).stem, command, np.sign(command) * np.abs(speed), np.abs(current), supply, thrust)
    against = table.turns & (np.sign(thrust) == -np.sign(command)) & (np.abs(thrust) > 0.05 * np.abs(thrust).max())
    if against.any():
        k = int(np.flatnonzero(against)[0])
        why = f"is {thrust[k]:.3g} N at a command of {command[k]:.3g}: command and thrust have one sign."
        raise InputError(why, file=str(path), field="thrust")
    return table
