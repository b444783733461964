"""Scan stage: a capture from cameras, a mesh and lit photos that no capture file names yet."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.capture.new_capture import (
    CAMERAS,
    LampWords,
    free_name,
    mesh_beside,
    model_of,
    sort_files,
    write_new_capture,
)
from ..core.errors import InputError, PatinaError
from ..core.scan.formats import read_reconstruction
from ..scene.scan.scan_collection import create_reconstruction
from ..scene.session.folders import rectified_folder
from .import_capture import bring_in
from .report_errors import refuse


class PATINA_OT_new_capture(bpy.types.Operator):
    """Write a capture file beside a scan's cameras and bring it in: choose its lit photos, and \
its mesh where several lie there. Without photos the cameras and their points alone come in"""

    bl_idname = "patina.new_capture"
    bl_label = "New Capture"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE", "HIDDEN"})  # type: ignore[valid-type]
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})  # type: ignore[valid-type]
    files: bpy.props.CollectionProperty(  # type: ignore[valid-type]
        type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"}
    )
    photos_directory: bpy.props.StringProperty(  # type: ignore[valid-type]
        subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"}
    )
    photos: bpy.props.CollectionProperty(  # type: ignore[valid-type]
        type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"}
    )
    cameras: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Cameras",
        description="What the reconstruction tool wrote. Empty: the file that is chosen",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    mesh: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Mesh",
        description="The scan's mesh. Empty: the one that is chosen, or the only one beside the "
        "cameras",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    images: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Scan's Photos",
        description="Folder of the photos that the scan was made from. Empty: not needed",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    chunk: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Chunk",
        description="Label of the chunk, for a Metashape file with several",
        options={"SKIP_SAVE"},
    )
    light: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Light",
        description="What the photos are lit by; its lamp can be dragged into place later",
        items=[
            ("FLASH", "Flash", "On the camera, and nothing else"),
            ("DISTANT", "Distant Lamp", "One that stands still, far away"),
            ("SUN", "Sun", "Where the photos' own time and place have it"),
        ],
    )
    offset: bpy.props.FloatVectorProperty(  # type: ignore[valid-type]
        name="Flash",
        description="Place of the flash: right, down and forward of the lens, scan units",
        size=3,
        soft_min=-10.0,
        soft_max=10.0,
    )
    direction: bpy.props.FloatVectorProperty(  # type: ignore[valid-type]
        name="Direction",
        description="From the surface to the lamp, in the scan's own axes",
        subtype="XYZ",
        size=3,
        default=(0.0, 0.0, 1.0),
        min=-1.0,
        max=1.0,
    )

    def draw(self, context: bpy.types.Context) -> None:
        """Beside the file browser."""
        layout = self.layout
        layout.use_property_split = True
        for name in ("cameras", "mesh", "images", "chunk", "light"):
            layout.prop(self, name)
        if self.light == "FLASH":
            layout.prop(self, "offset")
        elif self.light == "DISTANT":
            layout.prop(self, "direction")

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        dropped = Path(self.filepath) if self.filepath else None
        if dropped is not None and dropped.suffix.lower() in CAMERAS:
            self.cameras = str(model_of(dropped))
        if self.cameras and not self.mesh:
            self.mesh = str(mesh_beside(Path(self.cameras)) or "")
        self.files.clear()
        self.filepath = ""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            cameras, mesh, photos = self._given()
            if not photos:
                return self._cameras_alone(context, cameras)
            if mesh is None:
                raise InputError(
                    "the mesh is missing, or several lie beside the cameras: choose one with the "
                    "photos",
                    key="mesh",
                )
            folder = cameras.parent
            out = free_name(folder, folder.resolve().name or "scan")
            write_new_capture(
                out, cameras, mesh, photos, self._lamp(), self._images(), self.chunk or None
            )
        except PatinaError as error:
            return refuse(self, error)
        done = bring_in(self, context, out)
        if done == {"CANCELLED"}:
            out.unlink(missing_ok=True)  # it said why
            return done
        self.report({"INFO"}, f"wrote {out}")
        return done

    def _given(self) -> tuple[Path, Path | None, tuple[Path, ...]]:
        """(cameras, mesh, photos), of what was chosen, typed and dropped."""
        chosen = [_path(self.directory) / one.name for one in self.files if one.name]
        if not chosen and self.filepath and _path(self.filepath).is_file():
            chosen = [_path(self.filepath)]
        chosen += [_path(self.photos_directory) / one.name for one in self.photos if one.name]
        given = sort_files(chosen)
        cameras = (model_of(_path(self.cameras)),) if self.cameras else given.cameras
        if len(cameras) != 1:
            raise InputError(f"found {len(cameras)} files of cameras, expected one", key="cameras")
        if len(given.meshes) > 1:
            raise InputError(f"found {len(given.meshes)} meshes, expected one", key="mesh")
        mesh = given.meshes[0] if given.meshes else _path(self.mesh) if self.mesh else None
        return cameras[0], mesh or mesh_beside(cameras[0]), given.photos

    def _cameras_alone(self, context: bpy.types.Context, cameras: Path) -> set[str]:
        images = self._images()
        found = read_reconstruction(cameras, images, self.chunk or None)
        name = cameras.stem if cameras.is_file() else cameras.resolve().name
        create_reconstruction(context.scene, name, found, images, rectified_folder(cameras))
        for note in found.notes:
            self.report({"INFO"}, note)
        self.report(
            {"INFO"},
            f"{len(found.cameras)} cameras and {len(found.points):,} points; no photos were "
            "chosen, so nothing can be measured yet",
        )
        return {"FINISHED"}

    def _lamp(self) -> LampWords:
        if self.light == "FLASH":
            return LampWords.flash(self.offset)
        return LampWords.sun() if self.light == "SUN" else LampWords.distant(self.direction)

    def _images(self) -> Path | None:
        return _path(self.images) if self.images else None


def _path(text: str) -> Path:
    return Path(bpy.path.abspath(text))


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_new_capture,))
