"""The list of lit photos of a scene: camera, light and display settings (Scene.patina_photos)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ...core.capture.entries import PhotoEntry
from ..property_keys import CAPTURE, LIGHT_NAME, LIT_PHOTO, LIT_PHOTO_INDEX
from ..session.handlers import attach, detach, register_property_factory
from ..session.overlay_shading import leave_overlay
from ..session.scene_properties import capture_path
from . import ball_outline, cameras, lamps
from .exposed_photo import exposed


class PatinaPhoto(bpy.types.PropertyGroup):
    """A lit photo; ``name`` is its file name. Several photos may share a camera, each with its own
    light."""

    place: bpy.props.IntProperty(name="Place", description="Index of the photo in the capture")  # type: ignore[valid-type]
    camera: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Camera", description="Camera that took the photo", type=bpy.types.Object
    )
    image: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Photo", description="Image that is shown behind the mesh", type=bpy.types.Image
    )
    light: bpy.props.StringProperty(name="Light", description="Lamp that was on")  # type: ignore[valid-type]
    exposure: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Exposure",
        description="Exposure from the capture file, by which pixel values are divided; 0 to use "
        "the metadata of the photo",
    )


def _look(state: PatinaPhotos, context: bpy.types.Context) -> None:
    if 0 <= state.active < len(state.photos):
        leave_overlay()
        look_at(state.id_data, state.photos[state.active])
        for area in context.screen.areas if context.screen else ():
            if area.type == "VIEW_3D":
                area.spaces.active.region_3d.view_perspective = "CAMERA"


def _expose(state: PatinaPhotos, context: bpy.types.Context) -> None:
    photo = looked_at(state.id_data)
    if photo is not None:
        _put_behind(photo, state)


def _mix(state: PatinaPhotos, context: bpy.types.Context) -> None:
    _blend(state.id_data)


class PatinaPhotos(bpy.types.PropertyGroup):
    """Scene.patina_photos."""

    photos: bpy.props.CollectionProperty(type=PatinaPhoto)  # type: ignore[valid-type]
    active: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Lit Photo",
        description="Look through the camera of this photo, with its lamp switched on",
        min=0,
        update=_look,
    )
    mesh_over: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Mesh over Photo",
        description="Opacity of the mesh over the photo: 0 shows only the photo, 1 shows the mesh "
        "in front of the photo",
        subtype="FACTOR",
        min=0.0,
        max=1.0,
        default=1.0,
        update=_mix,
    )
    view_exposure: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="View Exposure",
        description="Exposure of the photo behind the mesh, in stops, for display only; it does "
        "not affect the fit",
        min=-10.0,
        max=10.0,
        soft_min=-5.0,
        soft_max=5.0,
        step=10,
        precision=1,
        options=set(),
        update=_expose,
    )


@dataclass(frozen=True)
class LitPhoto:
    """One entry of the list."""

    camera: bpy.types.Object
    image: bpy.types.Image
    entry: PhotoEntry


def list_photos(scene: bpy.types.Scene, photos: Sequence[LitPhoto]) -> None:
    """Fill the list in the order of the capture, and look at the first photo."""
    state = scene.patina_photos
    state.photos.clear()
    for place, photo in enumerate(photos):
        line = state.photos.add()
        line.name, line.place = photo.entry.file.name, place
        line.camera, line.image, line.light = photo.camera, photo.image, photo.entry.light
        line.exposure = photo.entry.exposures[0] if photo.entry.exposures else 0.0
        _with_thumbnail(photo.image)
    state.active = 0  # its update function looks at the photo


def lit_photos(scene: bpy.types.Scene) -> list[PatinaPhoto]:
    """The lit photos whose camera is still in the scene."""
    return [photo for photo in scene.patina_photos.photos if has_camera(scene, photo)]


def has_camera(scene: bpy.types.Scene, photo: PatinaPhoto) -> bool:
    """Whether the camera of a photo is in the scene."""
    return photo.camera is not None and photo.camera.name in scene.objects


def looked_at(scene: bpy.types.Scene) -> PatinaPhoto | None:
    """The active photo; None if the scene's camera is not that of the photo."""
    photos, line = scene.patina_photos.photos, scene.patina_photos.active
    if not 0 <= line < len(photos) or scene.camera is None:
        return None
    return photos[line] if photos[line].camera == scene.camera else None


def look_at(scene: bpy.types.Scene, photo: PatinaPhoto) -> None:
    """Look through the camera of a photo, with the photo behind the mesh and only its lamp on."""
    camera = photo.camera
    if not has_camera(scene, photo):
        return
    _put_behind(photo, scene.patina_photos)
    mark_lit(camera, photo.name, photo.place, photo.light)
    cameras.look_through(scene, camera)
    lamps.shine_only(scene, camera)
    ball_outline.show_only(scene, capture_path(scene), photo.place)
    _blend(scene)


def _put_behind(photo: PatinaPhoto, state: PatinaPhotos) -> None:
    """Show the photo in its camera's view with the view exposure."""
    behind = photo.camera.data.background_images
    if len(behind) and photo.image is not None:
        behind[-1].image = exposed(photo.image, state.view_exposure)


def _blend(scene: bpy.types.Scene) -> None:
    """Blend the photo of the scene's camera with the mesh by the factor ``mesh_over``."""
    camera = scene.camera
    if camera is None or camera.type != "CAMERA" or not len(camera.data.background_images):
        return
    photo, share = camera.data.background_images[-1], scene.patina_photos.mesh_over
    photo.display_depth = "BACK" if share >= 1.0 else "FRONT"
    photo.alpha = 1.0 if share >= 1.0 else 1.0 - share


def mark_lit(camera: bpy.types.Object, name: str, place: int, light: str) -> None:
    """Store on a camera which lit photo is behind it."""
    camera[LIT_PHOTO], camera[LIT_PHOTO_INDEX], camera[LIGHT_NAME] = name, place, light


def _with_thumbnail(image: bpy.types.Image | None) -> None:
    """Request a thumbnail for the list; Blender renders it in the background."""
    if image is not None and not bpy.app.background:
        image.preview_ensure()


@bpy.app.handlers.persistent
def _fill_old_files(*_: object) -> None:
    """Fill the list for files of versions without it, from the custom properties of the cameras."""
    for scene in bpy.data.scenes:
        state, capture = scene.patina_photos, capture_path(scene)
        if len(state.photos) or not capture:
            continue
        mine = [o for o in scene.objects if o.type == "CAMERA" and o.get(CAPTURE) == capture]
        for camera in sorted(mine, key=lambda o: o.get(LIT_PHOTO_INDEX, 0)):
            line, behind = state.photos.add(), camera.data.background_images
            line.name, line.place = camera.get(LIT_PHOTO, ""), camera.get(LIT_PHOTO_INDEX, 0)
            line.camera, line.light = camera, camera.get(LIGHT_NAME, "")
            line.image = behind[-1].image if len(behind) else None
            _with_thumbnail(line.image)
            if camera == scene.camera:
                state.active = len(state.photos) - 1


HANDLERS = (("load_post", _fill_old_files),)
_register_property, _unregister_property = register_property_factory(
    bpy.types.Scene, "patina_photos", PatinaPhoto, PatinaPhotos
)


def register() -> None:
    """Add the list of photos to every scene."""
    _register_property()
    attach(HANDLERS)


def unregister() -> None:
    """Remove the list of photos and its handlers."""
    detach(HANDLERS)
    _unregister_property()
