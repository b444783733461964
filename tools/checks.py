"""`run.py test`: run the linter, the type checker and the tests."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
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

PLAIN_TESTS = (ROOT / "tests/core",)
BPY_TESTS = (ROOT / "tests/wheel", ROOT / "tests/hunt")


def lint(python: Path) -> int:
    """Run ruff over the checkout."""
    return call([python, "-m", "ruff", "check", ROOT])


def types(python: Path) -> int:
    """Run mypy over core and the Python API.

    The imports are relative, so that core needs a parent package. The folder of the checkout can
    have any name; mypy therefore sees it as `patina`, a link in a temporary folder.
    """
    with tempfile.TemporaryDirectory(dir=cache_dir(), prefix="mypy-") as folder:
        seen = Path(folder) / "patina"
        try:
            seen.symlink_to(ROOT, target_is_directory=True)
        except OSError:  # Windows without the permission to create links
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
    """Run pytest; without arguments all folders, those with bpy in a second process."""
    if arguments:
        named = any(Path(word.split("::")[0]).exists() for word in arguments)
        folders = [] if named else [*PLAIN_TESTS, *BPY_TESTS]
        return call([*_pytest(python), *arguments, *folders])
    with tempfile.TemporaryFile("w+", encoding="utf-8") as output:
        with_bpy = subprocess.Popen(
            [*_pytest(python), *map(str, BPY_TESTS)], stdout=output, stderr=subprocess.STDOUT
        )
        try:
            code = call([*_pytest(python), *PLAIN_TESTS])
            other = with_bpy.wait()
        finally:
            with_bpy.kill()  # does nothing where it has ended
            with_bpy.wait()
        output.seek(0)
        shutil.copyfileobj(output, sys.stdout)
    return code or other


def _pytest(python: Path) -> list[str]:
    """The command without folders."""
    words = [python, "-m", "pytest", "--rootdir", ROOT, "-c", ROOT / "pyproject.toml"]
    return [str(word) for word in words]


def blender_tests() -> int:
    """Build the zip of this platform, install it in an empty user folder, run tests/blender."""
    blender = find_blender()
    if blender is None:
        raise Failure(
            "found no Blender; --blender requires Blender >= 4.2 on PATH or in PATINA_BLENDER"
        )
    archive = pack(blender.extension_tool, [this_platform()], PYTHONS, DIST)[0]
    with scratch_home() as home:
        install(blender, archive, home)
        say(f"installed {archive.name} in Blender {blender.label}")
        return run_script(blender, home, ROOT / "tests/blender/run_all.py", [])


def main(arguments: Sequence[str]) -> int:
    """Run all stages, even after a failure; return 1 if any of them failed."""
    parser = argparse.ArgumentParser(
        prog="run.py test", description=__doc__, epilog="All other arguments are passed to pytest."
    )
    parser.add_argument(
        "--blender",
        action="store_true",
        help="also test the zip of this platform in a real Blender",
    )
    parser.add_argument("--only-blender", action="store_true", help="run only the tests in Blender")
    options, rest = parser.parse_known_args(arguments)
    stages: list[tuple[str, Callable[[], int]]] = []
    if not options.only_blender:
        python = test_python()
        stages = [
            ("ruff", lambda: lint(python)),
            ("mypy", lambda: types(python)),
            ("imports", lambda: check_imports(python)),
            ("pytest", lambda: python_tests(python, rest)),
        ]
    if options.blender or options.only_blender:
        stages.append(("blender", blender_tests))
    failed = []
    for name, stage in stages:
        start = time.monotonic()
        code = stage()
        outcome = "passed" if code == 0 else f"FAILED (exit code {code})"
        say(f"{name}: {outcome}, {time.monotonic() - start:.1f} s")
        if code:
            failed.append(name)
    if failed:
        say(f"failed: {', '.join(failed)}")
    return 1 if failed else 0
