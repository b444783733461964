"""Results are published completely or not at all, and work of the user is never lost."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import sys
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.output_folder import complete_publication, staged_folder
from patina.core.output_folder.publication import PLAN, READY, RECORD

NAMES = ("result.json", "steel.binary", "scene.blend", "report/index.html", "report/a/b.png")


class Killed(BaseException):
    """Stands for the end of the process."""


def write(out: Path, content: str, names=NAMES, owner: str | None = "fit", say=lambda s: None):
    with staged_folder(out, owner, say) as folder:
        for name in names:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(f"{content} {name}", "utf-8")


def files(out: Path) -> dict[str, str]:
    """Contents of the visible files."""
    found = {}
    for path in sorted(out.rglob("*")):
        name = path.relative_to(out).as_posix()
        if path.is_file() and name != RECORD:
            found[name] = path.read_text("utf-8")
    return found


def expected(content: str, names=NAMES) -> dict[str, str]:
    return {name: f"{content} {name}" for name in sorted(names)}


def test_new_folder_appears_by_one_rename(tmp_path, monkeypatch):
    out = tmp_path / "deep" / "out"
    moves = []
    rename = os.rename
    monkeypatch.setattr(os, "rename", lambda a, b: (moves.append(b), rename(a, b)))
    write(out, "first")
    assert moves == [out]
    assert files(out) == expected("first")
    assert [p.name for p in out.parent.iterdir()] == ["out"]


def test_a_block_that_fails_changes_nothing(tmp_path):
    out = tmp_path / "out"
    write(out, "first")
    with pytest.raises(RuntimeError), staged_folder(out, "fit") as folder:
        (folder / "result.json").write_text("half")
        raise RuntimeError
    assert files(out) == expected("first")
    assert not list(out.glob(".patina-part-*"))


@given(st.integers(0, 40))
@settings(max_examples=40, deadline=None)
def test_process_killed_at_any_move_leaves_the_old_or_the_new_result(tmp_path_factory, after):
    out = tmp_path_factory.mktemp("killed") / "out"
    write(out, "old", [*NAMES, "removed.binary"])
    (out / "scene.blend").write_text("changed by the user")
    count = 0

    def dying(real):
        def call(*arguments, **named):
            nonlocal count
            count += 1
            if count > after:
                raise Killed
            return real(*arguments, **named)

        return call

    with pytest.MonkeyPatch.context() as patch:
        for name in ("rename", "replace", "unlink", "rmdir"):
            patch.setattr(os, name, dying(getattr(os, name)))
        with contextlib.suppress(Killed):
            write(out, "new")
    complete_publication(out)
    found = files(out)
    kept = found.pop("earlier-1/scene.blend", None)
    old = {**expected("old", [*NAMES, "removed.binary"]), "scene.blend": "changed by the user"}
    visible = {k: v for k, v in found.items() if not k.startswith(".patina-part-")}
    if kept is None:
        assert visible == old
    else:
        assert kept == "changed by the user"
        assert visible == expected("new")
    write(out, "third")  # and nothing is left of the killed process
    assert not [p.name for p in out.iterdir() if p.name.startswith((".patina-part", READY))]
    assert {k: v for k, v in files(out).items() if "earlier" not in k} == expected("third")


def test_files_of_the_user_are_kept_and_named(tmp_path):
    out, said = tmp_path / "out", []
    out.mkdir()
    (out / "scene.blend").write_text("mine")
    (out / "notes.txt").write_text("also mine")
    write(out, "first", say=said.append)
    assert files(out) == {
        **expected("first"), "notes.txt": "also mine", "earlier-1/scene.blend": "mine",
    }  # fmt: skip
    assert said == [
        "scene.blend: changed since Patina wrote it, or not written by Patina; kept in "
        f"{out / 'earlier-1'}"
    ]
    write(out, "second", say=said.append)
    assert len(said) == 1  # what Patina wrote itself is replaced without a word
    (out / "report" / "index.html").write_text("edited")
    write(out, "third", say=said.append)
    assert files(out)["earlier-2/report/index.html"] == "edited"
    assert len(said) == 2


def test_files_that_a_new_result_no_longer_has_are_removed(tmp_path):
    out = tmp_path / "out"
    write(out, "first", [*NAMES, "old.binary", "edited.binary", "report/materials/old.png"])
    write(out, "maps", ["maps.json"], owner="maps")
    (out / "edited.binary").write_text("by hand")
    write(out, "second")
    assert files(out) == {
        **expected("second"), "maps.json": "maps maps.json", "edited.binary": "by hand",
    }  # fmt: skip
    assert not (out / "report" / "materials").exists()


def test_without_an_owner_files_are_replaced_and_nothing_is_recorded(tmp_path):
    (tmp_path / "scene.blend").write_text("old")
    write(tmp_path, "new", ["scene.blend"], owner=None)
    assert files(tmp_path) == {"scene.blend": "new scene.blend"}
    assert not (tmp_path / RECORD).exists()


@pytest.mark.skipif(sys.platform == "win32", reason="links need a permission on Windows")
def test_results_are_not_written_through_links(tmp_path):
    out, other = tmp_path / "out", tmp_path / "other"
    out.mkdir()
    other.mkdir()
    (out / "report").symlink_to(other, target_is_directory=True)
    with pytest.raises(InputError, match="results are not written through links"):
        write(out, "first")
    assert not list(other.iterdir())
    assert files(out) == {}


@pytest.mark.skipif(sys.platform == "win32", reason="links need a permission on Windows")
@pytest.mark.parametrize("plan", [
    '{"keep": [], "earlier": "earlier-1", "remove": ["report/mine.txt"]}',
    '{"keep": [], "earlier": "earlier-1", "remove": ["../mine.txt"]}',
    '{"keep": ["a.txt"], "earlier": "..", "remove": []}',
    '{"keep": ["a.txt"], "earlier": "/tmp", "remove": []}',
    "[]", "{", '{"keep": 1}',
])  # fmt: skip
def test_plan_of_a_stranger_reaches_no_other_folder(tmp_path, plan):
    """A result folder from elsewhere may hold a plan that Patina did not write."""
    out, other = tmp_path / "out", tmp_path / "other"
    (out / READY).mkdir(parents=True)
    other.mkdir()
    for place in (other, tmp_path):
        (place / "mine.txt").write_text("mine")
    (out / "a.txt").write_text("a")
    (out / READY / "a.txt").write_text("new")
    (out / "report").symlink_to(other, target_is_directory=True)
    (out / READY / PLAN).write_text(plan)
    with pytest.raises(InputError, match="cannot be moved to its place"):
        complete_publication(out)
    assert (other / "mine.txt").is_file() and (tmp_path / "mine.txt").is_file()
    assert not (tmp_path / "a.txt").exists()


def _publish_often(out: Path, word: str) -> None:
    for number in range(12):
        write(out, f"{word}{number}")
        time.sleep(0.001)


def test_two_processes_never_mix_their_results(tmp_path):
    out = tmp_path / "out"
    context = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    both = [context.Process(target=_publish_often, args=(out, word)) for word in ("a", "b")]
    for one in both:
        one.start()
    for one in both:
        one.join(60)
        assert one.exitcode == 0
    words = {content.split()[0] for name, content in files(out).items() if "earlier" not in name}
    assert len(words) == 1
    assert not list(out.glob(".patina-*part*")) and not (out / READY).exists()
