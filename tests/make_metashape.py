"""Write files of Metashape and PhotoScan from an artificial scene with known projections.

Independent of the code under test: lenses follow the formulas of Metashape's manual, evaluated for
one point at a time, and files are assembled as text, for document versions 1.2, 1.5 and 2.0.
"""

from __future__ import annotations

import math
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

LOCAL = 'LOCAL_CS["Local Coordinates (m)",LOCAL_DATUM["Local Datum",0],UNIT["metre",1]]'
WGS84 = (
    'GEOGCS["WGS 84",DATUM["World Geodetic System 1984",SPHEROID["WGS 84",6378137,298.257223563]],'
    'PRIMEM["Greenwich",0],UNIT["degree",0.01745329251994328],AUTHORITY["EPSG","4326"]]'
)

PARAMETERS = ("cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4", "b1", "b2")
CLOSE = 0.01  # pixels


@dataclass
class Sensor:
    """One sensor. values: f, k1 … b2, and cx, cy as offsets from the centre. offset: (R, t) to the
    master sensor of a rig."""

    kind: str = "frame"
    width: int = 4000
    height: int = 3000
    values: dict = field(default_factory=dict)
    offset: tuple | None = None
    label: str = "lens"
    adjusted: bool = True

    def project(self, X, Y, Z):
        """Project a point in the camera frame to (u, v)."""
        if self.kind == "spherical":
            across = self.width / (2 * math.pi)
            return (
                self.width / 2 + across * math.atan2(X, Z),
                self.height / 2 + across * math.atan2(Y, math.hypot(X, Z)),
            )
        v = {name: 0.0 for name in PARAMETERS} | self.values
        if self.kind == "frame":
            x, y = X / Z, Y / Z
        else:
            R = math.hypot(X, Y)
            theta = math.atan2(R, Z)
            bent = 2 * math.sin(theta / 2) if self.kind == "equisolid_fisheye" else theta
            x, y = (X * bent / R, Y * bent / R) if R else (0.0, 0.0)
        r2 = x * x + y * y
        radial = 1 + v["k1"] * r2 + v["k2"] * r2**2 + v["k3"] * r2**3 + v["k4"] * r2**4
        more = 1 + v["p3"] * r2 + v["p4"] * r2**2
        x1 = x * radial + (v["p1"] * (r2 + 2 * x * x) + 2 * v["p2"] * x * y) * more
        y1 = y * radial + (v["p2"] * (r2 + 2 * y * y) + 2 * v["p1"] * x * y) * more
        return (
            self.width / 2 + v["cx"] + x1 * v["f"] + x1 * v["b1"] + y1 * v["b2"],
            self.height / 2 + v["cy"] + y1 * v["f"],
        )


@dataclass
class Camera:
    """One camera. matrix: (4, 4) camera → chunk (or component)."""

    label: str
    matrix: np.ndarray
    sensor: int = 0
    group: str | None = None
    component: int | None = None
    master: int | None = None
    enabled: bool = True
    aligned: bool = True
    extra: str = ""


@dataclass
class Scene:
    """Content of a chunk. transform, components: (rotation, translation, scale) to the world."""

    sensors: list
    cameras: list
    transform: tuple | None = None
    components: dict = field(default_factory=dict)
    active: int = 0
    reference: str = LOCAL
    label: str = "Chunk 1"


def rotation(rng) -> np.ndarray:
    """Return a random rotation (Shoemake's method)."""
    q = rng.normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def toe_in(rng) -> np.ndarray:
    """Return a rotation by a few degrees, as between the cameras of a rig."""
    a, b = rng.uniform(-0.1, 0.1, 2)
    about_y = np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]])
    about_z = np.array([[math.cos(b), -math.sin(b), 0], [math.sin(b), math.cos(b), 0], [0, 0, 1]])
    return about_y @ about_z


