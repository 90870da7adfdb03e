"""The picture of a browser tab: what of a run it shows, and from where."""

from collections.abc import Callable
from threading import RLock
from typing import Any

import numpy as np
import viser
from jaxtyping import UInt8

from nectosome.view.display.scene_graph import CAMERAS, COLOURINGS, UNITS, Look, Stage
from nectosome.view.markup import plain

_CAMERA = "three-quarter"  # at first
_MOVED = 0.02  # of the robot's length: the user turned a camera that is as far from where it was put
_SHAPE = 0.02  # change of a page's shape after which the camera is put anew


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
