"""A Dask cluster on this computer whose scheduler and workers are killed at random moments."""

from __future__ import annotations

import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

WORKERS = 2
DEATH_SECONDS = 60  # that a worker waits for a scheduler
MAX_MESSAGES = 4000  # characters, of the end
Process = subprocess.Popen[bytes]


class KilledCluster:
    """A scheduler and WORKERS workers of one thread. kills: how many of them were killed."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._port = free.getsockname()[1]
        self._folder, self.kills = folder, 0
        self._parts = [self._start(place) for place in range(1 + WORKERS)]

    @property
    def address(self) -> str:
        """Of the scheduler."""
        return f"tcp://127.0.0.1:{self._port}"

    def __enter__(self) -> KilledCluster:
        return self

    def __exit__(self, *_: object) -> None:
        for part in self._parts:
            self._end(part)

    def run(
        self,
        command: Sequence[str],
        chance: random.Random,
        most: int,
        pauses: tuple[float, float],
        limit: float,
    ) -> tuple[int | None, str]:
        """Run a command, and kill up to ``most`` parts meanwhile: of three, one scheduler and two
        workers. pauses: shortest and longest time between two, seconds; limit: of the command,
        seconds. Returns (exit code, messages); the code is None beyond the limit."""
        until = time.monotonic() + limit
        with tempfile.TemporaryFile("w+", encoding="utf-8") as messages:
            running = subprocess.Popen(list(command), stderr=messages)
            while running.poll() is None and time.monotonic() < until:
                time.sleep(chance.uniform(*pauses))
                if self.kills < most and running.poll() is None:
                    place = 0 if self.kills % 3 == 1 else 1 + self.kills % WORKERS
                    self._end(self._parts[place])
                    self.kills += 1
                for place, part in enumerate(self._parts):  # a worker ends with its scheduler
                    if part.poll() is not None:
                        self._parts[place] = self._start(place)
            code = running.poll()
            if code is None:
                running.kill()
                running.wait()
            messages.seek(0)
            return code, messages.read()[-MAX_MESSAGES:]

    def _start(self, place: int) -> Process:
        kind, words = "scheduler", ["--port", str(self._port), "--host", "127.0.0.1"]
        if place:
            own = ["--nthreads", "1", "--local-directory", str(self._folder)]
            kind, words = "worker", [self.address, "--death-timeout", str(DEATH_SECONDS), *own]
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", *words]
        quiet = subprocess.DEVNULL
        return subprocess.Popen(command, stdout=quiet, stderr=quiet, start_new_session=True)

    def _end(self, part: Process) -> None:
        if part.poll() is None:
            os.killpg(part.pid, signal.SIGKILL)
        part.wait()
