"""Gains of a PID in the units in which command and measurement are written: one row, or one for each frequency."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, parse_quantity, read_positive, shorten, show_quantity

_TABLE = '"0.2Hz: 4,0.5,0; 1Hz: 3,0.4,0"'


class PIDGains(NamedTuple):
    """K_p, K_i, K_d in SI, in rows; several belong to frequencies of the reference [Hz], which grow."""

    rows: Float[np.ndarray, "m 3"]
    frequencies: Float[np.ndarray, "m"] | None = None

    @classmethod
    def parse(cls, gains: str | Sequence[float], unit_size: float = 1.0) -> "PIDGains":
        """`4, 0.5, 0`, three numbers, or by frequency `0.2Hz: 4,0.5,0; 1Hz: 3,0.4,0`. Raises InputError."""
        if not isinstance(gains, str) or ":" not in gains:
            return cls(_row(gains, unit_size)[None])
        pairs = [row.partition(":") for row in gains.strip(" ;").split(";")]
        if not all(colon for _, colon, _ in pairs):
            raise InputError(f'"{shorten(gains)}" has a row without a frequency. Write {_TABLE}.', field="gains")
        frequencies = np.array([read_positive(f.strip(), "frequency", "gains") for f, _, _ in pairs])
        rows = np.stack([_row(row, unit_size) for _, _, row in pairs])
        if not (np.diff(frequencies) > 0).all():
            raise InputError(f'"{shorten(gains)}": its frequencies must grow from row to row.', field="gains")
        if rows.min() < 0 < rows.max():
            raise InputError(f'"{shorten(gains)}": all rows must share one sign.', field="gains")
        return cls(rows, frequencies)

    def times(self, factor: float) -> "PIDGains":
        """The same gains, larger by a factor."""
        return self._replace(rows=factor * self.rows)

    @property
    def row(self) -> Float[np.ndarray, "3"]:
        """The only row. Raises InputError for gains by frequency."""
        if self.frequencies is not None:
            raise InputError("gains by frequency belong to a scheduled PID. Give K_p,K_i,K_d.", field="gains")
        return self.rows[0]

    @property
    def table(self) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m 3"]]:
        """Frequencies and rows. Raises InputError for a single row."""
        if self.frequencies is None:
            raise InputError(f"a scheduled PID has gains by frequency. Write {_TABLE}.", field="gains")
        return self.frequencies, self.rows

    def text(self, unit_size: float) -> str:
        """As `parse` reads it."""
        rows = [",".join(f"{x:.4g}" for x in row / unit_size) for row in self.rows]
        if self.frequencies is None:
            return rows[0]
        named = zip(self.frequencies, rows, strict=True)
        return "; ".join(f"{show_quantity(float(f), 'frequency')}: {row}" for f, row in named)


def _row(gains: str | Sequence[float], unit_size: float = 1.0) -> Float[np.ndarray, "3"]:
    """K_p, K_i, K_d in SI from `4, 0.5, 0` or three numbers, of one sign: negative for a plant with negative response.

    `unit_size` is the SI size of their unit: that of the command over that of the measurement. Raises InputError.
    """
    text = gains if isinstance(gains, str) else ",".join(f"{float(x):g}" for x in gains)
    try:
        parts = gains.split(",") if isinstance(gains, str) else gains
        numbers = np.array([parse_quantity(part, "number") if isinstance(part, str) else float(part) for part in parts])
    except ValueError as error:
        raise InputError(str(error), field="gains") from None
    if len(numbers) != 3 or not numbers.any() or not np.isfinite(numbers).all():
        raise InputError(f'"{shorten(text)}" is not three numbers that are not all 0, such as 4,0.5,0.', field="gains")
    if min(numbers) < 0 < max(numbers):
        hint = "gains must share one sign; use negative gains for a plant with negative response"
        raise InputError(f'"{shorten(text)}": {hint}.', field="gains")
    return numbers * unit_size
