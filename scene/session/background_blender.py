"""A headless command in a second Blender without a window: what opens a .blend of its own must not
close the artist's."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path

import bpy

from ...core.concurrency.job import Step
from ...core.errors import PatinaError

HEADLESS = Path(__file__).parents[1] / "headless.py"
PACKAGE = __package__.rpartition(".")[0]
MOMENT = 0.05  # seconds between looks at it
PATIENCE = 10.0  # seconds in which it is to end when it is told so
PROGRESS = re.compile(r"^\[\s*(\d+) %\] (.*)$")
OURS = "patina: "  # before a mistake in one line
NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # Windows opens a console else


def command(words: Sequence[str]) -> list[str]:
    """How to call a headless command with this Blender, or with the Python that bpy is a module
    of."""
    binary = bpy.app.binary_path
    if not binary:
        return [sys.executable, str(HEADLESS), *words]
    factory = ["--factory-startup"] if bpy.app.factory_startup else []
    enabled = ["--addons", PACKAGE] if PACKAGE in bpy.context.preferences.addons else []
    return [
        binary, "-b", *factory, *enabled, "--python-exit-code", "1", "-P", str(HEADLESS), "--",
        *words,
    ]  # fmt: skip


def in_background(
    words: Sequence[str], environment: Mapping[str, str] | None = None
) -> Generator[Step, None, None]:
    """Run a command, yielding how far it is; dropped, it is ended and leaves nothing. environment:
    variables beside this Blender's own. Raises PatinaError with what the command said."""
    with tempfile.TemporaryDirectory(prefix="patina-", ignore_cleanup_errors=True) as folder:
        said = Path(folder) / "said.txt"
        with said.open("wb") as out:
            process = subprocess.Popen(
                command(words),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=out,
                env={**os.environ, **(environment or {})},
                creationflags=NO_WINDOW,
            )
        try:
            yield Step("starting another Blender", 0.0)
            while _runs(process, MOMENT):
                yield _progress(_lines(said))
        finally:
            _end(process)
        if process.returncode != 0:
            raise PatinaError(_mistake(_lines(said), process.returncode))


def _runs(process: subprocess.Popen[bytes], seconds: float) -> bool:
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return True
    return False


def _end(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        process.terminate()  # the command takes its half-written files away
        if _runs(process, PATIENCE):
            process.kill()
            process.wait()


def _lines(said: Path) -> list[str]:
    return said.read_text("utf-8", "replace").splitlines()


def _progress(lines: list[str]) -> Step:
    found = next((match for line in reversed(lines) if (match := PROGRESS.match(line))), None)
    if found is None:
        return Step("starting another Blender", 0.0)
    return Step(found[2], int(found[1]) / 100)


def _mistake(lines: list[str], code: int) -> str:
    """What went wrong, in the command's own words where it has any."""
    told = next((line for line in reversed(lines) if line.startswith(OURS)), None)
    if told is not None:
        return told.removeprefix(OURS)
    last = next((line for line in reversed(lines) if line.strip()), "it said nothing")
    return f"a second Blender was started to write it, and failed (exit code {code}: {last})"
