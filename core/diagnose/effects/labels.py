"""Names of the causes for users, and where each cause lies."""

from __future__ import annotations

LABELS = {
    "camera_pose": "Wrong Camera Poses",
    "anisotropy": "Anisotropic Material",
    "normal_error": "Errors of the Normals",
    "veiling_glare": "Veiling Glare",
    "cast_shadow": "Unexplained Shadows",
    "light_intensity": "Wrong Light Intensity",
    "second_material": "Second Material",
    "light_direction": "Wrong Light Direction",
    "subsurface": "Subsurface Scattering",
    "camera_response": "Camera Response",
    "area_light": "Area Light",
    "outside_basis": "Material Outside the Basis",
    "flash_offset": "Wrong Flash Position",
    "black_level": "Black Level",
    "near_light": "Near Light",
    "vignetting": "Vignetting",
    "environment_reflection": "Environment Reflections",
    "clipping": "Clipped Highlights",
    "interreflection": "Interreflection",
    "ambient_light": "Ambient Light",
    "unknown": "Unknown Cause",
    "residual": "Residual",
}

ORIGINS = {
    "Light": (
        "light_intensity", "light_direction", "near_light", "flash_offset", "area_light",
        "ambient_light", "environment_reflection", "interreflection", "cast_shadow",
    ),
    "Camera": ("camera_response", "black_level", "clipping", "vignetting", "veiling_glare"),
    "Scan": ("camera_pose", "normal_error"),
    "Material": ("anisotropy", "second_material", "subsurface", "outside_basis"),
}  # fmt: skip
"""What a user would change, repair or repeat → its causes. The order is that of the report."""


def origin_of(cause: str) -> str:
    """One of ORIGINS; Other for identifiers that are not in it."""
    return next((origin for origin, causes in ORIGINS.items() if cause in causes), "Other")


def cause_label(cause: str) -> str:
    """The name of a cause in Title Case; unknown identifiers are put into words."""
    return LABELS.get(cause, cause.replace("_", " ").title())
