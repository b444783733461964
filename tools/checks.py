"""`run.py test`: everything that must hold before a change is good."""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from .blender import find_blender, install, run_script, scratch_home
from .build import DIST
from .common import ROOT, Failure, cache_dir, call, say, this_platform
from .environment import test_python
from .extension import pack
from .import_rules import check_imports
from .wheels import PYTHONS


def lint(python: Path) -> int:
    """Run ruff over the checkout."""
    return call([python, "-m", "ruff", "check", ROOT])


def types(python: Path) -> int:
    """Run mypy over core and the Python API.

    Its imports are relative, so it is a package only under a parent; the checkout may have any
    name, so mypy is shown it as `patina` through a link in an empty folder.
    """
    with tempfile.TemporaryDirectory(dir=cache_dir(), prefix="mypy-") as folder:
        seen = Path(folder) / "patina"
        try:
            seen.symlink_to(ROOT, target_is_directory=True)
        except OSError:  # Windows without the right to make links
            for room in ("core", "commands"):
                shutil.copytree(ROOT / room, seen / room)
            for file in ("__init__.py", "api.py"):
                shutil.copy2(ROOT / file, seen)
        command = [
            python, "-c", "import os, sys; os.chdir(sys.argv.pop(1)); "
            "from mypy.__main__ import console_entry; console_entry()",
            folder, "--config-file", ROOT / "pyproject.toml",
            "--cache-dir", cache_dir() / "mypy", "-p", "patina.core", "-m", "patina.api",
        ]  # fmt: skip
        return call(command)


def python_tests(python: Path, arguments: Sequence[str]) -> int:
    """Run pytest; without arguments of the user's on the folders named in pyproject.toml."""
    folders = [
        path
        for path in (ROOT / "tests/core", ROOT / "tests/wheel", ROOT / "tests/hunt")
        if path.is_dir()
    ]
    named = any(Path(word.split("::")[0]).exists() for word in arguments)
    return call(
        [
            python, "-m", "pytest", "--rootdir", ROOT, "-c", ROOT / "pyproject.toml",
            *arguments, *([] if named else folders),
        ]
    )  # fmt: skip


def blender_tests() -> int:
    """Build this platform's zip, install it into an empty Blender, run tests/blender there."""
    blender = find_blender()
    if blender is None:
        raise Failure("--blender needs a Blender >= 4.2 on PATH or in PATINA_BLENDER")
    archive = pack(blender.extension_tool, [this_platform()], PYTHONS, DIST)[0]
    with scratch_home() as home:
        install(blender, archive, home)
        say(f"installed {archive.name} in Blender {blender.label}")
        return run_script(blender, home, ROOT / "tests/blender/run_all.py", [])


def main(arguments: Sequence[str]) -> int:
    """Run the stages one after the other; every one is run, and any failure is the result."""
    parser = argparse.ArgumentParser(
        prog="run.py test", description=__doc__, epilog="Everything else is handed to pytest."
    )
    parser.add_argument(
        "--blender", action="store_true", help="also test this platform's zip in a real Blender"
    )
    parser.add_argument("--only-blender", action="store_true", help="nothing but that")
    asked, rest = parser.parse_known_args(arguments)
    stages: list[tuple[str, Callable[[], int]]] = []
    if not asked.only_blender:
        python = test_python()
        stages = [
            ("ruff", lambda: lint(python)),
            ("mypy", lambda: types(python)),
            ("imports", lambda: check_imports(python)),
            ("pytest", lambda: python_tests(python, rest)),
        ]
    if asked.blender or asked.only_blender:
        stages.append(("blender", blender_tests))
    refused = []
    for name, stage in stages:
        start = time.monotonic()
        code = stage()
        told = "fine" if code == 0 else f"NOT fine (exit code {code})"
        say(f"{name}: {told}, {time.monotonic() - start:.1f} s")
        if code:
            refused.append(name)
    if refused:
        say(f"not fine: {', '.join(refused)}")
    return 1 if refused else 0
