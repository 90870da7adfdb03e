"""One browser tab: its robot, its scene and its controls. It shares nothing with other tabs."""

import gc
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import viser
import xarray as xr
from jaxtyping import Float

from nectosome.description import RobotDescription, get_value, parse_robot, with_values
from nectosome.designs import Problem, problem_of
from nectosome.io import load_dataset
from nectosome.model import build
from nectosome.robots import describe
from nectosome.units import show_quantity
from nectosome.view.display.scene_graph import Stage
from nectosome.view.markup import plain
from nectosome.view.saved import check_drawable, saved_run
from nectosome.view.still import standing
from nectosome.view.style import VERMILLION

from .answers import Answer, AnswerSolver
from .browser_script import on_page_width, plots_are_here
from .desk import StudioTask, Tasks
from .files import Files
from .folder import WorkFolder
from .numbers import Board
from .rig_room import RigRoom
from .sliders import SliderScale, scales_of
from .uploads import limit_values
from .viewer import Player, PlayerControls, Viewer
from .work import Machines, SolverThread, Work, errors_shown

_FIRST = "computing; the first answer of a robot compiles its equations"
_LATER = "computing; what is shown is the last answer"
_COUNTED = 1.0  # s, after which the time of an answer is shown
_SOON = 0.2  # s, within which most answers come
_ROBOT = '<div style="font-size:14px;font-weight:700;padding:0 12px 6px;overflow-wrap:anywhere">{}</div>'
_STAGE, _RIGHT = 0.35, 390.0  # of the page; px
_NARROW, _WIDE = 300.0, 640.0  # px
_BEYOND = f'<div style="font-size:12px;padding:0 12px 6px;color:{VERMILLION}">{{}}</div>'


