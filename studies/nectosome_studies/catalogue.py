"""Studies of this package: a folder with a `study.toml` is one, computed by its `study.py` or by its data alone."""

import time
from importlib import import_module
from typing import Any

from pydantic import BaseModel, ConfigDict

from nectosome.view.style import Panel

from . import charts, replay
from .study import FOLDER, Progress, Sets, Study, printed, read_book, read_table, scored


class StudyEntry(BaseModel):
    """The `study.toml` of a study.

    `study.py`, where there is one, has `part(quick, progress) -> StudyPart`, and perhaps `panels(data, runs)`, which
    makes its figures; without it the numbers are those of `replay.toml`, the figures those of `figures.toml`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    title: str
    about: str
    minutes: float = 1.0  # that it takes on two cores
    place: int = 100  # in the report, the smallest first
    trust: list[dict[str, Any]] = []  # groups of predictions of measured numbers: robot, quantity, rows

    def run(self, quick: bool, progress: Progress) -> Study:
        """All rows; `quick` computes less for each."""
        began = time.perf_counter()
        special = (FOLDER / self.name / "study.py").is_file()
        code: Any = import_module(f"nectosome_studies.{self.name}.study") if special else None
        done = code.part(quick, progress) if code else replay.part(self.name, progress)
        progress("scorecard", 1.0)
        rows = done.rows + (scored(printed(self.name), done.numbers) if done.numbers else [])
        return Study(
            self.name, self.title, f"{self.about} {done.about}".strip(), rows, done.runs,
            time.perf_counter() - began, done.data, getattr(code, "panels", self._charts), done.recorded,
        )  # fmt: skip

    def _charts(self, data: Sets, runs: Sets) -> list[Panel]:
        return [*charts.panels(self.name, {**runs, **data}).values()] or replay.panels(data)


def studies() -> dict[str, StudyEntry]:
    """All of them, in the order of the report."""
    there = [file.parent.name for file in FOLDER.glob("*/study.toml")]
    entries = [
        read_table(StudyEntry, {"name": name, **read_book(name, "study.toml")}, name, "study.toml") for name in there
    ]
    return {entry.name: entry for entry in sorted(entries, key=lambda entry: (entry.place, entry.name))}
