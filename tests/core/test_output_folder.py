"""Results are published completely or not at all, and work of the user is never lost."""

from __future__ import annotations

import contextlib
import hashlib
import json
import multiprocessing
import os
import sys
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.output_folder import (
    complete_publication,
    folder,
    folder_lock,
    record_again,
    staged_folder,
)
from patina.core.output_folder.publication import PLAN, READY, RECORD

NAMES = ("result.json", "steel.binary", "scene.blend", "report/index.html", "report/a/b.png")


@pytest.fixture(autouse=True)
def short_wait(monkeypatch):
    monkeypatch.setattr(folder_lock, "MAX_WAIT", 20.0)


class Killed(BaseException):
    """Stands for the end of the process."""


def write(out: Path, content: str, names=NAMES, owner: str | None = "fit", say=lambda s: None):
    with staged_folder(out, owner, say) as staging:
        for name in names:
            (staging / name).parent.mkdir(parents=True, exist_ok=True)
            (staging / name).write_text(f"{content} {name}", "utf-8")


def files(out: Path) -> dict[str, str]:
    """Contents of the visible files."""
    found = {}
    for path in sorted(out.rglob("*")):
        name = path.relative_to(out).as_posix()
        if path.is_file() and name not in (RECORD, folder_lock.LOCK):
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
    with pytest.raises(RuntimeError), staged_folder(out, "fit") as staging:
        (staging / "result.json").write_text("half")
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
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(folder, "MIN_AGE", -1.0)
        write(out, "third")  # and nothing is left of the killed process
    assert {p.name for p in out.iterdir() if p.name.startswith(".patina")} == {RECORD}
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
    assert not (out / "result.json").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="links need a permission on Windows")
@pytest.mark.parametrize("plan", [
    '{"known": {}, "remove": {"../mine.txt": "0"}}',
    '{"known": {"/tmp/x": "0"}, "remove": {}}',
    "[]", "{", '{"known": 1}', "[" * 100_000,
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
    (out / READY / PLAN).write_text(plan)
    with pytest.raises(InputError, match="cannot be moved to its place"):
        complete_publication(out)
    assert (other / "mine.txt").is_file() and (tmp_path / "mine.txt").is_file()
    assert not (tmp_path / "a.txt").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="links need a permission on Windows")
def test_link_of_a_stranger_is_not_followed(tmp_path):
    out, other = tmp_path / "out", tmp_path / "other"
    out.mkdir()
    write(other, "mine", ["a.txt"])
    (other / PLAN).write_text('{"known": {}, "remove": {}}')
    (out / READY).symlink_to(other, target_is_directory=True)
    with pytest.raises(InputError, match="it is no folder"):
        complete_publication(out)
    assert (other / "a.txt").is_file() and (other / PLAN).is_file()
    (out / READY).unlink()
    os.mkfifo(out / RECORD)
    (out / "report").mkdir()
    content = hashlib.blake2b(b"mine").hexdigest()[:32]
    (other / "old.txt").write_text("mine")
    write(out, "first")  # the pipe is no record
    record = json.loads((out / RECORD).read_text())
    record["gone/old.txt"] = {"owner": "fit", "content": content}
    (out / RECORD).write_text(json.dumps(record))
    (out / "gone").symlink_to(other, target_is_directory=True)
    write(out, "second")
    assert (other / "old.txt").is_file()
    assert files(out)["result.json"] == "second result.json"


def test_file_changed_after_the_publication_is_kept(tmp_path, monkeypatch):
    """The rest of a publication may be done days later."""
    out = tmp_path / "out"
    write(out, "first")
    real = os.replace

    def locked(source, target):
        if Path(source).name == "scene.blend":
            raise PermissionError(13, "is open in another program", str(source))
        return real(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", locked)
        with pytest.raises(InputError, match="holds a complete result"):
            write(out, "second")
    (out / "scene.blend").write_text("painted meanwhile")
    complete_publication(out)
    assert files(out) == {**expected("second"), "earlier-1/scene.blend": "painted meanwhile"}


def test_result_that_cannot_be_moved_is_not_lost(tmp_path):
    out = tmp_path / "out"
    (out / "result.json").mkdir(parents=True)
    with pytest.raises(
        InputError, match=r"is a folder that blocks.*the complete result is in"
    ) as e:
        write(out, "first")
    kept = Path(str(e.value).rpartition(" in ")[2])
    assert files(kept) == expected("first")


def test_change_of_case_removes_nothing(tmp_path):
    out = tmp_path / "out"
    write(out, "first", ["steel.binary"])
    write(out, "second", ["Steel.binary"])
    assert files(out)["Steel.binary"] == "second Steel.binary"


def test_file_that_patina_changed_itself_is_not_the_users(tmp_path):
    out, said = tmp_path / "out", []
    write(out, "first")
    page = out / "report" / "index.html"
    page.write_text("with pictures")
    record_again(out, page)
    write(out, "second", say=said.append)
    assert not said and files(out) == expected("second")


def test_files_of_another_owner_stay(tmp_path):
    out = tmp_path / "out"

    def owner(name):
        return "refit" if name == "result.json" else "maps"

    write(out, "first", ["maps.json", "old.exr", "result.json"], owner)
    write(out, "second", ["maps.json"], owner)
    assert set(files(out)) == {"maps.json", "result.json"}


def test_live_staging_folder_is_not_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "MIN_AGE", -1.0)
    out = tmp_path / "out"
    out.mkdir()
    with staged_folder(out, "fit") as first:
        (first / "a.txt").write_text("a")
        write(out, "other")
        assert (first / "a.txt").is_file()
    assert files(out)["a.txt"] == "a"


def test_folder_that_is_locked_for_ever_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(folder_lock, "MAX_WAIT", 0.2)
    out = tmp_path / "out"
    out.mkdir()
    held = folder_lock.lock_folder(out)
    with pytest.raises(InputError, match=r"another process has been writing"):
        write(out, "first")
    held.close()
    write(out, "second")
    assert not (out / folder_lock.LOCK).exists()


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
