"""State, folders, preferences and handlers of one Blender session."""
