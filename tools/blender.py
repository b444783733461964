"""Find an installed Blender, test whether it is suitable, and install the extension for it.

The extension is installed into a separate user folder in the cache. The add-ons and preferences of
the user's Blender are neither read nor changed.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from .common import ROOT, Failure, cache_dir, call, one_at_a_time, quietly, say, this_platform
from .extension import ExtensionTool, pack
from .staging import source_hash
from .wheels import PYTHONS

PACKAGE = "bl_ext.user_default.patina"
OLDEST = (4, 2)  # Blender version with extensions
MARK = "PATINA-PROBE "
PROBE = f"""
import bpy, json, sys
try:
    import numpy
    numpy = numpy.__version__
except ImportError:
    numpy = None
print({MARK!r} + json.dumps([list(bpy.app.version), list(sys.version_info[:2]), numpy]))
"""


@dataclass(frozen=True)
class Blender:
    """A Blender that can run the extension: its program, version and Python's wheel tag."""

    program: Path
    version: tuple[int, int, int]
    python: str

    @property
    def label(self) -> str:
        """The version as text."""
        return ".".join(map(str, self.version))

    @property
    def home(self) -> Path:
        """The user folder of this Blender in the cache."""
        return cache_dir() / f"blender-{self.version[0]}.{self.version[1]}-{self.python}"

    @property
    def extension_tool(self) -> ExtensionTool:
        """The `extension` command of this Blender."""
        return ExtensionTool((str(self.program), "--command", "extension"))


def probe(program: str) -> Blender | str:
    """Run a Blender and return its version and Python, or the reason why it cannot be used."""
    try:
        done = subprocess.run(
            [program, "-b", "--factory-startup", "--python-expr", PROBE],
            capture_output=True,
            text=True,
            timeout=120,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"it cannot be started ({error})"
    answers = [line for line in done.stdout.splitlines() if line.startswith(MARK)]
    if not answers:
        last = (done.stderr.strip() or done.stdout.strip() or "no output").splitlines()[-1]
        return f"it cannot run a script ({last})"
    version, python, numpy = json.loads(answers[0].removeprefix(MARK))
    tag = f"cp{python[0]}{python[1]}"
    label = ".".join(map(str, version))
    if tuple(version) < OLDEST:
        return f"found Blender {label}, expected 4.2 or later"
    if tag not in PYTHONS:
        return f"its Python is {python[0]}.{python[1]}, expected 3.11 or 3.13"
    if numpy is None:
        return "its Python has no numpy (Debian: install python3-numpy)"
    return Blender(Path(program), (version[0], version[1], version[2]), tag)


def find_blender() -> Blender | None:
    """Return the Blender to use: PATINA_BLENDER, else one on PATH, else None.

    PATINA_BLENDER=wheel selects the bpy wheel even if a Blender is installed.
    """
    own = os.environ.get("PATINA_BLENDER")
    if own == "wheel":
        return None
    program = own or shutil.which("blender")
    if program is None:
        return None
    result = probe(program)
    if isinstance(result, Blender):
        return result
    if own:
        raise Failure(f"PATINA_BLENDER={own}: {result}")
    say(f"not using {program}: {result}")
    return None


def private(home: Path) -> dict[str, str]:
    """Return environment variables with which Blender uses only this user folder."""
    env = {key: value for key, value in os.environ.items() if not key.startswith("BLENDER_USER_")}
    env["BLENDER_USER_RESOURCES"] = str(home)
    return env


def install(blender: Blender, archive: Path, home: Path) -> None:
    """Install and enable a zip in the given user folder. Raises Failure."""
    home.mkdir(parents=True, exist_ok=True)
    command = [
        blender.program, "--command", "extension", "install-file",
        "--repo", "user_default", "--enable", archive,
    ]  # fmt: skip
    output = quietly(command, f"installing {archive.name}", env=private(home))
    inside = list(home.glob("extensions/user_default/patina/blender_manifest.toml"))
    if not inside:  # Blender's exit code is 0 even if it rejects a zip
        raise Failure(f"Blender did not install {archive.name}:\n{output.strip()}", 1)


def prepare(blender: Blender) -> Path:
    """Install the extension of this checkout if it changed, and return its user folder."""
    stamp = blender.home / "patina-sources.txt"
    with one_at_a_time(blender.home.name):
        wanted = source_hash(blender.label, str(ROOT))
        if not (stamp.exists() and stamp.read_text(encoding="utf-8") == wanted):
            stamp.unlink(missing_ok=True)
            out = cache_dir() / f"install-{os.getpid()}"
            try:
                archive = pack(blender.extension_tool, [this_platform()], [blender.python], out)[0]
                say(f"installing the extension for Blender {blender.label} ...")
                install(blender, archive, blender.home)
            finally:
                shutil.rmtree(out, ignore_errors=True)
            stamp.write_text(wanted, encoding="utf-8")
    return blender.home


def script_command(blender: Blender, script: Path, arguments: Sequence[str]) -> list[str]:
    """Return the command that runs a script in Blender, with the extension enabled."""
    return [
        str(blender.program), "-b", "--factory-startup", "--addons", PACKAGE,
        "--python-exit-code", "1", "-P", str(script), "--", *arguments,
    ]  # fmt: skip


def run_script(blender: Blender, home: Path, script: Path, arguments: Sequence[str]) -> int:
    """Run a script in Blender, with the extension of that user folder enabled."""
    return call(script_command(blender, script, arguments), env=private(home))


@contextlib.contextmanager
def scratch_home() -> Iterator[Path]:
    """Create an empty user folder and remove it afterwards."""
    home = cache_dir() / f"home-{os.getpid()}"
    shutil.rmtree(home, ignore_errors=True)
    try:
        yield home
    finally:
        shutil.rmtree(home, ignore_errors=True)
