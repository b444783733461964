"""The libraries in the extension: pinned versions, file names, download and checksums.

Blender uses Python 3.11 (4.2 to 5.0) or 3.13 (from 5.1), so that every library is shipped for both.
numpy is not shipped: Blender contains it, and two versions in one process conflict. OpenImageIO is
below 3.1, which requires numpy 2, because Blender up to 5.0 has numpy 1.26. It also writes the EXR
files: the OpenEXR wheel exports its symbols, so that Blender's own OpenEXR library replaces them,
and writing a file crashes (observed in Blender 4.3 on Linux).
"""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from .common import ROOT, Failure, cache_dir, megabytes, quietly, say

PYTHONS = ("cp311", "cp313")
PLATFORMS = ("linux-x64", "windows-x64", "macos-arm64")

PINS = {
    "pycolmap": "4.2.1",
    "embreex": "4.4.0.post1",
    "OpenImageIO": "3.0.19.1",
    "scipy": "1.15.3",
    "defusedxml": "0.7.1",
    "sunposition": "1.2.1",
    "threadpoolctl": "3.8.0",
    "tomlkit": "0.15.2",
}

OPTIONAL = {"rawpy": "0.28.0"}
"""Camera RAW: only in the zips of `run.py build --raw`; too large for the extension site."""

TAGS = {
    "pycolmap": ("manylinux_2_28_x86_64", "win_amd64", "macosx_14_0_arm64"),
    "embreex": ("manylinux_2_27_x86_64.manylinux_2_28_x86_64", "win_amd64", "macosx_13_0_arm64"),
    "OpenImageIO": (
        "manylinux_2_27_x86_64.manylinux_2_28_x86_64",
        "win_amd64",
        "macosx_11_0_arm64",
    ),
    "scipy": ("manylinux_2_17_x86_64.manylinux2014_x86_64", "win_amd64", "macosx_12_0_arm64"),
    "defusedxml": None,
    "sunposition": None,
    "threadpoolctl": None,
    "tomlkit": None,
    "rawpy": ("manylinux_2_27_x86_64.manylinux_2_28_x86_64", "win_amd64", "macosx_11_0_arm64"),
}
"""Library → platform tags of its wheels, in the order of PLATFORMS; None: pure Python.

scipy also has a wheel for macOS 14; the one for macOS 12 runs on both.
"""

PIP_TAGS = {
    "linux-x64": ["manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64",
                  "manylinux2014_x86_64", "manylinux_2_12_x86_64", "manylinux2010_x86_64",
                  "manylinux_2_5_x86_64", "manylinux1_x86_64", "linux_x86_64"],
    "windows-x64": ["win_amd64"],
    "macos-arm64": ["macosx_14_0_arm64", "macosx_13_0_arm64", "macosx_12_0_arm64",
                    "macosx_11_0_arm64", "macosx_10_13_universal2", "macosx_10_9_universal2"],
}  # fmt: skip
"""Platform → platform tags that pip accepts there."""

PURE = {"defusedxml": "py2.py3"}  # Python tag of a pure wheel, if not py3

FOLDER = ROOT / "wheels"
SUMS = Path(__file__).with_name("wheels.sha256")


def requirements() -> list[str]:
    """Return the pinned versions in the syntax of pip."""
    return [f"{name}=={version}" for name, version in PINS.items()]


def wheel_name(library: str, platform: str, python: str) -> str:
    """Return the file name of one wheel."""
    tags, version = TAGS[library], {**PINS, **OPTIONAL}[library]
    if tags is None:
        return f"{library.lower()}-{version}-{PURE.get(library, 'py3')}-none-any.whl"
    tag = tags[PLATFORMS.index(platform)]
    return f"{library.lower()}-{version}-{python}-{python}-{tag}.whl"


def wheel_names(
    platforms: Iterable[str] = PLATFORMS,
    pythons: Iterable[str] = PYTHONS,
    raw: bool = False,
) -> list[str]:
    """Return the file names of the wheels for these platforms and Pythons, in a fixed order."""
    pythons = list(pythons)
    names = (
        wheel_name(library, platform, python)
        for platform in platforms
        for library in (*PINS, *(OPTIONAL if raw else ()))
        for python in pythons
    )
    return list(dict.fromkeys(names))  # a pure wheel is valid for all


def manifest_list(names: Sequence[str] | None = None) -> str:
    """Return the `wheels = [...]` entry of blender_manifest.toml."""
    listed = wheel_names() if names is None else names
    return "wheels = [\n" + "".join(f'  "./wheels/{name}",\n' for name in listed) + "]"


def checksums() -> dict[str, str]:
    """Return file name → SHA-256 of wheels.sha256."""
    pairs = (line.split() for line in SUMS.read_text(encoding="utf-8").splitlines() if line)
    return {name: digest for digest, name in pairs}


def is_whole(path: Path, digest: str) -> bool:
    """Return whether the file exists and has this SHA-256."""
    if not path.is_file():
        return False
    with path.open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest() == digest


def pip_command() -> list[str]:
    """Return a command for pip: of this Python, or of a small environment in the cache.

    Raises Failure if neither is possible.
    """
    own = [sys.executable, "-m", "pip"]
    if subprocess.run([*own, "--version"], capture_output=True).returncode == 0:
        return own
    folder = cache_dir() / "pip"
    python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    small = [str(python), "-m", "pip"]
    if (
        python.exists()
        and subprocess.run([*small, "--version"], capture_output=True).returncode == 0
    ):
        return small
    made = subprocess.run([sys.executable, "-m", "venv", "--clear", folder], capture_output=True)
    if made.returncode:
        raise Failure(
            f"found neither pip nor venv in {sys.executable}; install one (Debian: python3-pip)"
        )
    return small


def download(names: Sequence[str], folder: Path = FOLDER) -> list[Path]:
    """Download and verify wheels that the folder does not contain yet. Raises Failure."""
    sums = checksums()
    folder.mkdir(parents=True, exist_ok=True)
    missing = [name for name in names if not is_whole(folder / name, sums[name])]
    if missing:
        say(f"downloading {len(missing)} wheels (about {20 * len(missing)} MB, once) ...")
        pip = pip_command()
        for name in missing:
            fetch_one(pip, name, folder)
            if not is_whole(folder / name, sums[name]):
                raise Failure(
                    f"{name}: the SHA-256 differs from the pinned one in wheels.sha256", 1
                )
        say(f"downloaded {megabytes([folder / name for name in missing])}")
    return [folder / name for name in names]


def fetch_one(pip: Sequence[str], name: str, folder: Path) -> None:
    """Download one wheel with pip, requesting exactly its tags."""
    library, version, python, abi, tags = name.removesuffix(".whl").split("-")
    target = ["--implementation", "cp", "--python-version", python[2:], "--abi", abi]
    target += [word for tag in tags.split(".") for word in ("--platform", tag)]
    if abi == "none":
        target = []
    quietly(
        [
            *pip, "download", "--quiet", "--disable-pip-version-check", "--no-deps",
            "--only-binary=:all:", *target, "--dest", folder, f"{library}=={version}",
        ],
        f"downloading {name}",
    )  # fmt: skip


def write_manifest() -> None:
    """Write the list of wheels to blender_manifest.toml: `python3 -m tools.wheels`."""
    path = ROOT / "blender_manifest.toml"
    text = path.read_text(encoding="utf-8")
    listed = re.sub(r"^wheels = \[.*?^\]", lambda _: manifest_list(), text, flags=re.M | re.S)
    path.write_text(listed, encoding="utf-8")


if __name__ == "__main__":
    write_manifest()
