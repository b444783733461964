"""Render a scene that Patina exported: python render.py NAME.xml [--variant V] [--spp N].

Needs Mitsuba 3 (`pip install mitsuba`). scalar_rgb runs everywhere and slowly; llvm_ad_rgb is a
hundred times as fast and needs an LLVM library that Mitsuba likes (19 does, 15 does not).
NAME_spectral.xml wants scalar_spectral or llvm_ad_spectral.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def main() -> None:
    """Render and write the picture beside the scene, as .exr."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--variant", default="")
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--size", type=int, default=128)
    told = parser.parse_args()
    import mitsuba as mi

    spectral = told.scene.stem.endswith("_spectral")
    variant = told.variant or ("scalar_spectral" if spectral else "scalar_rgb")
    mi.set_variant(variant)
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    if "rgb" in variant:
        import patina_bsdf  # noqa: F401  (registers the plugin)
    scene = mi.load_file(str(told.scene), spp=told.spp, size=told.size)
    out = told.scene.with_suffix(".exr")
    mi.util.write_bitmap(str(out), mi.render(scene))
    print(f"wrote {out}")


if __name__ == "__main__":
    main()
