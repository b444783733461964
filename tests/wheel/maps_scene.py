"""A painted, bumpy body and a ball that shadows it, photographed by Cycles: each texel's base
colour is known. The mesh given to the fit is coarser than the photographed one.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pycolmap
from mathutils import Matrix, Vector

WIDTH, HEIGHT, FOCAL = 400, 300, 560.0
DISTANCE = 4.2
PHOTOS = 12
IRRADIANCE = 3.0
BODY_TOP, BALL_LOW, BALL_HIGH = 0.66, 0.72, 0.98  # in v: the body has 0.02 … BODY_TOP
ROUGHNESS = 0.35


def base_color(u, v):
    """(…, 3) linear base colour painted at texture coordinates: stripes, spots and a gradient."""
    turn = 2 * np.pi * np.asarray(u)
    v = np.asarray(v)
    stripes = 1 / (1 + np.exp(-6 * np.sin(5 * turn + 9 * v)))
    spots = 1 / (1 + np.exp(-8 * (np.cos(7 * turn) * np.cos(42 * v) - 0.35)))
    red = 0.12 + 0.5 * stripes
    green = 0.10 + 0.30 * spots + 0.18 * (1 - stripes)
    blue = 0.08 + 0.30 * v + 0.12 * stripes * (1 - spots)
    return np.stack(np.broadcast_arrays(red, green, blue), axis=-1)


def surface(columns, rows):
    """(points (n, 3), faces (f, 3), uv (f, 3, 2)) of body and ball, oriented outwards."""
    body = _grid(columns, rows, 0.02, BODY_TOP)
    ball = _grid(columns // 2, rows // 2, BALL_LOW, BALL_HIGH)
    points = np.concatenate([_body(*body[0]), _ball(*ball[0])])
    faces = np.concatenate([body[1], ball[1] + len(body[0][0])])
    return points, faces, np.concatenate([body[2], ball[2]])


def _body(turn, down):
    radius = 1 + 0.08 * np.sin(3 * turn) * np.sin(down) ** 2 + 0.07 * np.cos(4 * down)
    return radius[:, None] * _unit(turn, down)


def _ball(turn, down):
    return np.array([0.75, 0.55, 1.15]) + 0.3 * _unit(turn, down)


def _unit(turn, down):
    return np.stack([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)], -1)


def _grid(columns, rows, low, high):
    """((turn, down) of the points, faces, uv): the seam's points occur twice."""
    u, t = np.meshgrid(np.arange(columns + 1) / columns, np.linspace(0.001, 0.999, rows + 1))
    uv = np.stack([0.02 + 0.96 * u, high + (low - high) * t], axis=-1).reshape(-1, 2)
    row, column = (a.ravel() for a in np.indices((rows, columns)))
    a = row * (columns + 1) + column
    b, c, d = a + columns + 1, a + columns + 2, a + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return (2 * np.pi * u.ravel(), np.pi * t.ravel()), faces, uv[faces]


