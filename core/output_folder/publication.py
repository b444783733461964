"""Move a finished result into its folder so that it is there completely or not at all.

A folder that does not exist yet is made by one rename. In a folder that exists, the result is first
renamed to READY within it, with a plan: from then on the result counts as published. Its files are
then moved to their places. A process that is killed in between leaves the rest to the next one that
writes to the folder or reads a result in it.

The record lists the files that Patina wrote, with their content: files of the same kind that a new
result no longer has are deleted. Files that differ from the record, and files that are not in it,
are work of the user; where a new file has their name, they are moved to a folder "earlier-1",
"earlier-2" …. Both are decided when a file is moved, by its content at that moment.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from ..errors import InputError
from ..files import as_file_name, read_regular, write_text_atomic
from .folder_lock import LOCK, locked_folder

READY = ".patina-ready"  # folder of a published result whose files are not in their places yet
PLAN = ".patina-plan.json"  # in it
RECORD = ".patina-files"  # of the files that Patina wrote to a folder
MAX_RECORD_BYTES = 1 << 26
EARLIER = "earlier-{}"  # folder for files of the user
OWN_NAMES = frozenset((PLAN, RECORD, LOCK))

Record = dict[str, dict[str, str]]
"""Path in the folder, with slashes → {"owner": what wrote it, "content": its hash}."""
Owner = str | Callable[[str], str]
"""What writes a result, such as "fit"; or a function of the path of each file."""
UNUSABLE = (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError)
"""Errors of reading a plan or a record that is damaged, or made by a stranger."""


@dataclass(frozen=True)
class Plan:
    """known: path of a new file → hash of the one that Patina wrote there before; files of another
    content are the user's. remove: path of a file of an earlier result → its hash."""

    known: dict[str, str] = field(default_factory=dict)
    remove: dict[str, str] = field(default_factory=dict)

    def as_json(self) -> str:
        return json.dumps(vars(self), ensure_ascii=False)

    @staticmethod
    def read(path: Path) -> Plan:
        """Raises one of UNUSABLE for anything but a plan."""
        found: Any = json.loads(read_regular(path, MAX_RECORD_BYTES))
        known, remove = (
            {_checked(k): str(v) for k, v in found[key].items()} for key in ("known", "remove")
        )
        return Plan(known, remove)


@dataclass(frozen=True)
class Kept:
    """Files of the user that made way. names: their paths; folder: where they are now."""

    names: tuple[str, ...] = ()
    folder: str = ""


def publish(staging: Path, out: Path, owner: Owner | None) -> Kept:
    """Move the files of ``staging``, a folder next to ``out`` or in it, to ``out``.

    owner: what writes them, for the record; None: files of the same name are replaced, and there is
    no record. Returns what happened to files of the user. Raises InputError, OSError.
    """
    if not out.exists():
        if owner is not None:
            _write_record(staging, _recorded(staging, files_in(staging), owner))
        try:
            os.rename(staging, out)
            return Kept()
        except OSError:
            if not out.exists():  # else another process has made it meanwhile
                raise
    with locked_folder(out):
        _finish(out)
        _check_places(staging, out)
        plan = None if owner is None else _plan(staging, out, owner)
        if plan is not None:
            (staging / PLAN).write_text(plan.as_json(), "utf-8")
        try:
            os.rename(staging, out / READY)
            return _finish(out)
        except KeyboardInterrupt:
            _finish(out)  # what is published is completed first
            raise


def complete_publication(out: Path) -> None:
    """Finish the publication of a process that was killed. Raises InputError where that fails."""
    try:
        if not os.path.lexists(out / READY):
            return
        with locked_folder(out):
            _finish(out)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror or error})", file=out) from error


def record_again(out: Path, path: Path) -> None:
    """Record the content of a file of the result in ``out`` that Patina has changed since. Raises
    InputError, OSError."""
    name = path.relative_to(out).as_posix()
    with locked_folder(out):
        record = _read_record(out)
        if name in record:
            record[name]["content"] = content_hash(path)
            _write_record(out, record)


def files_in(folder: Path) -> list[str]:
    """All files of a folder, as paths with slashes, sorted."""
    return sorted(
        (Path(base) / name).relative_to(folder).as_posix()
        for base, _, names in os.walk(folder)
        for name in names
        if name not in OWN_NAMES
    )


