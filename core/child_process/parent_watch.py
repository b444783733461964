"""A process that ends with the process that started it, however that ends: its standard input is a
pipe that is closed then."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time

END_WITH_PARENT = "PATINA_END_WITH_PARENT"
"""Environment variable of a command whose parent holds its standard input open."""
CLEANUP_SECONDS = 0.4  # that the process has to remove its incomplete files
CANCELLED = 130  # exit code


def end_with_parent() -> None:
    """Send this process SIGTERM when standard input is closed, and end it soon after in any
    case."""
    threading.Thread(target=_watch, daemon=True).start()


def _watch() -> None:
    with contextlib.suppress(OSError):
        while os.read(0, 1):
            pass
    signal.raise_signal(signal.SIGTERM)
    time.sleep(CLEANUP_SECONDS)
    os._exit(CANCELLED)
