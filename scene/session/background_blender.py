"""Run a headless command in a second Blender process without a window, because a command that opens
a .blend must not close the user's file."""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path

import bpy

from ...core.child_process.parent_watch import END_WITH_PARENT
from ...core.child_process.python_command import python_command, python_environment
from ...core.concurrency.job import Step
from ...core.errors import PatinaError

HEADLESS = Path(__file__).parents[2] / "headless.py"
PACKAGE = __package__.rsplit(".", 2)[0]
POLL_INTERVAL = 0.05  # seconds between checks of the process
TERMINATION_TIMEOUT = 1.0  # seconds between asking the process to end and killing it
PROGRESS = re.compile(r"^\[\s*(\d+) %\] (.*)$")
ERROR_PREFIX = "patina: "  # of a one-line error message of the command
NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # otherwise Windows opens a console


def command(words: Sequence[str]) -> list[str]:
    """The command line of a headless command, for this Blender or for the Python that has bpy as a
    module."""
    binary = bpy.app.binary_path
    if not binary:
        return python_command("commands.registered", *words)
    factory = ["--factory-startup"] if bpy.app.factory_startup else []
    enabled = ["--addons", PACKAGE] if PACKAGE in bpy.context.preferences.addons else []
    return [
        binary, "-b", *factory, *enabled, "--python-exit-code", "1", "-P", str(HEADLESS), "--",
        *words,
    ]  # fmt: skip


def in_background(
    words: Sequence[str], environment: Mapping[str, str] | None = None
) -> Generator[Step, None, None]:
    """Run a command and yield its progress. Closing the generator ends the process and removes its
    files.

    words: the command and its arguments; environment: variables added to those of this process.
    Raises PatinaError with the message of the command if it fails.
    """
    with tempfile.TemporaryDirectory(prefix="patina-", ignore_cleanup_errors=True) as folder:
        own = python_environment() if not bpy.app.binary_path else os.environ
        messages = Path(folder) / "said.txt"
        with messages.open("wb") as out:
            process = subprocess.Popen(
                command(words),
                stdin=subprocess.PIPE,  # is closed when this Blender ends
                stdout=subprocess.DEVNULL,
                stderr=out,
                env={**own, **(environment or {}), END_WITH_PARENT: "1"},
                creationflags=NO_WINDOW,
            )
        try:
            yield Step("Starting a second Blender", 0.0)
            while _runs(process, POLL_INTERVAL):
                yield _progress(_lines(messages))
        finally:
            _end(process)
        if process.returncode != 0:
            raise PatinaError(_error_message(_lines(messages), process.returncode))


def _runs(process: subprocess.Popen[bytes], seconds: float) -> bool:
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return True
    return False


def _end(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        if process.stdin is not None:
            process.stdin.close()
        process.terminate()  # the command removes its incomplete files
        if _runs(process, TERMINATION_TIMEOUT):
            process.kill()
            process.wait()


def _lines(messages: Path) -> list[str]:
    return messages.read_text("utf-8", "replace").splitlines()


def _progress(lines: list[str]) -> Step:
    found = next((match for line in reversed(lines) if (match := PROGRESS.match(line))), None)
    if found is None:
        return Step("Starting a second Blender", 0.0)
    return Step(found[2], int(found[1]) / 100)


def _error_message(lines: list[str], code: int) -> str:
    """The error message of the command, or a general one if it printed none."""
    reported = next((line for line in reversed(lines) if line.startswith(ERROR_PREFIX)), None)
    if reported is not None:
        return reported.removeprefix(ERROR_PREFIX)
    last = next((line for line in reversed(lines) if line.strip()), "no output")
    return f"the second Blender that writes the files failed (exit code {code}: {last})"
