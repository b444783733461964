"""Operators on a window's timer, stepped by hand: duration of a tick, and state after ESC."""

from __future__ import annotations

import os
import signal
import threading
import time
from types import SimpleNamespace

import bpy
from support import extension, without_window
from test_workflow import counts, folder, make_capture_module

TIMER, ESC = SimpleNamespace(type="TIMER"), SimpleNamespace(type="ESC")
MOUSE = SimpleNamespace(type="MOUSEMOVE")


def import_ball() -> None:
    """A small capture of one material, which takes a quarter of the demo's time."""
    path = make_capture_module().make_capture(
        folder() / "ball", photos=3, extra="[fit]\nheld_out = false"
    )
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}


def begun(module: str, name: str):
    """Start the operator, to be ticked."""
    operator = getattr(extension(f"operators.{module}"), name)
    return without_window(operator, replace=False, count=0)


def tick_durations(operator) -> list[float]:
    """Seconds of every tick, to the end."""
    ticks = []
    while True:
        time.sleep(operator.TICK)
        since = time.perf_counter()
        answer = operator.modal(bpy.context, TIMER)
        ticks.append(time.perf_counter() - since)
        if answer != {"RUNNING_MODAL"}:
            assert answer == {"FINISHED"}
            return ticks


def test_fit_by_timer_equals_fit_by_script() -> None:
    import_ball()
    running = extension("scene.session.running_job").running
    ticks = tick_durations(begun("fit", "PATINA_OT_fit"))
    measured = extension("scene.scan.apply_result").measured_materials
    stepped = {m.name: list(m["patina_coefficients"]) for m in measured()}
    assert running(bpy.context.scene) is None and stepped
    # one step in a hundred may be slow on a busy machine
    assert sorted(ticks)[int(0.99 * len(ticks)) - 1] < 0.1, sorted(ticks)[-10:]
    assert bpy.ops.patina.fit() == {"FINISHED"}
    assert {m.name: list(m["patina_coefficients"]) for m in measured()} == stepped


def test_no_job_starts_a_thread_in_the_process_of_blender() -> None:
    """A Python thread that runs while Blender changes its data can crash it."""
    assert bpy.ops.patina.import_demo() == {"FINISHED"}
    started, start = [], threading.Thread.start

    def record(thread: threading.Thread) -> None:
        started.append(thread.name)
        start(thread)

    threading.Thread.start = record
    try:
        assert bpy.ops.patina.propose_materials() == {"FINISHED"}
        assert bpy.ops.patina.shadow_masks(replace=True) == {"FINISHED"}
        assert bpy.ops.patina.fit() == {"FINISHED"}
        assert bpy.ops.patina.show_chart(kind="sphere") == {"FINISHED"}
    finally:
        threading.Thread.start = start
    assert not started


def test_a_killed_process_is_one_sentence_and_changes_nothing() -> None:
    import_ball()
    before = counts()
    operator = begun("fit", "PATINA_OT_fit")
    while operator._child.now.stage in ("", "Starting"):
        time.sleep(operator.TICK)
        assert operator.modal(bpy.context, TIMER) == {"RUNNING_MODAL"}
    os.kill(operator._child.process_id, getattr(signal, "SIGKILL", signal.SIGTERM))
    while (answer := operator.modal(bpy.context, TIMER)) == {"RUNNING_MODAL"}:
        time.sleep(operator.TICK)
    assert answer == {"CANCELLED"} and counts() == before
    (sentence,) = operator.reports
    assert "ended" in sentence and "nothing was changed" in sentence and "\n" not in sentence
    assert bpy.ops.patina.fit() == {"FINISHED"}


def test_esc_leaves_file_unchanged() -> None:
    assert bpy.ops.patina.import_demo() == {"FINISHED"}
    before, running = counts(), extension("scene.session.running_job").running
    for module, name in (
        ("fit", "PATINA_OT_fit"),
        ("masks", "PATINA_OT_propose_materials"),
        ("masks", "PATINA_OT_shadow_masks"),
    ):
        operator = begun(module, name)
        while operator._child.now.stage in ("", "Starting"):
            time.sleep(operator.TICK)
            assert operator.modal(bpy.context, TIMER) == {"RUNNING_MODAL"}
        assert operator.modal(bpy.context, MOUSE) == {"PASS_THROUGH"}
        assert running(bpy.context.scene) is not None
        since = time.perf_counter()
        assert operator.modal(bpy.context, ESC) == {"CANCELLED"}
        assert time.perf_counter() - since < 0.2
        assert running(bpy.context.scene) is None and counts() == before


def test_events_are_blocked_while_result_is_applied() -> None:
    assert bpy.ops.patina.import_demo() == {"FINISHED"}
    operator = begun("masks", "PATINA_OT_propose_materials")
    while operator._applying is None:
        time.sleep(operator.TICK)
        assert operator.modal(bpy.context, TIMER) == {"RUNNING_MODAL"}
    assert operator.modal(bpy.context, ESC) == {"RUNNING_MODAL"}
    assert operator.modal(bpy.context, TIMER) == {"FINISHED"}
    assert len(bpy.context.scene.patina.mesh.material_slots) == 2
