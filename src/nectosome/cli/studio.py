"""`nectosome studio`: a page in the browser that simulates a robot live, with sliders for its quantities."""

import os
import signal
import time
import webbrowser
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.options import Cluster, Robot, command, robot_named, tell_far_out, whole
from nectosome.cli.output import tell, write_text
from nectosome.io.file_system import check_readable

_PATIENCE = 6.0  # s, for work under way, which ends sooner unless it compiles


@command
def studio(
    robot: Robot = "flagellum",
    /,
    *,
    folder: Annotated[Path, Parameter(help="Working folder: the page opens and saves files there only.")] = Path(),
    host: Annotated[str, Parameter(help="Address to listen at; other machines need a token.")] = "127.0.0.1",
    port: Annotated[int, whole("Port, or the next free one.", 1, 65_535)] = 8080,
    browser: Annotated[bool, Parameter(negative="--no-browser", help="Open the page in the browser.")] = True,
    cluster: Cluster = None,
) -> int:
    """Open a page in the browser that simulates a robot live, with sliders for its quantities. Ctrl-C ends it."""
    check_readable(folder)
    tell_far_out(robot_named(robot), robot)

    from nectosome.studio.server import Studio
    from nectosome.studio.work import wait_for_work

    for name in ("SIGTERM", "SIGHUP"):  # of a service that is stopped, and of a closed terminal: as Ctrl-C
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.default_int_handler)
    page = Studio(robot, folder, host, port, cluster)
    try:
        write_text(f"the studio is at {page.address} (Ctrl-C ends it)")
        if browser:
            webbrowser.open(page.address)
        while True:
            time.sleep(3600)
    except KeyboardInterrupt:
        page.close()
        page.wait_for_rig()
        wait_for_work(_PATIENCE)
        tell("closed.")
        os._exit(0)  # what is being compiled cannot be stopped otherwise
