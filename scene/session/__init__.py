"""State, folders, preferences and handlers of a Blender session."""
