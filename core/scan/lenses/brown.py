"""Choose the lens model for a tool's distortion: the simplest exact one."""

from __future__ import annotations

from collections.abc import Sequence

Lens = tuple[str, tuple[float, ...]]  # model, parameters (lens.py)


def brown_lens(
    fx: float,
    fy: float,
    cx: float,
    cy: float,
    radial: Sequence[float] = (),
    tangential: Sequence[float] = (0.0, 0.0),
) -> Lens:
    """Brown's lens: x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸) + 2 p1 x y + p2 (r² + 2 x²); y' with
    x and y, and p1 and p2, exchanged. p1 and p2 are in OpenCV's order; k4 is not OpenCV's k4.

    fx, fy, cx, cy: pixels. radial: up to k1 … k4. tangential: p1, p2.
    """
    k1, k2, k3, k4 = (*radial, *(0.0,) * (4 - len(radial)))
    p1, p2 = tangential
    if k4:
        # Metashape's model has this k4; p1 and p2 are exchanged in it, and f is fy
        return "METASHAPE_FRAME", (fy, cx, cy, k1, k2, k3, k4, p2, p1, 0.0, 0.0, fx - fy, 0.0)
    if k3:
        return "FULL_OPENCV", (fx, fy, cx, cy, k1, k2, p1, p2, k3, 0.0, 0.0, 0.0)
    if p1 or p2 or ((k1 or k2) and fx != fy):
        return "OPENCV", (fx, fy, cx, cy, k1, k2, p1, p2)
    if k1 or k2:
        return "RADIAL", (fx, cx, cy, k1, k2)
    if fx != fy:
        return "PINHOLE", (fx, fy, cx, cy)
    return "SIMPLE_PINHOLE", (fx, cx, cy)


def fisheye_lens(fx: float, fy: float, cx: float, cy: float, radial: Sequence[float] = ()) -> Lens:
    """Equidistant lens with a polynomial: r' = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸), θ the angle
    to the optical axis. radial: up to k1 … k4."""
    if not any(radial):
        return "FISHEYE", (fx, fy, cx, cy)
    return "OPENCV_FISHEYE", (fx, fy, cx, cy, *radial, *(0.0,) * (4 - len(radial)))


def panorama_lens(width: int, height: int) -> Lens:
    """The whole sphere: longitude along x, latitude along y; the centre looks along z."""
    return "EQUIRECTANGULAR", (float(width), float(height))
