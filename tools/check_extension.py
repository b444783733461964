"""Check the zip of the extension in the oldest and the newest Blender, and one between them.

    python3 -m tools.check_extension [VERSION ...]

The zip of this platform is installed in the bpy wheel of each version, with the numpy that this
Blender contains and no other libraries. Some tests of tests/blender run there, and the installed
headless.py fits the demo. The last line counts the tests as pytest does.

bpy 5.2 needs a `python3.13` on the PATH. It may be one in a chroot that has the same folders
(.ci/python/python3.13), without pip: that of another Python unpacks the wheels.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from .blender import private
from .build import extension_tool
from .common import ROOT, cache_dir, quietly, say, this_platform
from .environment import LOCKS
from .extension import pack
from .wheels import PIP_TAGS, PYTHONS

DEMO = ROOT / "assets" / "demo" / "demo.capture.toml"
SCRIPT = ROOT / "tests" / "blender" / "run_installed.py"
TESTS = (
    "test_lifecycle", "test_stages", "test_views", "test_hostile_blend",
    "test_results_survive_saving_and_loading", "test_lamp_follows_photo",
)  # fmt: skip
"""The tests that depend most on the version of Blender: registration, panels, data-blocks, files,
and one fit."""
EXECUTE = "import os, sys; os.execv(sys.argv[1], sys.argv[1:])"
LIMIT_SECONDS = 900


@dataclass(frozen=True)
class Release:
    """A version of the bpy wheel, the Python it needs, and the version of numpy in this Blender."""

    bpy: str
    python: tuple[int, int]
    numpy: str

    @property
    def label(self) -> str:
        """Major and minor version."""
        return ".".join(self.bpy.split(".")[:2])

    @property
    def lock(self) -> Path:
        """List of the wheels with checksums; tools/lock.py writes it."""
        return LOCKS / f"bpy-{self.label}-linux-x64.txt"

    @property
    def version(self) -> str:
        """That of Python."""
        return ".".join(map(str, self.python))

    @property
    def program(self) -> str | None:
        """The Python, None where there is none."""
        return shutil.which(f"python{self.version}")

    @property
    def libraries(self) -> Path:
        """The folder of the unpacked wheels, which the first call creates."""
        folder = cache_dir() / f"bpy-{self.bpy}-numpy-{self.numpy}"
        if not folder.exists():
            say(f"unpacking bpy {self.bpy} (about 400 MB, once) ...")
            making = folder.with_suffix(".making")
            shutil.rmtree(making, ignore_errors=True)
            quietly(
                [
                    sys.executable, "-m", "pip", "install", "--quiet", "--target", making,
                    "--disable-pip-version-check", "--only-binary=:all:", "--no-deps",
                    "--require-hashes", "--ignore-requires-python", "--python-version",
                    self.version, "--implementation", "cp",
                    *(word for tag in PIP_TAGS["linux-x64"] for word in ("--platform", tag)),
                    "-r", self.lock,
                ],
                f"unpacking the wheels of {self.lock.name}",
            )  # fmt: skip
            making.rename(folder)
        return folder


RELEASES = (
    Release("4.2.23", (3, 11), "1.24.3"),
    Release("5.0.1", (3, 11), "1.26.4"),
    Release("5.2.3", (3, 13), "2.4.6"),
)


def main() -> int:
    """Check the chosen versions; return 1 if a test failed or no version could be checked."""
    labels = [one.label for one in RELEASES]
    if unknown := [word for word in sys.argv[1:] if word not in labels]:
        sys.exit(f"found {unknown[0]!r}; expected one of {', '.join(labels)}")
    chosen = [one for one in RELEASES if one.label in sys.argv[1:] or not sys.argv[1:]]
    if this_platform() != "linux-x64":
        sys.exit("the wheels of this check are those of Linux")
    counts = {"passed": 0, "failed": 0, "skipped": 0}
    with tempfile.TemporaryDirectory(dir=cache_dir(), prefix="check-extension-") as name:
        (archive,) = pack(extension_tool(), [this_platform()], PYTHONS, Path(name))
        for release in chosen:
            if release.program is None:
                print(f"SKIPPED bpy {release.bpy}: no python{release.version} on the PATH")
                counts["skipped"] += 1
                continue
            for kind, number in _check(release, archive, Path(name) / release.label).items():
                counts[kind] += number
    print(", ".join(f"{number} {kind}" for kind, number in counts.items() if number))
    return 0 if counts["passed"] and not counts["failed"] else 1


def _check(release: Release, archive: Path, home: Path) -> dict[str, int]:
    """Number of passed, failed and skipped tests. home: an empty user folder of Blender."""
    home.mkdir()
    empty = [release.program or "", "-m", "venv", "--without-pip", home / "venv"]
    quietly(empty, "creating an environment")  # the Python may have libraries of its own
    counts = {"passed": 0, "failed": 0, "skipped": 0}
    done = _run(release, home, SCRIPT, archive, *TESTS)
    counted = re.findall(r"^\d+ passed, \d+ failed.*$", done.stdout, re.M)
    found = re.findall(r"(\d+) (passed|failed|skipped)", "".join(counted))
    for number, kind in found:
        counts[kind] += int(number)
    sound = bool(found) and not done.returncode and all(word in done.stdout for word in TESTS)
    counts["failed"] += not sound and not counts["failed"]
    program = home / "extensions" / "user_default" / "patina" / "headless.py"
    out = home / "fitted"
    fitted = _run(release, home, program, "fit", DEMO, "--out", out)
    written = fitted.returncode == 0 and all(
        (out / name).is_file() for name in ("scene.blend", "report/index.html", "glaze.binary")
    )
    errors = _errors(out / "result.json") if written else {}
    written &= bool(errors) and max(errors.values()) < 0.2
    counts["passed" if written else "failed"] += 1
    for holds, one in ((sound, done), (written, fitted)):
        if not holds:
            print(f"FAILED with bpy {release.bpy}: {_reasons(one)}")
    print(f"bpy {release.bpy}, numpy {release.numpy}: {counts}; {errors}", flush=True)
    return counts


def _reasons(done: subprocess.CompletedProcess[str]) -> str:
    """What an output says about failures."""
    traces = re.findall(r"^Traceback .*?^\w.*?$", done.stderr, re.M | re.S)
    failed = re.findall(r"^FAIL .*$", done.stdout, re.M)
    found = "\n".join([*failed, *traces]) or (done.stdout + done.stderr)[-2000:]
    return f"exit code {done.returncode}\n{found}"


def _errors(result: Path) -> dict[str, float]:
    """Material → error of held-out photos."""
    content = json.loads(result.read_text("utf-8"))
    held = {one["name"]: one["held_out"] for one in content["materials"]}
    return {name: float(one["typical"]) if one else float("inf") for name, one in held.items()}


def _run(release: Release, home: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a script with bpy, which finds nothing but its own libraries and the user folder."""
    env = {key: value for key, value in private(home).items() if not key.startswith("PYTHON")}
    env |= {"PYTHONPATH": str(release.libraries), "PYTHONDONTWRITEBYTECODE": "1"}
    python = home / "venv" / "bin" / "python"  # may be in the chroot
    command = [release.program or "", "-c", EXECUTE, python, *words]
    return subprocess.run(
        [str(word) for word in command],
        env=env,
        cwd=home,
        capture_output=True,
        text=True,
        timeout=LIMIT_SECONDS,
    )


if __name__ == "__main__":
    sys.exit(main())
