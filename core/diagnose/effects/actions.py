"""What a user can do about each cause: one sentence."""

from __future__ import annotations

ACTIONS = {
    "camera_pose": "Align the photos again, with more overlap between them.",
    "anisotropy": "Add photos in which the light comes from other sides of the brushed surface.",
    "normal_error": "Scan the object again from more and closer photos.",
    "veiling_glare": "Clean the lens, use a lens hood, and keep bright things out of the frame.",
    "cast_shadow": "Remove what stands before the lamp, or complete the mesh there.",
    "light_intensity": "Lock the exposure, and place a grey card in each photo.",
    "second_material": "Paint a mask for each material.",
    "light_direction": "Find the light from the photos, or place a mirror ball next to the object.",
    "subsurface": "Use the material only for objects of this size: the BRDF has no depth.",
    "camera_response": "Use raw photos, or photograph a colour chart.",
    "area_light": "Use a smaller lamp, or move it farther away.",
    "outside_basis": "Add photos around the highlight and at grazing angles.",
    "flash_offset": "State where the flash is on the camera in the capture.",
    "black_level": "Use raw photos, or subtract a photo taken with the lens cap on.",
    "near_light": "State the position of the lamp in the capture, or move the lamp farther away.",
    "vignetting": "Use a smaller aperture, or apply the profile of the lens.",
    "environment_reflection": "Cover bright surfaces around the object with black cloth.",
    "clipping": "Use a shorter exposure, or a bracket of exposures.",
    "interreflection": "Keep the correction: light from one part of the object to another is real.",
    "ambient_light": "Darken the room, or subtract a photo taken without the lamp.",
}
