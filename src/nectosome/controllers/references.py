"""References of the output: signals, recordings and constants, as samples from t = 0 on."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_origin

import numpy as np
from jaxtyping import Float

from nectosome.core import sampled
from nectosome.description.signal_contract import SignalDescription, read_signal, signal_kinds
from nectosome.io.file_system import is_file
from nectosome.io.yaml_text import read_yaml
from nectosome.units import DIMENSIONS, InputError, did_you_mean, read_quantity, shorten, unit_to_si

from .commands import unit_text

_CONSTANT_TIME = 10.0  # s, where none is given
_MOST_ROWS = 10_000_000  # of a recording that is followed
_POSITIVE = "amplitude", "frequency"


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


@dataclass(frozen=True)
class Reference:
    """A reference: a signal [SI], or an array with one value a sample, and the unit in which it was written.

    `timed` says whether a signal that depends on the length of the run, such as a chirp, gives its own.
    """

    dimension: str
    unit: str
    unit_size: float
    described: SignalDescription | None = None
    given: Float[np.ndarray, "m"] | None = None
    timed: bool = True

    @classmethod
    def parse(
        cls,
        reference: "str | Path | float | Float[np.ndarray, 'k'] | Mapping[str, Any] | Reference",
        dimension: str,
        **options: Any,
    ) -> "Reference":
        """Reference of a dimension: text with units, a file, fields of a signal, a number or samples in SI.

        - reference: `30 deg`; a kind of signal, such as `sine`; a signal with its fields as in a robot file, such as
          `{kind: stroke, ...}`; or the path of a recording.
        - options: fields of a kind, such as `amplitude="6 mm"`, numbers in SI; of `varying` lists such as
          `4 mm, 6 mm`; `column` of a file. Those that are None are left out.

        Raises InputError, whose field is the argument, for options that are missing or do not belong there.
        """
        if isinstance(reference, Reference):
            return reference
        options = {name: value for name, value in options.items() if value is not None}
        if isinstance(reference, str | Path) and str(reference).lstrip().startswith("{"):
            reference = read_yaml(str(reference), "reference")[0]
        if isinstance(reference, str | Path):
            return cls._of_text(str(reference).strip(), dimension, options)
        _refuse(options, "a number" if not isinstance(reference, Mapping) else "a group of fields")
        if isinstance(reference, Mapping):
            try:
                return cls._of(dict(reference), dimension)
            except InputError as error:
                raise InputError(f"{error.field}: {error.message}", field="reference") from None
        values = np.asarray(reference, dtype=float)
        if values.ndim > 1 or not values.size or not np.isfinite(values).all():
            raise InputError("is no finite number or row of finite numbers.", field="reference")
        if values.ndim == 0:
            return cls._of({"kind": "constant", "value": float(values)}, dimension)
        return cls(dimension, DIMENSIONS[dimension].unit, 1.0, given=values)

    @classmethod
    def _of_text(cls, text: str, dimension: str, options: dict[str, Any]) -> "Reference":
        kinds = signal_kinds()
        if text in kinds:
            fields = kinds[text].model_fields
            _refuse(options, f"a {text}", fields)
            for name, value in options.items():
                if get_origin(fields[name].annotation) is tuple and isinstance(value, str):
                    options[name] = [part.strip() for part in value.split(",")]
            return cls._of({"kind": text, **options}, dimension)
        if re.match(r"[-+]?\.?\d", text) and not is_file(text):
            _refuse(options, "a constant reference")
            value = read_quantity(text, dimension, "reference")
            return cls._of({"kind": "constant", "value": value}, dimension, text)
        if not Path(text).suffix:
            known = f"a quantity, {', '.join(kinds)}, or a file with a recording"
            near = did_you_mean(text, kinds)
            raise InputError(f'"{shorten(text)}" is no reference: {known}.{near}', field="reference")
        _refuse(options, "a file", ("column",))
        try:
            return cls._of({"kind": "recording", "file": text, **options}, dimension)
        except InputError as error:
            field = "reference" if error.field == "file" else error.field
            raise InputError(error.message, field=field) from None

    @classmethod
    def _of(cls, fields: dict[str, Any], dimension: str, written: str = "") -> "Reference":
        """A signal of these fields; `written` is the text whose unit counts, else that of its size."""
        size = fields.get("amplitude", fields.get("value", written))
        last = size[-1] if isinstance(size, list) else size
        kind = signal_kinds().get(str(fields.get("kind")), SignalDescription)
        timed = "time" in fields or "time" not in kind.model_fields
        signal = read_signal(fields if timed else {**fields, "time": 1.0}, dimension, Path(), _MOST_ROWS)
        for name in _POSITIVE:
            value = getattr(signal, name, 1.0)
            if min(value if isinstance(value, tuple) else (value,)) <= 0:
                raise InputError(f'"{shorten(fields[name])}" is out of range: it must be more than 0.', field=name)
        unit = _unit_of(written or (last if isinstance(last, str) else ""), dimension)
        return cls(dimension, *unit, signal, timed=timed)

    @property
    def kind(self) -> str:
        """The kind of its signal, or `samples`."""
        return "samples" if self.described is None else self.described.kind

    @property
    def constant(self) -> float | None:
        """Its value where it is constant, else None."""
        return dict(self.described)["value"] if self.described is not None and self.kind == "constant" else None

    def duration(self, dt: float) -> float:
        """Length [s] where none is given: two periods, that of the file, 10 s of a constant. Raises InputError."""
        if self.described is None:
            return (self._given.size - 1) * dt
        if not self.timed:
            raise InputError(f"a {self.kind} needs it.", field="time")
        if self.described.length is not None:
            return self.described.length
        return _CONSTANT_TIME if self.described.period is None else 2 * self.described.period

    def samples(self, time: float, dt: float, start: float = 0.0) -> Float[np.ndarray, "k"]:
        """Values at 0, dt, ... up to `time` [s]; where no offset is given, about `start`, the output at first."""
        t = times(time, dt)
        if self.described is None:
            return np.interp(np.arange(t.size), np.arange(self._given.size), self._given)
        fields = type(self.described).model_fields
        run = {} if self.timed else {"time": time}
        run |= {"offset": start} if "offset" in fields and "offset" not in self.described.model_fields_set else {}
        return sampled(self.described.model_copy(update=run), t)

    def show(self, value: float) -> str:
        """A value in the unit in which the reference was written."""
        return f"{value / self.unit_size:.4g} {self.unit}".strip()

    @property
    def _given(self) -> Float[np.ndarray, "m"]:
        assert self.given is not None
        return self.given


def wave(kind: str, time: float | None, dt: float, **fields: Any) -> Float[np.ndarray, "k"]:
    """Samples of a kind of signal with these fields [SI], `time` [s] long, or as long as it is by itself.

    `wave("sine", 5.0, dt, amplitude=0.8, frequency=1.5)`
    """
    reference = Reference.parse(kind, "number", **fields)
    return reference.samples(reference.duration(dt) if time is None else time, dt)


def _refuse(options: Mapping[str, Any], what: str, known: Iterable[str] = ()) -> None:
    """Raise InputError for an option that does not belong there."""
    for name in options:
        if name not in known:
            raise InputError(f"{what} does not take it.", field=name)


def _unit_of(text: str, dimension: str) -> tuple[str, float]:
    """Unit in which text is written, and its size in SI."""
    unit = unit_text(text)
    return unit or DIMENSIONS[dimension].unit, unit_to_si(unit)[0] if unit else 1.0
