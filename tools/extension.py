"""Build and validate the zips of the extension with Blender's `extension` command."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from . import manual, viewer_program
from .common import Failure, quietly
from .staging import manifest, staged
from .wheels import download, wheel_names

MAX_BYTES = 199_000_000  # of a zip: Blender's extension site accepts 200 MB


@dataclass(frozen=True)
class ExtensionTool:
    """How to call `extension build` and `extension validate`.

    command: program and first arguments. tags: file with the allowed tags, which the script in the
    bpy wheel requires; None for Blender itself.
    """

    command: tuple[str, ...]
    tags: Path | None = None

    def run(self, what: str, *arguments: str | Path) -> str:
        """Run one command and return its output."""
        tags = ["--valid-tags", str(self.tags)] if self.tags else []
        return quietly([*self.command, what, *arguments, *tags], f"extension {what}")


def pack(
    tool: ExtensionTool,
    platforms: Sequence[str],
    pythons: Sequence[str],
    out: Path,
    raw: bool = False,
) -> list[Path]:
    """Build and validate the zips for these platforms; return them in the same order.

    raw: include the library for camera RAW. Raises Failure.
    """
    viewer_program.build_if_possible()
    manual.build_if_possible()
    download(wheel_names(platforms, pythons, raw))
    out.mkdir(parents=True, exist_ok=True)
    with staged(platforms, pythons, raw) as source:
        tool.run("build", "--split-platforms", "--source-dir", source, "--output-dir", out)
    about = manifest()
    archives = []
    for platform in platforms:
        name = f"{about['id']}-{about['version']}-{platform.replace('-', '_')}.zip"
        archive = out / name
        if not archive.exists():
            raise Failure(f"Blender did not write {name}", 1)
        tool.run("validate", archive)
        check_wheels(archive, wheel_names([platform], pythons, raw))
        if archive.stat().st_size > MAX_BYTES and not raw:
            size = archive.stat().st_size / 1e6
            raise Failure(f"{name} has {size:.0f} MB; expected at most {MAX_BYTES / 1e6:.0f} MB", 1)
        archives.append(archive)
    return archives


def check_wheels(archive: Path, expected: Sequence[str]) -> None:
    """Raise Failure unless a zip contains exactly the expected wheels."""
    with zipfile.ZipFile(archive) as opened:
        inside = {Path(name).name for name in opened.namelist() if name.endswith(".whl")}
    if inside != set(expected):
        wrong = ", ".join(sorted(inside ^ set(expected)))
        raise Failure(f"{archive.name}: missing or unexpected wheels: {wrong}", 1)
