"""Charts, photo comparisons and evidence shown in Blender's editors."""
