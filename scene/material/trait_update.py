"""Update a material after its trait sliders change.

The coefficients of the OSL shader and a small preview are updated at once. Shortly after the last
change, a child process computes the remaining pieces, and a timer applies them one by one: the full
preview, the table that Cycles samples directions from (it also limits the
albedo to 1), the lobe stack for EEVEE, and the Principled for exporters. A custom property of the
material states which traits each piece shows, so that other changes of the sliders (undo, a file
from another version) are detected too.
"""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...core.appearance import osl_atlas
from ...core.basis import PrincipalBRDF
from ...core.child_process import ChildJob
from ...core.errors import PatinaError
from ...core.views.prepared_materials import (
    LOBES,
    PRINCIPLED,
    SAMPLING,
    SPHERE,
    EditedMaterialJob,
)
from ..property_keys import SHOWN_TRAITS
from ..session.child_processes import end_child, start_child
from ..session.handlers import attach, detach
from ..session.running_job import redraw
from . import material_nodes, osl_files
from .measured_nodes import (
    lobe_node,
    principled_node,
    restore_inputs,
    set_coefficients,
    set_sampling,
    store_inputs,
)
from .preview import set_preview, show_sphere
from .trait_offsets import clear_caches, edited_brdf, movable, quick_spheres, state

log = logging.getLogger(__name__)

START_DELAY, POLL_INTERVAL = 0.4, 0.1  # seconds after the last change; between checks of a child
QUICKLY = "quickly"  # stored instead of a state: the preview is a small sphere


@dataclass(frozen=True)
class _Work:
    """A state whose pieces a child process computes, and those that are not applied yet."""

    state: str
    child: ChildJob[EditedMaterialJob]
    computed: dict[str, Any]


_work: _Work | None = None
_changed_at = 0.0
_failed: set[tuple[str, str]] = set()  # (piece, state)
_drawn: dict[str, str] = {}  # material → the state that its preview shows


def update_material(material: bpy.types.Material, wholly: bool = False) -> None:
    """Update the quick pieces of a material to its sliders, and start the others.

    wholly: also draw the full preview at once.
    """
    global _changed_at
    brdf = edited_brdf(material) if movable(material) else None
    if brdf is None:
        return
    now = state(material)
    if now:
        store_inputs(material)
        set_coefficients(material, brdf)
    else:
        restore_inputs(material)
        set_coefficients(material, brdf)
        material.pop(SHOWN_TRAITS, None)
        osl_files.drop_unused()
    if wholly:
        show_sphere(material, brdf)
    else:
        set_preview(material, quick_spheres(material))
    _store_shown(material, SPHERE, now if wholly else QUICKLY)
    _drawn[material.name] = now
    _changed_at = time.monotonic()
    _start()


def outdated_pieces(material: bpy.types.Material) -> list[str]:
    """The pieces that do not show the present sliders yet, in the order of their update."""
    shown, now = material.get(SHOWN_TRAITS, {}), state(material)
    return [p for p in _pieces(material) if shown.get(p, "") != now and (p, now) not in _failed]


def finish_updates() -> None:
    """Update all pieces of all materials and wait for them. For scripts, where no timer runs."""
    while (todo := _next()) is not None:
        now, brdf, pieces = todo
        job = EditedMaterialJob(brdf, pieces[:1])
        job.drain()
        _apply(pieces[0], now, job.found[pieces[0]])


def _pieces(material: bpy.types.Material) -> list[str]:
    pieces = [SPHERE]
    if osl_files.script_nodes(material):
        pieces.append(SAMPLING)
    if lobe_node(material) is not None:
        pieces.append(LOBES)
    if principled_node(material) is not None:
        pieces.append(PRINCIPLED)
    return pieces


def _next() -> tuple[str, PrincipalBRDF, list[str]] | None:
    """(state, its BRDF, its outdated pieces) of the first material that has some; None if none
    has."""
    for material in bpy.data.materials:
        if not movable(material):
            continue
        late = outdated_pieces(material)
        brdf = edited_brdf(material) if late else None
        if brdf is not None:
            return state(material), brdf, late
    return None


def _apply(piece: str, now: str, found: Any) -> None:
    """Apply a piece to every material that still has the state it was computed for. found: None
    where it could not be computed."""
    if found is None:
        log.warning("The %s of an edited material could not be computed.", piece)
        _failed.add((piece, now))
        return
    for material in bpy.data.materials:
        if movable(material) and piece in outdated_pieces(material) and state(material) == now:
            _write(material, piece, found)
            _store_shown(material, piece, now)
    redraw()


