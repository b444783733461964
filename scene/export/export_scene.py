"""The scene that an exporter writes: that of the scan, or a preview sphere for each material."""

from __future__ import annotations

from collections.abc import Container, Sequence
from pathlib import Path

import bpy

from ...core.appearance.principled import Principled
from ...core.appearance.principled_fit import PrincipledFit
from ...core.export.subject import Subject
from ..material import material_nodes, osl_files
from ..material.map_nodes import NORMAL, principled_nodes
from ..material.preview import show_sphere
from ..paint.mesh_paint import COLOUR_ATTRIBUTE
from ..property_keys import EVIDENCE_COLOURS, MEASURED_NAME, VARIATION_COLOURS
from ..scan.vertex_colours import drop_vertex_colours
from .open_blend import open_blend
from .present_result import export_name

RINGS, SEGMENTS = 48, 96  # of a preview sphere
SPACING = 2.5  # between the centres of preview spheres of radius 1


def open_scan(file: Path, names: Sequence[str]) -> bpy.types.Object | None:
    """Open a result's scene.blend; returns its scanned mesh, or None if it has no mesh with all of
    the named materials.

    Raises PatinaError if the file cannot be opened.
    """
    open_blend(file)
    mesh = bpy.context.scene.patina.mesh
    if mesh is None or mesh.type != "MESH" or mesh.name not in bpy.context.scene.objects:
        return None
    measured = [
        s.material for s in mesh.material_slots if s.material and MEASURED_NAME in s.material
    ]
    assigned = {m[MEASURED_NAME] for m in measured} | {export_name(m) for m in measured}
    if not set(names) <= assigned:
        return None
    _drop_own_colours(mesh.data)
    _show(mesh)
    return mesh


def _drop_own_colours(mesh: bpy.types.Mesh) -> None:
    """Remove the colours of evidence, of the variation and of painted materials, which are not the
    scan's."""
    for prefix in (EVIDENCE_COLOURS, VARIATION_COLOURS):
        drop_vertex_colours(mesh, prefix)
    painted = mesh.color_attributes.get(COLOUR_ATTRIBUTE)
    if painted is not None:
        mesh.color_attributes.remove(painted)


def _show(thing: bpy.types.Object) -> None:
    """Unhide an object: exporters skip hidden objects, and the user may have hidden it."""
    thing.hide_viewport = False
    if thing.name not in bpy.context.view_layer.objects:  # its collection is excluded
        bpy.context.scene.collection.objects.link(thing)
        bpy.context.view_layer.update()
    thing.hide_set(False)
    if not thing.visible_get() and thing.name not in bpy.context.scene.collection.objects:
        bpy.context.scene.collection.objects.link(thing)
        bpy.context.view_layer.update()


def new_scene() -> bpy.types.Scene:
    """Open an empty file with factory settings; returns its scene."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True, load_ui=False)
    scene = bpy.context.scene
    if hasattr(scene, "cycles"):
        scene.render.engine = "CYCLES"
        if material_nodes.osl_missing() is None:
            scene.cycles.shading_system = True
    return scene


def create_materials(
    subjects: Sequence[Subject], whole: bool, stack: bool = True
) -> list[bpy.types.Material]:
    """Create the materials.

    whole: with all outputs, as a fit creates them; False: only the Principled that exporters read.
    stack: also fit the lobe stack that EEVEE shows, which takes seconds.
    """
    made = []
    for subject in subjects:
        item = subject.material
        fit = PrincipledFit(
            principled=item.principled,
            error=item.principled_error,
            diffuse_error=item.lambertian_error,
            errors={},
            start="",
            clipped=False,
        )
        files, lobes = None, None
        if whole:
            lobes = subject.lobes if stack else None
            if material_nodes.osl_missing() is None:
                files = osl_files.ensure_files(item.brdf)
        material = material_nodes.create_material(item.name, item.brdf, fit, files, lobes)
        material[MEASURED_NAME] = item.name
        if whole:
            show_sphere(material, item.brdf)
        made.append(material)
    return made


def materials_by_name(
    objects: Sequence[bpy.types.Object], names: Container[str]
) -> dict[str, list[bpy.types.Material]]:
    """The objects' measured materials by their names in the export, those of ``names`` only. A
    material and its copies have one name."""
    found: dict[str, list[bpy.types.Material]] = {}
    slots = [slot for thing in objects for slot in thing.material_slots]
    for material in dict.fromkeys(slot.material for slot in slots if slot.material):
        if MEASURED_NAME in material:
            for name in (export_name(material), str(material[MEASURED_NAME])):
                if name in names:
                    found.setdefault(name, []).append(material)
                    break
    return found


def as_fitted(material: bpy.types.Material, fitted: Principled) -> bool:
    """Whether a material's Principled nodes have the fitted values, and one of them is what is
    exported: no maps on their inputs but normals, and no values or links changed by hand, which an
    export has to keep."""
    nodes = principled_nodes(material)
    shown = material.node_tree.get_output_node("ALL")
    if shown is None or not any(link.from_node in nodes for link in shown.inputs["Surface"].links):
        return False
    for node in nodes:
        if any(socket.is_linked for socket in node.inputs if socket.name != NORMAL):
            return False
        if not material_nodes.has_values(node, fitted):
            return False
    return True


def preview_spheres(made: Sequence[bpy.types.Material]) -> list[bpy.types.Object]:
    """A unit sphere with UVs for each material, in a row along x."""
    scene, found = bpy.context.scene, []
    for place, material in enumerate(made):
        mesh = bpy.data.meshes.new(material.name)
        sphere = bpy.data.objects.new(material.name, mesh)
        fill_sphere(mesh)
        mesh.materials.append(material)
        sphere.location.x = SPACING * place
        scene.collection.objects.link(sphere)
        found.append(sphere)
    bpy.context.view_layer.update()
    return found


def select_only(objects: Sequence[bpy.types.Object]) -> None:
    """Select exactly these objects: exporters write the selection."""
    for item in bpy.context.view_layer.objects:
        item.select_set(item in objects)
    bpy.context.view_layer.objects.active = objects[0]


def fill_sphere(mesh: bpy.types.Mesh, rings: int = RINGS, segments: int = SEGMENTS) -> None:
    """Replace the geometry of a mesh by a smooth unit sphere with UVs."""
    import bmesh

    shape = bmesh.new()
    shape.loops.layers.uv.new("UVMap")
    bmesh.ops.create_uvsphere(
        shape, u_segments=segments, v_segments=rings, radius=1.0, calc_uvs=True
    )
    shape.to_mesh(mesh)
    shape.free()
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
