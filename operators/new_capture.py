"""Scan stage: write a new capture file from cameras, a mesh and lit photos, and import it. For
scripts: in a window the capture is set up in the panel (operators/draft)."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.capture.new_capture import (
    LampText,
    free_name,
    mesh_in_folder,
    model_of,
    sort_files,
    write_new_capture,
)
from ..core.errors import InputError, PatinaError
from ..core.scan.formats import read_reconstruction
from ..scene.scan.orientation import set_upright
from ..scene.scan.scan_collection import create_reconstruction
from ..scene.session.folders import rectified_folder
from .import_capture import import_written
from .report_errors import call_operator, report_and_cancel


class PATINA_OT_new_capture(bpy.types.Operator):
    """Write a capture file in the folder of the cameras and import it. Select the lit photos, and \
the mesh if the folder holds several. Without photos, only cameras and sparse points are imported"""

    bl_idname = "patina.new_capture"
    bl_label = "New Capture from Files"
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
        description="Cameras written by the reconstruction tool. If empty, the selected file",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    mesh: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Mesh",
        description="Mesh of the scan. If empty, the selected one, or the only one in the folder "
        "of the cameras",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    images: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Scan Photos",
        description="Folder of the photos that the scan was reconstructed from (optional)",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    chunk: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Chunk",
        description="Label of the chunk, for a Metashape file with several chunks",
        options={"SKIP_SAVE"},
    )
    light: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Light",
        description="Light source of the photos; its lamp can be moved into place later",
        items=[
            ("FLASH", "Flash", "A flash on the camera and no other light"),
            ("DISTANT", "Distant Lamp", "A fixed lamp far away"),
            ("SUN", "Sun", "The sun, in the direction given by the time and place of the photos"),
        ],
    )
    offset: bpy.props.FloatVectorProperty(  # type: ignore[valid-type]
        name="Flash Offset",
        description="Position of the flash right, down and forward of the lens, in scan units",
        size=3,
        soft_min=-10.0,
        soft_max=10.0,
    )
    direction: bpy.props.FloatVectorProperty(  # type: ignore[valid-type]
        name="Direction",
        description="Direction from the surface to the lamp, in the axes of the scan",
        subtype="XYZ",
        size=3,
        default=(0.0, 0.0, 1.0),
        min=-1.0,
        max=1.0,
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Set the capture up in the panel, where nothing chosen is lost."""
        return call_operator(
            self, bpy.ops.patina.add_files, "INVOKE_DEFAULT",
            filepath=self.filepath, directory=self.directory,
            files=[{"name": one.name} for one in self.files],
        )  # fmt: skip

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            cameras, mesh, photos = self._given()
            if not photos:
                return self._cameras_alone(context, cameras)
            if mesh is None:
                raise InputError(
                    "found no mesh, or several, in the folder of the cameras; select one together "
                    "with the photos",
                    key="mesh",
                )
            folder = cameras.parent
            out = free_name(folder, folder.resolve().name or "scan")
            write_new_capture(
                out, cameras, mesh, photos, self._lamp(), self._images(), self.chunk or None
            )
        except PatinaError as error:
            return report_and_cancel(self, error)
        return import_written(self, context, out)

    def _given(self) -> tuple[Path, Path | None, tuple[Path, ...]]:
        """(cameras, mesh, photos) from the selected files, the properties and the dropped files."""
        paths = [_path(self.directory) / one.name for one in self.files if one.name]
        if not paths and self.filepath and _path(self.filepath).is_file():
            paths = [_path(self.filepath)]
        paths += [_path(self.photos_directory) / one.name for one in self.photos if one.name]
        given = sort_files(paths)
        cameras = (model_of(_path(self.cameras)),) if self.cameras else given.cameras
        if len(cameras) != 1:
            raise InputError(
                f"found {len(cameras)} camera files, expected one; select exactly one",
                key="cameras",
            )
        if len(given.meshes) > 1:
            raise InputError(
                f"found {len(given.meshes)} meshes, expected one; select exactly one", key="mesh"
            )
        mesh = given.meshes[0] if given.meshes else _path(self.mesh) if self.mesh else None
        return cameras[0], mesh or mesh_in_folder(cameras[0]), given.photos

    def _cameras_alone(self, context: bpy.types.Context, cameras: Path) -> set[str]:
        images = self._images()
        found = read_reconstruction(cameras, images, self.chunk or None)
        name = cameras.stem if cameras.is_file() else cameras.resolve().name
        create_reconstruction(context.scene, name, found, images, rectified_folder(cameras))
        set_upright(context.scene)
        for note in found.notes:
            self.report({"INFO"}, note)
        self.report(
            {"INFO"},
            f"Imported: cameras {len(found.cameras)}, points {len(found.points):,}. No photos were "
            "selected, so materials cannot be measured yet.",
        )
        return {"FINISHED"}

    def _lamp(self) -> LampText:
        given = self.properties.is_property_set
        if self.light == "FLASH":
            return LampText.flash(self.offset, guess=not given("offset"))
        if self.light == "SUN":
            return LampText.sun()
        return LampText.distant(self.direction, guess=not given("direction"))

    def _images(self) -> Path | None:
        return _path(self.images) if self.images else None


def _path(text: str) -> Path:
    return Path(bpy.path.abspath(text))


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_new_capture,))
