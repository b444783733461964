"""Files that are written through Blender: .blend, glTF, USD, renders."""