def looking_at_origin(place, rng) -> np.ndarray:
    """Return (4, 4) camera → chunk of a camera at ``place``, z to the origin, with random roll."""
    place = np.asarray(place, float)
    z = -place / np.linalg.norm(place)
    x = np.cross(rng.normal(size=3), z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    matrix[:3, 3] = place
    return matrix


def motion(R, t) -> np.ndarray:
    """Return the (4, 4) matrix of a motion."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, t
    return matrix


def truth(scene: Scene, camera: Camera, points) -> np.ndarray:
    """Return pixels (n, 2) of points (n, 3) in the frame of the camera's matrix."""
    inverse = np.linalg.inv(camera.matrix)
    lens = scene.sensors[camera.sensor]
    return np.array([lens.project(*(inverse[:3, :3] @ p + inverse[:3, 3])) for p in points])


def _text(values) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(values))


def _transform(similarity, tag="transform") -> str:
    R, t, scale = similarity
    return (
        f'<{tag}><rotation locked="false">{_text(R)}</rotation><translation locked="false">'
        f'{_text(t)}</translation><scale locked="false">{float(scale)!r}</scale></{tag}>'
    )


def _calibration(sensor: Sensor, old: bool) -> str:
    size = f'<resolution width="{sensor.width}" height="{sensor.height}"/>'
    if not sensor.values:
        return ""
    values = dict(sensor.values)
    if old:  # PhotoScan: fx, fy, absolute cx, cy, skew
        f, b1 = values.pop("f"), values.pop("b1", 0.0)
        skew = values.pop("b2", 0.0)
        cx = values.pop("cx", 0.0) + sensor.width / 2
        cy = values.pop("cy", 0.0) + sensor.height / 2
        values = {"fx": f + b1, "fy": f, "cx": cx, "cy": cy, "skew": skew, **values}
    inside = "".join(f"<{k}>{float(v)!r}</{k}>" for k, v in values.items() if v != 0)
    level = "adjusted" if sensor.adjusted else "initial"
    return f'<calibration type="{sensor.kind}" class="{level}">{size}{inside}</calibration>'


def _sensor(number: int, sensor: Sensor, old: bool) -> str:
    offset = ""
    if sensor.offset is not None:
        R, t = sensor.offset
        offset = (
            f'<rotation locked="true">{_text(R)}</rotation>'
            f'<location locked="true">{_text(t)}</location>'
        )
    return f"""
      <sensor id="{number}" label={quoteattr(sensor.label)} type="{sensor.kind}">
        <resolution width="{sensor.width}" height="{sensor.height}"/>
        <property name="pixel_width" value="0.004"/>
        <property name="layer_index" value="0"/>
        <bands><band label="Red"/><band label="Green"/><band label="Blue"/></bands>
        <data_type>uint8</data_type>
        {_calibration(sensor, old)}{offset}
        <covariance><params>f cx</params><coeffs>1 0 0 1</coeffs></covariance>
        <meta><property name="Exif/Make" value="Canon"/></meta>
      </sensor>"""


def _camera(number: int, camera: Camera) -> str:
    attributes = f'id="{number}" sensor_id="{camera.sensor}" label={quoteattr(camera.label)}'
    if camera.component is not None:
        attributes += f' component_id="{camera.component}"'
    if not camera.enabled:
        attributes += ' enabled="false"'
    inside = camera.extra + "<orientation>6</orientation>"
    if camera.master is not None:
        attributes += f' master_id="{camera.master}"'
    elif camera.aligned:
        inside = f"<transform>{_text(camera.matrix)}</transform>" + inside
    return f'<camera {attributes}>{inside}<reference x="1" y="2" z="3" enabled="true"/></camera>\n'


