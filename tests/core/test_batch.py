"""A command over a collection: objects, limits, resuming, a cluster that dies, the page, farms."""

from __future__ import annotations

import json
import os
import random
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from patina.commands import command_line
from patina.core.batch import remote
from patina.core.batch.cluster import Limits
from patina.core.batch.collection import Item, read_collection
from patina.core.batch.farm_files import write_openjd
from patina.core.batch.page import write_page
from patina.core.batch.record import finished, input_hash
from patina.core.batch.rig_errors import common_mean, rig_errors
from patina.core.batch.summary import FAILED, FINISHED, Cause, Summary
from patina.core.errors import InputError
from patina.core.output_folder import only_writer
from tools.faults.killed_cluster import KilledCluster

pytest.importorskip("distributed")
FAKE = Path(__file__).parents[1] / "fake_command.py"
PROGRAM = shlex.join([sys.executable, str(FAKE)])


def collection(folder: Path, **texts: str) -> Path:
    """A folder with a capture file for each text."""
    for name, text in texts.items():
        (folder / name).mkdir(parents=True)
        (folder / name / "shot.capture.toml").write_text(f"# {name}\n{text}\n")
    return folder


def runs(path: Path, name: str) -> list[str]:
    """What the fake command has logged of an object."""
    return (path / name / "runs.txt").read_text().split()


def batch(path: Path, out: Path, *more: object) -> int:
    words = ["batch", path, "--out", out, "--program", PROGRAM, "--workers", 2, *more]
    return command_line.main([str(word) for word in words])


def test_folder_list_and_table_name_the_same_objects(tmp_path):
    path = collection(tmp_path / "all", vase="", bowl="")
    (path / "bowl" / "second.capture.toml").write_text("")
    names = [item.name for item in read_collection(path)]
    assert names == ["bowl-second", "bowl-shot", "vase"]
    listed = tmp_path / "list.txt"
    listed.write_text("# museum\nall/vase/shot.capture.toml\n\nall/bowl/second.capture.toml\n")
    assert [item.name for item in read_collection(listed)] == ["second", "shot"]
    table = tmp_path / "table.csv"
    table.write_text(
        "\ufeffcapture,name,session\nall/vase/shot.capture.toml,Vase 3/7,monday\n"
        "all/bowl/shot.capture.toml,,\n"
    )
    items = read_collection(table)
    assert [(item.name, item.session) for item in items] == [("Vase 3_7", "monday"), ("shot", "")]
    tabs = tmp_path / "table.tsv"
    tabs.write_text("name\tcapture\tsession\n\tall/vase/shot.capture.toml\tmonday\n")
    (item,) = read_collection(tabs)
    assert (item.name, item.session) == ("shot", "monday"), "an empty first cell"
    assert items[0].capture == (path / "vase" / "shot.capture.toml").resolve()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", "file\nx.toml\n", "has the columns file; expected capture"),
        ("a.csv", "capture,name\n,vase\n", "line 2 names no capture"),
        ("a.csv", "capture,name\na.toml,Vase\nb.toml,vase\n", "two objects with the name"),
        ("a.txt", "\n", "holds no captures"),
        ("a.csv", "capture,name\na.toml,../..\nb.toml,.\n", "two objects|object"),
    ],
)
def test_wrong_collections_are_refused(name, content, message, tmp_path):
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=message):
        items = read_collection(tmp_path / name)
        # names of folders stay within the folder of the batch
        assert all(item.name not in {"", ".", ".."} and "/" not in item.name for item in items)
        raise InputError("object names are folders")


def test_every_object_runs_once_and_finished_ones_are_not_run_again(tmp_path, capsys):
    path = collection(
        tmp_path / "all", one="", two="", bad="wrong", crash="crash", flaky="flaky"
    )  # fmt: skip
    out = tmp_path / "out"
    assert batch(path, out) == 2
    assert "2 objects failed (bad, crash)" in capsys.readouterr().err
    assert runs(path, "one") == ["started", "finished"]
    assert runs(path, "bad") == ["started"] * 2
    assert runs(path, "crash") == ["started"] * 2
    assert runs(path, "flaky") == ["started", "started", "finished"]
    table = (out / "collection.csv").read_text()
    assert "bad,,failed" in table and "the capture is wrong" in table and "SIGABRT" not in table
    (path / "crash" / "shot.capture.toml").write_text("mended")
    (path / "two" / "shot.capture.toml").write_text("changed")
    (path / "bad" / "shot.capture.toml").write_text("mended")
    assert batch(path, out) == 0
    assert runs(path, "one") == ["started", "finished"], "finished before"
    assert runs(path, "two").count("finished") == 2, "its capture has changed"
    (out / "one" / "result.json").unlink()
    assert batch(path, out) == 0
    assert runs(path, "one").count("finished") == 2, "its result was deleted"


