"""References of the output: shapes, recordings and constants, as samples from t = 0 on."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from nectosome.io.file_system import is_file
from nectosome.units import DIMENSIONS, InputError, did_you_mean, read_positive, read_quantity, shorten, unit_to_si

from .commands import unit_text


def sine(amplitude: float, frequency: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
    """amplitude sin(2 pi frequency t), `time` [s] long."""
    return amplitude * np.sin(2 * np.pi * frequency * times(time, dt))


def triangle(amplitude: float, frequency: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
    """Triangle wave from 0 to amplitude, to -amplitude and back, `time` [s] long."""
    return amplitude * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * frequency * times(time, dt)))


def varying(amplitudes: Sequence[float], frequencies: Sequence[float], dt: float) -> Float[np.ndarray, "n"]:
    """One period of each sine after the other; the rate jumps between them.

    Raises InputError where there are not as many amplitudes as frequencies.
    """
    if len(amplitudes) != len(frequencies) or not amplitudes:
        raise InputError(f"{len(amplitudes)} amplitudes and {len(frequencies)} frequencies; as many are needed.")
    ends = np.concatenate([[0.0], np.cumsum(1 / np.asarray(frequencies, dtype=float))])
    t = times(float(ends[-1]), dt)
    k = np.clip(np.searchsorted(ends, t, side="right") - 1, 0, len(amplitudes) - 1)
    return np.asarray(amplitudes)[k] * np.sin(2 * np.pi * np.asarray(frequencies)[k] * (t - ends[k]))


def chirp(amplitude: float, first: float, last: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
    """A sine whose frequency grows evenly on a logarithmic scale, from `first` to `last` [Hz]."""
    return amplitude * np.sin(2 * np.pi * chirp_turns(times(time, dt), first, last, time))


def chirp_turns(t: Float[np.ndarray, "n"], first: float, last: float, time: float) -> Float[np.ndarray, "n"]:
    """Turns of a chirp since t = 0, `time` [s] long; before and after it the frequency stays `first` and `last`."""
    within, growth = np.clip(t, 0.0, time), np.log(last / first) / time
    turns = first * within if growth == 0 else first * np.expm1(growth * within) / growth
    return turns + first * np.minimum(t, 0.0) + last * np.maximum(t - time, 0.0)


def eased(reference: Float[np.ndarray, "n"], time: float, dt: float) -> Float[np.ndarray, "n"]:
    """A reference that grows from 0 within `time` [s] by the factor s^2 (3 - 2 s), without an initial jump of its rate.

    Raises InputError for a time that is not above 0.
    """
    if not time > 0:
        raise InputError(f"is {time:g} s; it must be more than 0 s.", field="time")
    s = np.minimum(np.arange(len(reference)) * dt / time, 1.0)
    return reference * s**2 * (3 - 2 * s)


def times(time: float, dt: float) -> Float[np.ndarray, "n"]:
    """0, dt, ... up to `time` [s]."""
    return np.arange(int(time / dt + 1e-6) + 1) * dt


def local_frequency(reference: Float[np.ndarray, "n"], dt: float) -> Float[np.ndarray, "n"]:
    """Local frequency [Hz] at each sample, from the time between extrema; beyond the first and the last it is constant.

    0 throughout for a reference with fewer than two extrema.
    """
    signs = np.sign(np.diff(reference))
    moving = np.flatnonzero(signs)
    extrema = moving[1:][np.diff(signs[moving]) != 0] * dt
    if len(extrema) < 2:
        return np.zeros(len(reference))
    each = 0.5 / np.diff(extrema)
    k = np.searchsorted(extrema, np.arange(len(reference)) * dt, side="right") - 1
    return each[np.clip(k, 0, len(each) - 1)]


SHAPES = ("sine", "triangle", "chirp", "varying")
_KINDS = "a quantity, sine, triangle, chirp, varying, or a file with a recording"
_CONSTANT_TIME = 10.0  # s, where none is given


@dataclass(frozen=True)
class Reference:
    """A reference, SI, and the unit in which it was written.

    - kind: constant, sine, triangle, chirp, varying, file, or samples (an array, one value a sample).
    - values: the constant, or the amplitude (one for each sine of `varying`).
    - frequencies: [Hz]; first and last one of a chirp, one for each sine of `varying`.
    - recorded: times from 0 on, [s] of a file, in samples of `samples`; and values.
    """

    kind: str
    dimension: str
    unit: str
    unit_size: float
    values: tuple[float, ...] = ()
    frequencies: tuple[float, ...] = ()
    recorded: tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m"]] | None = None

    @classmethod
    def parse(
        cls,
        reference: "str | Path | float | Float[np.ndarray, 'k'] | Reference",
        dimension: str,
        *,
        amplitude: str | None = None,
        frequency: str | None = None,
        to: str | None = None,
        column: str | None = None,
    ) -> "Reference":
        """Reference of a dimension: text with units, a file, a number or an array of samples in SI.

        - reference: `30 deg`; `sine`, `triangle`, `chirp`, `varying`; or the path of a recording.
        - amplitude, frequency: of a shape, such as `6 mm`, `0.04 Hz`; lists such as `4 mm, 6 mm` of `varying`, which
          has one period of each sine after the other.
        - to: last frequency of a chirp.
        - column: quantity of the file, where several have this dimension.

        Raises InputError, whose field is the argument, for options that are missing or do not belong there.
        """
        if isinstance(reference, Reference):
            return reference
        options = {"amplitude": amplitude, "frequency": frequency, "to": to, "column": column}
        si = DIMENSIONS[dimension].unit
        if not isinstance(reference, str | Path):
            values = np.asarray(reference, dtype=float)
            if values.ndim > 1 or not values.size or not np.isfinite(values).all():
                raise InputError("is no finite number or row of finite numbers.", field="reference")
            _check_options("a number", options)
            if values.ndim == 0:
                return cls("constant", dimension, si, 1.0, (float(values),))
            return cls("samples", dimension, si, 1.0, recorded=(np.arange(values.size), values))
        text = str(reference).strip()
        if text in SHAPES:
            return cls._shape(text, dimension, options)
        if re.match(r"[-+]?\.?\d", text) and not is_file(text):
            _check_options("a constant reference", options)
            value = read_quantity(text, dimension, "reference")
            return cls("constant", dimension, *_unit_of(text, dimension), (value,))
        if not Path(text).suffix:
            near = did_you_mean(text, SHAPES)
            raise InputError(f'"{shorten(text)}" is no reference: {_KINDS}.{near}', field="reference")
        _check_options("a file", options, optional=("column",))
        recorded = recorded_reference(Path(text), dimension, column)
        return cls("file", dimension, si, 1.0, recorded=recorded)

    @classmethod
    def _shape(cls, kind: str, dimension: str, options: dict[str, str | None]) -> "Reference":
        needed = ("amplitude", "frequency", "to") if kind == "chirp" else ("amplitude", "frequency")
        _check_options(f"a {kind}" if kind != "varying" else "a varying reference", options, needed)
        amplitude, frequency = options["amplitude"] or "", options["frequency"] or ""
        sizes, turns = (text.split(",") if kind == "varying" else [text] for text in (amplitude, frequency))
        if len(sizes) != len(turns):
            message = f"{len(turns)} frequencies for {len(sizes)} amplitudes; as many are needed."
            raise InputError(message, field="frequency")
        values = tuple(read_positive(text.strip(), dimension, "amplitude") for text in sizes)
        frequencies = [read_positive(text.strip(), "frequency", "frequency") for text in turns]
        if kind == "chirp":
            frequencies.append(read_positive(options["to"] or "", "frequency", "to"))
        return cls(kind, dimension, *_unit_of(sizes[-1], dimension), values, tuple(frequencies))

    @property
    def size(self) -> float:
        """The constant, or the largest amplitude."""
        if self.recorded is not None:
            return float(np.abs(self.recorded[1]).max())
        return self.values[0] if self.kind == "constant" else max(self.values)

    def duration(self, dt: float) -> float:
        """Length [s] where none is given: two periods, that of the file, 10 s of a constant. Raises InputError."""
        if self.kind == "chirp":
            raise InputError("a chirp needs it.", field="time")
        if self.kind == "varying":
            return float(np.sum(1 / np.array(self.frequencies)))
        if self.recorded is not None:
            return float(self.recorded[0][-1]) * (dt if self.kind == "samples" else 1.0)
        return _CONSTANT_TIME if self.kind == "constant" else 2 / self.frequencies[0]

    def samples(self, time: float, dt: float, start: float = 0.0) -> Float[np.ndarray, "k"]:
        """Values at 0, dt, ... up to `time` [s]; shapes oscillate about `start`, the output at the beginning."""
        t = times(time, dt)
        if self.kind == "constant":
            return np.full(t.size, self.values[0])
        if self.recorded is not None:
            return np.interp(np.arange(t.size) if self.kind == "samples" else t, *self.recorded)
        if self.kind == "varying":
            return start + varying(self.values, self.frequencies, dt)
        if self.kind == "chirp":
            return start + chirp(self.values[0], self.frequencies[0], self.frequencies[1], time, dt)
        return start + (sine if self.kind == "sine" else triangle)(self.values[0], self.frequencies[0], time, dt)

    def show(self, value: float) -> str:
        """A value in the unit in which the reference was written."""
        return f"{value / self.unit_size:.4g} {self.unit}".strip()


def recorded_reference(
    path: Path, dimension: str, column: str | None = None
) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m"]]:
    """Times from 0 on [s] and values [SI] of a recording; between its samples it is linear.

    `column` names the quantity; without it there must be one of this dimension. Raises InputError for a file without
    time or such a quantity, and for gaps.
    """
    from nectosome.measure import read

    recording, kind = read(path), DIMENSIONS[dimension]
    units = {str(name): str(values.attrs.get("units", "")) for name, values in recording.data_vars.items()}
    listed = ", ".join(f"{name} [{unit or '?'}]" for name, unit in units.items())
    if "time" not in recording.dims:
        raise InputError(f"has no time. Its columns are {listed}.", file=str(path))
    if column is not None and column not in units:
        raise InputError(f"{path} has no such quantity.{did_you_mean(column, units)}", field="column")
    fits = [name for name, unit in units.items() if unit == kind.unit and column in (None, name)]
    if not fits:
        what = f"its {column} is no {kind.name}" if column else f"no column of it is {kind.with_article()}"
        raise InputError(f"{what}; it has {listed}. Write units in the heading: time (s).", file=str(path))
    if len(fits) > 1:
        raise InputError(f"{path} has several of this dimension: {', '.join(fits)}. Name one.", field="column")
    time, values = recording["time"].values.astype(float), recording[fits[0]].values.astype(float)
    if not np.isfinite(values).all():
        k = int(np.flatnonzero(~np.isfinite(values))[0])
        raise InputError(f"has no value at {time[k]:g} s.", file=str(path), field=fits[0])
    return time - time[0], values


def _check_options(
    what: str, options: dict[str, str | None], needed: tuple[str, ...] = (), optional: tuple[str, ...] = ()
) -> None:
    for option, text in options.items():
        if text is None and option in needed:
            raise InputError(f"{what} needs it.", field=option)
        if text is not None and option not in needed + optional:
            raise InputError(f"{what} does not take it.", field=option)


def _unit_of(text: str, dimension: str) -> tuple[str, float]:
    """Unit in which text is written, and its size in SI."""
    unit = unit_text(text)
    return unit or DIMENSIONS[dimension].unit, unit_to_si(unit)[0] if unit else 1.0
