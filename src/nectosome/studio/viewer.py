"""The picture of a browser tab: what of a run it shows, from where, and when: the clock and its controls."""

import threading
import time
from collections.abc import Callable
from threading import RLock
from typing import Any

import numpy as np
import viser
from jaxtyping import UInt8

from nectosome.view.display.scene_graph import CAMERAS, COLOURINGS, UNITS, Look, Stage
from nectosome.view.markup import plain

from .work import start_thread

_CAMERA = "three-quarter"  # at first
_MOVED = 0.02  # of the robot's length: the user turned a camera that is as far from where it was put
_SHAPE = 0.02  # change of a page's shape after which the camera is put anew
_FRAME = 0.05  # s between pictures
_SPEEDS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)


class Viewer:
    """How the stage of a tab is shown. `lock` is held while the stage changes."""

    def __init__(self, client: viser.ClientHandle, stage: Stage, lock: RLock):
        self._client, self._stage, self._lock = client, stage, lock
        self._camera, self._placed_for, self._placed_at = _CAMERA, 1.0, np.zeros(3)
        self.look = Look()

    def lay_out(self, changed: Callable[[], None]) -> None:
        """Lay out the controls. `changed` is called with the lock held, once `look` is another one."""
        gui = self._client.gui
        colouring = gui.add_dropdown("Colour", COLOURINGS, initial_value=COLOURINGS[0])
        forces = gui.add_checkbox("Forces by load", False)
        path = gui.add_checkbox("Path", True, hint="Where the body was before.")
        along = gui.add_checkbox("Go along", True, hint="The camera goes along with the body.")
        self._legend = gui.add_html("")
        cameras = gui.add_button_group("Camera", tuple(CAMERAS))

        def update(_: Any) -> None:
            with self._lock, self._client.atomic():
                self.look = Look(colouring.value, forces.value, path.value, along.value)
                changed()

        for control in (colouring, forces, path, along):
            control.on_update(update)
        cameras.on_click(lambda _: self.look_from(cameras.value))

    def follow_page(self) -> None:
        """Fit the picture to the page whenever its shape changes, once there is something on the stage."""
        self._client.camera.on_update(lambda _: self._fit())

    @property
    def aspect(self) -> float:
        """Width over height of the page's picture; 1 where the page shows none."""
        width, height = self._client.camera.image_width, self._client.camera.image_height
        return width / height if width and height else 1.0

    @property
    def direction(self) -> tuple[float, float, float]:
        """Direction from which the scene is seen."""
        camera = self._client.camera
        x, y, z = (float(k) for k in np.subtract(camera.position, camera.look_at))
        return x, y, z

    def picture(self, height: int) -> UInt8[np.ndarray, "height width 3"]:
        """What the page shows, on white, so many pixels high."""
        pixels = self._client.get_render(height, round(height * self.aspect), transport_format="png")
        opaque = pixels[..., 3:] / 255
        return np.round(opaque * pixels[..., :3] + (1 - opaque) * 255).astype(np.uint8)

    def look_from(self, camera: str = _CAMERA) -> None:
        """Put the camera, one of CAMERAS, so that all of the motion is seen."""
        aspect = self.aspect
        with self._lock:
            place, target = self._stage.camera(camera, aspect)
        with self._client.atomic():
            self._client.camera.position = place  # takes what is looked at along
            self._client.camera.look_at = target
        self._camera, self._placed_for, self._placed_at = camera, aspect, place

    def look_at_first(self) -> None:
        """Show all of the first motion of a robot, unless the user has turned the camera."""
        if not self._was_turned():
            self.look_from()

    def show_legend(self) -> None:
        """Show what the colours of the scene mean."""
        unit, lines = UNITS[self.look.colouring], []
        if unit and self._stage.largest:
            lines.append(f"{self.look.colouring}: dark 0, light {self._stage.largest:.3g} {unit}")
        if self.look.forces:
            marks = zip(self._stage.arrows.names, self._stage.arrows.colours, strict=True)
            lines.append(
                " ".join(f'<span style="color:{c}">&#9632; {plain(n.replace("_", " "))}</span>' for n, c in marks)
            )
        self._legend.content = f'<div style="font-size:13px;padding:0 12px">{"<br>".join(lines)}</div>'

    def _fit(self) -> None:
        """Put the same camera anew where the page has another shape, as once its panels are laid out."""
        if abs(self.aspect / self._placed_for - 1) > _SHAPE and not self._was_turned():
            self.look_from(self._camera)

    def _was_turned(self) -> bool:
        """Whether the camera is elsewhere than where it was put."""
        moved = np.linalg.norm(self._client.camera.position - self._placed_at)
        return bool(moved > _MOVED * self._stage.size)


class Player:
    """A clock that shows a picture at every tick. `show(t)` is called in its own thread, and after `seek`."""

    def __init__(self, show: Callable[[float], None]):
        self._show, self._lock = show, threading.Lock()
        self._closed, self._playing = threading.Event(), threading.Event()
        self.time, self.speed = 0.0, 1.0
        self._held = 0.0  # until when nothing is shown, on the clock of `perf_counter` [s]
        start_thread("studio-player", self._run)

    @property
    def playing(self) -> bool:
        """Whether the clock runs."""
        return self._playing.is_set()

    def play(self, on: bool) -> None:
        """Start or stop the clock."""
        (self._playing.set if on else self._playing.clear)()

    def seek(self, t: float) -> None:
        """Set the clock to t [s], and show that instant."""
        with self._lock:
            self.time = t
        self._show(t)

    def hold(self, seconds: float) -> None:
        """Show nothing for so long, while the clock runs: an answer that comes soon is drawn sooner. 0 ends it."""
        self._held = time.perf_counter() + seconds

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._playing.set()

    def _run(self) -> None:
        last = time.perf_counter()
        while not self._closed.is_set():
            if not self._playing.is_set():
                self._playing.wait()
                last = time.perf_counter()
                continue
            now = time.perf_counter()
            with self._lock:
                self.time += self.speed * (now - last)
                t = self.time
            last = now
            if now >= self._held:
                self._show(t)
            self._closed.wait(max(0.0, _FRAME - (time.perf_counter() - now)))


class PlayerControls:
    """A button, a speed and a slider over the time of a run, laid out where this is made."""

    def __init__(self, gui: viser.GuiApi, player: Player):
        self._player = player
        self._button = gui.add_button("Pause")
        self._speed: Any = gui.add_dropdown("Speed", [f"{s:g} x" for s in _SPEEDS], initial_value="1 x")
        self._time: Any = gui.add_slider("Time (s)", 0.0, 1.0, 0.001, 0.0)
        self._button.on_click(lambda _: self.play(not player.playing))
        self._speed.on_update(lambda _: setattr(player, "speed", float(self._speed.value.split()[0])))
        self._time.on_update(self._scrubbed)

    def play(self, on: bool) -> None:
        """Start or stop the clock; the button has the other one's name."""
        self._player.play(on)
        self._button.label = "Pause" if on else "Play"

    def set_end(self, end: float) -> None:
        """Take the end of a run [s]; at 0, without a motion, nothing can be played."""
        self._time.max = round(max(end, 1e-3), 3)
        self._button.disabled = self._time.disabled = end == 0

    def disable(self) -> None:
        """Until there is a motion nothing can be played."""
        self._button.disabled = self._time.disabled = True

    def show(self, t: float) -> None:
        """Let the slider follow the clock."""
        if self._player.playing:
            self._time.value = round(t, 3)

    def _scrubbed(self, event: Any) -> None:
        if event.client is None:  # it moved with the clock
            return
        self.play(False)
        self._player.seek(float(self._time.value))