def chunk_xml(scene: Scene, version="2.0.0", extra="", attributes="") -> str:
    """Return the <chunk> element."""
    old = version.startswith("1.2")
    sensors = "".join(_sensor(i, s, old) for i, s in enumerate(scene.sensors))
    groups: dict = {}
    for number, camera in enumerate(scene.cameras):
        groups.setdefault(camera.group, []).append(_camera(number, camera))
    cameras = "".join(
        "".join(lines)
        if name is None
        else f'<group id="{i}" label={quoteattr(name)} type="folder">{"".join(lines)}</group>'
        for i, (name, lines) in enumerate(groups.items())
    )
    components = ""
    if scene.components:
        inside = "".join(
            f'<component id="{i}" label="Component {i + 1}">{_transform(t) if t else ""}'
            "<region><center>0 0 0</center><size>1 1 1</size><R>1 0 0 0 1 0 0 0 1</R></region>"
            "</component>"
            for i, t in scene.components.items()
        )
        components = f'<components next_id="9" active_id="{scene.active}">{inside}</components>'
    world = _transform(scene.transform) if scene.transform else ""
    return f"""<chunk label={quoteattr(scene.label)} enabled="true" {attributes}>
    <sensors next_id="{len(scene.sensors)}">{sensors}
    </sensors>
    {components}
    <cameras next_id="{len(scene.cameras)}" next_group_id="0">
    {cameras}</cameras>
    <reference>{scene.reference}</reference>
    {world}
    <region><center>0 0 0</center><size>1 1 1</size><R>1 0 0 0 1 0 0 0 1</R></region>
    <settings><property name="accuracy_cameras" value="10"/></settings>{extra}
  </chunk>"""


HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'


def document(*chunks: str, version="2.0.0", active=None) -> str:
    """Return cameras.xml, with one <chunk>, or several in <chunks>."""
    inside = "\n".join(chunks)
    if len(chunks) > 1:
        which = "" if active is None else f' active_id="{active}"'
        inside = f"<chunks{which}>{inside}</chunks>"
    return f'{HEAD}<document version="{version}">\n  {inside}\n</document>\n'


FULL = {
    "f": 3600.0, "cx": 21.5, "cy": -13.25, "k1": -0.11, "k2": 0.09, "k3": -0.02, "k4": 0.006,
    "p1": 4e-4, "p2": -7e-4, "p3": 0.15, "p4": -0.05, "b1": 4.5, "b2": -2.25,
}  # fmt: skip
BROWN = {k: FULL[k] for k in ("f", "cx", "cy", "k1", "k2", "k3", "p1", "p2")}
FISH = {"f": 1500.0, "cx": 11.0, "cy": 7.0, "k1": 0.02, "k2": -0.004, "p1": 2e-4, "p2": 3e-4}
FULL_FISH = {**FISH, "k3": 1e-3, "k4": -1e-4, "p3": 0.1, "b1": 3.0, "b2": 1.5}


def ring(rng, count, sensor=0, **more):
    """Return cameras around the origin, at a distance of 4."""
    places = rng.normal(size=(count, 3))
    places *= 4 / np.linalg.norm(places, axis=1, keepdims=True)
    return [
        Camera(f"IMG_{i:04d}", looking_at_origin(place, rng), sensor, **more)
        for i, place in enumerate(places)
    ]


def scene(version: str, seed: int = 0) -> Scene:
    """Return a scene with all features of a document version."""
    rng = np.random.default_rng(seed)
    if version.startswith("1.2"):
        values = {k: v for k, v in FULL.items() if k not in ("p3", "p4")}
        cameras = ring(rng, 6)
        cameras[1].enabled = False
        cameras[2].aligned = False
        world = rotation(rng), rng.normal(size=3), 0.37
        return Scene([Sensor(values=values)], cameras, transform=world)
    sensors = [
        Sensor(values=FULL, label="full"),
        Sensor(values=BROWN, label="brown", offset=(toe_in(rng), rng.normal(size=3) * 0.1)),
        Sensor("fisheye", values=FISH, label="fisheye"),
        Sensor(values={"f": 5000.0}, label="bare"),
        Sensor("fisheye", values=FULL_FISH, label="full fisheye"),
    ]
    if version.startswith("2"):
        sensors.append(Sensor("equisolid_fisheye", values=FULL_FISH, label="equisolid"))
        sensors.append(Sensor("equidistant_fisheye", values=FISH, label="equidistant"))
        sensors.append(Sensor("spherical", 4000, 2000, label="panorama"))
    cameras = ring(rng, 8, component=0)
    for number in (2, 3):
        cameras[number].group = "left & right"
    cameras[4].enabled = False
    cameras[5].aligned = False
    slave = cameras[6]  # hangs on the first
    slave.sensor, slave.master = 1, 0
    slave.matrix = cameras[0].matrix @ motion(*sensors[1].offset)
    lost = cameras[7]  # hangs on the one that is not aligned
    lost.sensor, lost.master, lost.aligned = 1, 5, False
    for number in range(2, len(sensors)):
        extra = ring(rng, 2, number, component=0)
        for camera in extra:
            camera.label = f"S{number}_{camera.label}"
        cameras += extra
    world = rotation(rng), rng.normal(size=3) * 10, 1.7
    return Scene(sensors, cameras, components={0: world})


