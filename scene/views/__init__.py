"""Charts, photo comparisons and evidence of causes in Blender's editors."""
