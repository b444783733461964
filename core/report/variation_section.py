"""The section of the report about what varies over the surface: maps on the object."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..geometry import view_surface
from ..geometry.view import SurfaceView
from ..jobs import CaptureResult
from ..photo import write_png
from ..scan import Camera
from ..varying.node_model import NodeModel, diffuse_factor
from ..varying.varying_surface import VaryingSurface, barycentric
from ..views import display
from ..views.surface_view import QUANTITIES, shown_quantities

Array = NDArray[np.floating]

SIDE, MARGIN = 360, 4  # pixels of a picture, and around the object
LOW, NONE, HIGH = (np.array(c) for c in ([0.03, 0.12, 0.55], [0.85] * 3, [0.62, 0.05, 0.05]))
"""Linear colours of −1, 0 and 1 of a scale."""

ALBEDO = "Diffuse colour, without light and highlights"


def variation_section(folder: Path, result: CaptureResult, surface: VaryingSurface) -> str:
    """HTML; writes the pictures into ``folder``. surface: of the result, not even."""
    shown: list[tuple[str, str, Callable[[SurfaceView], Array]]] = [
        ("colour", ALBEDO, _albedo(result, surface))
    ]
    for kind in shown_quantities(surface):
        quantity = QUANTITIES[kind]
        if kind != "diffuse":
            text = f"{quantity.title}: {' … '.join(quantity.ends)}"
            shown.append((kind, text, _scaled(surface, kind)))
    rows = ""
    for number, camera in enumerate(_cameras(result)):
        view = view_surface(result.rays, camera)
        cells = ""
        for kind, text, colours in shown:
            file = f"varies_{number}_{kind}.png"
            picture = view.image(colours(view).astype(np.float32))
            write_png(
                folder / file,
                display.photo_picture(picture[display.crop_box(view.seen, MARGIN)], 1.0),
            )
            cells += (
                f"<figure><img src='{file}' alt='{escape(text)}' loading='lazy'>"
                f"<figcaption>{escape(text)}</figcaption></figure>"
            )
        rows += f"<div class='maps'>{cells}</div>"
    kinds = ", ".join(
        f"{material.name}: {one.kind}"
        for material, one in zip(result.materials, surface.materials, strict=True)
    )
    return (
        f"<h2>What varies over the surface</h2><p class='sub'>{escape(kinds)}. Estimated at "
        f"{len(surface.grid):,} points of the mesh. Blue is less, red is more than the typical "
        f"material; what no photo shows is like its surroundings.</p>{rows}"
    )


def _cameras(result: CaptureResult) -> list[Camera]:
    """The camera of the first photo, and that of the photo from the most different direction."""
    cameras = [result.scan.camera(photo.camera) for photo in result.capture.photos]
    known = [camera for camera in cameras if camera is not None]
    axes = np.array([camera.pose.rotation[2] for camera in known])
    chosen = dict.fromkeys([0, int(np.argmin(axes @ axes[0]))])
    found = []
    for index in chosen:
        camera = known[index]
        shrunk = SIDE / max(camera.width, camera.height)
        size = round(camera.width * shrunk), round(camera.height * shrunk)
        found.append(camera.resized(*size) if shrunk < 1 else camera)
    return found


def _albedo(result: CaptureResult, surface: VaryingSurface) -> Callable[[SurfaceView], Array]:
    """π × the diffuse level (n, 3) at the pixels of a view, at most 1; NaN where no material was
    fitted."""
    levels = [np.pi * NodeModel.of(m.fit.brdf, m.scale).body for m in result.materials]

    def colours(view: SurfaceView) -> Array:
        second, third = barycentric(surface.grid.mesh, view.face, view.point)
        factor = diffuse_factor(surface.at(view.face, second, third))
        found = np.full((len(view.face), 3), np.nan, np.float32)
        for index, level in enumerate(levels):
            own = result.face_material[view.face] == index
            found[own] = np.minimum(level * factor[own], 1.0)
        return found

    return colours


def _scaled(surface: VaryingSurface, kind: str) -> Callable[[SurfaceView], Array]:
    """Linear colours (n, 3) of the values of a quantity at the pixels of a view."""
    quantity = QUANTITIES[kind]
    values = quantity.of(surface)

    def colours(view: SurfaceView) -> Array:
        second, third = barycentric(surface.grid.mesh, view.face, view.point)
        node, weight = surface.interpolation(view.face, second, third)
        at = np.einsum("mk,mk->m", weight, values[node])[:, None]
        signed = np.clip(at, -1.0 if quantity.signed else 0.0, 1.0)
        return np.where(signed < 0, NONE - signed * (LOW - NONE), NONE + signed * (HIGH - NONE))

    return colours
