"""A Dask scheduler and its workers as processes of this machine, which can be killed."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

_PINNED = ("NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


class DaskProcesses:
    """A scheduler on a free port of the loopback, and workers; all end with the `with` block."""

    def __init__(self, folder: Path, *, pinned: bool = True):
        self.folder = folder
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self._environment = {**os.environ, **dict.fromkeys(_PINNED, "1")}
        if not pinned:
            del self._environment["NPROC"]
        self.scheduler: subprocess.Popen | None = None
        self.workers: list[subprocess.Popen] = []

    def begin(self) -> None:
        """Start the scheduler, at the same address as the one before."""
        host, port = self.address.removeprefix("tcp://").split(":")
        self.scheduler = self._start("scheduler", "--host", host, "--port", port, "--no-dashboard")
        until = time.monotonic() + 60
        while True:
            try:
                socket.create_connection((host, int(port)), 1).close()
            except OSError:
                if time.monotonic() > until:
                    raise
                time.sleep(0.05)
            else:
                return

    def restart(self) -> None:
        """Kill the scheduler and its workers, and start another one, without workers."""
        self._end()
        self.begin()

    def add(self, number: int = 1, threads: int = 1) -> None:
        """Start workers."""
        options = ("--nthreads", str(threads), "--no-nanny", "--no-dashboard", "--local-directory", str(self.folder))
        self.workers += [self._start("worker", self.address, *options) for _ in range(number)]

    def wait(self) -> None:
        """Wait until all workers have joined."""
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(len(self.workers), timeout=60)

    def _start(self, *argv: str) -> subprocess.Popen:
        with (self.folder / f"{argv[0]}.log").open("ab") as log:
            command = [sys.executable, "-m", "dask", *argv]
            return subprocess.Popen(command, env=self._environment, stdout=log, stderr=log)

    def __enter__(self) -> "DaskProcesses":
        self.begin()
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def _end(self) -> None:
        for process in (self.scheduler, *self.workers):
            if process is not None:
                kill(process)
        self.workers.clear()


def kill(process: subprocess.Popen) -> None:
    """End a process at once, as `kill -9` does."""
    process.send_signal(signal.SIGKILL)
    process.wait()
