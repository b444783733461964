"""`run.py torture [--kills N]`: kill commands at random moments (SIGKILL), and check that each of
them leaves the old result or the new one, whole, and that the next run leaves nothing else.

Two captures of one small object alternate, whose material and files have other names, so that a
mixture of two results is seen. A file counts as whole where its content is that of the folder's
record (core/output_folder), or, for exports, which have none, where all files of one capture are
there.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from .common import ROOT
from .package import load_patina

MEGAPIXELS, TRIANGLES, PHOTOS, VIEWS = 0.02, 2000, 3, 4
COMMANDS = ("fit", "masks", "material", "diagnose", "maps", "solve", "batch")
NAMES = ("alpha", "beta")  # of the material in the two captures
LATE_SHARE = 0.5  # of the kills happen in the last part of a run, where its result is moved
LATE = 0.85  # start of this part
AGE = 120.0  # seconds by which abandoned folders are aged: younger ones may belong to a process
LEFTOVERS = (".patina-part-", ".patina-ready", "patina-unpublished-", "earlier-")
PARTIAL = ".part"  # ending of files that are being written
OBJECT = "object"  # name of the object of a batch
END_SECONDS = 10.0  # after which the processes of a killed command must have ended


@dataclass
class Case:
    """A command. out: its folder; words: its arguments with a capture (0 or 1), without --out;
    inner: folder of the result in ``out``; listed: the files of a whole result, for each capture;
    seconds: an uninterrupted run."""

    name: str
    out: Path
    words: Callable[[int], list[str]]
    inner: str = ""
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


def main() -> int:
    """Run the kills; return 1 if a result was lost."""
    parser = argparse.ArgumentParser(prog="run.py torture", description=__doc__)
    parser.add_argument("--kills", type=int, default=200, help="number (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the moments (default %(default)s)")
    parser.add_argument("commands", nargs="*", help="commands to kill (default: all)")
    arguments = parser.parse_args()
    load_patina()
    with tempfile.TemporaryDirectory(prefix="patina-torture-") as name:
        cases = _cases(Path(name), arguments.commands)
        if not cases:
            parser.error(f"found no such command; expected one of {', '.join(COMMANDS)}")
        for case in cases:
            _prepare(case)
        wrong = _kill(cases, arguments.kills, random.Random(arguments.seed))
        wrong += [fault for case in cases for fault in _left(case)]
    print("| command | seconds | killed | old result | new result |\n|---|---|---|---|---|")
    for case in cases:
        print(f"| {case.name} | {case.seconds:.1f} | {case.kills} | {case.old} | {case.new} |")
    print(*wrong, f"{sum(c.kills for c in cases)} kills, {len(wrong)} faults", sep="\n")
    return 1 if wrong else 0


def _cases(folder: Path, chosen: Sequence[str]) -> list[Case]:
    """The commands, with their inputs made."""
    from tests import make_photos_of_scene as made

    from .bench_speed_scene import make_capture

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
            _run(Case("fit", result, lambda _, own=capture: [str(own)]).command(0))
    return cases


def _capture(folder: Path, material: str, make: Callable[..., Path]) -> Path:
    """A small capture with one material of that name."""
    path = make(folder, MEGAPIXELS, TRIANGLES, PHOTOS)
    path.write_text(path.read_text("utf-8") + f'\n[[material]]\nname = "{material}"\n', "utf-8")
    return path.rename(folder / f"{material}.capture.toml")


def _prepare(case: Case) -> None:
    """Run the command with both captures, to know its files and its time."""
    for which in (1, 0):
        shutil.rmtree(case.out, ignore_errors=True)
        since = time.monotonic()
        _run(case.command(which))
        case.seconds = time.monotonic() - since
        case.listed.insert(0, _files(case.result))
    assert case.name == "masks" or case.listed[0] != case.listed[1], case.name


def _run(command: Sequence[str]) -> None:
    """Run a command to its end. Raises RuntimeError where it fails."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr}")


def _kill(cases: Sequence[Case], kills: int, chance: random.Random) -> list[str]:
    """Kill each command in turn; returns the faults."""
    wrong: list[str] = []
    for number in range(kills):
        case = cases[number % len(cases)]
        before = _shown(case)
        which = 1 - before
        late = chance.random() < LATE_SHARE
        moment = case.seconds * (chance.uniform(LATE, 1.05) if late else chance.random())
        _age(case)
        process = subprocess.Popen(
            case.command(which),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        failed: list[str] = []
        try:
            if process.wait(moment):
                failed = [f"ended with exit code {process.returncode}"]
        except subprocess.TimeoutExpired:
            process.kill()  # alone: its own processes must end with it
            process.wait()
            case.kills += 1
            failed = _survivors(process.pid)
        faults = [
            f"{case.name}, kill {number} after {moment:.2f} s: {f}"
            for f in (*failed, *_faults(case))
        ]
        wrong += faults
        case.new += not faults and _shown(case) == which
        case.old += not faults and _shown(case) == before
        if sys.stderr.isatty():
            print(f"\r{number + 1} of {kills}, {len(wrong)} faults", end="", file=sys.stderr)
    return wrong


def _survivors(group: int) -> list[str]:
    """Whether processes of a killed command still run after END_SECONDS; they are killed then."""
    until = time.monotonic() + END_SECONDS
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return []
        time.sleep(0.05)
    os.killpg(group, signal.SIGKILL)
    return [f"processes still ran {END_SECONDS:g} s after the kill"]


def _shown(case: Case) -> int:
    """Which capture the result is of."""
    text = " ".join(sorted(_files(case.result)))
    if case.name == "masks":
        return int(NAMES[1] in text)
    return int(text == " ".join(sorted(case.listed[1])))


def _faults(case: Case) -> list[str]:
    """What is wrong with the result, as a program finds it that reads it."""
    from patina.core.output_folder import complete_publication
    from patina.core.output_folder.publication import RECORD, content_hash

    complete_publication(case.result)
    files = _files(case.result)
    if files not in case.listed:
        nearest = min(case.listed, key=lambda one: len(one ^ files))
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
    faults = [f"not of one result: {other}"] if other else []
    return [*faults, f"not recorded: {unknown}"] if unknown else faults


def _left(case: Case) -> list[str]:
    """What is left beside a result after another run."""
    _age(case)
    _run(case.command(0))
    folders = {case.result, case.out, case.out.parent}
    names = [path.name for folder in folders for path in folder.iterdir()]
    left = [name for name in names if name.startswith(LEFTOVERS) or name.endswith(PARTIAL)]
    return [f"{case.name}: left behind: {left}"] if left else _faults(case)


def _age(case: Case) -> None:
    """Let what killed processes have left be as old as what is removed."""
    then = time.time() - AGE
    for folder in (case.result, case.out, case.out.parent):
        for path in (*folder.glob(".patina-part-*"), *folder.glob(f"*{PARTIAL}")):
            os.utime(path, (then, then))


def _files(out: Path) -> set[str]:
    """The files of a result."""
    from patina.core.output_folder.publication import files_in

    skipped = (*LEFTOVERS, ".")
    return {name for name in files_in(out) if not name.startswith(skipped)}


if __name__ == "__main__":
    sys.exit(main())
