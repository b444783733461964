"""``batch COLLECTION --out DIR``: a command over many captures, on all cores or on a cluster."""

from __future__ import annotations

import argparse
import contextlib
import os
import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from ..core.batch.cluster import Limits, Work, run_on_cluster
from ..core.batch.collection import Item, read_collection
from ..core.batch.farm_files import write_flamenco, write_openjd
from ..core.batch.page import PAGE, TABLE, write_page
from ..core.batch.record import ENDING, Finished, finished, input_hash, record_file
from ..core.batch.remote import run_process
from ..core.batch.rig_errors import rig_errors
from ..core.batch.summary import FAILED, Summary, summary_of
from ..core.child_process.parent_watch import END_WITH_PARENT
from ..core.child_process.python_command import ROOT, python_command, python_environment
from ..core.concurrency.thread_pool import MAX_THREADS
from ..core.counted import counted
from ..core.errors import InputError, PatinaError
from ..core.files import remove_unfinished
from ..core.jobs.varying.variation_estimator import MODES
from ..core.output_folder import check_out, only_writer, remove_abandoned
from ..core.report.result_json import program_version
from .needs_blender import has_blender
from .progress import print_note

HELP = "fit or diagnose all captures of a collection, on all cores or on a cluster"
PAGE_INTERVAL = 5.0  # seconds between two versions of the page
FORMATS = ("openjd", "flamenco")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "collection", type=Path,
        help="folder of captures, list of capture files, or table (CSV) with a column 'capture'",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument(
        "--run", dest="task", choices=("fit", "diagnose"), default="fit",
        help="what to run for each object (default %(default)s)",
    )  # fmt: skip
    parser.add_argument("--varying", choices=MODES, default="never", help="as of fit")
    parser.add_argument(
        "--workers", type=int, default=1,
        help="processes at a time on this computer (default %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--threads", type=int,
        help="threads of each process (default: an equal share of the cores; with --scheduler one "
        "for each core; at most four)",
    )  # fmt: skip
    parser.add_argument("--scheduler", help="address of a Dask scheduler, in place of --workers")
    parser.add_argument("--memory", type=float, default=0.0, help="limit of a process, GB")
    parser.add_argument("--time", type=float, default=0.0, help="limit of a process, seconds")
    parser.add_argument(
        "--attempts", type=int, default=2,
        help="runs before an object counts as failed (default %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--program", help="command that runs Patina on the workers, such as 'blender -b -P "
        "headless.py --' (default: this Python, which writes no scene.blend without bpy)",
    )  # fmt: skip
    parser.add_argument("--only", metavar="NAME", help="run one object here, without a cluster")
    parser.add_argument("--to", choices=FORMATS, help="only write a job for this engine")


