"""Blender script: the process of a fit is ended in a real window, in four ways: by SIGKILL, by a
limit of its memory, by ESC, and by the end of Blender itself.

blender --factory-startup --addons bl_ext.user_default.patina -P tools/window/ended_process.py \
    -- OUT
Writes a screenshot of what Blender says after each, and `ended.json` with the seconds, and checks
that the file is as before and that the next fit works. (`.ci/real_blender.sh ended DIR OUT` runs it
on a virtual screen, and fails if it fails.)
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

import bpy

OUT = Path(sys.argv[sys.argv.index("--") + 1])
PACKAGE = "bl_ext.user_default.patina"
TIMEOUT = 600  # seconds for the whole script
REDRAW_DELAY = 2.0  # seconds after which a window has been redrawn
LOOK_INTERVAL = 0.02  # seconds between two looks at a process
MEMORY_LIMIT = 200 << 20  # bytes of address space: less than the process has already
MAX_END_SECONDS = 1.0  # within which a child ends
UNHARMED = ("materials", "meshes", "objects", "images", "cameras", "lights")
found: dict[str, object] = {}


def part(name: str):
    """A module of the installed extension."""
    return importlib.import_module(f"{PACKAGE}.{name}")


def photograph(name: str) -> None:
    """Save a screenshot."""
    subprocess.run(["import", "-window", "root", str(OUT / f"{name}.png")], check=True)


def press(operator: str, how: str = "EXEC_DEFAULT", **settings: object) -> None:
    """Call an operator as its button does."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    module, name = operator.split(".")
    with bpy.context.temp_override(window=window, area=area, region=region):
        outcome = getattr(getattr(bpy.ops, module), name)(how, **settings)
    assert outcome & {"FINISHED", "RUNNING_MODAL"}, (operator, outcome)


def children() -> list[int]:
    """The processes that this Blender has started."""
    return [
        int(n) for n in Path("/proc/self/task", str(os.getpid()), "children").read_text().split()
    ]


def state() -> list[object]:
    """What a fit would change in the file."""
    slots = [m and m.name for m in bpy.context.scene.patina.mesh.data.materials]
    return [sorted(getattr(bpy.data, kind).keys()) for kind in UNHARMED] + [slots]


def running() -> bool:
    """Whether a job runs in this scene."""
    return part("scene.session.running_job").running(bpy.context.scene) is not None


def fit_under_way() -> Iterator[float]:
    """Start a fit, and wait until its process samples the photos."""
    press("patina.fit", "INVOKE_DEFAULT")
    job = part("scene.session.running_job").running
    while (now := job(bpy.context.scene)) is not None and "fitting" not in now.stage:
        yield LOOK_INTERVAL
    assert now is not None, "the fit has ended already"


def ended_by(name: str, before: list[object], how) -> Iterator[float]:
    """Start a fit, end its process, and check what is left."""
    yield from fit_under_way()
    (child,) = children()
    since = time.monotonic()
    how(child)
    while child in children():
        assert time.monotonic() - since < 60, f"{name}: the process did not end"
        yield LOOK_INTERVAL
    found[f"{name}, seconds until the process ended"] = round(time.monotonic() - since, 2)
    while running():
        yield LOOK_INTERVAL
    yield REDRAW_DELAY
    photograph(name)
    assert state() == before, f"{name}: the file has changed"
    if name == "esc":
        assert found["esc, seconds until the process ended"] <= MAX_END_SECONDS


def limit_memory(child: int) -> None:
    """Limit the address space of a process to less than it has: its next allocation fails."""
    resource.prlimit(child, resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))


def escape(_: int) -> None:
    """Press ESC in the window."""
    subprocess.Popen(["xdotool", "mousemove", "700", "500", "key", "Escape"])


def steps() -> Iterator[float]:
    """The whole script."""
    bpy.context.preferences.view.show_splash = False
    press("patina.import_demo")
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    area.spaces.active.show_region_ui = True
    yield REDRAW_DELAY
    next(r for r in area.regions if r.type == "UI").active_panel_category = "Patina"
    subprocess.Popen(["xdotool", "mousemove", "700", "12", "sleep", "0.3", "click", "1"])
    yield REDRAW_DELAY
    blend = str(OUT / "own.blend")
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    before = state()
    yield from ended_by("killed", before, lambda child: os.kill(child, signal.SIGKILL))
    yield from ended_by("memory", before, limit_memory)
    yield from ended_by("esc", before, escape)
    assert not list(Path(bpy.app.tempdir).glob("job-*")), "files of ended processes are left"
    press("patina.fit", "INVOKE_DEFAULT")
    while running():
        yield REDRAW_DELAY
    yield REDRAW_DELAY
    photograph("next_fit")
    assert state() != before, "the next fit gave no materials"
    press("patina.fit", "INVOKE_DEFAULT")
    while not children():
        yield LOOK_INTERVAL
    found["left"] = children()  # real_blender.sh checks that it ends with Blender


def end(code: int) -> None:
    """Write and print the results, and quit Blender."""
    (OUT / "ended.json").write_text(json.dumps(found, indent=1), "utf-8")
    print("ended processes:", "failed" if code else "done", json.dumps(found), flush=True)
    os._exit(code)


STEPS = steps()


def tick() -> float | None:
    """Run the next step; any exception ends the script."""
    try:
        return next(STEPS)
    except StopIteration:
        end(0)
    except BaseException:
        traceback.print_exc()
        photograph("failed")
        end(1)
    return None


def too_long() -> None:
    """End the script after the timeout."""
    photograph("too_long")
    end(1)


OUT.mkdir(parents=True, exist_ok=True)
bpy.app.timers.register(tick, first_interval=4.0)
bpy.app.timers.register(too_long, first_interval=TIMEOUT)
