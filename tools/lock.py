"""Write the lists of packages with checksums that `run.py` installs (tools/locks):

    python3 -m tools.lock

Needed after a change of the pins in tools/wheels.py or tools/environment.py. pip resolves the
dependencies for every platform and Python; what it would install is written, nothing is installed.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from .check_extension import RELEASES
from .common import Failure, say
from .environment import BPY, LOCKS, TEST_TOOLS, lock_file
from .wheels import PINS, PIP_TAGS, PLATFORMS, checksums, requirements, wheel_name

ALSO = {"windows-x64": ["colorama==0.4.6"]}
"""Platform → packages that others need there: pip evaluates conditions on the platform for the one
that it runs on."""

Packages = dict[str, set[str]]
"""NAME==VERSION → SHA-256 sums of the wheels that may be installed."""


def main() -> int:
    """Write all lists."""
    LOCKS.mkdir(exist_ok=True)
    for version, bpy in BPY.items():
        for platform in PLATFORMS:
            base = _resolved([f"bpy=={bpy}", *requirements()], version, platform)
            tests = _resolved(
                [f"bpy=={bpy}", *requirements(), *TEST_TOOLS, *ALSO.get(platform, ())],
                version,
                platform,
            )
            _add_shipped(base, version, platform)
            _write(lock_file(version, platform, False), base)
            _write(
                lock_file(version, platform, True),
                {name: sums for name, sums in tests.items() if name not in base},
            )
    for one in RELEASES:
        exact = [f"bpy=={one.bpy}", f"numpy=={one.numpy}"]
        found = _resolved(exact, one.python, "linux-x64")
        _write(one.lock, {name: found[name] for name in exact})
    return 0


def _resolved(wanted: list[str], version: tuple[int, int], platform: str) -> Packages:
    """What pip would install."""
    number, abi = f"{version[0]}.{version[1]}", f"cp{version[0]}{version[1]}"
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [
            sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed", "--quiet",
            "--only-binary=:all:", "--ignore-requires-python", "--target", folder,
            "--python-version", number, "--implementation", "cp",
            "--abi", abi, "--abi", "abi3", "--abi", "none",
            *(word for tag in PIP_TAGS[platform] for word in ("--platform", tag)),
            "--report", str(report), *wanted,
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise Failure(f"pip cannot resolve {', '.join(wanted)} for {platform}: {done.stderr}")
        content = json.loads(report.read_text(encoding="utf-8"))
    found: Packages = {}
    for entry in content["install"]:
        name = f"{entry['metadata']['name'].lower()}=={entry['metadata']['version']}"
        found[name] = {entry["download_info"]["archive_info"]["hashes"]["sha256"]}
    return found


def _add_shipped(packages: Packages, version: tuple[int, int], platform: str) -> None:
    """Allow the wheels of the zips too: pip may choose one for a newer system."""
    sums = checksums()
    for name, number in PINS.items():
        wheel = wheel_name(name, platform, f"cp{version[0]}{version[1]}")
        packages[f"{name.lower()}=={number}"].add(sums[wheel])


def _write(path: Path, packages: Packages) -> None:
    lines = ["# written by python3 -m tools.lock"]
    for name in sorted(packages):
        sums = " ".join(f"--hash=sha256:{digest}" for digest in sorted(packages[name]))
        lines.append(f"{name} {sums}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    say(f"{path.name}: {len(packages)} packages")


if __name__ == "__main__":
    sys.exit(main())
