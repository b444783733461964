"""`run.py faults`: run commands where the disk is full, the folder is read-only or vanishes, or the
same command writes to it, and print what each says and what it leaves.

The folders are mounted in a namespace of their own (`unshare`, Linux), which ends with the command.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from ..package import load_patina
from .cases import COMMANDS, LEFTOVERS, Case, make_cases, prepare, result_faults, shown_capture

FREE = 8 << 20  # bytes that are left on the full disk: less than one table of a BRDF
PAGE = 4096  # bytes: the unit of space in a tmpfs
TEMPORARY = 1 << 20  # bytes of the full folder for temporary files
MIDDLE = 0.5  # of the time of a run: the folder vanishes then
INSIDE = "results"  # name of the folder of the result in the mounted one
PROGRESS = re.compile(r"\[ *\d+ %\] ")
NAMESPACE = ("unshare", "--map-root-user", "--mount")
VANISHED, TWO = "vanished", "two at once"
UNCHANGED, NEW, GONE = "unchanged", "the new one", "–"


@dataclass(frozen=True)
class Row:
    """What came of a command. code: exit code; said: its messages; result: what is in the folder;
    left: other files there."""

    command: str
    condition: str
    code: int
    said: tuple[str, ...]
    result: str
    left: tuple[str, ...] = ()

    @property
    def sound(self) -> bool:
        """A new result and no error, or one sentence and the old result; nothing else is left."""
        lost = self.condition == VANISHED  # the folder and its result, but not by the command
        expected = (NEW,) if self.code == 0 else (UNCHANGED, GONE) if lost else (UNCHANGED,)
        if self.condition.startswith(TWO):  # either may be the last
            expected = (NEW, UNCHANGED)
        whole = self.result in expected and not self.left
        return whole and len(self.said) == (self.code != 0) and self.code in (0, 2)

    @property
    def line(self) -> str:
        """For the table."""
        said = re.sub(r"/\S*/", "…/", "<br>".join(self.said)).replace("|", "\\|")
        left = ", ".join(self.left) or "nothing"
        mark = "" if self.sound else " (fault)"
        return (
            f"| {self.condition} | {self.command} | {self.code} | {said or '–'} | {self.result} | "
            f"{left}{mark} |"
        )


def main() -> int:
    """Print the table; return 1 if a command said several lines, or a result was damaged."""
    parser = argparse.ArgumentParser(prog="run.py faults", description=__doc__)
    parser.add_argument("commands", nargs="*", help="commands to run (default: all)")
    arguments = parser.parse_args()
    if subprocess.run([*NAMESPACE, "true"], capture_output=True).returncode:
        sys.exit("patina: this system allows no mounts in namespaces (unshare)")
    load_patina()
    rows = []
    print("| condition | command | exit code | what it says | result in the folder | left there |\n"
          "|---|---|---|---|---|---|")  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="patina-faults-") as name:
        cases = make_cases(Path(name), arguments.commands)
        if not cases:
            parser.error(f"found no such command; expected one of {', '.join(COMMANDS)}")
        for case in cases:
            prepare(case)  # leaves the result of capture 0
            for condition in CONDITIONS:
                for row in condition(case, Path(name) / "mount"):
                    rows.append(row)
                    print(row.line, flush=True)
    wrong = [row for row in rows if not row.sound]
    print(f"{len(rows)} runs, {len(wrong)} faults")
    return 1 if wrong else 0


def full_disk(case: Case, mount: Path) -> Iterator[Row]:
    """The folder is on a disk with little space left."""
    files = [file for file in case.out.rglob("*") if file.is_file()]
    used = sum(PAGE * (1 + file.stat().st_size // PAGE) for file in files)
    size = used + min(FREE, used // 2)  # results of some commands are smaller
    yield _mounted(case, mount, "full disk", f"-o size={size}")


def full_temporary(case: Case, mount: Path) -> Iterator[Row]:
    """There is no space for temporary files."""
    temporary = f"mkdir {mount}/tmp; mount -t tmpfs -o size={TEMPORARY} tmpfs {mount}/tmp"
    yield _mounted(case, mount, "full folder for temporary files", then=temporary)


def read_only(case: Case, mount: Path) -> Iterator[Row]:
    """Nothing can be written to the folder."""
    yield _mounted(case, mount, "read-only", then=f"mount -o remount,ro {mount}")


def vanished(case: Case, mount: Path) -> Iterator[Row]:
    """The folder vanishes while the command runs, as that of a network that is lost."""
    lost = f"(sleep {MIDDLE * case.seconds}; exec umount -l {mount}) &"
    yield _mounted(case, mount, VANISHED, then=lost)


def two_at_once(case: Case, mount: Path) -> Iterator[Row]:
    """Two processes write to one folder."""
    both = replace(case, out=mount / INSIDE)
    shutil.copytree(case.out, both.out)
    running = [
        subprocess.Popen(
            both.command(which), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        for which in (1, 0)
    ]
    ended = [(process.communicate()[1], process.returncode) for process in running]
    for number, (said, code) in enumerate(ended, 1):
        yield _row(both, f"{TWO}, no. {number}", said, code)
    shutil.rmtree(mount)


def _mounted(case: Case, mount: Path, condition: str, options: str = "", then: str = "") -> Row:
    """Run the command with the second capture in a file system that holds the result of the first.

    mount: folder for it; options: of `mount`; then: shell commands after it has been filled.
    """
    mount.mkdir()
    copy, vanished = mount.with_name("copy"), mount.with_name("vanished")
    script = f"""set -e
        mount -t tmpfs {options} tmpfs {mount}
        cp -a {case.out} {mount}/{INSIDE}
        {then}
        set +e
        "$@"
        code=$?
        if ! mountpoint -q {mount}; then touch {vanished}; fi
        cp -a {mount} {copy}
        exit $code"""
    own = replace(case, out=mount / INSIDE)
    env = {**os.environ, "TMPDIR": f"{mount}/tmp"} if f"{mount}/tmp" in then else None
    done = subprocess.run(
        [*NAMESPACE, "sh", "-c", script, "sh", *own.command(1)],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=env,
    )  # fmt: skip
    if "umount" in then and not vanished.exists():
        condition += " after its end"
    vanished.unlink(missing_ok=True)
    row = _row(replace(case, out=copy / INSIDE), condition, done.stderr, done.returncode)
    shutil.rmtree(copy)
    shutil.rmtree(mount)  # with what was written after the file system had vanished
    return row


def _row(case: Case, condition: str, stderr: str, code: int) -> Row:
    """What is found in the folder of a result and in the one around it."""
    lines = [line for line in stderr.splitlines() if line and not PROGRESS.match(line)]
    said = [line.removeprefix("patina: ") for line in lines]
    if not case.result.is_dir():
        return Row(case.name, condition, code, tuple(said), GONE, tuple(_names(case.out.parent)))
    wrong = result_faults(case)
    found = "; ".join(wrong) if wrong else NEW if shown_capture(case) else UNCHANGED
    around = [
        name
        for folder in {case.out.parent, case.out, case.result}
        for name in _names(folder)
        if name.startswith((*LEFTOVERS, ".patina-lock")) or name.endswith(".part")
    ]
    return Row(case.name, condition, code, tuple(said), found, tuple(around))


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []


CONDITIONS = (full_disk, full_temporary, read_only, vanished, two_at_once)

if __name__ == "__main__":
    sys.exit(main())
