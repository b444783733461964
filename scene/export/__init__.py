"""What is written from Blender: .blend, glTF, USD, renders."""
