"""Preferences: empty the cache."""

from __future__ import annotations

import bpy

from ..scene.material.file_cache import MB, cached_files, empty_cache


class PATINA_OT_empty_cache(bpy.types.Operator):
    """Remove the files that Patina can create again, except those that the open file uses. Other \
.blend files may then lack photos behind their cameras; import the capture again in these"""

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
        more = f" Files kept because the open file uses them: {left}." if left else ""
        self.report({"INFO"}, f"Files removed: {count}, {size / MB:,.1f} MB.{more}")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_empty_cache,))
