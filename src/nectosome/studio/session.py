"""One browser tab: its robot, its scene and its controls. Nothing of it is shared with other tabs."""

import gc
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription, get_value, parse_robot, with_values
from nectosome.designs import Problem, load_problem, shipped_problem
from nectosome.io import load_dataset
from nectosome.model import build
from nectosome.robots import describe
from nectosome.units import InputError, show_quantity
from nectosome.view.saved import check_drawable, check_run
from nectosome.view.stage.folder import WorkFolder
from nectosome.view.stage.stage import CAMERAS, COLOURINGS, UNITS, Look, Stage
from nectosome.view.start import standing

from .answers import Answer, AnswerSolver
from .files import Files
from .latest_request import Latest
from .numbers import NumberTable
from .player import Player
from .sliders import Knob, knobs_of
from .tasks import TASKS, StudioTask
from .work import Work, told

if TYPE_CHECKING:
    import viser
    import xarray as xr

_CAMERA = "three-quarter"  # at first
_FIRST = "computing; the first answer of a robot compiles its equations"
_LATER = "computing; what is shown is the last answer"
_TOLD = 1.0  # s
_MOVED = 0.02  # of the robot's length: a camera that is as far from where it was put was moved by the user
_SHAPE = 0.02  # change of a page's shape by which the robot is looked at anew
_SOON = 0.2  # s, within which most answers come
_SPEEDS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)


