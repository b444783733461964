"""Find out whether an environment is damaged, after a program in it ended abnormally.

A disk that was full, or a process that was killed, leaves truncated files: Python then ends with a
traceback or with a signal, and would do so at every later call.
"""

from __future__ import annotations

import base64
import csv
import hashlib
import shutil
from pathlib import Path

from .common import one_at_a_time, say

USUAL_CODES = frozenset((0, 2, 130, 143))  # done, wrong input, interrupted
CHECKED_SUFFIXES = frozenset((".py", ".so", ".pyd", ".dll", ".dylib", ".npz", ".json", ".txt"))


def damaged_files(environment: Path) -> list[Path]:
    """Files of the packages of an environment that are missing, or differ from their checksums."""
    found = []
    for record in sorted(environment.rglob("*.dist-info/RECORD")):
        site = record.parent.parent
        with record.open(newline="", encoding="utf-8") as file:
            rows = [row for row in csv.reader(file) if len(row) == 3 and row[1]]
        for name, digest, _ in rows:
            path = site / name
            if path.suffix in CHECKED_SUFFIXES and not _is_intact(path, digest):
                found.append(path)
    return found


def _is_intact(path: Path, digest: str) -> bool:
    """Whether a file has the digest of a RECORD (PEP 376): sha256=…, in base64 for URLs."""
    algorithm, _, expected = digest.partition("=")
    try:
        with path.open("rb") as file:
            found = hashlib.file_digest(file, algorithm).digest()
    except (OSError, ValueError):
        return False
    return base64.urlsafe_b64encode(found).rstrip(b"=").decode("ascii") == expected


def remove_if_damaged(python: Path, code: int) -> None:
    """Remove the environment of ``python`` if a program in it ended abnormally with ``code``, and
    files of its packages are damaged. The next call sets it up again."""
    if code in USUAL_CODES:
        return
    environment = python.parent.parent
    with one_at_a_time(environment.name):
        wrong = damaged_files(environment)
        if not wrong:
            return
        broken = environment.with_name(f"{environment.name}.broken")
        shutil.rmtree(broken, ignore_errors=True)
        try:
            environment.rename(broken)  # at once: half an environment would be used
        except OSError as error:
            say(f"{environment} is damaged; remove it ({error.strerror})")
            return
        shutil.rmtree(broken, ignore_errors=True)
    say(
        f"{len(wrong)} files of the environment {environment} were damaged (first "
        f"{wrong[0].name}), so it was removed; run the command again to set it up anew"
    )
