"""The draft of a new capture, kept in the scene until it is written (Scene.patina_draft)."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.new_capture import Draft, DraftLamp, DraftPhoto, LampKind
from ..session.handlers import register_property_factory

LAMP_KINDS = [
    (LampKind.UNKNOWN.value, "Unknown", "A lamp far away; find its direction from the photos"),
    (LampKind.FLASH.value, "Flash on Camera", "A flash fixed to the camera and no other light"),
    (LampKind.DISTANT.value, "Known Direction", "A lamp far away in the direction below"),
    (LampKind.SUN.value, "Sun", "The sun, by the time and place in the photos' metadata"),
    (LampKind.NEAR.value, "Near Lamp", "A lamp near the object; find its position from the photos"),
]


class PatinaDraftPhoto(bpy.types.PropertyGroup):
    """A photo of the draft; ``name`` is its file name."""

    path: bpy.props.StringProperty(name="File", subtype="FILE_PATH")  # type: ignore[valid-type]
    use: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Use", description="Measure materials with this photo", default=True
    )
    camera: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Camera", description="Camera of the scan with the viewpoint of this photo"
    )
    how: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Match", description="How the camera was found"
    )
    lamp: bpy.props.StringProperty(name="Lamp", description="Lamp that was on")  # type: ignore[valid-type]


class PatinaDraftLamp(bpy.types.PropertyGroup):
    """A lamp of the draft."""

    kind: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Light", description="What is known of this lamp", items=LAMP_KINDS
    )
    values: bpy.props.FloatVectorProperty(  # type: ignore[valid-type]
        name="Direction",
        description="Direction from the surface to the lamp, in the axes of the scan",
        size=3,
        default=(0.0, 0.0, 1.0),
    )
    stated: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Measured", description="The values were measured; otherwise they are a guess"
    )


class PatinaDraftCamera(bpy.types.PropertyGroup):
    """A camera of the scan; ``name`` is its label."""


class PatinaDraft(bpy.types.PropertyGroup):
    """Scene.patina_draft."""

    is_open: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="New Capture", description="A new capture is being set up"
    )
    cameras: bpy.props.StringProperty(name="Cameras", subtype="FILE_PATH")  # type: ignore[valid-type]
    mesh: bpy.props.StringProperty(name="Mesh", subtype="FILE_PATH")  # type: ignore[valid-type]
    images: bpy.props.StringProperty(name="Scan Photos", subtype="DIR_PATH")  # type: ignore[valid-type]
    extra: bpy.props.StringProperty(name="Localised Cameras", subtype="FILE_PATH")  # type: ignore[valid-type]
    photos: bpy.props.CollectionProperty(type=PatinaDraftPhoto)  # type: ignore[valid-type]
    active_photo: bpy.props.IntProperty(name="Photo", min=0)  # type: ignore[valid-type]
    lamps: bpy.props.CollectionProperty(type=PatinaDraftLamp)  # type: ignore[valid-type]
    labels: bpy.props.CollectionProperty(type=PatinaDraftCamera)  # type: ignore[valid-type]
    found: bpy.props.StringProperty(name="Recognised")  # type: ignore[valid-type]
    problems: bpy.props.StringProperty(name="Problems")  # type: ignore[valid-type]


def draft_of(scene: bpy.types.Scene) -> Draft:
    """The draft as core's dataclass."""
    state = scene.patina_draft
    names = [lamp.name for lamp in state.lamps]
    return Draft(
        cameras=_path(state.cameras),
        mesh=_path(state.mesh),
        images=_path(state.images),
        extra=_path(state.extra),
        photos=tuple(
            DraftPhoto(
                Path(photo.path),
                photo.camera or None,
                photo.how,
                names.index(photo.lamp) if photo.lamp in names else 0,
                photo.use,
            )
            for photo in state.photos
        ),
        lamps=tuple(
            DraftLamp(
                lamp.name,
                LampKind(lamp.kind),
                tuple(lamp.values),
                lamp.stated or lamp.kind == LampKind.DISTANT.value,
            )
            for lamp in state.lamps
        ),
        found=tuple(line for line in state.found.split("\n") if line),
        problems=tuple(line for line in state.problems.split("\n") if line),
        camera_labels=tuple(camera.name for camera in state.labels),
    )


def store_draft(scene: bpy.types.Scene, draft: Draft) -> None:
    """Store a draft in the scene."""
    state = scene.patina_draft
    state.is_open = True
    state.cameras, state.mesh, state.images, state.extra = (
        "" if path is None else str(path)
        for path in (draft.cameras, draft.mesh, draft.images, draft.extra)
    )
    state.lamps.clear()
    for lamp in draft.lamps:
        item = state.lamps.add()
        item.name, item.kind, item.values = lamp.name, lamp.kind.value, lamp.values
        item.stated = lamp.stated
    state.photos.clear()
    for photo in draft.photos:
        row = state.photos.add()
        row.name, row.path, row.use = photo.file.name, str(photo.file), photo.used
        row.camera, row.how = photo.camera or "", photo.how
        row.lamp = draft.lamps[photo.lamp].name if photo.lamp < len(draft.lamps) else ""
    state.labels.clear()
    for label in draft.camera_labels:
        state.labels.add().name = label
    state.active_photo = min(state.active_photo, max(len(state.photos) - 1, 0))
    state.found, state.problems = "\n".join(draft.found), "\n".join(draft.problems)


def clear_draft(scene: bpy.types.Scene) -> None:
    """Forget the draft."""
    store_draft(scene, Draft())
    scene.patina_draft.is_open = False


def _path(text: str) -> Path | None:
    return Path(bpy.path.abspath(text)) if text else None


register, unregister = register_property_factory(
    bpy.types.Scene,
    "patina_draft",
    PatinaDraftPhoto,
    PatinaDraftLamp,
    PatinaDraftCamera,
    PatinaDraft,
)
