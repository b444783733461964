"""Preferences: the cache emptied."""

from __future__ import annotations

import bpy

from ..scene.material.file_cache import MB, cached_files, empty_cache


class PATINA_OT_empty_cache(bpy.types.Operator):
    """Remove what Patina keeps on disk and can make again, except what the open file shows. A \
.blend that was saved after its import may miss photos behind its cameras: import it again then"""

    bl_idname = "patina.empty_cache"
    bl_label = "Empty Cache"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if cached_files():
            return True
        cls.poll_message_set("The cache is empty")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        count, size = empty_cache()
        left = len(cached_files())
        more = f"; {left} are in use by the open file" if left else ""
        self.report({"INFO"}, f"{count} files removed, {size / MB:,.1f} MB{more}")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_empty_cache,))
