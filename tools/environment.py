"""A Python of our own with bpy in it: Blender as a module, for machines without Blender."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from .common import Failure, cache_dir, one_at_a_time, quietly, say, this_platform
from .wheels import requirements

BPY = {(3, 11): "5.0.1", (3, 13): "5.2.3"}
"""Python version → the bpy wheel made for it (each wheel works with one Python only)."""

TEST_TOOLS = [
    "pytest==8.4.2",
    "hypothesis==6.140.3",
    "rawpy==0.28.0",  # camera RAW is optional: the zips do not carry it
    "trimesh==5.2.0",  # writes meshes that are not ours
    "usd-core==26.11",  # these three judge what is exported
    "MaterialX==1.39.5",
    "mitsuba==3.9.1",
    "ruff==0.13.3",
    "mypy==1.18.2",
    "import-linter==2.17",
    "jsonschema==4.25.1",  # validates what is written against assets/schemas
]

PROBE = """
import json, sys, venv, ensurepip
print(json.dumps([sys.executable, list(sys.version_info[:2]), sys.maxsize > 2**32]))
"""


@dataclass(frozen=True)
class Interpreter:
    """A Python that can carry bpy: its program and its (major, minor) version."""

    program: Path
    version: tuple[int, int]


def probe(program: str | Path) -> Interpreter | str:
    """Ask a Python what it is; a str says why it will not do.

    A name on PATH proves nothing (pyenv puts shims there for versions that are not installed,
    Debian ships Pythons without venv), so the program is run.
    """
    try:
        done = subprocess.run(
            [str(program), "-c", PROBE], capture_output=True, text=True, timeout=60
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"{program} does not run ({error})"
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return f"{program} cannot make an environment ({reason.strip()})"
    executable, version, wide = json.loads(done.stdout)
    if tuple(version) not in BPY or not wide:
        return f"{program} is Python {version[0]}.{version[1]}"
    return Interpreter(Path(executable), (version[0], version[1]))


def candidates() -> list[str]:
    """Return the Pythons worth asking: the one at hand, then those on PATH by name."""
    found = [sys.executable]
    names = [f"python{major}.{minor}" for major, minor in BPY]
    for name in names:
        for folder in os.environ.get("PATH", "").split(os.pathsep):
            program = shutil.which(name, path=folder) if folder else None
            if program and program not in found:
                found.append(program)
    if launcher := shutil.which("py") if sys.platform == "win32" else None:
        for major, minor in BPY:
            asked = [launcher, f"-{major}.{minor}", "-c", "import sys; print(sys.executable)"]
            done = subprocess.run(asked, capture_output=True, text=True)
            if done.returncode == 0:
                found.append(done.stdout.strip())
    return found


def find_interpreter() -> Interpreter:
    """Return the first Python that can carry bpy; a Failure tells what was looked at."""
    refused = []
    for program in candidates():
        result = probe(program)
        if isinstance(result, Interpreter):
            return result
        refused.append(result)
    raise Failure(
        "no Blender >= 4.2 with numpy on PATH and no Python 3.11 or 3.13 with venv "
        f"({'; '.join(refused)}): install Blender, or python3.11 with python3.11-venv"
    )


def venv_python(folder: Path) -> Path:
    """Return the program of an environment."""
    return folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")


def bpy_python() -> Path:
    """Return the Python of our environment, made on the first call and reused after.

    The folder's name holds a hash of its requirements, and it is made under another name and
    renamed when whole: a half-made one is never used.
    """
    this_platform()
    interpreter = find_interpreter()
    bpy = BPY[interpreter.version]
    wanted = [f"bpy=={bpy}", *requirements()]
    key = f"{interpreter.program}\n" + "\n".join(wanted)
    tag = f"cp{interpreter.version[0]}{interpreter.version[1]}"
    folder = cache_dir() / f"venv-{tag}-{hashlib.sha256(key.encode()).hexdigest()[:10]}"
    if venv_python(folder).exists():
        return venv_python(folder)
    with one_at_a_time(folder.name):
        if not venv_python(folder).exists():
            making = folder.with_suffix(".making")
            shutil.rmtree(making, ignore_errors=True)
            shutil.rmtree(folder, ignore_errors=True)
            say(f"setting up Python {tag} with bpy in {folder}")
            quietly([interpreter.program, "-m", "venv", making], "making an environment")
            say(f"installing bpy {bpy} (Blender as a module, about 400 MB, once) ...")
            pip_install(making, wanted[:1])
            say(f"installing {', '.join(requirements())} (about 100 MB, once) ...")
            pip_install(making, wanted)
            making.rename(folder)
    return venv_python(folder)


def test_python() -> Path:
    """Return the same Python, with the tools that the tests need beside bpy."""
    python = bpy_python()
    folder = python.parent.parent
    stamp = folder / "test-tools.txt"
    wanted = "\n".join(TEST_TOOLS)
    with one_at_a_time(folder.name):
        if not (stamp.exists() and stamp.read_text(encoding="utf-8") == wanted):
            say("installing pytest, hypothesis, ruff, mypy … (about 35 MB, once) ...")
            pip_install(folder, TEST_TOOLS)
            stamp.write_text(wanted, encoding="utf-8")
    return python


def pip_install(folder: Path, what: list[str]) -> None:
    """Install into an environment, from wheels only: nothing is ever compiled."""
    quietly(
        [
            venv_python(folder), "-m", "pip", "install", "--quiet",
            "--disable-pip-version-check", "--only-binary=:all:", *what,
        ],
        f"installing {', '.join(what)}",
    )  # fmt: skip