class Session:
    """A tab from when it is opened to when it is closed."""

    def __init__(self, client: "viser.ClientHandle", robot: str, folder: WorkFolder):
        self._client, self.gui, self.folder = client, client.gui, folder
        self._stage, self._numbers = Stage(client.scene), NumberTable()
        self._words = {"motion": ("", False), "deed": ("", False)}  # of what is shown, and of what the user did last
        self._drawing = threading.RLock()  # the stage changes, or shows a moment, one after the other
        self._answer: Answer | None = None
        self._live = False  # whether what is shown is made while it is shown
        self._opened = 0  # robots and runs so far: an answer for one before is not shown
        self._on_seen: list[Callable[[Answer], None]] = []
        self._setting = threading.Lock()  # numbers of the robot change one after the other
        self._player = Player(self._show)
        self._latest = Latest(self._work)
        self._lay_out()
        self.open(robot)
        client.camera.on_update(lambda _: self._look_anew())

    def open(self, robot: str | Path) -> None:
        """Take a robot that ships, by name, or a file. Raises InputError where it cannot be read: nothing changes."""
        description = describe(str(robot))
        self._take(description, problem_of(robot))
        with self._waiting(self._opened):
            self._stand()
        self._ask()

    def open_run(self, path: Path) -> None:
        """Show a saved run, and take its robot. Raises InputError where it is none."""
        run = load_dataset(path)
        check_run(run, path.name)
        check_drawable(run, path.name)
        robot = parse_robot(run.attrs["robot"])
        self._take(robot, Problem())
        self._put(Answer(run, robot, "a run", 0.0, {}, ""), f"{run.attrs['title']}, as it was saved")
        self._look_from(_CAMERA)

    @property
    def view(self) -> Look:
        """How it is shown."""
        return self._look

    @property
    def aspect(self) -> float:
        """What the page's picture is wide by what it is high; 1 where the page shows none."""
        width, height = self._client.camera.image_width, self._client.camera.image_height
        return width / height if width and height else 1.0

    @property
    def answer(self) -> Answer | None:
        """What is shown; None until there is an answer."""
        return self._answer

    @property
    def sliders(self) -> list[str]:
        """Names of what has a slider."""
        return [knob.name for knob in knobs_of(self.description, self.problem.variables)]

    @property
    def moment(self) -> float:
        """Time of the run [s] that is shown."""
        start = 0.0 if self._answer is None else float(self._answer.run["time"].values[0])
        return start + (self._player.time % self._stage.course.end if self._stage.course.end else 0.0)

    def become(self, description: RobotDescription) -> None:
        """Take other numbers of the same robot: sliders follow, and its motion is asked for."""
        self._leave_live()
        with self._setting:
            self.description = description
            self._put_sliders(knobs_of(description, self.problem.variables))
        self._ask()

    def go_live(self, run: "xr.Dataset") -> None:
        """Show from now on what `live` shows, which goes on from a run of the session's robot."""
        self._go_on(False)
        with self._drawing, self._client.atomic():
            self._live, self._answer = True, None
            self._play.disabled = self._scrub.disabled = True
            self._tell("motion", "", bad=False)
            self._stage.load(run, self.description, 0.0, self._look)
            self._stage.at(0.0)

    def live(self, moment: "xr.Dataset", way: Float[np.ndarray, "n 3"]) -> None:
        """Show one moment more (see `Stage.go_on`); nothing where the robot is another one by now."""
        with self._drawing:
            if self._live:
                with self._client.atomic():
                    self._stage.go_on(moment, self.description, way)

    def end_live(self, run: "xr.Dataset | None", words: str) -> None:
        """Keep what was shown as a run, to play it; without one, and with another robot, ask for its motion."""
        with self._drawing:
            going, self._live = self._live, False
        if not going:
            return
        if run is None:
            self._ask()
            return
        self._player.seek(0.0)
        self._put(Answer(run, self.description, "a run", 0.0, {}, ""), words)

    def on_seen(self, tell: Callable[[Answer], None]) -> None:
        """Have the first answer of each robot told, before it is shown."""
        self._on_seen.append(tell)

    def close(self) -> None:
        """End all that runs for this tab."""
        self._player.close()
        self._latest.close()
        self.work.close()

    def _take(self, description: RobotDescription, problem: Problem) -> None:
        knobs = knobs_of(description, problem.variables)
        self._leave_live()
        self.work.cancel()  # what is found for the last robot is not for this one
        self._go_on(False)
        self._latest.close()  # what is being compiled for the last robot cannot be stopped, but need not be waited for
        with self._setting, self._drawing:
            self.description, self.problem = description, problem
            self._opened, self._answer = self._opened + 1, None
            self._words["deed"] = "", False
            self._solve = AnswerSolver(problem.forward)  # what the last robot did is no place to begin for another one
            self._latest = Latest(self._work)
            self._numbers.forget()
            self._put_sliders(knobs)
            self._play.disabled = self._scrub.disabled = True  # until there is a motion
        for task in self._tasks:
            task.renew()

    # --- controls

    def _lay_out(self) -> None:
        gui = self.gui
        gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        gui.set_panel_label("nectosome studio")
        self._board = gui.add_html("")
        self.work = Work(gui, self.tell)
        with gui.add_folder("Motion"):
            self._play = gui.add_button("Pause")
            self._speed = gui.add_dropdown("Speed", [f"{s:g} x" for s in _SPEEDS], initial_value="1 x")
            self._scrub = gui.add_slider("Time (s)", 0.0, 1.0, 0.001, 0.0)
        tabs = gui.add_tab_group()
        self._robot_tab = tabs.add_tab("Robot")
        with tabs.add_tab("View"):
            self._lay_out_view()
        with tabs.add_tab("Files"):
            Files(self, self._client, self.folder)
        self._tasks = self._lay_out_tasks()
        self._play.on_click(lambda _: self._toggle())
        self._speed.on_update(lambda _: setattr(self._player, "speed", float(self._speed.value.split()[0])))
        self._scrub.on_update(self._scrubbed)

    def _lay_out_tasks(self) -> list[StudioTask]:
        if not TASKS:
            return []
        panel, tasks = self.gui.add_panel(), []
        for name, lay_out in TASKS.items():
            with panel.add_tab(name):
                tasks.append(lay_out(self))
        panel.dock_left()
        return tasks

    def _lay_out_view(self) -> None:
        gui = self.gui
        colouring = gui.add_dropdown("Colour", COLOURINGS, initial_value=COLOURINGS[0])
        forces = gui.add_checkbox("Forces by load", False)
        way = gui.add_checkbox("Way", True, hint="The way of the body.")
        along = gui.add_checkbox("Go along", True, hint="The observer goes along with the body.")
        self._legend = gui.add_html("")
        cameras = gui.add_button_group("Camera", tuple(CAMERAS))

        def changed(_: Any) -> None:
            look = Look(colouring.value, forces.value, way.value, along.value)
            with self._drawing, self._client.atomic():
                self._look = look
                if self._live:
                    self._stage.look(look)
                elif self._answer is not None:
                    self._stage.look(look)
                    self._stage.at(self._player.time)
                    self._tell_colours()

        for control in (colouring, forces, way, along):
            control.on_update(changed)
        self._look = Look()
        cameras.on_click(lambda _: self._look_from(cameras.value))

    def _put_sliders(self, knobs: list[Knob]) -> None:
        """One slider for each number, in place of those of the last robot."""
        for handle in getattr(self, "_sliders", ()):
            handle.remove()
        self._sliders = []
        with self._robot_tab:
            self._sliders.append(self.gui.add_markdown(f"**{self.description.name}**"))
            for knob in knobs:
                value = knob.shown(float(get_value(self.description, knob.name)))
                slider = self.gui.add_slider(knob.label, knob.low, knob.high, knob.step, value)
                slider.on_update(lambda event, knob=knob: self._turned(knob, event.target))
                self._sliders.append(slider)

    # --- what the user does

    def _turned(self, knob: Knob, slider: Any) -> None:
        """Take where a slider is by now: moves are told in threads of their own, which may overtake each other."""
        with told(self.tell), self._setting:
            if slider not in self._sliders:
                return
            value = float(slider.value)
            if not knob.low <= value <= knob.high:  # as it is typed, figure by figure
                raise InputError(f"{value:g} is not from {knob.low:g} to {knob.high:g}.", field=knob.label)
            self._words["deed"] = "", False
            self.description = with_values(self.description, {knob.name: value * knob.factor})
            self._leave_live()
            self._player.hold(_SOON)
            self._ask()

    def _toggle(self) -> None:
        self._go_on(not self._player.playing)

    def _go_on(self, on: bool) -> None:
        """Let time go on, or stop it; the button says what else there is."""
        self._player.play(on)
        self._play.label = "Pause" if on else "Play"

    def _scrubbed(self, event: Any) -> None:
        if event.client is None:  # it moved with the time
            return
        self._go_on(False)
        self._player.seek(float(self._scrub.value))

    def _look_from(self, camera: str) -> None:
        aspect = self.aspect
        with self._drawing:
            place, target = self._stage.camera(camera, aspect)
        with self._client.atomic():
            self._client.camera.position = place  # takes what is looked at along
            self._client.camera.look_at = target
        self._camera, self._seen_in, self._seen_from = camera, aspect, place

    def _look_anew(self) -> None:
        """Look from the same camera where the page has another shape, as once its panels are laid out."""
        if abs(self.aspect / self._seen_in - 1) > _SHAPE and not self._turned_away():
            self._look_from(self._camera)

    def _turned_away(self) -> bool:
        """Whether the user looks from elsewhere than where the camera was put."""
        gone = np.linalg.norm(self._client.camera.position - self._seen_from)
        return bool(gone > _MOVED * self._stage.size)

    def _leave_live(self) -> None:
        """What goes on with the robot as it was ends."""
        with self._drawing:
            if self._live:
                self._live = False
                self.work.cancel()

    # --- answers

    def _stand(self) -> None:
        """Show the robot as it starts, until it moves."""
        with self._drawing, self._client.atomic():
            self._stage.load(standing(self.description, build(self.description)), self.description, 0.0, self._look)
            self._stage.at(0.0)
        self._look_from(_CAMERA)

    def _ask(self) -> None:
        self._latest.ask((self._opened, self._solve, self.description))

    def _work(self, asked: tuple[int, AnswerSolver, RobotDescription]) -> None:
        began = time.perf_counter()
        opened, solve, description = asked

        def tell(words: str, bad: bool) -> None:
            if opened == self._opened:
                self._tell("motion", f"{words} What is shown is the last answer.", bad)

        with told(tell):
            with self._waiting(opened):
                answer = solve(description)
            with self._drawing:
                if opened == self._opened and not self._live:
                    seconds = float(f"{time.perf_counter() - began:.2g}")
                    took = f"{answer.kind}, computed in {show_quantity(seconds, 'time')}"
                    self._put(answer, f"{took}: {answer.warning}" if answer.warning else took)

    @contextmanager
    def _waiting(self, opened: int) -> Iterator[None]:
        """Tell how long an answer takes, while it does: of the first one of a robot at once, else after a second."""
        done, began = threading.Event(), time.perf_counter()
        words = _FIRST if self._answer is None else _LATER

        def count() -> None:
            while not done.wait(_TOLD):
                with self._drawing:
                    if done.is_set() or opened != self._opened or self._live:
                        return
                    self._tell("motion", f"{words}: {time.perf_counter() - began:.0f} s so far", bad=False)

        if self._answer is None:
            self._tell("motion", _FIRST, bad=False)
        threading.Thread(target=count, name="studio-waiting", daemon=True).start()
        try:
            yield
        finally:
            done.set()

    def _put(self, answer: Answer, words: str) -> None:
        """Show an answer, and begin to play where it is the first one of its robot."""
        first = self._answer is None
        for tell in self._on_seen if first else ():
            tell(answer)
        self._player.hold(0.0)
        with self._drawing, self._client.atomic():
            self._answer = answer
            self._stage.load(answer.run, answer.robot, answer.period, self._look)
            self._stage.at(self._player.time)
            self._numbers.add(answer.numbers)
            self._tell("motion", words, bad=bool(answer.warning))
            self._tell_colours()
            self._scrub.max = round(max(self._stage.course.end, 1e-3), 3)
            self._play.disabled = self._scrub.disabled = self._stage.course.end == 0  # at rest
        self._client.flush()  # viser would wait for more to send along
        if first and not self._turned_away():
            self._look_from(_CAMERA)  # all of the motion
        if first:
            gc.freeze()  # what compiling left is there to stay: looking through it takes longer than an answer
            self._go_on(self._stage.course.end > 0)

    def _show(self, t: float) -> None:
        if self._answer is None:
            return
        with told(self.tell), self._drawing, self._client.atomic():
            course = self._stage.course
            if not course.period and t > course.end:
                t = t % course.end if course.end else 0.0
            self._stage.at(t)
            if self._player.playing:
                self._scrub.value = round(t % course.end if course.end else 0.0, 3)

    def tell(self, words: str, bad: bool) -> None:
        """Say under the numbers what came of something that the user did; it stays until the next thing is done."""
        self._tell("deed", words, bad)

    def _tell(self, of: str, words: str, bad: bool) -> None:
        with self._drawing:
            self._words[of] = words, bad
            self._board.content = self._numbers.html(self._words.values())

    def _tell_colours(self) -> None:
        """What the colours of the scene mean."""
        unit, lines = UNITS[self._look.colouring], []
        if unit and self._stage.largest:
            lines.append(f"{self._look.colouring}: dark 0, light {self._stage.largest:.3g} {unit}")
        if self._look.forces:
            marks = zip(self._stage.arrows.names, self._stage.arrows.colours, strict=True)
            lines.append(
                " ".join(f'<span style="color:{c}">&#9632; {escape(n.replace("_", " "))}</span>' for n, c in marks)
            )
        self._legend.content = f'<div style="font-size:13px;padding:0 12px">{"<br>".join(lines)}</div>'


def problem_of(robot: str | Path) -> Problem:
    """The design problem beside a robot file, or that ships with a robot; an empty one where that is a mission's."""
    beside = Path(robot).with_suffix(".design.yaml")
    problem = load_problem(beside) if beside.is_file() else shipped_problem(str(robot))
    return Problem() if problem is None or problem.mission else problem
