"""The tab that searches for the best design of a robot: what varies, the objective, limits, the search's progress."""

import threading
from functools import partial
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from nectosome.description import get_value, resolve
from nectosome.description.variables import read_variable
from nectosome.designs import QUANTITIES, MotionDesign, Problem, design, read_constraint
from nectosome.designs.design import SEED, STARTS
from nectosome.designs.motion import FORWARD
from nectosome.search import read_starts
from nectosome.studio.desk import Desk
from nectosome.studio.sliders import around
from nectosome.studio.work import Progress, errors_shown, labelled
from nectosome.units import InputError, show_quantity

from .design_progress import SearchProgress, figure, table
from .left_panel import note

_OPTIMISERS = ("gradient", "pattern")
_GOALS = tuple(f"{'maximise' if q.best == 'high' else 'minimise'} {name}" for name, q in QUANTITIES.items())
_MOST = 64  # starts
_LINE = 22  # letters that a field of the panel shows


class _Row(NamedTuple):
    """Controls of a variable."""

    name: str
    varies: Any
    range: Any


class Design:
    """Lays out the tab."""

    def __init__(self, session: Desk):
        self._session, gui = session, session.gui
        self._drawing = threading.Lock()
        self._robot = 0  # how many there were: what is found for one before is not shown
        self._rows: list[_Row] = []
        self._found: SearchProgress | None = None
        self._list = gui.add_folder("May vary")
        self._new = gui.add_text("Another", "", hint="A path of the robot file, or PATH = LOW..HIGH.")
        gui.add_button("Add").on_click(lambda _: self._told(self._add))
        self._objective = gui.add_dropdown("Objective", _GOALS)
        self._forward = gui.add_dropdown("Forward", tuple(FORWARD), hint="Where speed counts.")
        self._limits = gui.add_text("Limits", "", multiline=True, hint="One a line, such as torque <= 0.4 N m.")
        self._optimiser = gui.add_dropdown("Optimiser", _OPTIMISERS)
        self._starts = gui.add_number("Starts", STARTS, min=1, max=_MOST, step=1)
        self._seed = gui.add_number("Seed", SEED, min=0, max=2**31 - 1, step=1)
        self._here = gui.add_checkbox("First start from the sliders", True)
        gui.add_button("Start search").on_click(lambda _: self._told(self._begin))
        self._line = gui.add_html("")
        self._place = gui.add_folder(None, visible=False)
        self._plot: Any = None  # made when it is needed, as its program is large
        self._table = gui.add_html("")
        self._apply = gui.add_button("Apply best", visible=False)
        self._apply.on_click(lambda _: self._told(self._become))

    def renew(self) -> None:
        """Show the problem of the session's robot."""
        problem = self._session.problem
        with self._drawing:
            self._robot, self._found = self._robot + 1, None
            for row in self._rows:
                row.varies.remove()
                row.range.remove()
            self._rows = []
            self._place.visible = self._apply.visible = False
            self._line.content = self._table.content = ""
        for name, span in problem.vary.items():
            self._put(name, str(span))
        if not problem.vary:
            found = (around(self._session.description, alias) for alias in self._session.description.aliases)
            for v in filter(None, found):
                self._put(v.name, v.text())
        verb, name = ("minimise", problem.minimise) if problem.minimise else ("maximise", problem.maximise or "speed")
        self._objective.options = tuple(dict.fromkeys((*_GOALS, f"{verb} {name}")))
        self._objective.value = f"{verb} {name}"
        self._forward.value = problem.forward or "x"
        self._limits.value = "\n".join(map(str, problem.keep))

    def _put(self, name: str, text: str) -> None:
        """A row for a variable."""
        with self._list:
            varies = self._session.gui.add_checkbox(name, True)
            hint = "Lowest and highest; log for a logarithmic scale."
            span = self._session.gui.add_text("", text, multiline=len(text) > _LINE, hint=hint)
        varies.on_update(lambda _: setattr(span, "visible", varies.value))
        self._rows.append(_Row(name, varies, span))

    def _told(self, work: Any) -> None:
        with errors_shown(self._session.tell):
            work()

    def _add(self) -> None:
        robot = self._session.description
        name, _, text = (part.strip() for part in self._new.value.partition("="))
        taken = {path for row in self._rows for path in resolve(robot, row.name)}
        if taken & set(resolve(robot, name)):
            raise InputError("is there already.", field=name)
        found = read_variable(name, text, robot) if text else around(robot, name)
        if found is None:
            raise InputError("has no range around its value. Write PATH = LOW..HIGH.", field=name)
        self._put(name, text or found.text())
        self._new.value = ""
        self._session.tell("", False)  # what was wrong before is no longer of interest

    def _asked(self) -> tuple[Problem, MotionDesign]:
        """The problem as it stands on the page, and its task. Raises InputError."""
        ranges = {row.name: row.range.value for row in self._rows if row.varies.value}
        verb, _, name = self._objective.value.partition(" ")
        with labelled({"constraint": "Limits", "variables": "May vary"}):
            limits = [read_constraint(line) for line in self._limits.value.splitlines() if line.strip()]
            problem = Problem(ranges, **{verb: name}, keep=tuple(limits), forward=self._forward.value)
            return problem, problem.motion(self._session.description)

    def _begin(self) -> None:
        (problem, task), robot, description = self._asked(), self._robot, self._session.description
        asked = {"optimiser": self._optimiser.value, "own_first": self._here.value}
        asked |= {"starts": int(self._starts.value), "seed": int(self._seed.value)}

        def compute(progress: Progress) -> SearchProgress:
            self._line.content = ""
            progress(0.0, "compiling the equations")
            with TemporaryDirectory(prefix="nectosome-") as folder:
                search = SearchProgress(task, [])

                def look(_: str, share: float) -> bool:
                    nonlocal search
                    before, search = search.evaluations, SearchProgress(task, read_starts(folder))
                    if search.evaluations > before:
                        self._show(robot, search)
                    return progress(share, _words(search))

                try:
                    design(description, problem=problem, folder=folder, progress=look, **asked)
                except RuntimeError:
                    raise InputError("a process of the search died, perhaps for want of memory.") from None
                return SearchProgress(task, read_starts(folder))

        self._session.work.begin("search", compute, partial(self._show, robot, ended=True))

    def _show(self, robot: int, search: SearchProgress, ended: bool = False) -> None:
        """Draw what is found so far."""
        with self._drawing:
            if robot != self._robot:
                return
            self._found = search
            self._line.content = note(f"{_words(search)}{', ended' if ended else ''}")
            self._table.content = table(search)
            self._apply.visible, self._place.visible = bool(search.best), True
            drawn = figure(search)
            if self._plot is None:
                with self._place:
                    self._plot = self._session.gui.add_plotly(drawn, aspect=0.75, config={"displayModeBar": False})
            else:
                self._plot.figure = drawn

    def _become(self) -> None:
        with self._drawing:
            search = self._found
        if search is None or not search.best:
            return
        robot, variables = search.task.robot_at(search.best[0][1].u), search.task.variables
        self._session.become(robot)
        shown = {path for name in self._session.sliders for path in resolve(robot, name)}
        unseen = [v for v in variables if not shown & set(resolve(robot, v.name))]
        if unseen:
            each = (f"{v.name} = {show_quantity(float(get_value(robot, v.name)), v.dimension)}" for v in unseen)
            self._session.tell(f"applied; without a slider: {', '.join(each)}", False)


def _words(search: SearchProgress) -> str:
    best = f"best {search.task.objective} {search.objective_text(search.best[0][1])}, " if search.best else ""
    return f"{best}{search.evaluations} evaluations"
