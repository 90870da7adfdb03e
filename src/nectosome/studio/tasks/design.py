"""The tab that searches for the best design of a robot: what varies, the objective, limits, the search's progress."""

from functools import partial
from itertools import cycle
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go

from nectosome.description import DIRECTIONS, dump_robot, get_value, resolve
from nectosome.description.variables import read_variable
from nectosome.designs import QUANTITIES, MotionDesign, Problem, design, read_constraint
from nectosome.designs.design import SEED, STARTS
from nectosome.search import Evaluation, read_starts
from nectosome.studio.desk import Desk
from nectosome.studio.sliders import around
from nectosome.studio.work import STOP, Progress, labelled
from nectosome.units import InputError, show_quantity
from nectosome.view.style import CYCLE, readable, span, titled

from .left_panel import PanelTask, Plot, add_text, cells, note, small

_OPTIMISERS = ("gradient", "pattern")
_GOALS = tuple(f"{'maximise' if q.best == 'high' else 'minimise'} {name}" for name, q in QUANTITIES.items())
_MOST = 64  # starts
_LINE = 22  # letters that a field of the panel shows
_SHOWN = 3  # designs of the table


class SearchProgress(NamedTuple):
    """A task, the evaluations of each start so far, the limits of the task that its problem does not name, its end."""

    task: MotionDesign
    starts: list[list[Evaluation]]
    added: tuple[str, ...] = ()
    end: str = ""  # how it ended, in words

    @property
    def evaluations(self) -> int:
        """How many there are."""
        return sum(map(len, self.starts))

    @property
    def best(self) -> list[tuple[int, Evaluation]]:
        """Number of each start that found something, and the best that it found; the best of all first."""
        kept = [(k, [e for e, fits in zip(s, self.fits(s), strict=True) if fits]) for k, s in enumerate(self.starts)]
        bests = [(k, min(own, key=lambda e: e.objective)) for k, own in kept if own]
        return sorted(bests, key=lambda one: one[1].objective)

    def fits(self, start: list[Evaluation]) -> list[bool]:
        """Which evaluations of a start keep all limits; not those of designs that were drawn and refused."""
        begun = next((k for k, e in enumerate(start) if not self.task.accepts(e)), len(start))
        return [k >= begun and e.feasible(self.task.tolerance) for k, e in enumerate(start)]

    def objective_text(self, e: Evaluation) -> str:
        """Objective of a design, with its unit."""
        return self.task.show_output(self.task.objective_name, e.outputs[self.task.objective_name])


class _Row(NamedTuple):
    """Controls of a variable."""

    name: str
    varies: Any
    range: Any


