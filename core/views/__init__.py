"""Pictures and charts of a capture and its fit, the same in the report and in Blender."""
