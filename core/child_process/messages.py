"""Messages from a child process to its parent: lines of JSON in a pipe, read without waiting."""

from __future__ import annotations

import json
import os
import sys
from typing import Any

MAX_READ = 1 << 16  # bytes at a time


class MessageReader:
    """Reads messages from the reading end of a pipe."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor, self._rest = descriptor, b""
        if sys.platform != "win32":
            os.set_blocking(descriptor, False)

    def read(self) -> list[dict[str, Any]]:
        """The messages that have arrived since the last call."""
        while content := self._available():
            self._rest += content
        *lines, self._rest = self._rest.split(b"\n")
        return [json.loads(line) for line in lines]

    def _available(self) -> bytes:
        if sys.platform == "win32":
            import _winapi
            import msvcrt

            handle = msvcrt.get_osfhandle(self._descriptor)
            try:
                count, _ = _winapi.PeekNamedPipe(handle, 0)
            except OSError:  # the child has ended
                return b""
            return os.read(self._descriptor, min(count, MAX_READ)) if count else b""
        try:
            return os.read(self._descriptor, MAX_READ)
        except BlockingIOError:
            return b""


class MessageWriter:
    """Writes messages to the writing end of a pipe."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def write(self, **content: Any) -> None:
        """Write a message; waits while the pipe is full."""
        line = json.dumps(content).encode() + b"\n"
        while line:
            line = line[os.write(self._descriptor, line) :]
