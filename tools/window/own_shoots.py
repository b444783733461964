"""Blender script: own objects from loose files to a material, by a real mouse, from a new file.

blender --factory-startup --addons bl_ext.user_default.patina -P tools/window/own_shoots.py -- \
    NAME OUT
NAME is a folder in the home folder's `Scans`; "demo" is made there from the demo capture, without
its capture file and with photos whose names match no camera, and its result is checked. A folder
with `.truth.json` (tools/make_textured_shoot.py) has no cameras: they are solved first. Writes a
screenshot of each step, and `NAME.json` with the number of clicks and keys, the seconds and the
results. (`.ci/real_blender.sh own DIR NAME OUT` runs it on a virtual screen.)
"""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))  # a script: Blender starts it by its path
import mouse

NAME, OUT = sys.argv[sys.argv.index("--") + 1], Path(sys.argv[sys.argv.index("--") + 2])
PACKAGE = "bl_ext.user_default.patina"
TIMEOUT = 1500  # seconds
REDRAW_DELAY = 2.0  # seconds after which a window has been redrawn
SCANS = Path.home() / "Scans"
DEMO_LETTERS = "hcafbged"  # of the demo's loose photos: an order that matches no camera
MAX_CLICKS = 15
BOX_OF_ROW = -16  # pixels, from the left end of a photo's name to its box
MAX_DEGREES_OFF = 5.0  # of the demo's lamps, as seen from the jar
MAX_DISTANCE_RATIO = 1.7  # found ÷ true or true ÷ found, of these lamps

hand = mouse.Mouse()
found: dict[str, object] = {"name": NAME}
marks: dict[str, float] = {}
number = 0


def part(name: str):
    """A module of the installed extension."""
    return importlib.import_module(f"{PACKAGE}.{name}")


def photograph(name: str) -> None:
    """Save a screenshot."""
    global number
    number += 1
    path = OUT / f"{NAME}_{number:02d}_{name}.png"
    subprocess.run(["import", "-window", "root", str(path)], check=True)


def window() -> bpy.types.Window:
    """The main window."""
    return bpy.context.window_manager.windows[0]


def sidebar() -> mouse.Box:
    """The sidebar on the screen."""
    area = next(a for a in window().screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "UI")
    top = window().height - region.y - region.height
    return region.x, top, region.x + region.width, window().height - region.y


def idle() -> Iterator[float]:
    """Wait until the running job ends."""
    running = part("scene.session.running_job").running
    yield REDRAW_DELAY
    while running(bpy.context.scene) is not None:
        yield 0.5
    yield REDRAW_DELAY


def open_tab() -> Iterator[float]:
    """Show the sidebar's tab Patina, as a user does after starting Blender."""
    hand.act("mousemove", 700, 500, "sleep", 0.3, "click", 1)  # closes the splash screen
    yield REDRAW_DELAY
    yield hand.press_key("n")
    yield from hand.click("Patina", turned=True)
    photograph("start")


def choose_folder() -> Iterator[float]:
    """New Capture, and the folder in the file browser."""
    yield from hand.click("New Capture", sidebar())
    yield REDRAW_DELAY
    photograph("browser")
    yield from hand.click("Scans", times=2)
    yield from hand.click(NAME, times=2)
    photograph("folder")
    yield from hand.click("New Capture", browser_buttons(), vanishes=True)
    yield from idle()
    photograph("recognised")


def browser_buttons() -> mouse.Box:
    """Where the file browser's buttons are."""
    picture = mouse.screenshot()
    return 0, picture.shape[0] // 2, picture.shape[1], picture.shape[0]


def results() -> None:
    """Note lights, fit and clicks."""
    scene = bpy.context.scene
    properties = part("scene.session.scene_properties")
    path = properties.capture_path(scene)
    result = properties.stored_result(path)
    if result is not None:
        found["fit"] = {m["name"]: m["quality"]["sentence"] for m in result["materials"]}
    capture, _ = part("scene.photos.dragged_lamps").with_dragged_lamps(
        part("core.capture").read_capture(Path(path)), scene
    )
    found["lights"] = {light.name: _place(light) for light in capture.lights}


def _place(light) -> list[float]:
    """Direction, flash offset or position."""
    values = (light.direction, light.mounted, light.position)
    return [round(float(x), 4) for x in next(v for v in values if v is not None)]


def make_demo() -> dict[str, str]:
    """Copy the demo's scan and photos to the home folder as loose files; returns the true camera of
    each photo."""
    demo, folder = Path(part("operators.import_capture").DEMO).parent, SCANS / NAME
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(demo / "sparse", folder / "sparse")
    shutil.copy(demo / "mesh.ply", folder)
    (folder / "lit").mkdir()
    true = {}
    for letter, photo in zip(DEMO_LETTERS, sorted((demo / "lit").glob("*.exr")), strict=True):
        shutil.copy(photo, folder / "lit" / f"shot_{letter}.exr")
        true[f"shot_{letter}.exr"] = photo.stem
    return true


