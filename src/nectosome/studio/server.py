"""The studio's server: one session for each browser tab, until it is closed."""

import gc
import threading
import warnings
from pathlib import Path

import viser

from nectosome.core.programs.remember import give_back

from .folder import WorkFolder
from .gate import Gate
from .rig_room import RigRoom
from .session import Session
from .tasks import TASKS
from .web_server import guarded_server
from .work import Machines, start_thread, unless_ending

_PULSE = 0.5  # s between looks whether the program ends


class Studio:
    """A page at `address`, for a robot that ships, by name, or a file; other files are those of a working folder.

    - cluster: address of the scheduler whose workers compute maps, designs and fits; this machine without one.

    Raises InputError where the folder or the address to listen at cannot be used, and where no cluster answers.
    """

    def __init__(self, robot: str, folder: Path, host: str, port: int, cluster: str | None = None):
        with Machines(cluster).executor():
            pass  # it answers
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection")  # of a tab closed while it plays
        self._sessions: dict[int, Session] = {}
        self._lock = threading.Lock()
        self._robot, self._folder, self._rigs, self._cluster = robot, WorkFolder(folder), RigRoom(), cluster
        gate = Gate.at(host)
        self._server = guarded_server(gate, port)
        self.address = gate.address(self._server.get_port())
        self._server.scene.world_axes.visible = False
        self._server.scene.configure_default_lights(cast_shadow=False)  # shadows halve the pictures a second
        self._closed = threading.Event()
        self._server.on_client_connect(self._enter)
        self._server.on_client_disconnect(self._leave)
        start_thread("studio-end", self._close_at_the_end)

    def close(self) -> None:
        """Close all tabs' sessions and the server; what compiles for them ends by itself, a rig by its ramp to 0."""
        self._closed.set()
        with self._lock:
            sessions, self._sessions = [*self._sessions.values()], {}
        for session in sessions:
            session.close()
        self._server.stop()

    def wait_for_rig(self) -> None:
        """Wait until no rig is in use: after `close`, until it is without power."""
        self._rigs.wait()

    def _close_at_the_end(self) -> None:
        """Close where nobody did before the main thread ended: the interpreter waits for the threads of sessions."""
        while not self._closed.wait(_PULSE):
            if not threading.main_thread().is_alive():
                self.close()

    def _enter(self, client: viser.ClientHandle) -> None:
        with unless_ending():
            session = Session(client, self._robot, self._folder, TASKS, self._rigs, Machines(self._cluster))
            with self._lock:
                self._sessions[client.client_id] = session
            # it was closed, or the studio, while its session was made
            if self._closed.is_set() or client.client_id not in self._server.get_clients():
                self._end(client.client_id)

    async def _leave(self, client: viser.ClientHandle) -> None:  # async: at the end viser's threads take no more work
        self._end(client.client_id)

    def _end(self, client_id: int) -> None:
        with self._lock:
            session = self._sessions.pop(client_id, None)
        if session is not None:
            session.close()
            _forget_closed_tabs()


def _forget_closed_tabs() -> None:
    """Free what closed tabs have left; `Session` froze it with what compiling left, which is there to stay."""
    gc.unfreeze()
    give_back()
    gc.freeze()
