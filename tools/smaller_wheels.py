"""Wheels without the tests of their library, which nothing imports: the zips of the extension have
a limit of size. Code and licences stay as they are."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

from .common import cache_dir

WITHOUT_TESTS = ("scipy",)
"""Libraries whose tests are left out. (4.4 MB of a wheel; the other libraries ship none.)"""
VERSION = "1"  # of what is left out, in the name of the cache
LEVEL = 9  # of the compression


def shipped_wheel(wheel: Path, digest: str) -> Path:
    """The file to ship for a downloaded wheel: the wheel, or its copy without tests in the cache.

    digest: SHA-256 of the wheel.
    """
    if wheel.name.split("-")[0] not in WITHOUT_TESTS:
        return wheel
    made = cache_dir() / "wheels" / f"{digest[:16]}-{VERSION}" / wheel.name
    if not made.is_file():
        made.parent.mkdir(parents=True, exist_ok=True)
        partial = made.with_name(f"{os.getpid()}.part")
        write_without_tests(wheel, partial)
        os.replace(partial, made)
    return made


def write_without_tests(wheel: Path, target: Path) -> None:
    """Write a wheel without the files in folders called "tests", and without their lines in its
    RECORD. The same wheel gives the same bytes."""
    with (
        zipfile.ZipFile(wheel) as before,
        zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as after,
    ):
        for entry in before.infolist():
            if is_test(entry.filename):
                continue
            content = before.read(entry)
            if entry.filename.endswith(".dist-info/RECORD"):
                lines = content.decode("utf-8").splitlines(keepends=True)
                kept = (line for line in lines if not is_test(line.split(",")[0]))
                content = "".join(kept).encode("utf-8")
            after.writestr(entry, content, zipfile.ZIP_DEFLATED, LEVEL)


def is_test(name: str) -> bool:
    """Whether a file of a wheel belongs to tests."""
    return "tests" in Path(name).parts[:-1]
