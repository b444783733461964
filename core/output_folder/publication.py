"""Move a finished result into its folder so that it is there completely or not at all.

A folder that does not exist yet is made by one rename. In a folder that exists, the result is first
renamed to READY within it, with a plan: from then on the result counts as published. Its files are
then moved to their places. A process that is killed in between leaves the rest to the next one that
writes to the folder or reads a result in it.

The record lists the files that Patina wrote, with their content: files of the same kind that a new
result no longer has are deleted. Files that differ from the record, and files that are not in it,
are work of the user; where a new file has their name, they are moved to a folder "earlier-1",
"earlier-2" ….
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from ..errors import InputError
from ..files import write_text_atomic
from .folder_lock import locked_folder

READY = ".patina-ready"  # folder of a published result whose files are not in their places yet
PLAN = ".patina-plan.json"  # in it
RECORD = ".patina-files.json"  # of the files that Patina wrote to a folder
MAX_RECORD_BYTES = 1 << 26
EARLIER = "earlier-{}"  # folder for files of the user

Record = dict[str, dict[str, str]]
"""Path in the folder, with slashes → {"owner": what wrote it, "content": its hash}."""


@dataclass(frozen=True)
class Plan:
    """keep: files of the user that make way; earlier: the folder they move to; remove: files of an
    earlier result."""

    keep: tuple[str, ...] = ()
    earlier: str = ""
    remove: tuple[str, ...] = ()

    def as_json(self) -> str:
        return json.dumps(vars(self), ensure_ascii=False)

    @staticmethod
    def read(path: Path) -> Plan:
        """Raises ValueError for anything but a plan."""
        found: Any = json.loads(path.read_text("utf-8"))
        return Plan(tuple(found["keep"]), str(found["earlier"]), tuple(found["remove"]))


def publish(staging: Path, out: Path, owner: str | None) -> Plan:
    """Move the files of ``staging``, a folder next to ``out`` or in it, to ``out``.

    owner: what writes them, for the record; None: files of the same name are replaced, and there is
    no record. Returns what was done to other files. Raises InputError, OSError.
    """
    if not out.exists():
        if owner is not None:
            _write_record(staging, _recorded(staging, files_in(staging), owner))
        try:
            os.rename(staging, out)
            return Plan()
        except OSError:
            if not out.exists():  # else another process has made it meanwhile
                raise
    with locked_folder(out):
        _finish(out)
        new = files_in(staging)
        _check_places(staging, out)
        plan = Plan() if owner is None else _plan(staging, out, new, owner)
        (staging / PLAN).write_text(plan.as_json(), "utf-8")
        try:
            os.rename(staging, out / READY)
            _finish(out)
        except KeyboardInterrupt:
            _finish(out)  # what is published is completed first
            raise
    return plan


def complete_publication(out: Path) -> None:
    """Finish the publication of a process that was killed. Raises InputError where that fails."""
    if (out / READY).is_dir():
        with locked_folder(out):
            _finish(out)


def _finish(out: Path) -> None:
    """Move the files of READY, if there are any. Raises InputError where that fails."""
    try:
        _complete(out)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"holds a complete result in {READY!r} that cannot be moved to its place ({error}); "
            "close programs that use files of the folder, allow writing to it, and try again",
            file=out,
        ) from error


def files_in(folder: Path) -> list[str]:
    """All files of a folder, as paths with slashes, sorted."""
    return sorted(
        (Path(base) / name).relative_to(folder).as_posix()
        for base, _, names in os.walk(folder)
        for name in names
        if name not in (PLAN, RECORD)
    )


def _complete(out: Path) -> None:
    """Move the files of READY to their places. Every move can be repeated."""
    ready = out / READY
    if not ready.is_dir():
        return
    if not (ready / PLAN).is_file():  # only the removal of the empty folder was left
        shutil.rmtree(ready)
        return
    plan = Plan.read(ready / PLAN)
    _check_places(ready, out)
    for name in files_in(ready):
        target = _inside(out, name)
        if name in plan.keep and target.exists():
            earlier = _inside(out, f"{plan.earlier}/{name}")
            earlier.parent.mkdir(parents=True, exist_ok=True)
            os.replace(target, earlier)
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(ready / name, target)
    for name in plan.remove:
        target = _inside(out, name)
        target.unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # it has other files
            target.parent.rmdir()
    if (ready / RECORD).is_file():
        os.replace(ready / RECORD, out / RECORD)
    (ready / PLAN).unlink()
    shutil.rmtree(ready)


def _check_places(staging: Path, out: Path) -> None:
    """Raise InputError where a folder, a file or a link is in the way of the result."""
    for base, folders, files in os.walk(staging):
        for name in folders + files:
            source = Path(base) / name
            target = out / source.relative_to(staging)
            if target.is_symlink() and source.is_dir():
                raise InputError(
                    "is a link; results are not written through links; remove it", file=target
                )
            if target.exists() and target.is_dir() != source.is_dir():
                kind = "a folder" if target.is_dir() else "a file"
                raise InputError(
                    f"is {kind} that blocks a result of this name; move or rename it", file=target
                )


def _plan(staging: Path, out: Path, new: list[str], owner: str) -> Plan:
    """The plan of a publication. Writes the record of the folder after it to the staging folder."""
    before, now = _read_record(out), _recorded(staging, new, owner)
    keep = []
    for name in new:
        target = out / name
        if not (target.is_file() or target.is_symlink()):
            continue
        content = _content(target)
        if content not in (now[name]["content"], before.get(name, {}).get("content")):
            keep.append(name)
    gone = [name for name, one in before.items() if one["owner"] == owner and name not in now]
    remove = [
        name
        for name in gone
        if _inside(out, name).is_file() and _content(out / name) == before[name]["content"]
    ]
    _write_record(staging, {k: v for k, v in before.items() if k not in gone} | now)
    number = 1
    while (out / EARLIER.format(number)).exists():
        number += 1
    return Plan(tuple(keep), EARLIER.format(number), tuple(remove))


def _recorded(folder: Path, names: list[str], owner: str) -> Record:
    return {name: {"owner": owner, "content": _content(folder / name)} for name in names}


def _content(path: Path) -> str:
    """A hash of a file's content; that of a link is its target."""
    if path.is_symlink():
        return f"link to {os.readlink(path)}"
    with path.open("rb") as file:
        return hashlib.file_digest(file, "blake2b").hexdigest()[:32]


def _write_record(folder: Path, record: Record) -> None:
    lines = json.dumps(record, ensure_ascii=False, indent=0, sort_keys=True)
    write_text_atomic(folder / RECORD, lines + "\n")


def _read_record(folder: Path) -> Record:
    """The record of a folder, {} where there is none or it is damaged."""
    path = folder / RECORD
    try:
        if path.is_symlink() or path.stat().st_size > MAX_RECORD_BYTES:
            return {}
        found: Any = json.loads(path.read_text("utf-8"))
        return {
            _checked(name): {"owner": str(one["owner"]), "content": str(one["content"])}
            for name, one in found.items()
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def _inside(folder: Path, name: str) -> Path:
    """The path of a file in a folder. Raises ValueError for one outside it."""
    path = folder / _checked(name)
    for parent in path.parents:
        if parent == folder:
            return path
        if parent.is_symlink():
            raise ValueError(f"{parent} is a link")
    raise ValueError(f"{name!r} is not in the folder")


def _checked(name: str) -> str:
    """The name of a file in a folder, from a file that a stranger may have written."""
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or "\\" in name or not path.parts:
        raise ValueError(f"{name!r} is not in the folder")
    return name
