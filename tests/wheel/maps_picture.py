"""Make the picture and the figures of docs/guide/maps.md (needs the bpy wheel, some minutes):

python -m tests.wheel.maps_picture docs/images/maps.jpg
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from tools.package import load_patina

load_patina()

from patina.core.geometry import RayScene, view_surface  # noqa: E402
from patina.core.inputs import capture_data  # noqa: E402
from patina.core.maps.write import base_color  # noqa: E402
from tests.wheel import maps_scene  # noqa: E402
from tests.wheel import test_maps_truth as truth  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
SHOWN_PHOTO = 0  # index of a photo with a highlight and the ball's shadow
SIZE = 512


def coordinates(mesh, face, point):
    """(n, 2) texture coordinates of points on faces."""
    a, b, c = (mesh.vertices[mesh.faces[face, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.maximum(np.einsum("ij,ij->i", normal, normal), 1e-30)
    second = np.einsum("ij,ij->i", np.cross(point - a, c - a), normal) / area
    third = np.einsum("ij,ij->i", np.cross(b - a, point - a), normal) / area
    weights = np.stack([1 - second - third, second, third], axis=1)
    return np.einsum("nk,nkc->nc", weights, mesh.uv[face])


def panels(folder, result):
    """(h, 3 w, 3) sRGB: a photo, the recovered map and the painted map, from its viewpoint."""
    camera = capture_data.camera_of(result.capture, result.scan, SHOWN_PHOTO)
    view = view_surface(RayScene.build(result.scan.mesh), camera)
    uv = coordinates(result.scan.mesh, view.face, view.point)
    size = result.texels.size
    column, row = np.clip((uv * [1, -1] + [0, 1]) * size, 0, size - 1).astype(int).T
    found = result.texels.image(base_color(result, 0))[row, column]
    painted = maps_scene.base_color(uv[:, 0], uv[:, 1])
    photo = maps_scene.photo(folder, SHOWN_PHOTO)
    rest = [np.nan_to_num(view.image(v.astype(np.float64))) for v in (found, painted)]
    return np.concatenate([photo, *rest], axis=1)


def figures(folder, result):
    """The figures in docs/guide/maps.md."""
    expected, found = truth.truth(result.texels), base_color(result, 0)
    cosine, shaded, points = truth.visibility(result.scan, result.texels)
    plain = truth.naive_albedo(folder, points, cosine)
    rows = {
        "seen lit by one photo": result.maps.photos == 1,
        "by two": result.maps.photos == 2,
        "by three or more": result.maps.photos >= 3,
        "by five or more": result.maps.photos >= 5,
        "shaded by the ball in a photo": ((cosine > 0.2) & shaded).any(0)
        & (result.maps.photos > 1),
    }
    fine = truth.resolved(result.texels)
    for name, some in rows.items():
        some = some & fine
        yield (
            f"| {name} | {100 * some.mean():.0f} % | "
            f"{100 * truth.relative_rms(found[some], expected[some]):.1f} % | "
            f"{100 * truth.relative_rms(plain[some], expected[some]):.1f} % |"
        )


def main(out: Path) -> None:
    with tempfile.TemporaryDirectory(prefix="maps_picture_") as name:
        folder = Path(name)
        maps_scene.photograph(folder)
        capture = maps_scene.write_scan(folder)
        for words in (
            ("fit", capture, "--out", folder / "fit"),
            ("maps", capture, folder / "fit", "--out", folder / "maps", "--size", 128),
        ):
            done = truth.headless(ROOT, *words)
            if done.returncode:
                raise SystemExit(done.stderr)
            print(done.stdout)
        result = truth.run_maps_job(folder, size=SIZE)
        print("\n".join(figures(folder, result)))
        write(out, panels(folder, result))


def write(out: Path, linear) -> None:
    """A small JPEG."""
    linear = np.clip(linear, 0, 1)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    data = np.ascontiguousarray(np.round(255 * srgb), np.uint8)
    spec = oiio.ImageSpec(data.shape[1], data.shape[0], 3, "uint8")
    spec.attribute("compression", "jpeg:88")
    file = oiio.ImageOutput.create(str(out))
    file.open(str(out), spec)
    file.write_image(data)
    file.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
