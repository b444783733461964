"""Stage the folder that Blender packs: the extension's files and the requested wheels."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

from .common import ROOT, cache_dir
from .smaller_wheels import shipped_wheel
from .wheels import FOLDER, checksums, manifest_list, wheel_names

MANIFEST = "blender_manifest.toml"
IGNORED = shutil.ignore_patterns("__pycache__", "*.py[co]", ".*", "*~", "*.blend1", "*.part")


def manifest() -> dict:
    """Return the content of blender_manifest.toml."""
    return tomllib.loads((ROOT / MANIFEST).read_text(encoding="utf-8"))


def shipped() -> list[Path]:
    """Return the top-level files and folders that the manifest does not exclude."""
    anchored = {
        pattern.strip("/")
        for pattern in manifest()["build"]["paths_exclude_pattern"]
        if pattern.startswith("/")
    }
    excluded = anchored | IGNORED(str(ROOT), os.listdir(ROOT))
    return sorted(
        path for path in ROOT.iterdir() if path.name not in excluded and path.suffix != ".zip"
    )


def source_hash(*extra: str) -> str:
    """Return a hash of all files that are shipped, and of the strings ``extra``."""
    digest = hashlib.sha256("\n".join(extra).encode())
    for top in shipped():
        files = sorted(path for path in top.rglob("*") if path.is_file()) if top.is_dir() else [top]
        for path in files:
            inside = path.relative_to(ROOT)
            if IGNORED(str(path.parent), list(inside.parts)):
                continue
            digest.update(f"\n{inside.as_posix()}\n".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def filtered_manifest(platforms: Sequence[str], pythons: Sequence[str], raw: bool) -> str:
    """Return the text of the manifest, reduced to these platforms, Pythons and their wheels."""
    text = (ROOT / MANIFEST).read_text(encoding="utf-8")
    wheels = manifest_list(wheel_names(platforms, pythons, raw))
    words = ", ".join(f'"{platform}"' for platform in platforms)
    text = re.sub(r"^wheels = \[.*?^\]", lambda _: wheels, text, flags=re.M | re.S)
    return re.sub(r"^platforms = \[.*?\]", lambda _: f"platforms = [{words}]", text, flags=re.M)


@contextlib.contextmanager
def staged(platforms: Sequence[str], pythons: Sequence[str], raw: bool = False) -> Iterator[Path]:
    """Yield a temporary folder for `extension build`; requires downloaded wheels."""
    folder = cache_dir() / f"staging-{os.getpid()}"
    shutil.rmtree(folder, ignore_errors=True)
    try:
        (folder / "wheels").mkdir(parents=True)
        for path in shipped():
            if path.is_dir():
                shutil.copytree(path, folder / path.name, ignore=IGNORED)
            else:
                shutil.copy2(path, folder)
        sums = checksums()
        for name in wheel_names(platforms, pythons, raw):
            wheel = shipped_wheel(FOLDER / name, sums[name])
            try:
                os.link(wheel, folder / "wheels" / name)
            except OSError:  # another disk, or a file system without links
                shutil.copy2(wheel, folder / "wheels")
        text = filtered_manifest(platforms, pythons, raw)
        (folder / MANIFEST).write_text(text, encoding="utf-8")
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
