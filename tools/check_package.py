"""Check the Python package after `pip install .` into empty environments, without bpy.

    python3 -m tools.check_package

For each installed Python 3.11 and 3.13, the package is installed from a copy of the checkout and
used in an empty folder: the command line on a scan, wrong input, and (for the newest Python) the
examples of the API and of the tutorial. The last line counts the checks as pytest does.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from .common import ROOT, say
from .environment import Interpreter, candidates, probe, venv_python

PYTHONS = ((3, 11), (3, 13))
SCAN = Path("data/scans/bunny_red/scan.capture.toml")  # in the reference data
DEMO = ROOT / "assets" / "demo" / "demo.capture.toml"
TUTORIAL = ROOT / "docs" / "guide" / "python.md"
REFERENCE = ROOT / "docs" / "reference" / "api.md"
LIMIT_SECONDS = 400
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.M | re.S)


@dataclass
class Report:
    """Results of the checks of all Pythons."""

    passed: list[str] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)

    def check(self, what: str, holds: bool, detail: str = "") -> None:
        """Count one check; print a failure with its details."""
        (self.passed if holds else self.failed).append(what)
        if not holds:
            print(f"FAILED {what}\n{detail}", flush=True)

    def skip(self, what: str) -> None:
        """Count and print a check that is not possible on this machine."""
        self.skipped.append(what)
        print(f"SKIPPED {what}", flush=True)

    @property
    def last_line(self) -> str:
        """The counts in the format of pytest."""
        counts = {"failed": self.failed, "passed": self.passed, "skipped": self.skipped}
        words = [f"{len(some)} {name}" for name, some in counts.items() if some]
        return ", ".join(words) or "nothing checked"


def find_pythons() -> dict[tuple[int, int], Interpreter]:
    """Return an interpreter of each installed version, including those of pyenv."""
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    names = [*candidates(), *map(str, sorted(versions.glob("3.1[13].*/bin/python")))]
    found: dict[tuple[int, int], Interpreter] = {}
    for name in names:
        result = probe(name)
        if isinstance(result, Interpreter):
            found.setdefault(result.version, result)
    return {version: found[version] for version in PYTHONS if version in found}


@contextmanager
def clean_copy() -> Iterator[Path]:
    """Yield a copy of the files of the checkout, so that building does not change the checkout."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="patina-source-") as folder:
        for name in filter(None, listed.stdout.split("\0")):
            if (ROOT / name).is_file():
                target = Path(folder) / name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, target)
        yield Path(folder)


def scan_to_fit(report: Report) -> Path:
    """Return the capture of the reference data, or the demo without reference data."""
    scan = Path(os.environ.get("PATINA_SHARED", ROOT.parent / "shared")) / SCAN
    if scan.is_file():
        return scan
    report.skip(f"a fit of {SCAN.parent.name}: no reference data; the demo is fitted instead")
    return DEMO


@dataclass(frozen=True)
class Installed:
    """An environment with the installed package, and an empty working folder."""

    label: str
    python: Path
    folder: Path
    report: Report

    def run(self, *words: str | Path) -> subprocess.CompletedProcess[str]:
        """Run the Python of the environment, without the checkout on its path."""
        env = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        return subprocess.run(
            [str(self.python), *map(str, words)],
            cwd=self.folder, env=env, capture_output=True, text=True, timeout=LIMIT_SECONDS,
        )  # fmt: skip

    def command(self, *words: str | Path) -> subprocess.CompletedProcess[str]:
        """Run the console script `patina`."""
        script = self.python.with_name("patina.exe" if sys.platform == "win32" else "patina")
        env = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        return subprocess.run(
            [str(script), *map(str, words)],
            cwd=self.folder, env=env, capture_output=True, text=True, timeout=LIMIT_SECONDS,
        )  # fmt: skip

    def check(self, what: str, done: subprocess.CompletedProcess[str], holds: bool) -> None:
        """Count a check of a finished process."""
        tail = (done.stdout + done.stderr)[-2000:]
        self.report.check(f"Python {self.label}: {what}", holds, tail)


def check_import(installed: Installed) -> None:
    """The package can be imported, has the right version and contains no code that needs bpy."""
    code = (
        "import importlib.util as u, json, sys, patina; early = sorted(sys.modules); "
        "patina.fit; print(json.dumps([patina.__version__, u.find_spec('bpy') is None, "
        "'numpy' in early, patina.__file__, [n for n in ('scene', 'operators', 'panels', 'tests', "
        "'tools', 'run', 'setup') if u.find_spec('patina.' + n)]]))"
    )
    done = installed.run("-c", code)
    installed.check("import patina", done, done.returncode == 0)
    if done.returncode:
        return
    version, no_bpy, numpy_early, file, foreign = json.loads(done.stdout)
    manifest = (ROOT / "blender_manifest.toml").read_text("utf-8")
    installed.check("the manifest's version", done, f'\nversion = "{version}"\n' in manifest)
    installed.check("no bpy in the environment", done, no_bpy)
    installed.check("import patina loads no numpy", done, not numpy_early)
    installed.check("imported from the environment", done, str(installed.python.parents[1]) in file)
    installed.check("no modules for Blender or developers", done, foreign == [])