class Design(PanelTask):
    """Lays out the tab."""

    def __init__(self, desk: Desk):
        super().__init__(desk)
        gui = desk.gui
        self._rows: list[_Row] = []
        self._found: SearchProgress | None = None
        self._list = gui.add_folder("May vary")
        hint = "A path of the robot file, or PATH = LOW..HIGH."
        self._new = add_text(gui, "Another", "body.length = 0.2..0.4 m", hint=hint)
        self._add_button("Add", self._add)
        self._objective = gui.add_dropdown("Objective", _GOALS)
        self._forward = gui.add_dropdown("Forward", tuple(DIRECTIONS), hint="Where speed counts.")
        hint = "What the design has to keep, one a line."
        self._limits = add_text(gui, "Limits", "torque <= 0.4 N m", multiline=True, hint=hint)
        self._optimiser = gui.add_dropdown("Optimiser", _OPTIMISERS)
        self._starts = gui.add_number("Starts", STARTS, min=1, max=_MOST, step=1)
        self._seed = gui.add_number("Seed", SEED, min=0, max=2**31 - 1, step=1)
        self._here = gui.add_checkbox("First start from the sliders", True)
        self._add_button("Start search", self._begin)
        self._line = gui.add_html("")
        self._plot = Plot(gui)
        self._table = gui.add_html("")
        self._apply = self._add_button("Apply best", self._become, visible=False)

    def renew(self) -> None:
        """Show the problem of the robot of the desk."""
        problem = self._desk.problem
        with self._drawing:
            self._robot, self._found = self._robot + 1, None
            for row in self._rows:
                row.varies.remove()
                row.range.remove()
            self._rows = []
            self._plot.folder.visible = self._apply.visible = False
            self._line.content = self._table.content = ""
        for name, ends in problem.vary.items():
            self._put(name, str(ends))
        if not problem.vary:
            variables = (around(self._desk.description, alias) for alias in self._desk.description.number_aliases)
            for v in filter(None, variables):
                self._put(v.name, v.text())
        verb, name = ("minimise", problem.minimise) if problem.minimise else ("maximise", problem.maximise or "speed")
        self._objective.options = tuple(dict.fromkeys((*_GOALS, f"{verb} {name}")))
        self._objective.value = f"{verb} {name}"
        self._forward.value = problem.forward or "x"
        self._limits.value = "\n".join(map(str, problem.keep))

    def _put(self, name: str, text: str) -> None:
        """A row for a variable."""
        with self._list:
            varies = self._desk.gui.add_checkbox(name, True)
            hint = "Lowest and highest; log for a logarithmic scale."
            ends = add_text(self._desk.gui, "", "1..9 MPa log", text, multiline=len(text) > _LINE, hint=hint)
        varies.on_update(lambda _: setattr(ends, "visible", varies.value))
        self._rows.append(_Row(name, varies, ends))

    def _add(self) -> None:
        robot = self._desk.description
        name, _, text = (part.strip() for part in self._new.value.partition("="))
        taken = {path for row in self._rows for path in resolve(robot, row.name)}
        if taken & set(resolve(robot, name)):
            raise InputError("is there already.", field=name)
        variable = read_variable(name, text, robot) if text else around(robot, name)
        if variable is None:
            raise InputError("has no range around its value. Write PATH = LOW..HIGH.", field=name)
        self._put(name, text or variable.text())
        self._new.value = ""
        self._desk.tell("", False)  # what was wrong before is no longer of interest

    def _problem(self) -> tuple[Problem, MotionDesign]:
        """The problem as it stands on the page, and its task. Raises InputError."""
        ranges = {row.name: row.range.value for row in self._rows if row.varies.value}
        verb, _, name = self._objective.value.partition(" ")
        goal: dict[str, Any] = {verb: name}
        with labelled({"constraint": "Limits", "variables": "May vary"}):
            limits = [read_constraint(line) for line in self._limits.value.splitlines() if line.strip()]
            given = self._desk.problem
            draws = {"quantile": given.quantile, "draws": given.draws}
            problem = Problem(ranges, **goal, keep=tuple(limits), forward=self._forward.value, **draws)
            return problem, problem.motion(self._desk.description)

    def _begin(self) -> None:
        (problem, task), robot, description = self._problem(), self._robot, self._desk.description
        empty = not_begun(problem, task)
        options = {"optimiser": self._optimiser.value, "own_first": self._here.value}
        options |= {"starts": int(self._starts.value), "seed": int(self._seed.value)}
        machines, request = self._desk.machines, f"design\n{problem}\n{options}\n{dump_robot(description)}"

        def compute(progress: Progress) -> SearchProgress:
            self._line.content = line_html(empty)
            progress("compiling the equations", 0.0)
            with machines.kept(request) as folder, machines.executor() as executor:
                search, going = empty, True

                def look(_: str, share: float) -> bool:
                    nonlocal search, going
                    before, search = search.evaluations, empty._replace(starts=read_starts(folder))
                    if search.evaluations > before:
                        self._show(robot, search)
                    going = progress(_words(search), share)
                    return going

                where = {"folder": folder, "executor": executor}
                design(description, problem=problem, progress=look, **where, **options)
                return empty._replace(starts=read_starts(folder), end="ended" if going else "stopped, best so far")

        self._desk.work.begin(machines.named("search"), compute, partial(self._show, robot), button=STOP)

    def _show(self, robot: int, search: SearchProgress) -> None:
        """Draw what is found so far."""
        with self._drawing:
            if robot != self._robot:
                return
            self._found = search
            self._line.content = line_html(search)
            self._table.content = designs_html(search)
            self._apply.visible, self._plot.folder.visible = bool(search.best), True
            self._plot.show(_figure(search), 0.75)

    def _become(self) -> None:
        with self._drawing:
            search = self._found
        if search is None or not search.best:
            return
        robot, variables = search.task.robot_at(search.best[0][1].u), search.task.variables
        self._desk.become(robot)
        shown = {path for name in self._desk.sliders for path in resolve(robot, name)}
        unseen = [v for v in variables if not shown & set(resolve(robot, v.name))]
        if unseen:
            each = (f"{v.name} = {show_quantity(float(get_value(robot, v.name)), v.dimension)}" for v in unseen)
            self._desk.tell(f"applied; without a slider: {', '.join(each)}", False)