def test_limits_of_time_and_memory_stop_a_process(tmp_path, capsys):
    path = collection(tmp_path / "all", slow="slow", large="large", small="")
    assert batch(path, tmp_path / "out", "--time", 3, "--memory", 0.3, "--attempts", 1) == 2
    table = (tmp_path / "out" / "collection.csv").read_text()
    assert "takes more than 3 seconds" in table and "needs more than 0.3 GB" in table
    assert "small,,finished" in table
    started = [line for line in table.splitlines() if line.startswith("large")]
    assert len(started) == 1


def test_a_process_does_not_inherit_how_dask_frees_memory(tmp_path, monkeypatch):
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "65536")  # as Dask sets it for its workers
    monkeypatch.setenv("PATINA_TEST_INHERITED", "1")
    names = ["OWN", "PATINA_TEST_INHERITED", "MALLOC_TRIM_THRESHOLD_"]
    code = f"import os, sys; sys.exit(' '.join(n for n in {names} if n in os.environ))"
    place = str(tmp_path / "a")
    ended = remote.run_process(
        [sys.executable, "-c", code], {"OWN": "1"}, place, f"{place}.json", "", 1, 0.0, 0.0
    )
    assert ended["message"] == "OWN PATINA_TEST_INHERITED"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_lost_workers_and_schedulers_cost_no_result(tmp_path):
    count = 40
    path = collection(tmp_path / "all", **{f"object{k:02d}": "pause" for k in range(count)})
    root = FAKE.parents[1]
    with KilledCluster(tmp_path / "x") as cluster:
        command = [sys.executable, root / "headless.py", "batch", path, "--out", tmp_path / "out",
                   "--program", PROGRAM, "--scheduler", cluster.address]  # fmt: skip
        code, said = cluster.run([str(w) for w in command], random.Random(0), 6, (2, 5), 240)
        kills = cluster.kills
    assert code == 0, said
    assert kills >= 3, "a scheduler and two workers"
    table = (tmp_path / "out" / "collection.csv").read_text()
    assert table.count(",finished,") == count, "every object exactly once"
    # only a process that ended at the moment at which its worker was killed runs again
    again = sum(runs(path, f"object{k:02d}").count("finished") - 1 for k in range(count))
    assert again <= kills
    for k in range(count):
        name = f"object{k:02d}"
        content = json.loads((tmp_path / "out" / name / "result.json").read_text())
        assert content["text"].startswith(f"# {name}")


def test_a_record_of_other_inputs_or_of_a_damaged_result_does_not_count(tmp_path):
    path = collection(tmp_path / "all", one="")
    out = tmp_path / "out"
    assert batch(path, out) == 0
    (record,) = out.glob("*.batch.json")
    inputs = json.loads(record.read_text())["inputs"]
    assert finished(out, "one", inputs) is not None
    assert finished(out, "one", "other") is None
    for damage in ("", "[]", '{"inputs": 3}', "\xff"):
        record.write_text(damage)
        assert finished(out, "one", inputs) is None
    capture = path / "one" / "shot.capture.toml"
    first = input_hash(capture, ["fit"], "1")
    assert first == input_hash(capture, ["fit"], "1") != input_hash(capture, ["fit"], "2")
    capture.write_text("other")
    assert input_hash(capture, ["fit"], "1") != first


def test_two_batches_at_once_are_refused_and_unfinished_files_are_removed(tmp_path, capsys):
    path = collection(tmp_path / "all", one="")
    out = tmp_path / "out"
    out.mkdir()
    old, new = out / "one.batch.json.0123.part", out / "collection.html.4567.part"
    for file in (old, new):
        file.write_text("half")
    os.utime(old, (0, 0))
    with only_writer(out):
        assert batch(path, out) == 2
    assert "another process is writing to it" in capsys.readouterr().err
    assert batch(path, out) == 0
    assert new.is_file() and not old.exists(), "another process may be writing the new one"
    assert not list(out.glob(".patina-lock"))


def test_unfinished_results_are_removed_from_folders_of_finished_objects(tmp_path):
    path, out = collection(tmp_path / "all", one=""), tmp_path / "out"
    assert batch(path, out) == 0
    left = [out / ".patina-part-01234567", out / "one" / ".patina-part-89abcdef"]
    for folder in left:
        folder.mkdir(parents=True)
        (folder / "half").write_text("half")
        os.utime(folder, (0, 0))
    assert batch(path, out) == 0
    assert not any(folder.exists() for folder in left)


def diagnosed(name: str, value: float, error: float, named: bool = True) -> Summary:
    cause = Cause("light_direction", named, {"tilt": (value, error, "rad")})
    return Summary(Item(name, Path(name), "monday"), FINISHED, causes=(cause,))


