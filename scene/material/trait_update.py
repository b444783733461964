"""A material follows its sliders: what is quick at once, the rest a moment after the last change.

At once: the coefficients of the OSL shader, and a small sphere. A moment later, worked out in a
thread that touches nothing of Blender and taken over by a timer, piece by piece: the sphere in
full, the table that Cycles draws directions from (it holds the material to what falls on it), the
lobe stack for EEVEE, the Principled for exporters. What each piece shows is written on the
material, so that whatever else changes the sliders (undo, a file from elsewhere) is followed too.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...core.appearance import osl_atlas
from ...core.appearance.lobe_fit import fit_lobe_stack
from ...core.appearance.principled_fit import fit_principled
from ...core.basis import PrincipalBRDF
from ...core.maps.split import split_body
from ..property_keys import SHOWN_TRAITS
from ..session.handlers import attach, detach
from ..session.running_job import redraw
from . import material_nodes, osl_files
from .measured_nodes import (
    keep,
    lobe_node,
    principled_node,
    put_back,
    set_coefficients,
    set_sampling,
)
from .preview import put_spheres, show_sphere, spheres
from .trait_offsets import forget, movable, moved_brdf, quick_spheres, state

log = logging.getLogger(__name__)

QUIET, POLL = 0.4, 0.1  # seconds after the last change, and between looks at the thread
QUICKLY = "quickly"  # in place of a state: what is shown is a small sphere
SPHERE, SAMPLING, LOBES, PRINCIPLED = "sphere", "sampling", "lobes", "principled"


@dataclass(frozen=True)
class _Work:
    """A piece of a state, under way."""

    piece: str
    state: str
    future: Future[Any]


_pool: ThreadPoolExecutor | None = None
_work: _Work | None = None
_changed_at = 0.0
_failed: set[tuple[str, str]] = set()  # (piece, state)
_drawn: dict[str, str] = {}  # material → the state of the sphere it was last given


def follow(material: bpy.types.Material, wholly: bool = False) -> None:
    """Show what the sliders say, as far as that is quick. wholly: the sphere in full at once."""
    global _changed_at
    brdf = moved_brdf(material) if movable(material) else None
    if brdf is None:
        return
    now = state(material)
    if now:
        keep(material)
        set_coefficients(material, brdf)
    else:
        put_back(material)
        set_coefficients(material, brdf)
        material.pop(SHOWN_TRAITS, None)
        osl_files.drop_unused()
    if wholly:
        show_sphere(material, brdf)
    else:
        put_spheres(material, quick_spheres(material))
    _say(material, SPHERE, now if wholly else QUICKLY)
    _drawn[material.name] = now
    _changed_at = time.monotonic()
    _start()


def behind(material: bpy.types.Material) -> list[str]:
    """The pieces that do not show what the sliders say yet, in the order they will."""
    shown, now = material.get(SHOWN_TRAITS, {}), state(material)
    return [p for p in _pieces(material) if shown.get(p, "") != now and (p, now) not in _failed]


def settle() -> None:
    """Every piece of every material, waiting for them: for scripts, where no timer runs."""
    while (todo := _next()) is not None:
        piece, now, work = todo
        _take(piece, now, work)


def _pieces(material: bpy.types.Material) -> list[str]:
    there = [SPHERE]
    if osl_files.script_nodes(material):
        there.append(SAMPLING)
    if lobe_node(material) is not None:
        there.append(LOBES)
    if principled_node(material) is not None:
        there.append(PRINCIPLED)
    return there


def _next() -> tuple[str, str, Callable[[], Any]] | None:
    """(piece, state, what works it out) of the first that is behind."""
    for material in bpy.data.materials:
        if not movable(material):
            continue
        late = behind(material)
        brdf = moved_brdf(material) if late else None
        if brdf is not None:
            return late[0], state(material), _WORK[late[0]](brdf)
    return None


def _sampling(brdf: PrincipalBRDF) -> Any:
    made = osl_files.shader_tables(brdf)
    alphas = tuple(float(a) for a in made.parts.alpha)
    return osl_atlas.sampling_name(brdf), made.texels, alphas, split_body(brdf.evaluate).body


_WORK: dict[str, Callable[[PrincipalBRDF], Callable[[], Any]]] = {
    SPHERE: lambda brdf: lambda: spheres(brdf),
    SAMPLING: lambda brdf: lambda: _sampling(brdf),
    LOBES: lambda brdf: lambda: fit_lobe_stack(brdf.evaluate),
    PRINCIPLED: lambda brdf: lambda: fit_principled(brdf.evaluate),
}


def _take(piece: str, now: str, result: Callable[[], Any]) -> None:
    """Put a piece on every material that still is in the state it was made for."""
    try:
        found = result()
    except Exception:  # the sliders may ask for anything: the rest must go on
        log.exception("the %s of a moved material cannot be made", piece)
        _failed.add((piece, now))
        return
    for material in bpy.data.materials:
        if movable(material) and piece in behind(material) and state(material) == now:
            _put(material, piece, found)
            _say(material, piece, now)
    redraw()


def _put(material: bpy.types.Material, piece: str, found: Any) -> None:
    if piece == SPHERE:
        put_spheres(material, found)
    elif piece == SAMPLING:
        name, texels, alphas, body = found
        # not beside the .blend: it goes there when the file is saved, and most are never saved
        path = Path(bpy.app.tempdir) / name
        if not path.is_file():
            osl_atlas.write_picture(path, texels)
        osl_files.pack(path)
        set_sampling(material, path, alphas, body)
        osl_files.drop_unused()
    elif piece == LOBES:
        material_nodes.show_lobes(lobe_node(material), found)
    else:
        material_nodes.show_principled(principled_node(material), found)
        material_nodes.show_solid(material, found.principled)


def _say(material: bpy.types.Material, piece: str, shows: str) -> None:
    """Write down the state that a piece shows; a material as measured needs no such word."""
    said = {**dict(material.get(SHOWN_TRAITS, {})), piece: shows}
    if any(said.values()):
        material[SHOWN_TRAITS] = said
    else:
        material.pop(SHOWN_TRAITS, None)


def _start() -> None:
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=QUIET)


def _tick() -> float | None:
    """Called by Blender: begin a piece, look whether it is done, take it over."""
    global _pool, _work
    if _work is None:
        wait = QUIET - (time.monotonic() - _changed_at)
        if wait > 0:
            return wait
        todo = _next()
        if todo is None:
            return None
        _pool = _pool or ThreadPoolExecutor(1, "patina")
        _work = _Work(todo[0], todo[1], _pool.submit(todo[2]))
    if not _work.future.done():
        return POLL
    work, _work = _work, None
    _take(work.piece, work.state, work.future.result)
    return 0.0


def _drop() -> None:
    """What is under way ends unheard."""
    global _pool, _work
    if _pool is not None:
        _pool.shutdown(wait=False, cancel_futures=True)
    _pool = _work = None


@persistent
def _before_load(*_: object) -> None:
    _drop()
    _failed.clear()
    _drawn.clear()


@persistent
def _after_load(*_: object) -> None:
    """A file that was saved before everything had followed."""
    for material in bpy.data.materials:
        if movable(material) and SHOWN_TRAITS in material:
            _drawn[material.name] = state(material)
            if behind(material):
                _start()


@persistent
def _after_undo(*_: object) -> None:
    """Undo brings sliders and nodes back as they were when it last looked, without the update."""
    for material in bpy.data.materials:
        if not movable(material):
            continue
        if state(material) != _drawn.get(material.name, ""):
            follow(material)
        elif behind(material):
            _start()


@persistent
def _in_background(*_: object) -> None:
    """Nobody waits at a window, and no timer runs there."""
    if bpy.app.background:
        settle()


HANDLERS = (
    ("load_pre", _before_load),
    ("load_post", _after_load),
    ("undo_post", _after_undo),
    ("redo_post", _after_undo),
    ("save_pre", _in_background),
    ("render_pre", _in_background),
)


def register() -> None:
    """Follow undo, and files that are opened."""
    attach(HANDLERS)


def unregister() -> None:
    """Leave nothing behind: no timer, no thread with work to come."""
    detach(HANDLERS)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _drop()
    _failed.clear()
    _drawn.clear()
    forget()
