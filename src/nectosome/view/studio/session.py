"""One browser tab: its robot, its scene and its controls. Nothing of it is shared with other tabs."""

import threading
import time
from typing import TYPE_CHECKING, Any

from nectosome.design import shipped_problem
from nectosome.io import InputError, RobotDescription, get_value, with_values
from nectosome.robots import build, describe
from nectosome.view.standing import standing

from .answers import Answer, Solver
from .knobs import Knob, knobs_of
from .latest import Latest
from .numbers import Numbers
from .player import Player
from .scene import CAMERAS, COLOURINGS, UNITS, Look, Stage

if TYPE_CHECKING:
    import viser

_SPEEDS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)


class Session:
    """A tab from when it is opened to when it is closed."""

    def __init__(self, client: "viser.ClientHandle", robot: str):
        self._client, self._gui = client, client.gui
        self._stage, self._numbers, self._solve = Stage(client.scene), Numbers(), Solver()
        self._drawing = threading.RLock()  # the stage changes, or shows a moment, one after the other
        self._answer: Answer | None = None
        self._moved_by_us = False  # the scrubber, as time goes on
        self._player = Player(self._show)
        self._latest = Latest(self._work)
        self._lay_out()
        self.open(robot)

    def open(self, robot: str) -> None:
        """Take a robot that ships, by name, or a file. What cannot be read is told, and the last one stays."""
        try:
            description = describe(robot)
            problem = shipped_problem(robot)
            knobs = knobs_of(description, problem.variables if problem else {})
        except InputError as error:
            self._tell(str(error), bad=True)
            return
        self.description = description
        self._answer = None
        self._put_sliders(knobs)
        self._stand()
        self._ask()

    def close(self) -> None:
        """End all that runs for this tab."""
        self._player.close()
        self._latest.close()

    # --- controls

    def _lay_out(self) -> None:
        gui = self._gui
        gui.configure_theme(control_layout="fixed", control_width="large", show_logo=False, show_share_button=False)
        gui.set_panel_label("nectosome studio")
        self._board = gui.add_html("")
        with gui.add_folder("Motion"):
            self._play = gui.add_button("Pause")
            self._speed = gui.add_dropdown("Speed", [f"{s:g} x" for s in _SPEEDS], initial_value="1 x")
            self._scrub = gui.add_slider("Time (s)", 0.0, 1.0, 0.001, 0.0)
        tabs = gui.add_tab_group()
        self._robot_tab = tabs.add_tab("Robot")
        with tabs.add_tab("View"):
            self._lay_out_view()
        self._play.on_click(lambda _: self._toggle())
        self._speed.on_update(lambda _: setattr(self._player, "speed", float(self._speed.value.split()[0])))
        self._scrub.on_update(self._scrubbed)

    def _lay_out_view(self) -> None:
        gui = self._gui
        colouring = gui.add_dropdown("Colour", COLOURINGS, initial_value=COLOURINGS[0])
        forces = gui.add_checkbox("Forces by load", False)
        way = gui.add_checkbox("Way", True)
        along = gui.add_checkbox("Go along with the body", True)
        self._legend = gui.add_html("")
        cameras = gui.add_button_group("Camera", tuple(CAMERAS))

        def changed(_: Any) -> None:
            look = Look(colouring.value, forces.value, way.value, along.value)
            with self._drawing, self._client.atomic():
                self._look = look
                if self._answer is not None:
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
            self._sliders.append(self._gui.add_markdown(f"**{self.description.name}**"))
            for knob in knobs:
                value = knob.shown(float(get_value(self.description, knob.name)))
                slider = self._gui.add_slider(knob.label, knob.low, knob.high, knob.step, value)
                slider.on_update(lambda event, knob=knob: self._turned(knob, float(event.target.value)))
                self._sliders.append(slider)

    # --- what the user does

    def _turned(self, knob: Knob, value: float) -> None:
        try:
            self.description = with_values(self.description, {knob.name: value * knob.factor})
        except InputError as error:
            self._tell(str(error), bad=True)
            return
        self._ask()

    def _toggle(self) -> None:
        self._player.play(not self._player.playing)
        self._play.label = "Pause" if self._player.playing else "Play"

    def _scrubbed(self, event: Any) -> None:
        if event.client is None:  # it moved with the time
            return
        self._player.play(False)
        self._play.label = "Play"
        self._player.seek(float(self._scrub.value))

    def _look_from(self, camera: str) -> None:
        with self._drawing:
            place, target = self._stage.camera(camera)
        with self._client.atomic():
            self._client.camera.position = place  # takes what is looked at along
            self._client.camera.look_at = target

    # --- answers

    def _stand(self) -> None:
        """Show the robot as it starts, until it moves."""
        with self._drawing, self._client.atomic():
            self._stage.load(standing(self.description, build(self.description)), 0.0, self._look)
            self._stage.at(0.0)
        self._look_from("three-quarter")

    def _ask(self) -> None:
        if self._answer is None:
            self._tell("computing; the first answer of a robot compiles its equations", bad=False)
        self._latest.ask(self.description)

    def _work(self, description: RobotDescription) -> None:
        began = time.perf_counter()
        try:
            answer = self._solve(description)
        except InputError as error:
            self._tell(f"{error} What is shown is the last answer.", bad=True)
            return
        seconds = time.perf_counter() - began
        first = self._answer is None
        with self._drawing, self._client.atomic():
            self._answer = answer
            self._stage.load(answer.run, answer.period, self._look)
            self._stage.at(self._player.time)
            self._numbers.add(answer.numbers)
            kind = str(answer.run.attrs["title"]).partition(": ")[2]
            self._tell(answer.warning or f"{kind}, {1e3 * seconds:.0f} ms", bad=bool(answer.warning))
            self._tell_colours()
            self._scrub.max = round(max(self._stage.course.end, 1e-3), 3)
        if first:
            self._player.play(self._stage.course.end > 0)

    def _show(self, t: float) -> None:
        if self._answer is None:
            return
        with self._drawing, self._client.atomic():
            course = self._stage.course
            if not course.period and t > course.end:
                t = t % course.end if course.end else 0.0
            self._stage.at(t)
            if self._player.playing:
                self._scrub.value = round(t % course.end if course.end else 0.0, 3)

    def _tell(self, words: str, bad: bool) -> None:
        self._board.content = self._numbers.html(words, bad)

    def _tell_colours(self) -> None:
        unit = UNITS[self._look.colouring]
        text = f"{self._look.colouring}: dark 0, light {self._stage.largest:.3g} {unit}" if unit else ""
        self._legend.content = f'<div style="font-size:13px;padding:0 12px">{text}</div>'