def run(arguments: argparse.Namespace) -> None:
    limits = Limits(arguments.memory, arguments.time, arguments.attempts)
    for value, key in (
        (arguments.workers, "--workers"),
        (arguments.attempts, "--attempts"),
        (arguments.memory + 1, "--memory"),
        (arguments.time + 1, "--time"),
    ):
        if value < 1:
            raise InputError("found a number that is too small", key=key)
    out = check_out(arguments.out)
    items = read_collection(arguments.collection)
    out.mkdir(parents=True, exist_ok=True)
    if arguments.only is not None:
        _run_only(arguments, items, out, limits)
        return
    if arguments.to:
        names, words = [item.name for item in items], _farm_words(arguments, out)
        if arguments.to == "openjd":
            path = write_openjd(out, names, words, limits)
        else:
            path = write_flamenco(out, names, words)
        print(f"wrote {path}")
        return
    if arguments.threads is None and arguments.scheduler is None:
        cores = os.cpu_count() or 1
        arguments.threads = min(MAX_THREADS, max(1, cores // arguments.workers))
    with only_writer(out):
        _run_batch(arguments, items, out, limits)


def _run_batch(
    arguments: argparse.Namespace, items: Sequence[Item], out: Path, limits: Limits
) -> None:
    """Run what is not finished, and write the page. Raises PatinaError where an object fails."""
    _remove_leftovers(out, items)
    work = _work(arguments, items, out)
    summaries, left = _known(out, work)
    if len(left) < len(work):
        print_note(f"{counted(len(work) - len(left), 'object')} finished before.")
    _run_all(arguments, out, left, limits, summaries)
    done = list(summaries.values())
    write_page(out, done, running=False)
    _remove_leftovers(out, items)
    for error in rig_errors(done):
        print(error.sentence)
    failed = [one for one in done if one.state == FAILED]
    print(f"{len(done) - len(failed)} of {counted(len(done), 'object')} finished")
    print(f"wrote {out / PAGE}")
    if failed:
        names = ", ".join(one.item.name for one in failed[:5])
        raise PatinaError(
            f"{counted(len(failed), 'object')} failed ({names}{' …' if failed[5:] else ''}); "
            f"{out / PAGE} has the reasons. Run the command again to try only these"
        )


def _remove_leftovers(out: Path, items: Sequence[Item]) -> None:
    """Remove what killed processes have left. Objects that are finished are not run again, so no
    later fit removes it from their folders."""
    for pattern in (PAGE, TABLE, f"*{ENDING}"):
        remove_unfinished(out, pattern)
    for folder in (out, *(out / item.name for item in items)):
        remove_abandoned(folder)


def _work(arguments: argparse.Namespace, items: Sequence[Item], out: Path) -> list[Work]:
    """What to run for each object."""
    found = []
    for item in items:
        words = [arguments.task, str(item.capture), "--out", str(out / item.name)]
        if arguments.varying != "never":
            words += ["--varying", arguments.varying]
        inputs = input_hash(item.capture, words, program_version())  # threads change no result
        if arguments.threads is not None:
            words += ["--threads", str(arguments.threads)]
        found.append(Work(item, tuple(_process(arguments, words)), inputs))
    return found


def _process(arguments: argparse.Namespace, words: Sequence[str]) -> list[str]:
    """The process that runs a command."""
    if arguments.program:
        windows = sys.platform == "win32"  # where "\\" separates folders
        split = shlex.split(arguments.program, posix=not windows)
        return [*(word.strip('"') if windows else word for word in split), *words]
    if has_blender():
        from ..scene.session.background_blender import command  # needs bpy

        return command(words)
    return python_command("commands.command_line", *words)


def _farm_words(arguments: argparse.Namespace, out: Path) -> list[str]:
    """The command that an engine runs for an object, without its name."""
    words = ["batch", str(arguments.collection.resolve()), "--out", str(out)]
    words += ["--run", arguments.task, "--varying", arguments.varying]
    for option in ("threads", "memory", "time", "program"):
        value = getattr(arguments, option)
        if value:
            words += [f"--{option}", str(value)]
    own = python_command("commands.command_line", *words, "--only")
    if sys.platform == "win32":  # needs an installed Python package
        return own
    return ["env", f"PYTHONPATH={ROOT.parent}", *own]


def _run_only(
    arguments: argparse.Namespace, items: Sequence[Item], out: Path, limits: Limits
) -> None:
    """Run one object here, without a cluster and without a page."""
    name = arguments.only
    chosen = [item for item in items if item.name == name]
    if not chosen:
        raise InputError(f"found no object {name!r} in the collection", key="--only")
    (found,) = _work(arguments, chosen, out)
    if finished(out, name, found.inputs) is not None:
        print(f"{name}: finished before")
        return
    ended = run_process(
        list(found.words), _environment(), str(out / name), str(record_file(out, name)),
        found.inputs, 1, limits.gigabytes, limits.seconds,
    )  # fmt: skip
    if ended["message"]:
        raise PatinaError(f"{name}: {ended['message']}")
    print(f"{name}: finished")


def _known(out: Path, work: Sequence[Work]) -> tuple[dict[str, Summary], list[Work]]:
    """(what is known of each object, those that are not finished)."""
    summaries: dict[str, Summary] = {}
    left = []
    for one in work:
        known: Finished | None = finished(out, one.item.name, one.inputs)
        if known is None:
            left.append(one)
            summaries[one.item.name] = Summary(one.item)
        else:
            summaries[one.item.name] = summary_of(out, one.item, **vars(known), error="")
    return summaries, left


def _run_all(
    arguments: argparse.Namespace,
    out: Path,
    left: Sequence[Work],
    limits: Limits,
    summaries: dict[str, Summary],
) -> None:
    """Run what is left; ``summaries`` is kept up to date, and so is the page."""
    written = 0.0

    def write(now: bool = False) -> None:
        nonlocal written
        if now or time.monotonic() - written > PAGE_INTERVAL:
            written = time.monotonic()
            with contextlib.suppress(OSError):  # such as a table that is open in a spreadsheet
                write_page(out, list(summaries.values()), running=True)

    if not left:
        return
    write(now=True)
    ended = run_on_cluster(
        left, out, _environment(), limits, arguments.scheduler, arguments.workers, write
    )
    for count, one in enumerate(ended, 1):
        summaries[one.item.name] = summary_of(
            out, one.item, one.seconds, one.peak_mb, one.attempts, one.error
        )
        print(
            f"[{100 * count // len(left):3d} %] {one.item.name}: {one.error or 'finished'}",
            file=sys.stderr,
            flush=True,
        )


def _environment() -> dict[str, str]:
    """What a process needs to find this Patina, and to end with its worker."""
    names = ("PYTHONPATH", "PYTHONSAFEPATH")
    own = {key: value for key, value in python_environment().items() if key in names}
    return {**own, END_WITH_PARENT: "1"}
