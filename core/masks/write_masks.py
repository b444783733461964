"""Write shadow masks and proposed materials as mask images, with a new capture file that uses
them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..basis import default_basis
from ..capture import Capture
from ..capture.model import SHADOW_MASK
from ..concurrency.job import Job, Step, finished
from ..errors import InputError
from ..files import as_file_name
from ..geometry import RayScene, SurfaceView, edges, view_surface
from ..inputs import capture_data
from ..inputs.photos import LitPhotos
from ..photo import read_mask, write_png
from .capture_text import capture_with_masks
from .proposal import Proposal
from .proposal_job import ProposalJob, capture_lights
from .shadow import light_visibility, to_grey

FOLDER = "masks"


@dataclass(frozen=True)
class MasksSettings:
    """The masks to write. shadows: shadow masks; materials: masks of proposed materials; count:
    their number (None: as many as differ significantly); uncertainty: of the mesh, scan units
    (None: shadow.mesh_uncertainty)."""

    shadows: bool = True
    materials: bool = False
    count: int | None = None
    uncertainty: float | None = None


@dataclass
class WrittenMasks:
    """The written files. capture: the new capture file; shadows, materials: mask files of each
    photo, relative to the capture file; names: the proposed materials; proposal: None if no
    materials were proposed."""

    capture: Path
    shadows: list[str] = field(default_factory=list)
    materials: list[dict[str, str]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    proposal: Proposal | None = None


class MasksJob(Job):
    """Write masks of a capture into ``folder``. final: the folder for which the paths in the new
    capture file are written, if the files are moved later; otherwise the same folder. ``result``
    holds the files when the job is done."""

    def __init__(self, capture: Capture, wanted: MasksSettings, folder: Path, final: Path) -> None:
        super().__init__()
        self.capture, self.wanted = capture, wanted
        self.folder, self.final = folder, final
        self.result: WrittenMasks | None = None

    def run(self) -> Iterator[Step]:
        """Propose the materials, if requested, then write the masks of every photo."""
        capture, wanted = self.capture, self.wanted
        done = WrittenMasks(self.folder / new_name(capture))
        share = 0.0
        if wanted.materials:
            share = 0.6
            proposing = ProposalJob(capture, wanted.count)
            while proposing.step():
                yield Step(proposing.now.stage, share * proposing.now.fraction)
            found = finished(proposing.result)
            scan, rays, lights, done.proposal = (
                found.scan, found.rays, found.lights, found.proposal,
            )  # fmt: skip
            done.names = material_names(done.proposal.count)
        else:
            yield Step("reading the scan", 0.0)
            scan = capture_data.open_scan(capture)
            capture_data.check_photos(capture, scan)
            rays = RayScene.build(scan.mesh)
            photos = LitPhotos.open(capture)
            lights = capture_lights(capture, scan, photos, rays, default_basis())
        (self.folder / FOLDER).mkdir(parents=True, exist_ok=True)
        stems = _stems(capture)
        for place in range(len(capture.photos)):
            part = place / len(capture.photos)
            yield Step("writing the masks", share + (1.0 - share) * part)
            camera = capture_data.camera_of(capture, scan, place)
            view = view_surface(rays, camera)
            if wanted.shadows:
                light = lights.of(capture, place)
                seen = light_visibility(
                    rays, view, light, camera, uncertainty=wanted.uncertainty
                ) if len(view.pixel) else np.zeros(0, np.float32)  # fmt: skip
                grey = view.image(to_grey(seen), fill=0)
                grey[_painted_shadow(capture, place, grey.shape)] = 255
                done.shadows.append(self._write(f"{stems[place]}_{SHADOW_MASK}.png", grey))
            if done.proposal is not None and done.proposal.count > 1:
                done.materials.append(self._materials(done, view, stems[place]))
        text = capture_with_masks(
            capture,
            self.final,
            done.shadows if wanted.shadows else None,
            done.names if done.proposal is not None else None,
            done.materials,
        )
        done.capture.write_text(text, "utf-8")
        self.result = done

    def _materials(self, done: WrittenMasks, view: SurfaceView, stem: str) -> dict[str, str]:
        """Write the material masks of one photo; returns {material: file}."""
        assert done.proposal is not None
        label = done.proposal.labels[view.face]
        outline = edges.widen(view.silhouette, max(self.capture.fit.margins.silhouette - 1, 0))
        files = {}
        for number, name in enumerate(done.names):
            mask = view.image(label == number, fill=0).astype(bool) & ~outline
            files[name] = self._write(f"{stem}_{name}.png", mask * np.uint8(255))
        return files

    def _write(self, name: str, grey: NDArray[np.uint8]) -> str:
        """Write a mask; returns its path relative to the capture file."""
        write_png(self.folder / FOLDER / name, grey)
        return f"{FOLDER}/{name}"


def new_name(capture: Capture) -> str:
    """The file name of the new capture file: that of the capture, which is in another folder."""
    name = capture.file.name
    return name if name.endswith(".capture.toml") else f"{capture.file.stem}.capture.toml"


def check_final(capture: Capture, final: Path) -> None:
    """Raise InputError for a folder in which files of the capture would be overwritten."""
    mine = final / new_name(capture)
    inputs_of_it = {capture.file, *(p.resolve() for photo in capture.photos for p in photo.files)}
    for photo in capture.photos:
        inputs_of_it |= {mask.resolve() for mask in photo.masks.values()}
    room = (final / FOLDER).resolve()
    if mine.resolve() in inputs_of_it or any(room == file.parent for file in inputs_of_it):
        raise InputError(
            "contains files of the capture itself, which would be overwritten; expected a folder "
            "without them; choose another folder",
            file=final,
            key="--out",
        )


def material_names(count: int) -> list[str]:
    """Names of proposed materials, the largest first."""
    return ["surface"] if count == 1 else [f"material_{i + 1}" for i in range(count)]


def _stems(capture: Capture) -> list[str]:
    """File stem of the masks of each photo: that of the photo; all with numbers if any two photos
    have the same."""
    stems = [photo.file.stem for photo in capture.photos]
    if len({as_file_name(stem) for stem in stems}) == len(stems):
        return stems
    return [f"{i + 1:03d}_{stem}" for i, stem in enumerate(stems)]


def _painted_shadow(capture: Capture, place: int, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """(h, w) True in the existing shadow mask of the photo, which is kept."""
    file = capture.photos[place].masks.get(SHADOW_MASK)
    return np.zeros(shape, bool) if file is None else read_mask(file)
