"""How long Blender stands still: the longest tick of each operator that runs in steps, on the demo.

A window's timer calls `modal` once a tick; so does this, with the operators' own code and without a
window. Between ticks Blender is free to draw.
"""

from __future__ import annotations

import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np

OPERATORS = ("fit", "check", "refit", "propose_materials", "shadow_masks")
"""Masks last: they change what is fitted."""
MODULES = {"fit": "fit", "check": "check", "refit": "check"}
PROPERTIES = {"count": 0, "replace": True}


def run(data: Path) -> None:
    """Print the table of docs/guide/sidebar.md. data: not looked at."""
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
    """One operator, from its press to its end."""
    import importlib

    import bpy

    from tests.blender.support import without_window

    module = importlib.import_module(f"patina.operators.{MODULES.get(name, 'masks')}")
    context, timer = bpy.context, SimpleNamespace(type="TIMER")
    since = time.perf_counter()
    operator = without_window(getattr(module, f"PATINA_OT_{name}"), **PROPERTIES)
    begun = time.perf_counter() - since
    going: list[float] = []
    taking: list[float] = []
    answer = {"RUNNING_MODAL"}
    while answer == {"RUNNING_MODAL"}:
        time.sleep(operator.TICK)
        ticks = going if operator._taking is None else taking
        moment = time.perf_counter()
        answer = operator.modal(context, timer)
        ticks.append(time.perf_counter() - moment)
    took = time.perf_counter() - since
    half, most = np.quantile(going, (0.5, 0.99))
    return (
        f"| {name} | {took:.1f} s | {begun:.3f} s | {half:.3f} s, {most:.3f} s, {max(going):.3f} s "
        f"| {len(taking)}, {max(taking):.3f} s |"
    )