def check_demo(cameras: dict[str, str]) -> None:
    """Compare what was found with the truth of the demo's photos: its lamps are near the jar, at
    truth.json's ``lamp_positions``."""
    truth = json.loads((Path(__file__).parents[2] / "assets" / "demo" / "truth.json").read_text())
    away = truth["lamp_distance"]
    true = {name: np.array(truth["lights"][name]) for name in truth["lamp_positions"]}
    centre = np.mean([np.array(truth["lamp_positions"][n]) - away * true[n] for n in true], axis=0)
    off, distances, nearest = [], [], []
    for place in found["lights"].values():
        towards = np.array(place) - centre
        distance = float(np.linalg.norm(towards))
        cosine = {name: float(towards @ d) / distance for name, d in true.items()}
        distances.append(distance / away)
        nearest.append(max(cosine, key=cosine.__getitem__))
        off.append(float(np.degrees(np.arccos(min(cosine[nearest[-1]], 1.0)))))
    found["degrees off"] = [round(value, 2) for value in off]
    found["distances ÷ true"] = [round(value, 2) for value in distances]
    assert not found["wrong cameras"], found
    assert sorted(nearest) == sorted(true) and max(off) < MAX_DEGREES_OFF, found
    assert 1 / MAX_DISTANCE_RATIO < min(distances) < max(distances) < MAX_DISTANCE_RATIO, found
    assert len(cameras) >= len(DEMO_LETTERS) - 1, found
    assert hand.clicks <= MAX_CLICKS, found


def cameras_of_draft() -> dict[str, str]:
    """Photo → camera, of the new capture's used photos."""
    photos = bpy.context.scene.patina_draft.photos
    return {p.name: Path(p.camera).stem for p in photos if p.use and p.camera}


def write_dense_mesh() -> None:
    """Stand in for a dense reconstruction: write the scanned surface in the frame of the solved
    cameras."""
    folder = SCANS / NAME
    truth = json.loads((folder / ".truth.json").read_text())
    surface = np.load(folder / ".surface.npz")
    cameras = (
        part("core.scan.formats").read_reconstruction(folder / "scan solved" / "sparse").cameras
    )
    solved = np.array([c.pose.centre for c in cameras])
    true = np.array([truth["centres"][c.label] for c in cameras])
    scale, turn, shift = similarity(true, solved)
    vertices = scale * surface["vertices"] @ turn.T + shift
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"element face {len(surface['faces'])}", "property list uchar int vertex_indices"]
    lines += ["end_header", *(" ".join(f"{x:.7g}" for x in v) for v in vertices)]
    lines += [f"3 {a} {b} {c}" for a, b, c in surface["faces"]]
    (folder / "model.ply").write_text("\n".join([*lines, ""]))
    found["solved cameras"] = len(cameras)
    off = np.linalg.norm(scale * true @ turn.T + shift - solved, axis=1) / scale
    found["solved camera error"] = float(np.median(off))


def similarity(a: np.ndarray, b: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Scale, rotation and translation that map points a to b (Umeyama 1991)."""
    ca, cb = a - a.mean(axis=0), b - b.mean(axis=0)
    u, s, vt = np.linalg.svd(cb.T @ ca)
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    turn = u @ sign @ vt
    scale = (s * np.diag(sign)).sum() / (ca**2).sum()
    return scale, turn, b.mean(axis=0) - scale * turn @ a.mean(axis=0)


def solve_and_add_mesh() -> Iterator[float]:
    """Solve the cameras, add a mesh in their frame, and localise what matches no camera."""
    count = len(list((SCANS / NAME / "scan").glob("*.jpg")))
    yield from hand.click(f"Solve {count} Photos in", sidebar())
    yield from idle()
    photograph("solved")
    write_dense_mesh()
    yield from hand.click("Add or Replace Files", sidebar())
    yield REDRAW_DELAY
    photograph("browser_again")
    yield from hand.click("model.ply")
    yield from hand.click("New Capture", browser_buttons(), vanishes=True)
    yield from idle()
    photograph("mesh_added")
    lost = [p.name for p in bpy.context.scene.patina_draft.photos if p.use and not p.camera]
    if lost:
        yield from hand.click(f"Localise {len(lost)} Photo", sidebar())
        yield from idle()
        photograph("localised")


def whole_way() -> Iterator[float]:
    """From a new file to a material."""
    true = make_demo() if NAME == "demo" else {}
    yield from open_tab()
    start = time.perf_counter()
    yield from choose_folder()
    marks["recognised"] = time.perf_counter() - start
    if (SCANS / NAME / ".truth.json").exists():
        yield from solve_and_add_mesh()
        marks["solved and localised"] = time.perf_counter() - start
    cameras = cameras_of_draft()
    found["wrong cameras"] = [name for name in true if cameras.get(name, true[name]) != true[name]]
    for photo in bpy.context.scene.patina_draft.photos:
        if photo.use and not photo.camera:  # no camera explains it: its box in the list
            yield from hand.click(photo.name, sidebar(), shift=BOX_OF_ROW)
            assert not photo.use, photo.name
    yield from hand.click("Create Capture", sidebar(), vanishes=True)
    yield REDRAW_DELAY
    photograph("imported")
    marks["imported"] = time.perf_counter() - start
    yield from hand.click("Find from Photos", sidebar())
    yield from idle()
    photograph("lights")
    marks["lights"] = time.perf_counter() - start
    yield from hand.click("Fit Materials", sidebar())
    yield from idle()
    photograph("fitted")
    marks["fitted"] = time.perf_counter() - start
    results()
    if NAME == "demo":
        check_demo(cameras)


def end(code: int) -> None:
    """Write and print the results, and quit Blender."""
    found.update(clicks=hand.clicks, keys=hand.keys, log=hand.log, seconds=marks)
    (OUT / f"{NAME}.json").write_text(json.dumps(found, indent=1), "utf-8")
    print("own shoot:", "failed" if code else "done", json.dumps(found), flush=True)
    os._exit(code)


STEPS = whole_way()


def tick() -> float | None:
    """Run the next step; any exception ends the run."""
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
    """End the run after the timeout."""
    photograph("too_long")
    end(1)


bpy.app.timers.register(tick, first_interval=4.0)
bpy.app.timers.register(too_long, first_interval=TIMEOUT)
