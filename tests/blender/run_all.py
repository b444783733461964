"""Run every test_* function of the test_*.py files in this folder, inside Blender.

    blender -b --factory-startup --addons bl_ext.user_default.patina \
        --python-exit-code 1 -P tests/blender/run_all.py [-- [--claims FOLDER] WORD ...]

Each test starts from Blender's factory scene. With WORDs only tests whose `file::function` holds
one of them are run. With `--claims FOLDER` several processes share the test files: each takes the
next file that none has claimed in this folder. A test fails by raising, and is skipped by raising
`support.Skip`. The last line is the count; the exit code is 1 if anything failed. With the bpy
wheel the same file runs as `python tests/blender/run_all.py WORD ...`, on the checkout instead of
the installed zip.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER))

import support  # noqa: E402

LONGEST = ("test_varying", "test_workflow", "test_stepped", "test_export_panel")
"""Files that take longest, which start first so that no process waits long for another."""


def claimed(path: Path, claims: Path | None) -> bool:
    """Whether this process runs the tests of a file."""
    if claims is None:
        return True
    try:
        (claims / path.stem).touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def collect(words: list[str], claims: Path | None) -> Iterator[tuple[str, Callable[[], None]]]:
    """Yield (label, function) of the selected tests, in the order of their definition."""
    for path in sorted(FOLDER.glob("test_*.py"), key=lambda p: (p.stem not in LONGEST, p.stem)):
        if not claimed(path, claims):
            continue
        module = importlib.import_module(path.stem)
        for name, function in list(vars(module).items()):
            label = f"{path.stem}::{name}"
            ours = callable(function) and getattr(function, "__module__", "") == path.stem
            if name.startswith("test_") and ours and (not words or any(w in label for w in words)):
                yield label, function


def run_one(label: str, function: Callable[[], None]) -> str:
    """Run one test from a fresh scene; return "passed", "failed" or "skipped"."""
    start = time.monotonic()
    try:
        bpy.ops.wm.read_homefile(use_factory_startup=True)
        function()
    except support.Skip as reason:
        print(f"SKIP {label}: {reason}", flush=True)
        return "skipped"
    except Exception:
        traceback.print_exc()
        print(f"FAIL {label} ({time.monotonic() - start:.2f} s)", flush=True)
        return "failed"
    print(f"PASS {label} ({time.monotonic() - start:.2f} s)", flush=True)
    return "passed"


def main() -> int:
    """Run them all; return the exit code."""
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    if Path(sys.argv[0]).name == Path(__file__).name:  # python, not Blender
        words = sys.argv[1:]
    parser = argparse.ArgumentParser(prog="run_all.py")
    parser.add_argument("--claims", type=Path, metavar="FOLDER")
    parser.add_argument("words", nargs="*", metavar="WORD")
    options = parser.parse_args(words)
    print(f"Blender {bpy.app.version_string}, extension {support.extension().__name__}")
    tests = collect(options.words, options.claims)
    results = [run_one(label, function) for label, function in tests]
    skipped = results.count("skipped")
    failed = results.count("failed")
    more = f", {skipped} skipped" if skipped else ""
    print(f"{results.count('passed')} passed, {failed} failed{more}", flush=True)
    nothing = not results and options.claims is None  # another process may have the tests
    return 1 if failed or nothing else 0


if __name__ == "__main__":
    sys.exit(main())