def _finish(out: Path) -> Kept:
    """Move the files of READY, if there are any. Raises InputError where that fails."""
    try:
        return _complete(out)
    except UNUSABLE as error:
        raise InputError(
            f"holds a complete result in {READY!r} that cannot be moved to its place ({error}); "
            "close programs that use files of the folder, allow writing to it, and try again",
            file=out,
        ) from error


def _complete(out: Path) -> Kept:
    """Move the files of READY to their places. Every move can be repeated."""
    ready = out / READY
    if not os.path.lexists(ready):
        return Kept()
    if ready.is_symlink() or not ready.is_dir():
        raise ValueError("it is no folder")
    _check_places(ready, out)
    plan = Plan.read(ready / PLAN) if os.path.lexists(ready / PLAN) else None
    earlier, kept = _free_name(out), []
    for name in files_in(ready):
        target = _inside(out, name)
        if plan is not None and os.path.lexists(target):
            known = (plan.known.get(name), content_hash(ready / name))
            if content_hash(target) not in known:
                away = _inside(out, f"{earlier}/{name}")
                away.parent.mkdir(parents=True, exist_ok=True)
                os.replace(target, away)
                kept.append(name)
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(ready / name, target)
    for name, content in ({} if plan is None else plan.remove).items():
        with contextlib.suppress(ValueError):  # behind a link now
            target = _inside(out, name)
            if target.is_file() and content_hash(target) == content:
                target.unlink()
                with contextlib.suppress(OSError):  # it has other files
                    target.parent.rmdir()
    if os.path.lexists(ready / RECORD):
        os.replace(ready / RECORD, out / RECORD)
    (ready / PLAN).unlink(missing_ok=True)
    shutil.rmtree(ready)
    return Kept(tuple(kept), earlier)


def _check_places(staging: Path, out: Path) -> None:
    """Raise InputError where a folder, a file or a link is in the way of the result, or a folder
    that files cannot be moved to."""
    device = os.stat(out).st_dev
    for base, folders, files in os.walk(staging):
        for name in folders + files:
            source = Path(base) / name
            target = out / source.relative_to(staging)
            if source.is_dir() and target.is_symlink():
                raise InputError(
                    "is a link; results are not written through links; remove it", file=target
                )
            if target.exists() and target.is_dir() != source.is_dir():
                kind = "a folder" if target.is_dir() else "a file"
                raise InputError(
                    f"is {kind} that blocks a result of this name; move or rename it", file=target
                )
            if target.is_dir() and (
                os.stat(target).st_dev != device or not os.access(target, os.W_OK)
            ):
                raise InputError(
                    "cannot be written to, or is on another disk than the folder of the result; "
                    "move or rename it",
                    file=target,
                )


def _plan(staging: Path, out: Path, owner: Owner) -> Plan:
    """The plan of a publication. Writes the record of the folder after it to the staging folder."""
    before, now = _read_record(out), _recorded(staging, files_in(staging), owner)
    folded = {as_file_name(name): one["content"] for name, one in before.items()}
    known = {name: folded[as_file_name(name)] for name in now if as_file_name(name) in folded}
    owners = {one["owner"] for one in now.values()}
    new = {as_file_name(name) for name in now}
    gone = {
        name: one["content"]
        for name, one in before.items()
        if one["owner"] in owners and as_file_name(name) not in new
    }
    _write_record(staging, {k: v for k, v in before.items() if k not in gone} | now)
    return Plan(known, gone)


def _free_name(out: Path) -> str:
    """The name of a folder for files of the user that does not exist yet, or is empty."""
    number = 1
    while True:
        folder = out / EARLIER.format(number)
        empty = folder.is_dir() and not folder.is_symlink() and not files_in(folder)
        if empty or not os.path.lexists(folder):
            return folder.name
        number += 1


def _recorded(folder: Path, names: list[str], owner: Owner) -> Record:
    return {
        name: {
            "owner": owner if isinstance(owner, str) else owner(name),
            "content": content_hash(folder / name),
        }
        for name in names
    }


def content_hash(path: Path) -> str:
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
        if path.is_symlink():
            return {}
        found: Any = json.loads(read_regular(path, MAX_RECORD_BYTES))
        return {
            _checked(name): {"owner": str(one["owner"]), "content": str(one["content"])}
            for name, one in found.items()
        }
    except UNUSABLE:
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
