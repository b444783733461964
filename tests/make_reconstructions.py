"""Write an artificial scene in the format of every reconstruction tool, following the public
descriptions of the formats (which the readers cite)."""

from __future__ import annotations

import json
import math
import struct
import zlib
from pathlib import Path

from tests.make_points_scene import (
    FOCAL,
    HEIGHT,
    WIDTH,
    Scene,
    Vector,
    View,
    axis_angle,
    brown,
    pixels,
    quaternion,
    straightened_by,
    translation,
)


def write_photos(folder: Path, scene: Scene, width: int = WIDTH, height: int = HEIGHT) -> Path:
    """Write grey PNG files of this size."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = zlib.compress((b"\0" + b"\x80" * width) * height)
    data = b"\x89PNG\r\n\x1a\n"
    for kind, content in (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)),
        (b"IDAT", rows),
        (b"IEND", b""),
    ):
        check = struct.pack(">I", zlib.crc32(kind + content))
        data += struct.pack(">I", len(content)) + kind + content + check
    for view in scene.views:
        (folder / view.name).write_bytes(data)
    return folder


def write_bundler(path: Path, scene: Scene, k1: float, k2: float) -> dict[str, list[Vector]]:
    """Write bundle.out v0.3 and list.txt (Bundler)."""
    expected = pixels(scene, brown((k1, k2)), FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2)
    lines = ["# Bundle file v0.3", f"{len(scene.views)} {len(scene.points)}"]
    for view in scene.views:
        right, down, forward = view.rotation
        tx, ty, tz = translation(view)
        lines.append(f"{FOCAL:.10e} {k1:.10e} {k2:.10e}")
        for row in (right, tuple(-v for v in down), tuple(-v for v in forward)):
            lines.append(" ".join(f"{v:.10e}" for v in row))
        lines.append(f"{tx:.10e} {-ty:.10e} {-tz:.10e}")
    for i, (point, colour) in enumerate(zip(scene.points, scene.colours, strict=True)):
        seen = [
            f"{j} {i} {expected[view.name][i][0] - WIDTH / 2:.4f} "
            f"{HEIGHT / 2 - expected[view.name][i][1]:.4f}"
            for j, view in enumerate(scene.views)
        ]
        lines += [" ".join(f"{v:.10e}" for v in point), " ".join(map(str, colour))]
        lines.append(" ".join([str(len(seen)), *seen]))
    path.write_text("\n".join(lines) + "\n")
    listed = "".join(f"./photos/{view.name} 0 {FOCAL}\n" for view in scene.views)
    (path.parent / "list.txt").write_text(listed)
    return expected


def write_nvm(
    path: Path, scene: Scene, r: float, colmap: bool = False, fixed: bool = False
) -> dict[str, list[Vector]]:
    """Write NVM_V3 as VisualSFM does, or as COLMAP does."""
    distort = brown((-r,)) if colmap else straightened_by(r)
    cx, cy = (333.0, 222.0) if fixed else (WIDTH / 2, HEIGHT / 2)
    expected = pixels(scene, distort, FOCAL, FOCAL, cx, cy)
    head = f"NVM_V3 FixedK {FOCAL} {cx} {FOCAL} {cy} {r}" if fixed else "NVM_V3 "
    lines = [head, "", str(len(scene.views))]
    for view in scene.views:
        numbers = (FOCAL, *quaternion(view.rotation), *view.centre, r, 0)
        lines.append(f"photos/{view.name}\t" + " ".join(f"{v:.12g}" for v in numbers))
    lines += ["", str(len(scene.points))]
    origin = (0.0, 0.0) if colmap or fixed else (WIDTH / 2, HEIGHT / 2)
    for i, (point, colour) in enumerate(zip(scene.points, scene.colours, strict=True)):
        words = [f"{v:.12g}" for v in point] + [str(c) for c in colour] + [str(len(scene.views))]
        for j, view in enumerate(scene.views):
            x, y = expected[view.name][i]
            words.append(f"{j} {i} {x - origin[0]:.6g} {y - origin[1]:.6g}")
        lines.append(" ".join(words))
    path.write_text(
        "\n".join(lines) + "\n\n\n0\n#the last part of NVM file points to the PLY files\n"
    )
    return expected


def write_meshroom(
    path: Path, scene: Scene, intrinsic: dict[str, object], version: str = "1.2.5"
) -> None:
    """Write an .sfm (Meshroom) with all numbers in quotes, as Boost does."""

    def quoted(value: object) -> object:
        if isinstance(value, (list, tuple)):
            return [quoted(v) for v in value]
        return value if isinstance(value, (str, dict)) else repr(value)

    views, poses = [], []
    for i, view in enumerate(scene.views):
        views.append({
            "viewId": str(1000 + i), "poseId": str(1000 + i), "frameId": str(i),
            "intrinsicId": "3553739036", "path": f"/somebody/photos/{view.name}",
            "width": str(WIDTH), "height": str(HEIGHT), "metadata": {"ISO": "100"},
        })  # fmt: skip
        by_column = [view.rotation[row][column] for column in range(3) for row in range(3)]
        transform = {"rotation": quoted(by_column), "center": quoted(list(view.centre))}
        pose = {"transform": transform, "locked": "0"}
        poses.append({"poseId": str(1000 + i), "pose": pose})
    structure = [
        {"landmarkId": str(i), "descType": "sift", "color": quoted(list(colour)),
         "X": quoted(list(point)), "observations": []}
        for i, (point, colour) in enumerate(zip(scene.points, scene.colours, strict=True))
    ]  # fmt: skip
    lens = {"intrinsicId": "3553739036", "width": str(WIDTH), "height": str(HEIGHT),
            "locked": "false", **{key: quoted(value) for key, value in intrinsic.items()},
            }  # fmt: skip
    data = {"version": version.split("."), "views": views, "intrinsics": [lens], "poses": poses,
            "structure": structure}  # fmt: skip
    path.write_text(json.dumps(data, indent=4))


def write_transforms(
    path: Path,
    scene: Scene,
    intrinsics: dict[str, object],
    extension: bool = True,
    per_frame: bool = False,
) -> None:
    """Write transforms.json; camera → world, x right, y up, z back."""  # fmt: skip
    frames = []
    for view in scene.views:
        right, down, forward = view.rotation
        rows = [[right[i], -down[i], -forward[i], view.centre[i]] for i in range(3)]
        name = view.name if extension else view.name.removesuffix(".png")
        frame = {"file_path": f"./photos/{name}", "transform_matrix": [*rows, [0, 0, 0, 1]]}
        frames.append(frame | (intrinsics if per_frame else {}))
    shared = {} if per_frame else intrinsics
    path.write_text(json.dumps({**shared, "frames": frames}))


def write_openmvg(path: Path, scene: Scene, kind: str, intrinsic: dict[str, object]) -> None:
    """Write sfm_data.json (OpenMVG), as the library cereal does."""
    views = [
        {"key": i, "value": {"polymorphic_id": 1 << 30, "ptr_wrapper": {
            "id": (1 << 31) + 1 + i,
            "data": {"local_path": "", "filename": view.name, "width": WIDTH, "height": HEIGHT,
                     "id_view": i, "id_intrinsic": 0, "id_pose": i}}}}
        for i, view in enumerate(scene.views)
    ]  # fmt: skip
    lens = {"key": 0, "value": {
        "polymorphic_id": (1 << 31) + 1, "polymorphic_name": kind,
        "ptr_wrapper": {"id": (1 << 31) + 9,
                        "data": {"width": WIDTH, "height": HEIGHT, **intrinsic}}}}  # fmt: skip
    poses = [
        {"key": i, "value": {"rotation": [list(row) for row in view.rotation],
                             "center": list(view.centre)}}
        for i, view in enumerate(scene.views)
    ]  # fmt: skip
    points = [
        {"key": i, "value": {"X": list(point), "observations": []}}
        for i, point in enumerate(scene.points)
    ]
    data = {"sfm_data_version": "0.3", "root_path": "/somebody/photos", "views": views,
            "intrinsics": [lens], "extrinsics": poses, "structure": points,
            "control_points": []}  # fmt: skip
    path.write_text(json.dumps(data))


def write_opensfm(path: Path, scene: Scene, camera: dict[str, object]) -> None:
    """Write reconstruction.json (OpenSfM)."""
    shots = {
        view.name: {"rotation": list(axis_angle(view.rotation)), "orientation": 1,
                    "translation": list(translation(view)), "camera": "v2 a camera"}
        for view in scene.views
    }  # fmt: skip
    points = {
        str(i): {"coordinates": list(point), "color": [float(c) for c in colour]}
        for i, (point, colour) in enumerate(zip(scene.points, scene.colours, strict=True))
    }
    lens = {"width": WIDTH, "height": HEIGHT, **camera}
    place = {"latitude": -33.5, "longitude": 151.25, "altitude": 12.0}
    data = [{"cameras": {"v2 a camera": lens}, "shots": shots, "points": points,
             "reference_lla": place}]  # fmt: skip
    path.write_text(json.dumps(data))


def heading_pitch_roll(view: View) -> Vector:
    """Return angles in degrees: camera → world (x right, y up, z back) is Rz(−heading) Rx(pitch)
    Ry(roll)."""
    right, down, forward = view.rotation
    up, back = tuple(-v for v in down), tuple(-v for v in forward)
    # rows of the matrix are the world's axes: m[i][0] = right[i], m[i][1] = up[i] …
    pitch = math.asin(up[2])
    heading = math.atan2(up[0], up[1])
    roll = math.atan2(-right[2], back[2])
    return tuple(math.degrees(v) for v in (heading, pitch, roll))


def write_realityscan_csv(
    path: Path, scene: Scene, distortion: Vector, centre: Vector, newer: bool = False
) -> None:
    """Write the CSV of RealityScan. distortion: k1 … k4, t1, t2; centre: px, py."""
    columns = "name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2"
    if newer:
        columns = "name,x,y,alt,yaw,pitch,roll,f_35mm,px_norm,py_norm,k1,k2,k3,k4,t1,t2"
    lines = [f"#cameras {len(scene.views)}", f"#{columns}"]
    f = FOCAL / max(WIDTH, HEIGHT) * 36
    for view in scene.views:
        numbers = (*view.centre, *heading_pitch_roll(view), f, *centre, *distortion)
        lines.append(",".join([view.name, *(repr(v) for v in numbers)]))
    path.write_text("\n".join(lines) + "\n")


def write_realityscan_xmp(
    folder: Path,
    scene: Scene,
    model: str,
    distortion: Vector,
    centre: Vector,
    elements: bool = True,
) -> None:
    """Write one .xmp per photo; values as elements or as attributes."""  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    f = FOCAL / max(WIDTH, HEIGHT) * 36
    for view in scene.views:
        values = {
            "Rotation": " ".join(repr(v) for row in view.rotation for v in row),
            "Position": " ".join(repr(v) for v in view.centre),
            "DistortionCoeficients": " ".join(repr(v) for v in distortion),
        }
        attributes = "" if elements else "".join(f' xcr:{k}="{v}"' for k, v in values.items())
        inner = "".join(f"<xcr:{k}>{v}</xcr:{k}>\n" for k, v in values.items()) if elements else ""
        (folder / view.name).with_suffix(".xmp").write_text(
            '<x:xmpmeta xmlns:x="adobe:ns:meta/">\n'
            '  <rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">\n'
            '    <rdf:Description xcr:Version="3" xcr:PosePrior="exact" xcr:Coordinates="absolute"'
            f' xcr:DistortionModel="{model}" xcr:FocalLength35mm="{f!r}" xcr:Skew="0"'
            f' xcr:AspectRatio="1" xcr:PrincipalPointU="{centre[0]!r}"'
            f' xcr:PrincipalPointV="{centre[1]!r}" xcr:InTexturing="1"{attributes}'
            ' xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#">\n'
            f"{inner}    </rdf:Description>\n  </rdf:RDF>\n</x:xmpmeta>\n"
        )
