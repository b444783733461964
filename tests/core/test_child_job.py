"""Jobs in a child process: results, references to kept results, errors, ends of every kind."""

from __future__ import annotations

import gc
import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import patina
from patina.core.basis import default_basis
from patina.core.child_process import ChildJob
from patina.core.child_process.object_files import read_object, write_object
from patina.core.child_process.python_command import ROOT, python_environment
from patina.core.errors import PatinaError
from patina.core.jobs import FitJob, finished
from patina.core.jobs.refit_job import RefitJob
from patina.core.report.report_job import ReportJob

linux = pytest.mark.skipif(sys.platform != "linux", reason="signals and /proc of Linux")


def small_fit(**options) -> FitJob:
    capture = patina.select_photos(patina.load_capture(patina.DEMO_CAPTURE), range(4))
    quick = replace(capture.fit, method="paper", held_out=False)
    capture = replace(capture, fit=quick)
    return FitJob(capture, **{"portable": False, **options})


def run(child: ChildJob) -> float:
    """Step the job to its end; returns the longest step in seconds."""
    longest = 0.0
    while True:
        start = time.perf_counter()
        more = child.step()
        longest = max(longest, time.perf_counter() - start)
        if not more:
            return longest
        time.sleep(0.01)


def alive(process_id: int) -> bool:
    try:
        state = Path(f"/proc/{process_id}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


@pytest.fixture(scope="module")
def fitted(tmp_path_factory) -> tuple[FitJob, Path, float]:
    """(the job that ran in a child, folder of its files, longest step)"""
    folder = tmp_path_factory.mktemp("children")
    default_basis()
    child = ChildJob(small_fit(portable=True), folder)
    longest = run(child)
    return child.result, folder, longest


def test_a_child_finds_the_result_of_this_process_and_never_blocks_it(fitted):
    job, _, longest = fitted
    own = small_fit()
    own.drain()
    found, expected = finished(job.result), finished(own.result)
    for one, other in zip(found.materials, expected.materials, strict=True):
        np.testing.assert_array_equal(one.fit.brdf.coefficients, other.fit.brdf.coefficients)
    np.testing.assert_array_equal(found.face_material, expected.face_material)
    assert {stage.name for stage in own.stages} < {stage.name for stage in job.stages}
    assert longest < 0.1, "seconds"
    assert found.basis is default_basis(), "the embedded basis is not copied"
    # the ray tracer is built again where it is used
    start, along = np.zeros(3), np.eye(3)
    for one, other in zip(
        found.rays.first_hits(start, along), expected.rays.first_hits(start, along), strict=True
    ):
        np.testing.assert_array_equal(one, other)


def test_a_kept_result_is_read_by_the_next_child_and_not_copied(fitted, tmp_path):
    job, folder, _ = fitted
    before = set(folder.iterdir())
    child = ChildJob(ReportJob(finished(job.result), tmp_path), folder)
    (request,) = set(folder.iterdir()) - before
    assert sum(file.stat().st_size for file in request.iterdir()) < 10_000, "bytes"
    run(child)
    assert (tmp_path / "index.html").is_file()
    assert child.result.fit is job.result


def test_files_are_deleted_with_the_objects(tmp_path):
    child = ChildJob(small_fit(), tmp_path)
    run(child)
    rays = finished(child.result.result).rays
    assert any(tmp_path.iterdir())
    del child
    gc.collect()
    assert any(tmp_path.iterdir()), "an object of the folder is in use"
    vertices = rays.mesh.vertices
    del rays
    gc.collect()
    assert not any(tmp_path.iterdir())
    assert np.isfinite(vertices).all(), "arrays outlive their files"


def test_objects_that_change_in_the_child_are_written_anew(tmp_path):
    """A job in the request has no result; its answer must not refer to that state."""
    from patina.core.jobs.diagnose_job import DiagnoseJob

    again = RefitJob(DiagnoseJob(small_fit()))
    write_object(tmp_path / "request", again)
    copy = read_object(tmp_path / "request", changes=True)
    copy.checked.separate = True
    write_object(tmp_path / "answer", copy)
    assert read_object(tmp_path / "answer").checked.separate


def test_arrays_of_a_file_can_be_changed_without_changing_the_file(tmp_path):
    write_object(tmp_path / "one", {"values": np.arange(1000.0), "empty": np.zeros((0, 3))})
    first = read_object(tmp_path / "one")
    first["values"][:] = 7
    second = read_object(tmp_path / "one")
    np.testing.assert_array_equal(second["values"], np.arange(1000.0))
    assert second["empty"].shape == (0, 3)
    (tmp_path / "one.object").write_bytes(b"\x80\x05")
    with pytest.raises((EOFError, pickle.UnpicklingError)):
        read_object(tmp_path / "one")


@pytest.mark.parametrize(
    ("basis", "expected"),
    [
        (partial(bytearray, 1 << 60), "The memory was not sufficient; nothing was changed"),
        (partial(int, "seven"), "An error in Patina ended the job .ValueError: .*'seven'"),
        (partial(os._exit, 3), "ended unexpectedly .exit code 3."),
        pytest.param(
            partial(signal.raise_signal, signal.SIGSEGV),
            "ended unexpectedly .SIGSEGV.",
            marks=linux,
        ),
        pytest.param(
            partial(os.kill, 0, 0) if sys.platform == "win32" else partial(
                signal.raise_signal, getattr(signal, "SIGKILL", 9)
            ),
            "The system ended the process of this job .SIGKILL., most often because memory ran out",
            marks=linux,
        ),
    ],
)  # fmt: skip
def test_every_end_of_a_child_is_one_sentence(basis: Callable, expected: str, tmp_path):
    child = ChildJob(small_fit(basis=basis), tmp_path)
    with pytest.raises(PatinaError, match=expected) as caught:
        run(child)
    assert "\n" not in str(caught.value)
    assert not any(tmp_path.iterdir()), "no file is left"


def test_errors_of_the_job_are_those_of_this_process(tmp_path):
    capture = patina.load_capture(patina.DEMO_CAPTURE)
    photos = (replace(capture.photos[0], files=(tmp_path / "gone.exr",)), *capture.photos[1:])
    job = FitJob(replace(capture, photos=photos))
    with pytest.raises(PatinaError) as own:
        job.drain()
    with pytest.raises(PatinaError) as other:
        run(ChildJob(FitJob(replace(capture, photos=photos)), tmp_path))
    assert str(other.value) == str(own.value)


@linux
@pytest.mark.parametrize("hangs", [False, True])
def test_a_cancelled_child_ends_within_a_second(hangs, tmp_path):
    child = ChildJob(small_fit(basis=partial(time.sleep, 60) if hangs else None), tmp_path)
    while child.now.stage in ("", "Starting"):
        child.step()
        time.sleep(0.01)
    start = time.perf_counter()
    child.request_end()
    assert time.perf_counter() - start < 0.05, "Blender does not wait"
    while not child.ended():
        time.sleep(0.01)
    assert time.perf_counter() - start < 1.5 and not alive(child.process_id)
    assert not any(tmp_path.iterdir()), "no file is left"


@linux
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_child_ends_with_its_parent(number, tmp_path):
    code = f"""
import sys, time
from functools import partial
from pathlib import Path
import importlib
name = {ROOT.name!r}
children = importlib.import_module(name + ".core.child_process")
jobs = importlib.import_module(name + ".core.jobs")
package = importlib.import_module(name)
capture = package.load_capture(package.DEMO_CAPTURE)
job = jobs.FitJob(capture, basis=partial(time.sleep, 60))
child = children.ChildJob(job, Path({str(tmp_path)!r}))
while child.now.stage != "computing the basis":
    child.step(); time.sleep(0.02)
print(child.process_id, flush=True)
time.sleep(60)
"""
    parent = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, env=python_environment()
    )
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    assert alive(child)
    parent.send_signal(number)
    parent.wait(10)
    until = time.monotonic() + 1.5
    while alive(child) and time.monotonic() < until:
        time.sleep(0.02)
    assert not alive(child)
    parent.stdout.close()


@linux
def test_memory_that_runs_out_ends_the_child_before_its_parent(tmp_path):
    child = ChildJob(small_fit(basis=partial(time.sleep, 60)), tmp_path)
    while child.now.stage in ("", "Starting"):
        child.step()
        time.sleep(0.01)
    score = int(Path(f"/proc/{child.process_id}/oom_score_adj").read_text())
    assert score > int(Path("/proc/self/oom_score_adj").read_text())
    assert os.getpriority(os.PRIO_PROCESS, child.process_id) > os.getpriority(os.PRIO_PROCESS, 0)
    child.end()
