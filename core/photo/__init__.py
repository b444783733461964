"""Read image files as linear radiance, with exposure and noise; read masks and write images."""

from .bracket import Merged, merge_bracket
from .clipping import black, clipped
from .exif import Exif, read_exif
from .image import image_size, read_encoded, read_mask, write_exr, write_jpeg, write_png
from .noise_estimate import estimate_noise
from .photo import Photo, PhotoInfo, read_photo, read_radiance
from .transfer import Transfer

__all__ = [
    "Exif",
    "Merged",
    "Photo",
    "PhotoInfo",
    "Transfer",
    "black",
    "clipped",
    "estimate_noise",
    "image_size",
    "merge_bracket",
    "read_encoded",
    "read_exif",
    "read_mask",
    "read_photo",
    "read_radiance",
    "write_exr",
    "write_jpeg",
    "write_png",
]