def shots(count=PHOTOS):
    """(rotation, translation, light) of each photo; light: surface → light."""
    for i in range(count):
        turn = 2 * np.pi * (i * 5 % count) / count
        lift = (0.5, -0.35, 0.9)[i % 3]
        eye = DISTANCE * np.array([np.cos(turn) * np.cos(lift), np.sin(turn) * np.cos(lift),
                                   np.sin(lift)])  # fmt: skip
        forward = -eye / np.linalg.norm(eye)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        away, around = np.radians((22, 50, 75)[(i // 2) % 3]), 2.4 * i
        light = rotation.T @ [
            np.sin(away) * np.cos(around), np.sin(away) * np.sin(around), -np.cos(away)
        ]  # fmt: skip
        yield rotation, -rotation @ eye, light


def photograph(folder: Path, roughness=ROUGHNESS, metallic=0.0, samples=12):
    """Render all photos into ``folder`` as lit_NN.exr: direct light only. roughness: a number, or
    an image of (size, size) over the texture.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.world = bpy.data.worlds.new("black")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes.clear()
    cycles = scene.cycles
    cycles.device, cycles.seed, cycles.samples = "CPU", 0, samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type, cycles.max_bounces = "BOX", 0
    cycles.sample_clamp_direct = cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.resolution_percentage = 100
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    _object(scene, _material(roughness, metallic))
    lens = bpy.data.cameras.new("lens")
    lens.sensor_fit, lens.sensor_width = "HORIZONTAL", 36.0
    lens.lens, lens.clip_start = FOCAL * 36.0 / WIDTH, 0.01
    camera, sun = bpy.data.objects.new("camera", lens), bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = IRRADIANCE, 0.0
    lamp = bpy.data.objects.new("lamp", sun)
    lamp.rotation_mode = "QUATERNION"
    scene.collection.objects.link(camera)
    scene.collection.objects.link(lamp)
    scene.camera = camera
    for i, (rotation, translation, light) in enumerate(shots()):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation.T, -rotation.T @ translation
        camera.matrix_world = Matrix(pose @ np.diag([1.0, -1.0, -1.0, 1.0]))
        lamp.rotation_quaternion = Vector(light).to_track_quat("Z", "Y")
        scene.render.filepath = str(folder / f"lit_{i:02d}.exr")
        bpy.ops.render.render(write_still=True)


def _object(scene, material):
    points, faces, uv = surface(480, 240)
    mesh = bpy.data.meshes.new("body")
    mesh.from_pydata(points.tolist(), [], faces.tolist())
    mesh.uv_layers.new(name="UVMap")
    mesh.uv_layers["UVMap"].uv.foreach_set("vector", uv.astype(np.float32).ravel())
    mesh.shade_smooth()
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("body", mesh))


def _material(roughness, metallic):
    material = bpy.data.materials.new("painted")
    material.use_nodes = True
    tree = material.node_tree
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.distribution = "GGX"
    shader.inputs["Metallic"].default_value = metallic
    u, v = centres(1024)
    _texture(tree, "paint", base_color(u, v), shader.inputs["Base Color"])
    if np.ndim(roughness):
        grey = np.repeat(np.asarray(roughness)[..., None], 3, axis=2)
        _texture(tree, "gloss", grey, shader.inputs["Roughness"])
    else:
        shader.inputs["Roughness"].default_value = roughness
    return material


def _texture(tree, name, pixels, socket):
    size = len(pixels)
    image = bpy.data.images.new(name, size, size, float_buffer=True, is_data=True)
    rgba = np.ones((size, size, 4), np.float32)
    rgba[..., :3] = pixels[::-1]
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs["Color"], socket)


def centres(size):
    """(u, v), each (size, size), of a texture's texels, row 0 on top."""
    at = (np.arange(size) + 0.5) / size
    return np.meshgrid(at, 1 - at)


def write_scan(folder: Path, columns=150, rows=75, uv=True, extra="") -> Path:
    """Write the coarser mesh, the cameras and the capture file; return the path of the latter."""
    points, faces, places = surface(columns, rows)
    lines = [f"v {x:.8g} {y:.8g} {z:.8g}" for x, y, z in points]
    if uv:
        lines += [f"vt {a:.8g} {b:.8g}" for a, b in places.reshape(-1, 2)]
        lines += [
            "f " + " ".join(f"{p + 1}/{3 * i + k + 1}" for k, p in enumerate(face))
            for i, face in enumerate(faces)
        ]
    else:
        lines += ["f " + " ".join(str(p + 1) for p in face) for face in faces]
    (folder / "mesh.obj").write_text("\n".join(lines) + "\n")
    made = pycolmap.Reconstruction()
    parameters = [FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2]
    lens = pycolmap.Camera(
        model="PINHOLE", width=WIDTH, height=HEIGHT, params=parameters, camera_id=1
    )
    made.add_camera_with_trivial_rig(lens)
    text = ["[scan]", 'cameras = "sparse"', 'mesh = "mesh.obj"']
    tail = []
    for i, (rotation, translation, light) in enumerate(shots()):
        image = pycolmap.Image(name=f"view_{i:02d}.jpg", camera_id=1, image_id=i + 1)
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), translation)
        made.add_image_with_trivial_frame(image, pose)
        direction = ", ".join(f"{x:.12g}" for x in light)
        text += ["[[light]]", f'name = "sun{i}"', f"direction = [{direction}]",
                 f"irradiance = [{IRRADIANCE}, {IRRADIANCE}, {IRRADIANCE}]"]  # fmt: skip
        tail += ["[[photo]]", f'file = "lit_{i:02d}.exr"', f'camera = "view_{i:02d}.jpg"',
                 f'light = "sun{i}"']  # fmt: skip
    (folder / "sparse").mkdir(exist_ok=True)
    made.write_binary(str(folder / "sparse"))
    path = folder / "painted.capture.toml"
    path.write_text("\n".join([*text, *tail, extra]) + "\n")
    return path


def photo(folder: Path, i: int) -> np.ndarray:
    """(h, w, 3) of a rendered photo."""
    return np.array(oiio.ImageBuf(str(folder / f"lit_{i:02d}.exr")).get_pixels(oiio.FLOAT))[..., :3]
