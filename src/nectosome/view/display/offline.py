"""A stage that records what would be sent to a browser: a scene that turns and plays in a page, without a server."""

import base64
import threading
from collections.abc import Callable
from contextlib import nullcontext
from functools import cache
from typing import Any

import numpy as np
import viser
import xarray as xr
from jaxtyping import Float
from viser.infra import WebsockMessageHandler

from nectosome.description import RobotDescription
from nectosome.view.markup import guarded, sealed, with_nonce

from .scene_graph import CAMERAS, Look, Stage

_PICTURES = 20  # a second
_MOST = 600  # pictures
_PERIODS = 3  # of a periodic motion
_ANGLE = 0.6  # rad, from the top of the picture to its bottom: less than viser's, which distorts what is near
_ASPECT = 1.8  # width of the picture over its height, at least
_ROOM = 0.8  # of the picture that the motion takes
Direction = tuple[float, float, float]
_MARK = 'window.__VISER_EMBED_DATA__="'  # what viser puts a recording behind, in a page that is the same for all


class _Recorder(WebsockMessageHandler):
    """What viser takes for a client. It has no port: nobody can come in."""

    client_id = ""  # of everybody, as viser has it

    def __init__(self):
        super().__init__()
        self._websock_connection = self._viser_server = self
        self._scene_lifecycle_lock = threading.RLock()
        self.tape = self.get_message_serializer(lambda message: message.include_in_scene_serialization)
        owner: Any = self
        threads: Any = None  # there are no events
        self.scene = viser.SceneApi(owner, threads, threads)
        self.camera = viser.InitialCameraConfig(self.queue_message)

    def get_message_buffer(self) -> Any:
        return _Discarded


class _Discarded:
    """The queue to a browser, where there is none."""

    push = staticmethod(lambda message: None)
    remove_entity_state_from_buffer = staticmethod(lambda kind, name: None)
    sanctioned_dead_writes = staticmethod(nullcontext)


def page_of(run: xr.Dataset, robot: RobotDescription, period: float, look: Look) -> str:
    """HTML with all that it needs: three periods of a periodic motion [s], else the whole run, in its own time."""
    tape = _recorder(lambda stage: stage.load(run, robot, period, look)).tape
    page = guarded(tape.as_html())
    return sealed(lambda nonce: with_nonce(page, nonce))


def recording(put: Callable[[Stage], None], camera: Direction = CAMERAS["three-quarter"]) -> str:
    """What `put` puts on a stage, and its motion, as text for `player_page`, seen from the direction `camera`."""
    return base64.b64encode(_recorder(put, camera).tape.serialize()).decode()


@cache
def player_page() -> tuple[str, str]:
    """The page that plays a recording: the text before the recording, and after."""
    before, _, rest = guarded(_Recorder().tape.as_html()).partition(_MARK)
    return before + _MARK, rest[rest.index('"') :]


def pictures(seconds: float) -> int:
    """How many pictures a recording of so many seconds has."""
    return int(np.clip(round(seconds * _PICTURES) + 1, 2, _MOST)) if seconds else 1


def _recorder(put: Callable[[Stage], None], camera: Direction = CAMERAS["three-quarter"]) -> _Recorder:
    recorder = _Recorder()
    stage = Stage(recorder.scene)
    put(stage)
    recorder.camera.fov = _ANGLE
    recorder.camera.position, recorder.camera.look_at = _camera(stage.corners(), np.array(camera))
    playback = stage.playback
    end = _PERIODS * playback.period or playback.end
    times = np.linspace(0.0, end, pictures(end))
    for t in times:
        stage.at(float(t))
        if end:
            recorder.tape.insert_sleep(float(times[1]))
    return recorder


def _camera(
    corners: Float[np.ndarray, "n 3"], direction: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Place from which corners [m] are seen within the picture, in a direction from their middle, and the middle."""
    out = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], out)
    right /= np.linalg.norm(right)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    x, y, depth = ((corners - middle) @ axis for axis in (right, np.cross(out, right), out))
    half = _ROOM * np.tan(0.5 * _ANGLE)
    away = np.max(depth + np.maximum(np.abs(x) / (_ASPECT * half), np.abs(y) / half))
    return middle + (away or 1.0) * out, middle
