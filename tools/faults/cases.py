"""The commands that the fault tests interrupt, with two captures whose results differ in the names
of their files, so that a mixture of two results is seen.

A file counts as whole where its content is that of the folder's record (core/output_folder), or,
for exports, which have none, where all files of one capture are there.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from ..common import ROOT

MEGAPIXELS, TRIANGLES, PHOTOS, VIEWS = 0.02, 2000, 3, 4
COMMANDS = ("fit", "masks", "material", "diagnose", "maps", "solve", "batch")
NAMES = ("alpha", "beta")  # of the material in the two captures
LEFTOVERS = (".patina-part-", ".patina-ready", "patina-unpublished-", "earlier-")
OBJECT = "object"  # name of the object of a batch


@dataclass
class Case:
    """A command. out: its folder; words: its arguments with a capture (0 or 1), without --out;
    inner: folder of the result in ``out``; keeps: whether files of another result stay, as those of
    exports do; listed: the files of a whole result, for each capture; seconds: an uninterrupted
    run."""

    name: str
    out: Path
    words: Callable[[int], list[str]]
    inner: str = ""
    keeps: bool = False
    listed: list[set[str]] = field(default_factory=list)
    seconds: float = 0.0
    kills: int = 0
    old: int = 0
    new: int = 0

    @property
    def result(self) -> Path:
        """The folder of the result."""
        return self.out / self.inner

    def command(self, which: int) -> list[str]:
        """The words of the process."""
        own = [*self.words(which), "--out", str(self.out)]
        return [sys.executable, str(ROOT / "headless.py"), self.name, *own]


def make_cases(folder: Path, chosen: Sequence[str]) -> list[Case]:
    """The commands, with their inputs made."""
    from tests import make_photos_of_scene as made

    from ..bench_speed_scene import make_capture

    captures = [_capture(folder / name, name, make_capture) for name in NAMES]
    shoots = [folder / f"photos of {name}" for name in NAMES]
    for shoot, height in zip(shoots, (0.5, 0.6), strict=True):
        shoot.mkdir()
        for i, view in enumerate(islice(made.ring(30, heights=(height,)), VIEWS)):
            made.write_picture(shoot / f"photo {i}.jpg", made.photo(view, seed=i))
    results = [folder / f"result {name}" for name in NAMES]
    tables = [folder / f"{name}.csv" for name in NAMES]
    for table, capture in zip(tables, captures, strict=True):
        table.write_text(f"capture,name\n{capture},{OBJECT}\n", "utf-8")
    cases = [
        Case("fit", folder / "fit", lambda which: [str(captures[which])]),
        Case("masks", folder / "masks", lambda which: [str(captures[which]), "--shadows"]),
        Case(
            "material",
            folder / "material",
            lambda which: [str(results[which]), "--to", "mtlx", "binary"],
            keeps=True,
        ),
        Case("diagnose", folder / "diagnose", lambda which: [str(captures[which])]),
        Case(
            "maps",
            folder / "maps",
            lambda which: [str(captures[which]), str(results[which]), "--size", "64"],
        ),
        Case("solve", folder / "solve", lambda which: [str(shoots[which]), "--threads", "2"]),
        Case("batch", folder / "batch", lambda which: [str(tables[which])], inner=OBJECT),
    ]
    cases = [case for case in cases if not chosen or case.name in chosen]
    if {case.name for case in cases} & {"material", "maps"}:
        for capture, result in zip(captures, results, strict=True):
            run(Case("fit", result, lambda _, own=capture: [str(own)]).command(0))
    return cases


def _capture(folder: Path, material: str, make: Callable[..., Path]) -> Path:
    """A small capture with one material of that name."""
    path = make(folder, MEGAPIXELS, TRIANGLES, PHOTOS)
    path.write_text(path.read_text("utf-8") + f'\n[[material]]\nname = "{material}"\n', "utf-8")
    return path.rename(folder / f"{material}.capture.toml")


def prepare(case: Case) -> None:
    """Run the command with both captures, to know its files and its time."""
    for which in (1, 0):
        shutil.rmtree(case.out, ignore_errors=True)
        since = time.monotonic()
        run(case.command(which))
        case.seconds = time.monotonic() - since
        case.listed.insert(0, files_of(case.result))
    assert case.name == "masks" or case.listed[0] != case.listed[1], case.name


def run(command: Sequence[str]) -> None:
    """Run a command to its end. Raises RuntimeError where it fails."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr}")


def shown_capture(case: Case) -> int:
    """Which capture the result is of."""
    text = " ".join(sorted(files_of(case.result)))
    if case.name == "masks" or case.keeps:
        return int(NAMES[1] in text)
    return int(text == " ".join(sorted(case.listed[1])))


def result_faults(case: Case) -> list[str]:
    """What is wrong with the result, as a program finds it that reads it."""
    from patina.core.output_folder import complete_publication
    from patina.core.output_folder.publication import RECORD, content_hash

    complete_publication(case.result)
    files = files_of(case.result)
    whole = [*case.listed, set().union(*case.listed)] if case.keeps else case.listed
    if files not in whole:
        nearest = min(whole, key=lambda one: len(one ^ files))
        return [f"missing {sorted(nearest - files)}, stale {sorted(files - nearest)}"]
    empty = [name for name in files if not (case.result / name).stat().st_size]
    record = case.result / RECORD
    if not record.is_file():
        return [f"empty: {empty}"] if empty else []
    known = json.loads(record.read_text("utf-8"))
    other = [
        name
        for name in files
        if name in known and content_hash(case.result / name) != known[name]["content"]
    ]
    unknown = sorted(files - set(known))
    found = [f"not of one result: {other}"] if other else []
    return [*found, f"not recorded: {unknown}"] if unknown else found


def files_of(out: Path) -> set[str]:
    """The files of a result."""
    from patina.core.output_folder.publication import files_in

    skipped = (*LEFTOVERS, ".")
    return {name for name in files_in(out) if not name.startswith(skipped)}