def _write(material: bpy.types.Material, piece: str, found: Any) -> None:
    if piece == SPHERE:
        set_preview(material, found)
    elif piece == SAMPLING:
        tables, split = found
        alphas = tuple(float(a) for a in tables.parts.alpha)
        name = osl_atlas.sampling_name(edited_brdf(material))
        # not next to the .blend: the file is written there on save, and most states are never saved
        path = Path(bpy.app.tempdir) / name
        if not path.is_file():
            osl_atlas.write_picture(path, tables.texels)
        osl_files.pack(path)
        set_sampling(material, path, alphas, split)
        osl_files.drop_unused()
    elif piece == LOBES:
        material_nodes.show_lobes(lobe_node(material), found)
    else:
        material_nodes.show_principled(principled_node(material), found)
        material_nodes.show_solid(material, found.principled)


def _store_shown(material: bpy.types.Material, piece: str, shows: str) -> None:
    """Store the state that a piece shows. A material as measured has no such property."""
    shown = {**dict(material.get(SHOWN_TRAITS, {})), piece: shows}
    if any(shown.values()):
        material[SHOWN_TRAITS] = shown
    else:
        material.pop(SHOWN_TRAITS, None)


def _start() -> None:
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=START_DELAY)


def _tick() -> float | None:
    """Timer callback: start a child process, check whether it is done, apply one of its pieces.
    Returns the seconds until the next call, None to stop."""
    global _work
    if _work is None:
        wait = START_DELAY - (time.monotonic() - _changed_at)
        if wait > 0:
            return wait
        todo = _next()
        if todo is None:
            return None
        now, brdf, pieces = todo
        try:
            _work = _Work(now, start_child(EditedMaterialJob(brdf, pieces)), {})
        except (PatinaError, OSError) as error:
            return _give_up(now, pieces, error)
        return POLL_INTERVAL
    if _work.computed:
        piece = next(iter(_work.computed))
        _apply(piece, _work.state, _work.computed.pop(piece))
    elif not any(state(m) == _work.state for m in bpy.data.materials if movable(m)):
        _drop()  # the sliders have moved on
        return 0.0
    elif not _finished(_work):
        return POLL_INTERVAL
    if _work is not None and not _work.computed:
        _work = None
    return 0.0


def _finished(work: _Work) -> bool:
    """Whether the child is done; its pieces are then in ``work``."""
    try:
        if work.child.step():
            return False
        work.computed.update(work.child.result.found)
    except PatinaError as error:
        pieces = [p for m in bpy.data.materials if movable(m) for p in outdated_pieces(m)]
        _give_up(work.state, pieces, error)
    return True


def _give_up(now: str, pieces: list[str], error: Exception) -> float:
    """Leave the pieces of a state as they are."""
    log.warning("Previews of an edited material were not updated: %s", error)
    _failed.update((piece, now) for piece in pieces)
    return 0.0


def _drop() -> None:
    """End the child and discard its pieces."""
    global _work
    work, _work = _work, None
    if work is not None:
        end_child(work.child)


@persistent
def _before_load(*_: object) -> None:
    _drop()
    _failed.clear()
    _drawn.clear()


@persistent
def _after_load(*_: object) -> None:
    """Finish the update of a file that was saved before all pieces were updated."""
    for material in bpy.data.materials:
        if movable(material) and SHOWN_TRAITS in material:
            _drawn[material.name] = state(material)
            if outdated_pieces(material):
                _start()


@persistent
def _after_undo(*_: object) -> None:
    """Update materials after undo, which restores sliders and nodes without the update function."""
    for material in bpy.data.materials:
        if not movable(material):
            continue
        if state(material) != _drawn.get(material.name, ""):
            update_material(material)
        elif outdated_pieces(material):
            _start()


@persistent
def _in_background(*_: object) -> None:
    """Without a window no timer runs: update all pieces now."""
    if bpy.app.background:
        finish_updates()


HANDLERS = (
    ("load_pre", _before_load),
    ("load_post", _after_load),
    ("undo_post", _after_undo),
    ("redo_post", _after_undo),
    ("save_pre", _in_background),
    ("render_pre", _in_background),
)


def register() -> None:
    """Add the handlers for undo, loading, saving and rendering."""
    attach(HANDLERS)


def unregister() -> None:
    """Remove handlers, timer and child process, and clear the caches."""
    detach(HANDLERS)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _drop()
    _failed.clear()
    _drawn.clear()
    clear_caches()