def test_a_cause_of_all_objects_is_an_error_of_the_rig():
    rng = np.random.default_rng(0)
    common = [diagnosed(f"o{k}", 0.03 + rng.normal(0, 0.002), 0.002) for k in range(8)]
    (found,) = rig_errors(common)
    assert found.objects == found.of == 8 and "Wrong Light Direction" in found.sentence
    assert abs(found.values[0].value - 0.03) < 3 * found.values[0].error < 0.01
    # of another sign in each object: an error of the objects, or of their scans
    varied = [diagnosed(f"o{k}", 0.03 * (-1) ** k, 0.002) for k in range(8)]
    assert not rig_errors(varied)
    assert not rig_errors(common[:2]), "two may agree by chance"
    # a parameter of one object says nothing about the others
    cause = Cause(
        "light_direction", True, {"tilt": (0.0, 0.01, "rad"), "photo 39": (0.4, 0.02, "")}
    )
    alone = Summary(Item("own", Path("own"), "monday"), FINISHED, causes=(cause,))
    (found,) = rig_errors([alone, *common])
    assert [one.name for one in found.values] == ["tilt"]
    few = [*common[:3], *(diagnosed(f"n{k}", 0.0, 0.002, named=False) for k in range(5))]
    assert not rig_errors(few), "most objects do not have it"


def test_common_mean_has_the_right_error_with_and_without_differences():
    rng = np.random.default_rng(1)
    for between in (0.0, 0.5):
        pulls = []
        for _ in range(400):
            errors = rng.uniform(0.1, 0.4, 20)
            values = 1.0 + rng.normal(0, between, 20) + rng.normal(0, errors)
            mean, error, _ = common_mean(values, errors)
            pulls.append((mean - 1.0) / error)
        assert 0.85 < np.std(pulls) < 1.2


def test_page_and_table_run_nothing_of_a_stranger(tmp_path):
    hostile = "<script>alert(1)</script>"
    item = Item("=HYPERLINK(1)", tmp_path / f"{hostile}.toml", hostile)
    failed = Summary(item, FAILED, error=hostile, attempts=2)
    done = Summary(
        Item("vase", tmp_path), FINISHED, ("clay",), 0.04, 0.5,
        causes=(Cause("near_light", True, {}),), sphere="a%20b.png", report="r.html",
        warnings=(hostile,),
    )  # fmt: skip
    write_page(tmp_path, [done, failed], running=True)
    page = (tmp_path / "collection.html").read_text()
    assert "<script" not in page and "1 of 2 objects finished" in page and "refresh" in page
    assert page.index("HYPERLINK") < page.index("vase"), "what failed is shown first"
    table = (tmp_path / "collection.csv").read_text()
    assert "'=HYPERLINK" in table and "Near Light" in table
    write_page(tmp_path, [done], running=False)
    assert "refresh" not in (tmp_path / "collection.html").read_text()


def test_openjd_template_is_valid_and_runs(tmp_path):
    pytest.importorskip("openjd.cli")
    path = collection(tmp_path / "all", **{"one": "", "it's": ""})
    assert batch(path, tmp_path / "out", "--to", "openjd", "--memory", 2, "--time", 60) == 0
    template = tmp_path / "out" / "patina.openjd.json"
    tool = [sys.executable, "-m", "openjd.cli"] if not shutil.which("openjd") else ["openjd"]
    own = Path(sys.executable).with_name("openjd")
    tool = [str(own)] if own.is_file() else tool
    checked = subprocess.run([*tool, "check", template], capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    done = subprocess.run(
        [*tool, "run", template, "--step", "Objects 1"], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stdout + done.stderr
    for name in ("one", "it_s"):
        assert (tmp_path / "out" / name / "result.json").is_file()
    assert batch(path, tmp_path / "out") == 0
    assert runs(path, "one") == ["started", "finished"], "the result of the task is known"
    many = write_openjd(tmp_path, [f"o{k}" for k in range(2500)], ["true"], Limits())
    checked = subprocess.run([*tool, "check", many], capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    with pytest.raises(InputError, match="rename it"):
        write_openjd(tmp_path, ["a"], ["fit", "/x/{{y}}/a.toml"], Limits())


def test_flamenco_job_type_makes_a_task_for_each_object(tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    path = collection(tmp_path / "all", one="", two="")
    assert batch(path, tmp_path / "out", "--to", "flamenco") == 0
    script = (tmp_path / "out" / "patina_batch.js").read_text()
    stub = """
    const tasks = [];
    const author = {
      Task: (name, type) => ({name, type, commands: [], addCommand(c) { this.commands.push(c); }}),
      Command: (name, parameters) => ({name, parameters}),
    };
    """
    after = (
        "compileJob({addTask: t => tasks.push(t)}); console.log(JSON.stringify([JOB_TYPE, tasks]));"
    )
    done = subprocess.run([node, "-e", stub + script + after], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    kind, tasks = json.loads(done.stdout)
    assert kind["label"] == "Patina Batch"
    assert [task["name"] for task in tasks] == ["one", "two"]
    (command,) = tasks[0]["commands"]
    assert command["name"] == "exec"
    words = [command["parameters"]["exe"], *command["parameters"]["args"]]
    assert subprocess.run(words).returncode == 0
    assert (tmp_path / "out" / "one" / "result.json").is_file()
