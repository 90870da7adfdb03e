"""Columns of text that say what a row belongs to: each text becomes its place among those that occurred."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from nectosome.measure.formats.source import Column


class Labels:
    """The texts of a column in the order of their first occurrence; `number` is the place of one, from 0."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._places: dict[str, int] = {}

    def number(self, cell: str) -> float:
        """Return the place of a text."""
        cell = cell.strip()
        place = self._places.setdefault(cell, len(self.texts))
        if place == len(self.texts):
            self.texts.append(cell)
        return float(place)

    def numbers(self, cells: pd.Series) -> np.ndarray:
        """Return the places of many texts, NaN for missing ones."""
        codes, distinct = pd.factorize(cells)
        places = np.array([*(self.number(text) for text in distinct), np.nan])
        return places[codes]


def find_label(chosen: int | str | None, columns: Sequence[Column]) -> int | None:
    """Return the index of the column with this place or name among all of a file; None if there is none."""
    for k, column in enumerate(columns):
        if chosen in (column.place, column.name, column.heading):
            return k
    return None
