"""`run.py test`: run the linter, the type checker and the tests."""

from __future__ import annotations

import argparse
import contextlib
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from . import viewer_program
from .blender import find_blender, install, private, run_script, scratch_home, script_command
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
    with beside([*_pytest(python), *map(str, BPY_TESTS)]) as with_bpy:
        code = call([*_pytest(python), *PLAIN_TESTS])
    return code or with_bpy.returncode


@contextlib.contextmanager
def beside(
    command: Sequence[str], env: Mapping[str, str] | None = None
) -> Iterator[subprocess.Popen[str]]:
    """Run a command beside the body of a `with`, wait for it, and print its output then."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as output:
        process = subprocess.Popen(
            command, stdout=output, stderr=subprocess.STDOUT, env=env and dict(env), text=True
        )
        try:
            yield process
            process.wait()
        finally:
            process.kill()  # does nothing where it has ended
            process.wait()
        output.seek(0)
        shutil.copyfileobj(output, sys.stdout)


def _pytest(python: Path) -> list[str]:
    """The command without folders."""
    words = [python, "-m", "pytest", "--rootdir", ROOT, "-c", ROOT / "pyproject.toml"]
    return [str(word) for word in words]


def blender_tests(words: Sequence[str], processes: int) -> int:
    """Build the zip of this platform, install it in empty user folders, and run tests/blender.

    words: only tests whose name holds one of them. processes: number of Blenders that share them.
    """
    blender = find_blender()
    if blender is None:
        raise Failure(
            "found no Blender; --blender requires Blender >= 4.2 on PATH or in PATINA_BLENDER"
        )
    archive = pack(blender.extension_tool, [this_platform()], PYTHONS, DIST)[0]
    script = ROOT / "tests/blender/run_all.py"
    with scratch_home() as home, contextlib.ExitStack() as others:
        claims = home / "claims"
        claims.mkdir(parents=True)
        homes = [home / str(number) for number in range(processes)]
        for each in homes:
            install(blender, archive, each)
        say(f"installed {archive.name} in Blender {blender.label}")
        shared = ["--claims", str(claims)] if processes > 1 else []
        arguments = [*shared, *words]
        command = script_command(blender, script, arguments)
        running = [others.enter_context(beside(command, private(each))) for each in homes[1:]]
        code = run_script(blender, homes[0], script, arguments)
        others.close()
        return next(filter(None, [code, *(process.returncode for process in running)]), 0)


def main(arguments: Sequence[str]) -> int:
    """Run all stages, even after a failure; return 1 if any of them failed."""
    parser = argparse.ArgumentParser(
        prog="run.py test",
        description=__doc__,
        epilog="All other arguments are passed to pytest; with --only-blender they are words, and "
        "only tests whose name holds one of them are run.",
    )
    parser.add_argument(
        "--blender",
        action="store_true",
        help="also test the zip of this platform in a real Blender",
    )
    parser.add_argument("--only-blender", action="store_true", help="run only the tests in Blender")
    parser.add_argument(
        "--processes",
        type=int,
        default=1,
        metavar="N",
        help="number of Blenders that share the tests in Blender",
    )
    options, rest = parser.parse_known_args(arguments)
    viewer_program.build_if_possible()
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
        words = rest if options.only_blender else []
        stages.append(("blender", lambda: blender_tests(words, options.processes)))
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
