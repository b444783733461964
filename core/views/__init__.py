"""What a person sees of a capture and its fit: pictures and figures, the same in the report and in
Blender."""
