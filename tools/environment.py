"""Create a Python environment with bpy (Blender as a module), for machines without Blender."""

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
"""Python version → version of bpy (each wheel supports one Python version only)."""

LOCKS = Path(__file__).with_name("locks")
"""Lists of what is installed, with checksums; tools/lock.py writes them."""

TEST_TOOLS = [
    "pytest==8.4.2",
    "hypothesis==6.140.3",
    "rawpy==0.28.0",  # camera RAW is optional and not part of the zips
    "flip-evaluator==1.7",  # likewise: perceptual error of predicted photos
    "trimesh==5.2.0",  # writes meshes independently of Patina
    "usd-core==26.11",  # these three validate exported files
    "MaterialX==1.39.5",
    "mitsuba==3.9.1",
    "distributed==2026.8.0",  # likewise: batches
    "openjd-cli==0.8.0",  # checks the job templates of batches
    "matplotlib==3.10.7",  # draws the charts of the experiments
    "ruff==0.13.3",
    "mypy==1.18.2",
    "import-linter==2.17",
    "playwright==1.65.2",  # drives a browser that shows exported pages
    "jsonschema==4.25.1",  # validates written files against assets/schemas
]

PROBE = """
import json, sys, venv, ensurepip
print(json.dumps([sys.executable, list(sys.version_info[:2]), sys.maxsize > 2**32]))
"""


@dataclass(frozen=True)
class Interpreter:
    """A Python for which there is a bpy wheel: its program and (major, minor) version."""

    program: Path
    version: tuple[int, int]


def probe(program: str | Path) -> Interpreter | str:
    """Run a Python and return its version, or the reason why it cannot be used.

    The name on PATH is not sufficient: pyenv has shims for versions that are not installed, and
    Debian has Pythons without venv.
    """
    try:
        done = subprocess.run(
            [str(program), "-c", PROBE], capture_output=True, text=True, timeout=60
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"{program} cannot be started ({error})"
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return f"{program} cannot create an environment ({reason.strip()})"
    executable, version, wide = json.loads(done.stdout)
    if tuple(version) not in BPY or not wide:
        return f"{program} is Python {version[0]}.{version[1]}"
    return Interpreter(Path(executable), (version[0], version[1]))


def candidates() -> list[str]:
    """Return the Pythons to test: the running one, then those on PATH by name."""
    found = [sys.executable]
    names = [f"python{major}.{minor}" for major, minor in BPY]
    for name in names:
        for folder in os.environ.get("PATH", "").split(os.pathsep):
            program = shutil.which(name, path=folder) if folder else None
            if program and program not in found:
                found.append(program)
    if launcher := shutil.which("py") if sys.platform == "win32" else None:
        for major, minor in BPY:
            command = [launcher, f"-{major}.{minor}", "-c", "import sys; print(sys.executable)"]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode == 0:
                found.append(done.stdout.strip())
    return found


def find_interpreter() -> Interpreter:
    """Return the first suitable Python. Raises Failure, which lists the tested Pythons."""
    rejected = []
    for program in candidates():
        result = probe(program)
        if isinstance(result, Interpreter):
            return result
        rejected.append(result)
    raise Failure(
        "found no Blender >= 4.2 with numpy on PATH and no Python 3.11 or 3.13 with venv "
        f"({'; '.join(rejected)}); install Blender, or python3.11 with python3.11-venv"
    )


def venv_python(folder: Path) -> Path:
    """Return the Python program of an environment."""
    return folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")


def bpy_python() -> Path:
    """Return the Python of the environment with bpy, which the first call creates."""
    return _environment(find_interpreter())


def _environment(interpreter: Interpreter) -> Path:
    """Return the Python of the environment of an interpreter, which the first call creates.

    The name of the folder contains a hash of the requirements. It is created under another name and
    renamed when complete, so that an incomplete environment is never used.
    """
    platform = this_platform()
    bpy = BPY[interpreter.version]
    wanted = lock_file(interpreter.version, platform, tests=False)
    key = f"{interpreter.program}\n" + wanted.read_text(encoding="utf-8")
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
            quietly([interpreter.program, "-m", "venv", making], "creating an environment")
            say(f"installing bpy {bpy} (Blender as a module, about 400 MB, once) and")
            say(f"{', '.join(requirements())} (about 100 MB, once) ...")
            pip_install(making, wanted)
            making.rename(folder)
    return venv_python(folder)


def test_python() -> Path:
    """Return the Python of the same environment, after installing the test tools in it."""
    interpreter = find_interpreter()
    python = _environment(interpreter)
    folder = python.parent.parent
    stamp = folder / "test-tools.txt"
    lock = lock_file(interpreter.version, this_platform(), tests=True)
    wanted = lock.read_text(encoding="utf-8")
    with one_at_a_time(folder.name):
        if not (stamp.exists() and stamp.read_text(encoding="utf-8") == wanted):
            say("installing pytest, ruff, mypy, matplotlib … (about 160 MB, once) ...")
            pip_install(folder, lock)
            stamp.write_text(wanted, encoding="utf-8")
    return python


def lock_file(version: tuple[int, int], platform: str, tests: bool) -> Path:
    """The list of packages for a Python and a platform; tests: of those that only tests need."""
    return LOCKS / f"cp{version[0]}{version[1]}-{platform}{'-tests' if tests else ''}.txt"


def pip_install(folder: Path, lock: Path) -> None:
    """Install the packages of a list into an environment: only wheels, so that nothing is compiled,
    and only those with the checksums of the list."""
    quietly(
        [
            venv_python(folder), "-m", "pip", "install", "--quiet",
            "--disable-pip-version-check", "--only-binary=:all:", "--no-deps", "--require-hashes",
            "-r", lock,
        ],
        f"installing the packages of {lock.name}",
    )  # fmt: skip
