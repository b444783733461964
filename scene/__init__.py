"""The only code that turns Blender data into core types and back."""
