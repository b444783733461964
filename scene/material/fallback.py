"""Use the portable material in Cycles if the measured shader cannot run.

Cycles renders a script node as black if Open Shading Language is off or it renders on a GPU. The
output for Cycles is then linked to the portable branch, and back to the shader when it can run.
"""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ..session.handlers import register_handlers_factory
from .material_nodes import osl_missing
from .osl_files import own_materials, script_nodes


def osl_hindrance(scene: bpy.types.Scene) -> str | None:
    """Why renders of this scene do not show the measured shader (for the user); None if they do."""
    missing = osl_missing()
    if missing is not None:
        return missing
    if scene.render.engine != "CYCLES":
        return "only Cycles renders the measured BRDF, and this scene uses another render engine"
    if scene.cycles.device == "GPU" and _gpu_enabled():
        return "the measured BRDF needs the CPU; set the device to CPU in the Render properties"
    if not scene.cycles.shading_system:
        return "Open Shading Language is off; enable it in the Render properties"
    return None


def update_fallback(scene: bpy.types.Scene) -> int:
    """Link each Patina material's Cycles output to a branch that can run; returns the number of
    changed materials."""
    if scene.render.engine != "CYCLES":
        return 0  # other engines have outputs of their own
    runs = osl_hindrance(scene) is None
    return sum(
        _link_output(material, node, runs)
        for material in own_materials()
        for node in script_nodes(material)[:1]
    )


def _link_output(material: bpy.types.Material, measured: bpy.types.Node, runs: bool) -> bool:
    tree = material.node_tree
    outputs = {n.target: n for n in tree.nodes if n.type == "OUTPUT_MATERIAL"}
    portable = next(
        (
            outputs[target].inputs["Surface"].links[0].from_node
            for target in ("EEVEE", "ALL")
            if target in outputs and outputs[target].inputs["Surface"].links
        ),
        None,
    )
    links = outputs["CYCLES"].inputs["Surface"].links if "CYCLES" in outputs else ()
    if portable is None or not links:
        return False
    current, wanted = links[0].from_node, measured if runs else portable
    if current not in (measured, portable) or current == wanted:  # the user's own links stay
        return False
    tree.links.new(wanted.outputs["BSDF"], outputs["CYCLES"].inputs["Surface"])
    return True


def _gpu_enabled() -> bool:
    """Whether the preferences select a device for "GPU"."""
    cycles = bpy.context.preferences.addons.get("cycles")
    return cycles is not None and cycles.preferences.compute_device_type != "NONE"


@persistent
def _after_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if any(isinstance(update.id, bpy.types.Scene) for update in depsgraph.updates):
        update_fallback(scene)


@persistent
def _after_load(*_: object) -> None:
    update_fallback(bpy.context.scene)


@persistent
def _before_render(scene: bpy.types.Scene, *_: object) -> None:
    update_fallback(scene)


HANDLERS = (
    ("depsgraph_update_post", _after_update),
    ("load_post", _after_load),
    ("render_pre", _before_render),
)
register, unregister = register_handlers_factory(HANDLERS)