def read_from(made: Scene) -> dict:
    """Return label → camera, for the cameras that a reader should return."""
    return {c.label: c for c in made.cameras if c.enabled and c.aligned}


def simple(count=3, **more) -> Scene:
    """Return a scene with one frame lens."""
    return Scene([Sensor(values=BROWN)], ring(np.random.default_rng(0), count, **more))


def agree(reconstruction, scene: Scene) -> None:
    """Check that every camera that was read projects 1,000 points to the expected pixels."""
    points = np.random.default_rng(5).uniform(-1.0, 1.0, (1000, 3))
    expected = read_from(scene)
    assert {c.label for c in reconstruction.cameras} == set(expected)
    for camera in reconstruction.cameras:
        pixels = truth(scene, expected[camera.label], points)
        assert np.abs(camera.project(points) - pixels).max() < CLOSE, camera.label


def write_psx(folder: Path, name: str, chunks: list[str], photos=None, active=0) -> Path:
    """Write NAME.psx and NAME.files. photos: camera id → path, for the frame of each chunk."""
    path = folder / f"{name}.psx"
    path.write_text(f'{HEAD}<document version="1.2.0" path="{{projectname}}.files/project.zip"/>\n')
    files = folder / f"{name}.files"
    listed = "".join(f'<chunk id="{i}" path="{i}/chunk.zip"/>' for i in range(len(chunks)))
    write_zip(
        files / "project.zip",
        {"doc.xml": f'<document version="1.2.0"><chunks active_id="{active}">{listed}</chunks>'
         "</document>"},
    )  # fmt: skip
    frames = '<frames next_id="1"><frame id="0" path="0/frame.zip"/></frames>'
    for i, chunk in enumerate(chunks):
        text = chunk.replace("</chunk>", f"{frames}</chunk>")
        write_zip(files / str(i) / "chunk.zip", {"doc.xml": HEAD + text})
        write_zip(files / str(i) / "0" / "frame.zip", {"doc.xml": frame_xml(photos or {})})
    return path


def frame_xml(photos: dict) -> str:
    """Return the document of a frame."""
    cameras = "".join(
        f'<camera camera_id="{i}"><photo path={quoteattr(path)}><meta/></photo></camera>'
        for i, path in photos.items()
    )
    return (
        f'{HEAD}<frame version="1.2.0"><cameras>{cameras}</cameras>'
        '<model id="0" path="model/model.zip"/></frame>'
    )


def write_psz(path: Path, chunks: list[str], photos=None, active=0) -> Path:
    """Write everything in one document, NAME.psz."""
    frames = f"<frames>{frame_xml(photos or {}).removeprefix(HEAD)}</frames></chunk>"
    inside = "".join(c.replace("</chunk>", frames) for c in chunks)
    text = (
        f'{HEAD}<document version="1.2.0"><chunks active_id="{active}">{inside}</chunks></document>'
    )
    return write_zip(path, {"doc.xml": text})


def write_zip(path: Path, members: dict) -> Path:
    """Write a zip archive."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return path
