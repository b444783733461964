"""The record of a finished object: what it was computed from, and what its result is. Whether an
object is finished is read from its folder, not from the memory of a scheduler."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path

from ..capture import Capture, read_capture
from ..errors import PatinaError
from ..files import read_regular
from .remote import recorded

ENDING = ".batch.json"  # of a record, beside the folder of the result
MAX_CAPTURE_BYTES = 1 << 26


@dataclass(frozen=True)
class Finished:
    """A finished object. seconds, peak_mb: of the process; attempts: how many it took."""

    seconds: float
    peak_mb: float
    attempts: int


def record_file(out: Path, name: str) -> Path:
    """The record of an object in the folder of a batch."""
    return out / f"{name}{ENDING}"


def finished(out: Path, name: str, inputs: str) -> Finished | None:
    """What is recorded of an object, if its result is there, and was computed from the same inputs;
    else None. out: folder of the batch; inputs: of ``input_hash``."""
    found = recorded(str(out / name), str(record_file(out, name)), inputs)
    try:
        if found is None:
            return None
        return Finished(float(found["seconds"]), float(found["peak_mb"]), int(found["attempts"]))
    except (ValueError, TypeError):
        return None


def input_hash(capture: Path, words: Sequence[str], version: str) -> str:
    """A hash of what the result of an object depends on: the command, the version of Patina, the
    capture file, and size and time of change of the files that it names."""
    digest = hashlib.blake2b(json.dumps([version, *words]).encode())
    try:
        digest.update(read_regular(capture, MAX_CAPTURE_BYTES))
        files = sorted(_files(read_capture(capture)))
    except (OSError, PatinaError):  # the run will say what is wrong with it
        files = []
    for file in files:
        try:
            state = os.stat(file)
        except OSError:
            continue
        digest.update(json.dumps([str(file), state.st_size, state.st_mtime_ns]).encode())
    return digest.hexdigest()[:32]


def _files(capture: Capture) -> set[Path]:
    """The files that a capture names, also in the folder of a camera model."""
    named: set[Path | None] = set()
    for entry in (capture.scan, capture.tone.chart, *capture.lights, *capture.photos):
        named |= set(_paths(entry))
    found = {file for file in named if file is not None}
    inside = {one for file in found if file.is_dir() for one in file.iterdir()}
    return {file for file in found | inside if file.is_file()}


def _paths(entry: object) -> Iterator[Path]:
    """The paths in a table of a capture, and in those within it."""
    if isinstance(entry, Path):
        yield entry
    elif is_dataclass(entry):
        for one in fields(entry):
            yield from _paths(getattr(entry, one.name))
    elif isinstance(entry, Mapping):
        for value in entry.values():
            yield from _paths(value)
    elif isinstance(entry, tuple | list):
        for value in entry:
            yield from _paths(value)
