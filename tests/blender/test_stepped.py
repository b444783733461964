"""Operators on a window's timer, stepped by hand: duration of a tick, and state after ESC."""

from __future__ import annotations

import time
from types import SimpleNamespace

import bpy
from support import extension, without_window
from test_workflow import counts

TIMER, ESC = SimpleNamespace(type="TIMER"), SimpleNamespace(type="ESC")
MOUSE = SimpleNamespace(type="MOUSEMOVE")


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
    assert bpy.ops.patina.import_demo() == {"FINISHED"}
    running = extension("scene.session.running_job").running
    ticks = tick_durations(begun("fit", "PATINA_OT_fit"))
    measured = extension("scene.scan.apply_result").measured_materials
    stepped = {m.name: list(m["patina_coefficients"]) for m in measured()}
    assert running(bpy.context.scene) is None and stepped
    # one step in a hundred may be slow on a busy machine
    assert sorted(ticks)[int(0.99 * len(ticks)) - 1] < 0.1
    assert bpy.ops.patina.fit() == {"FINISHED"}
    assert {m.name: list(m["patina_coefficients"]) for m in measured()} == stepped


def test_esc_leaves_file_unchanged() -> None:
    assert bpy.ops.patina.import_demo() == {"FINISHED"}
    before, running = counts(), extension("scene.session.running_job").running
    for module, name in (
        ("fit", "PATINA_OT_fit"),
        ("masks", "PATINA_OT_propose_materials"),
        ("masks", "PATINA_OT_shadow_masks"),
    ):
        operator = begun(module, name)
        for _ in range(10):
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
