"""A command that run.py starts ends with it, also where run.py is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="signals of Linux")
ROOT = Path(__file__).resolve().parents[2]
CHILD = """
import os, signal, sys, time
def end(*_):
    open(sys.argv[1] + ".ended", "w").write("cleaned up")
    sys.exit(130)
signal.signal(signal.SIGTERM, end)
open(sys.argv[1], "w").write(str(os.getpid()))
time.sleep(60)
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_child_ends_with_its_parent(number, tmp_path):
    script, file = tmp_path / "child.py", tmp_path / "pid"
    script.write_text(CHILD)
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "from tools.common import call\n"
        f"call([sys.executable, {str(script)!r}, {str(file)!r}])"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL)
    until = time.monotonic() + 20
    while not (file.is_file() and file.read_text()) and time.monotonic() < until:
        time.sleep(0.05)
    child = int(file.read_text())
    parent.send_signal(number)
    parent.wait(10)
    until = time.monotonic() + 5
    while _runs(child) and time.monotonic() < until:
        time.sleep(0.05)
    assert not _runs(child)
    assert Path(f"{file}.ended").read_text() == "cleaned up"


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    return state != "Z"  # ended, but its new parent has not noticed yet
