"""The science of Patina: numpy in, numpy out. Nothing below this folder imports bpy."""