def not_begun(problem: Problem, task: MotionDesign) -> SearchProgress:
    """A search for the task of a problem before its first evaluation."""
    named = {str(limit) for limit in problem.keep}
    return SearchProgress(task, [], tuple(name for name in task.constraint_names if name not in named))


def line_html(search: SearchProgress) -> str:
    """How far a search is, and which limits nobody named."""
    words = [f"{_words(search)}{f', {search.end}' if search.end else ''}"] if search.starts else []
    kept = (f"Kept besides, since the robot has servos: {name} (a line of Limits changes it)." for name in search.added)
    return "".join(map(note, (*words, *kept)))


def _words(search: SearchProgress) -> str:
    best = f"best {search.task.objective_name} {search.objective_text(search.best[0][1])}, " if search.best else ""
    return f"{best}{search.evaluations} evaluations"


def _figure(search: SearchProgress) -> go.Figure:
    """Best objective so far against evaluations, one line a start; crosses did not keep the limits."""
    fig, name = go.Figure(), search.task.objective_name
    pick = np.fmax if search.task.highest else np.fmin
    shown: list[float] = []
    for k, (start, colour) in enumerate(zip(search.starts, cycle(CYCLE))):
        value = np.array([e.outputs.get(name, np.nan) if e.solved else np.nan for e in start], dtype=float)
        fits = np.array(search.fits(start), dtype=bool)
        x, best = np.arange(1, value.size + 1), pick.accumulate(np.where(fits, value, np.nan))
        line = {"color": colour, "shape": "hv", "width": 2}
        fig.add_scatter(x=x, y=best, mode="lines", line=line, name=f"start {k + 1}", hovertemplate="%{y:.4g} at %{x}")
        cross = {"color": colour, "symbol": "x-thin-open", "size": 6}
        off = ~fits & np.isfinite(value)
        fig.add_scatter(x=x[off], y=value[off], mode="markers", marker=cross, showlegend=False, hoverinfo="skip")
        shown += best[np.isfinite(best)].tolist()
    if shown:  # what keeps no limit may lie far away
        fig.update_yaxes(range=span(shown, 0.15))
    unit = search.task.units[name]
    fig.update_xaxes(title="evaluations", rangemode="tozero")
    fig.update_yaxes(title=titled(readable(name), unit))
    return small(fig).update_layout(showlegend=len(search.starts) > 1)


def designs_html(search: SearchProgress) -> str:
    """The best designs beside each other, those of different starts."""
    best, task = search.best[:_SHOWN], search.task
    if not best:
        return note("No design so far keeps all limits.")
    rows = [["", *(f"start {k + 1}" for k, _ in best)]]
    for name in task.units:
        rows.append([readable(name), *(task.show_output(name, e.outputs[name]) for _, e in best)])
    values = [task.box.values(e.u) for _, e in best]
    for k, v in enumerate(task.variables):
        rows.append([v.name, *(show_quantity(float(own[k]), v.dimension) for own in values)])
    first = best[0][1]
    limits = [name for name, g in zip(task.constraint_names, first.constraints, strict=True) if g > -1e-4]
    ends = [v.name for v in task.at_an_end(first.u)]
    notes = {"at its limit": limits, "at an end of its range, widen it if the robot allows": ends}
    return cells(rows, "studio-designs", [f"{words}: {', '.join(names)}" for words, names in notes.items() if names])