class Session:
    """A tab from when it is opened to when it is closed: the `Desk` of its tasks."""

    def __init__(
        self,
        client: viser.ClientHandle,
        robot: str,
        folder: WorkFolder,
        tasks: Tasks,
        rigs: RigRoom,
        machines: Machines,
    ):
        self._client, self.gui, self.folder, self.rigs, self.machines = client, client.gui, folder, rigs, machines
        plots_are_here(self.gui)
        limit_values(self.gui, self.tell)
        self._stage = Stage(client.scene)
        self._drawing = threading.RLock()  # one thread at a time changes the stage
        self._viewer = Viewer(client, self._stage, self._drawing)
        self.answer: Answer | None = None  # the motion that is shown
        self._took: float | None = None  # what the last answer of this robot took, but for the first [s]
        self._live = False  # whether what is shown is computed while it is shown
        self._opened = 0  # robots and runs so far: an answer for one before is not shown
        self._on_first_answer: list[Callable[[Answer], None]] = []
        self._on_closed: list[Callable[[], None]] = []
        self._setting = threading.Lock()  # numbers of the robot change one after the other
        self._player = Player(self._show)
        self._solver = SolverThread(self._solve)
        self._sliders: list[Any] = []
        self._lay_out(tasks)
        try:
            self.open(robot)
        except BaseException:
            self.close()
            raise
        self._viewer.follow_page()

    def open(self, robot: str | Path) -> None:
        """Take a robot that ships, by name, or a file. Raises InputError where it cannot be read: nothing changes."""
        description = describe(str(robot))
        self._take(description, motion_problem(robot))
        with self._counting(self._opened):  # it stands as it starts, until it moves
            start = standing(self.description, build(self.description))
            with self._drawing, self._client.atomic():
                self._stage.load(start, self.description, 0.0, self._viewer.look)
                self._stage.at(0.0)
            self._viewer.look_from()
        self._compute_motion()

    def open_run(self, path: Path) -> None:
        """Show a saved run, and take its robot. Raises InputError where the file is no run."""
        run = saved_run(load_dataset(path), path.name)
        check_drawable(run, path.name)
        robot = parse_robot(run.attrs["robot"], f"{path.name}, its robot")
        self._take(robot, Problem())
        self._put(Answer(run, robot, "a run", 0.0, {}, ""), f"{run.attrs['title']}, as it was saved")
        self._viewer.look_from()

    @property
    def sliders(self) -> list[str]:
        """Names of the quantities that have a slider."""
        return [scale.name for scale in scales_of(self.description, self.problem.vary)]

    @property
    def shown_time(self) -> float:
        """Time of the run that is shown [s]."""
        start = 0.0 if self.answer is None else float(self.answer.run["time"].values[0])
        return start + (self._player.time % self._stage.playback.end if self._stage.playback.end else 0.0)

    def tell(self, words: str, bad: bool) -> None:
        """Show a message under the numbers; it stays until the user does the next thing."""
        self._board.show_action(words, bad)

    def notify(self, title: str, words: str) -> viser.NotificationHandle:
        """Show a notice at the edge of the page, whatever else is seen there, until it is removed."""
        return self._client.add_notification(title, words, with_close_button=False, color="red")

    def on_closed(self, leave: Callable[[], None]) -> None:
        """Call `leave` when the tab is closed; it may not wait."""
        self._on_closed.append(leave)

    def become(self, description: RobotDescription) -> None:
        """Take other numbers of the same robot: the sliders follow, and its motion is computed."""
        self._leave_live()
        with self._setting:
            self.description = description
            self._put_sliders(scales_of(description, self.problem.vary))
        self._compute_motion()

    def on_seen(self, tell: Callable[[Answer], None]) -> None:
        """Call `tell` with the first answer of each robot, before it is shown."""
        self._on_first_answer.append(tell)

    def go_live(self, run: xr.Dataset) -> None:
        """Show from now on what `live` shows; it continues a run of this robot."""
        self._controls.play(False)
        with self._drawing, self._client.atomic():
            self._live, self.answer = True, None
            self._controls.disable()
            self._board.show_motion("")
            self._stage.load(run, self.description, 0.0, self._viewer.look)
            self._stage.at(0.0)

    def live(self, instant: xr.Dataset, path: Float[np.ndarray, "n 3"]) -> None:
        """Show the next instant of a live run (see `Stage.go_on`); nothing where the robot has changed."""
        with self._drawing:
            if self._live:
                with self._client.atomic():
                    self._stage.go_on(instant, self.description, path)

    def end_live(self, run: xr.Dataset | None, words: str) -> None:
        """Keep the live run, to play it; without one compute the robot's motion again."""
        with self._drawing:
            was_live, self._live = self._live, False
        if not was_live:
            return
        if run is None:
            self._compute_motion()
            return
        self._player.seek(0.0)
        self._put(Answer(run, self.description, "a run", 0.0, {}, ""), words)

    def close(self) -> None:
        """End all that runs for this tab."""
        for leave in self._on_closed:
            leave()
        self._player.close()
        self._solver.close()
        self.work.close()
        self.machines.close()

    # --- controls

    def _lay_out(self, tasks: Tasks) -> None:
        gui = self.gui
        gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        gui.set_panel_label("nectosome studio")
        self._board = Board(gui)
        self.work = Work(gui, self.tell)
        with gui.add_folder("Motion"):
            self._controls = PlayerControls(gui, self._player)
        tabs = gui.add_tab_group()
        self._robot_tab = tabs.add_tab("Robot")
        with tabs.add_tab("View"):
            self._viewer.lay_out(self._look_changed)
        with tabs.add_tab("Files"):
            Files(self, self._viewer)
        panel, self._tasks = gui.add_panel(), list[StudioTask]()
        for name, lay_out in tasks.items():
            with panel.add_tab(name):
                self._tasks.append(lay_out(self))
        panel.dock_left()
        on_page_width(gui, lambda width: panel.set_width(_left_panel(width)))

    def _put_sliders(self, scales: list[SliderScale]) -> None:
        """One slider for each number, in place of those of the last robot."""
        for handle in self._sliders:
            handle.remove()
        self._sliders = []
        with self._robot_tab:
            self._sliders.append(self.gui.add_html(_ROBOT.format(plain(self.description.name))))
            for scale in scales:
                value = float(get_value(self.description, scale.name))
                slider = self.gui.add_slider(scale.label, scale.low, scale.high, scale.step, scale.shown(value))
                beyond = self.gui.add_html(_BEYOND.format(plain(words)) if (words := scale.beyond(value)) else "")
                slider.on_update(lambda event, scale=scale, beyond=beyond: self._slid(scale, event.target, beyond))
                self._sliders += [slider, beyond]

    def _slid(self, scale: SliderScale, slider: Any, beyond: Any) -> None:
        """Take the newest value of a slider: its events come in threads of their own, in any order."""
        with errors_shown(self.tell), self._setting:
            if slider not in self._sliders:
                return
            self._board.forget_action()
            beyond.content = ""
            self.description = with_values(self.description, {scale.name: float(slider.value) * scale.factor})
            self._leave_live()
            self._player.hold(_SOON)
            self._compute_motion()

    def _look_changed(self) -> None:
        """Show the same run with another look."""
        if self._live or self.answer is not None:
            self._stage.look(self._viewer.look)
        if self.answer is not None:
            self._stage.at(self._player.time)
            self._viewer.show_legend()

    # --- the robot and its motion

    def _take(self, description: RobotDescription, problem: Problem) -> None:
        """Begin anew with another robot."""
        scales = scales_of(description, problem.vary)
        self._leave_live()
        if self._opened:  # what began before the first robot, such as a run on a rig, is of none
            self.work.cancel()  # its result is not for this robot
        self._controls.play(False)
        self._solver.close()  # a program that is being compiled cannot be stopped, but nobody waits for it
        with self._setting, self._drawing:
            self.description, self.problem = description, problem
            self._opened, self.answer, self._took = self._opened + 1, None, None
            self._answer_solver = AnswerSolver(problem.forward)  # the last robot's motion is no guess for another one's
            self._solver = SolverThread(self._solve)
            self._board.forget()
            self._put_sliders(scales)
            self._controls.disable()
        for task in self._tasks:
            task.renew()

    def _leave_live(self) -> None:
        """End a live run."""
        with self._drawing:
            if self._live:
                self._live = False
                self.work.cancel()

    def _compute_motion(self) -> None:
        self._solver.submit((self._opened, self._answer_solver, self.description))

    def _solve(self, request: tuple[int, AnswerSolver, RobotDescription]) -> None:
        """Compute a motion and show it, in the solver's thread."""
        began = time.perf_counter()
        opened, solve, description = request

        def show_error(words: str, bad: bool) -> None:
            if opened == self._opened:
                self._board.show_motion(f"{words} What is shown is the last answer.", bad, old=True)

        with errors_shown(show_error):
            with self._counting(opened):
                answer = solve(description)
            with self._drawing:
                if opened == self._opened and not self._live:
                    seconds = float(f"{time.perf_counter() - began:.2g}")
                    self._took = seconds if self.answer is not None else None  # the first one compiles
                    took = f"{answer.kind}, computed in {show_quantity(seconds, 'time')}"
                    self._put(answer, f"{took}: {answer.warning}" if answer.warning else took)

    @contextmanager
    def _counting(self, opened: int) -> Iterator[None]:
        """Show for how long an answer has been computed, and is to be, and the numbers of the last one pale.

        That of a robot's first one at once, else where it does not come soon.
        """
        done, began, later = threading.Event(), time.perf_counter(), self.answer is not None

        def count() -> None:
            pause = _SOON if later else _COUNTED
            while not done.wait(pause):
                with self._drawing:
                    if done.is_set() or opened != self._opened or self._live:
                        return
                    so_far = time.perf_counter() - began
                    self._board.show_motion(_waiting(later, so_far, self._took), old=later)
                pause = _COUNTED

        if self.answer is None:
            self._board.show_motion(_FIRST)
        threading.Thread(target=count, name="studio-waiting", daemon=True).start()
        try:
            yield
        finally:
            done.set()

    def _put(self, answer: Answer, words: str) -> None:
        """Show an answer, and begin to play where it is the first one of its robot."""
        first = self.answer is None
        for tell in self._on_first_answer if first else ():
            tell(answer)
        self._player.hold(0.0)
        with self._drawing, self._client.atomic():
            self.answer = answer
            self._stage.load(answer.run, answer.robot, answer.period, self._viewer.look)
            self._stage.at(self._player.time)
            self._board.add(answer.numbers)
            self._board.show_motion(words, bad=bool(answer.warning))
            self._viewer.show_legend()
            self._controls.set_end(self._stage.playback.end)
        self._client.flush()  # viser would wait for more to send along
        if first:
            self._viewer.look_at_first()
            gc.freeze()  # what compiling left is there to stay: looking through it takes longer than an answer
            self._controls.play(self._stage.playback.end > 0)

    def _show(self, t: float) -> None:
        """Show an instant [s] of the motion, in the player's thread."""
        if self.answer is None:
            return
        with errors_shown(self.tell), self._drawing, self._client.atomic():
            playback = self._stage.playback
            if not playback.period and t > playback.end:
                t = t % playback.end if playback.end else 0.0
            self._stage.at(t)
            self._controls.show(t % playback.end if playback.end else 0.0)


def _left_panel(page: float) -> float:
    """Width of the panel on the left: what the stage, a third of the page at least, and the other one leave [px]."""
    return min(max((1 - _STAGE) * page - _RIGHT, _NARROW), _WIDE)


def motion_problem(robot: str | Path) -> Problem:
    """The design problem of a robot; an empty one where that is a mission's."""
    problem = problem_of(robot)
    return Problem() if problem.mission else problem


def _waiting(later: bool, so_far: float, took: float | None) -> str:
    """What is said while an answer is computed; the one before `took` so long [s]."""
    words = f"{_LATER if later else _FIRST}: {so_far:.0f} s so far"
    return f"{words}, about {took - so_far:.1g} s left" if later and took is not None and took > so_far else words