def check_fit(installed: Installed, capture: Path) -> None:
    """`patina fit` writes all files but scene.blend, and other commands can read its result."""
    done = installed.command("fit", capture, "--out", "fitted")
    installed.check("patina fit", done, done.returncode == 0)
    if done.returncode:
        return
    out = installed.folder / "fitted"
    result = json.loads((out / "result.json").read_text("utf-8"))
    tables = {f"{material['name']}.binary" for material in result["materials"]}
    names = {path.name for path in out.iterdir()}
    expected = {"result.json", "report", ".patina-files", *tables}
    installed.check("the files of a fit", done, names == expected)
    installed.check("the report", done, (out / "report" / "index.html").is_file())
    blender_lines = [line for line in done.stdout.splitlines() if "Blender" in line]
    installed.check("one line about scene.blend", done, len(blender_lines) == 1)
    errors = [material["held_out"]["typical"] for material in result["materials"]]
    installed.check("held-out photos are predicted", done, max(errors) < 0.2)
    formats = ("mitsuba", "pbrt", "binary", "exr", "npz")  # mtlx takes a minute: tests/core
    done = installed.command("material", "fitted", "--to", *formats, "--out", "exported")
    installed.check("patina material", done, done.returncode == 0)
    if done.returncode:
        return
    losses = json.loads((installed.folder / "exported" / "losses.json").read_text("utf-8"))
    files = {file for loss in losses["losses"] for file in loss["files"]}
    there = all((installed.folder / "exported" / file).is_file() for file in files)
    installed.check("the exported files", done, bool(files) and there)
    table = next(iter(tables))
    done = installed.command("compare", f"fitted/{table}", f"exported/{table}")
    same = done.returncode == 0 and done.stdout.count("0.0000") == 3
    installed.check("patina compare", done, same)


def check_mistakes(installed: Installed) -> None:
    """Wrong input, and commands that need Blender, give one line and exit code 2."""
    for words in (
        ("fit", "missing.toml", "--out", "nothing"),
        ("fit", "missing.toml"),
        ("nonsense",),
        ("import", DEMO, "--out", "scan.blend"),
        ("render", "fitted", "--world", "forest", "--out", "nothing"),
        ("material", "fitted", "--to", "usd", "--out", "nothing"),
    ):
        done = installed.command(*words)
        lines = done.stderr.splitlines()
        short = done.returncode == 2 and len(lines) == 1 and lines[0].startswith("patina")
        what = " ".join(Path(str(word)).name for word in words)
        installed.check(f"one line for `{what}`", done, short)
        if words[0] in ("import", "render", "material"):
            installed.check(f"`{what}` names Blender", done, "blender -b" in done.stderr)
    installed.report.check(
        f"Python {installed.label}: wrong input writes no files",
        not (installed.folder / "nothing").exists(),
    )


def check_doctests(installed: Installed) -> None:
    """The doctests of api.py run without errors."""
    code = (
        "import doctest, sys, patina.api; found = doctest.testmod(patina.api); "
        "print(found); sys.exit(found.failed > 0 or found.attempted < 10)"
    )
    done = installed.run("-c", code)
    installed.check("the doctests of api.py", done, done.returncode == 0)


def check_documents(installed: Installed) -> None:
    """The examples of the API's reference, and the tutorial from top to bottom."""
    done = installed.run("-m", "doctest", REFERENCE)
    installed.check("the examples of docs/reference/api.md", done, done.returncode == 0)
    blocks = BLOCK.findall(TUTORIAL.read_text("utf-8"))
    script = installed.folder / "tutorial.py"
    script.write_text("\n".join(blocks), "utf-8")
    done = installed.run("-W", "error::SyntaxWarning", script)
    enough = len(blocks) >= 5 and done.returncode == 0
    installed.check("the tutorial docs/guide/python.md", done, enough)


def install(
    interpreter: Interpreter, source: Path, workspace: Path, report: Report
) -> Installed | None:
    """Create an environment and install the package; None if that fails."""
    label = ".".join(map(str, interpreter.version))
    venv, folder = workspace / f"venv-{label}", workspace / f"work-{label}"
    folder.mkdir()
    copy = workspace / f"source-{label}"  # builds in one folder would interfere
    shutil.copytree(source, copy)
    for words in (
        [interpreter.program, "-m", "venv", venv],
        [venv_python(venv), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", copy],
    ):
        done = subprocess.run(
            [*map(str, words)], cwd=folder, capture_output=True, text=True, timeout=LIMIT_SECONDS
        )
        if done.returncode:
            report.check(f"Python {label}: pip install .", False, done.stderr[-2000:])
            return None
    report.check(f"Python {label}: pip install .", True)
    return Installed(label, venv_python(venv), folder, report)


def check_one(
    interpreter: Interpreter,
    source: Path,
    workspace: Path,
    report: Report,
    capture: Path,
    examples: Sequence[Callable[[Installed], None]],
) -> None:
    """Run all checks with one Python, and some of the examples."""
    installed = install(interpreter, source, workspace, report)
    if installed is None:
        return
    check_import(installed)
    check_fit(installed, capture)
    check_mistakes(installed)
    for check in examples:
        check(installed)


def main() -> int:
    """Check every installed Python; return 1 if a check failed or no Python was found."""
    start, report = time.monotonic(), Report()
    found = find_pythons()
    for version in PYTHONS:
        if version not in found:
            report.skip(f"Python {version[0]}.{version[1]}: not found")
    report.check("a Python 3.11 or 3.13 is installed", bool(found))
    capture = scan_to_fit(report)
    oldest, newest = min(found, default=None), max(found, default=None)
    examples = {version: list[Callable[[Installed], None]]() for version in found}
    if oldest is not None and newest is not None:  # each once, side by side
        examples[newest].append(check_doctests)
        examples[oldest].append(check_documents)
    with (
        clean_copy() as source,
        tempfile.TemporaryDirectory(prefix="patina-package-") as workspace,
        ThreadPoolExecutor(2) as pool,
    ):
        running = [
            pool.submit(check_one, one, source, Path(workspace), report, capture, examples[version])
            for version, one in found.items()
        ]
        for one in running:
            one.result()
    say(f"the package: {time.monotonic() - start:.0f} s")
    print(report.last_line)
    return 1 if report.failed else 0


if __name__ == "__main__":
    sys.exit(main())
