"""Measure how long Blender blocks: the longest tick of each stepped operator, on the demo.

In a window, a timer calls `modal` once per tick. This benchmark calls it in the same way, without a
window. Between ticks Blender can redraw.
"""

from __future__ import annotations

import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np

OPERATORS = ("fit", "check", "refit", "propose_materials", "shadow_masks")
"""Masks are last, because they change what is fitted."""
MODULES = {"fit": "fit", "check": "check", "refit": "check"}
PROPERTIES = {"count": 0, "replace": True}


def run(data: Path) -> None:
    """Print the table of docs/guide/sidebar.md. data: not used."""
    import bpy

    from .package import load_patina

    bpy.ops.wm.read_homefile(use_factory_startup=True)
    patina = load_patina()
    patina.register()
    try:
        bpy.ops.patina.import_demo()
        print(
            "| operator | duration | start | a tick during the job: median, 99th percentile, "
            "longest | writing the result: ticks, longest |\n|---|---|---|---|---|"
        )
        for name in OPERATORS:
            print(_row(name), flush=True)
    finally:
        patina.unregister()


def _row(name: str) -> str:
    """Run one operator from its start to its end; return its row."""
    import importlib

    import bpy

    from tests.blender.support import without_window

    module = importlib.import_module(f"patina.operators.{MODULES.get(name, 'masks')}")
    context, timer = bpy.context, SimpleNamespace(type="TIMER")
    press = time.perf_counter()
    operator = without_window(getattr(module, f"PATINA_OT_{name}"), **PROPERTIES)
    start_seconds = time.perf_counter() - press
    job_ticks: list[float] = []
    result_ticks: list[float] = []
    answer = {"RUNNING_MODAL"}
    while answer == {"RUNNING_MODAL"}:
        time.sleep(operator.TICK)
        ticks = job_ticks if operator._applying is None else result_ticks
        tick_start = time.perf_counter()
        answer = operator.modal(context, timer)
        ticks.append(time.perf_counter() - tick_start)
    total_seconds = time.perf_counter() - press
    median, percentile_99 = np.quantile(job_ticks, (0.5, 0.99))
    return (
        f"| {name} | {total_seconds:.1f} s | {start_seconds:.3f} s | {median:.3f} s, "
        f"{percentile_99:.3f} s, {max(job_ticks):.3f} s "
        f"| {len(result_ticks)}, {max(result_ticks):.3f} s |"
    )
