"""The libraries that travel inside the extension: pinned, named, downloaded and checked.

Blender runs Python 3.11 (4.2 to 5.0) or 3.13 (5.1 on), so every library is shipped for both.
numpy is never among them: Blender brings its own, and two of them in one process do not mix.
OpenImageIO stays below 3.1, which wants numpy 2 while Blender up to 5.0 has 1.26. It also writes
our EXR files: the OpenEXR wheel exports its symbols, Blender's own OpenEXR library takes their
place, and writing a file then crashes (seen in Blender 4.3 on Linux).
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
"""Camera RAW: only in the zips of `run.py build --raw`, too large for the extension site."""

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
"""Per library the platform part of its wheels' names, in the order of PLATFORMS; None: pure Python.

scipy has a wheel for macOS 14 too; the one for macOS 12 is taken because it runs on both.
"""

PURE = {"defusedxml": "py2.py3"}  # the Python part of a pure wheel's name, where it is not py3

FOLDER = ROOT / "wheels"
SUMS = Path(__file__).with_name("wheels.sha256")


def requirements() -> list[str]:
    """Return the pins as pip reads them."""
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
    return list(dict.fromkeys(names))  # a pure wheel serves them all


def manifest_list(names: Sequence[str] | None = None) -> str:
    """Return the `wheels = [...]` entry of blender_manifest.toml."""
    chosen = wheel_names() if names is None else names
    return "wheels = [\n" + "".join(f'  "./wheels/{name}",\n' for name in chosen) + "]"


def checksums() -> dict[str, str]:
    """Return file name → SHA-256, as written in wheels.sha256."""
    pairs = (line.split() for line in SUMS.read_text(encoding="utf-8").splitlines() if line)
    return {name: digest for digest, name in pairs}


def is_whole(path: Path, digest: str) -> bool:
    """Say whether the file is there and is the one that was pinned."""
    if not path.is_file():
        return False
    with path.open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest() == digest


def pip_command() -> list[str]:
    """Return how to call pip: this Python's own, or one in a small environment in the cache."""
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
            f"{sys.executable} has neither pip nor venv: install one (Debian: python3-pip)"
        )
    return small


def download(names: Sequence[str], folder: Path = FOLDER) -> list[Path]:
    """Put these wheels into the folder, verified; those already there and whole are kept."""
    sums = checksums()
    folder.mkdir(parents=True, exist_ok=True)
    missing = [name for name in names if not is_whole(folder / name, sums[name])]
    if missing:
        say(f"downloading {len(missing)} wheels (about {20 * len(missing)} MB, once) ...")
        pip = pip_command()
        for name in missing:
            fetch_one(pip, name, folder)
            if not is_whole(folder / name, sums[name]):
                raise Failure(f"{name}: not the file that was pinned (SHA-256 differs)", 1)
        say(f"downloaded {megabytes([folder / name for name in missing])}")
    return [folder / name for name in names]


def fetch_one(pip: Sequence[str], name: str, folder: Path) -> None:
    """Download one wheel, asking pip for exactly its tags."""
    library, version, python, abi, tags = name.removesuffix(".whl").split("-")
    asked = ["--implementation", "cp", "--python-version", python[2:], "--abi", abi]
    asked += [word for tag in tags.split(".") for word in ("--platform", tag)]
    if abi == "none":
        asked = []
    quietly(
        [
            *pip, "download", "--quiet", "--disable-pip-version-check", "--no-deps",
            "--only-binary=:all:", *asked, "--dest", folder, f"{library}=={version}",
        ],
        f"downloading {name}",
    )  # fmt: skip


def write_manifest() -> None:
    """Write the list of wheels into blender_manifest.toml: `python3 -m tools.wheels`."""
    path = ROOT / "blender_manifest.toml"
    text = path.read_text(encoding="utf-8")
    listed = re.sub(r"^wheels = \[.*?^\]", lambda _: manifest_list(), text, flags=re.M | re.S)
    path.write_text(listed, encoding="utf-8")


if __name__ == "__main__":
    write_manifest()
