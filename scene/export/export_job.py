"""Export the materials of the open .blend for other programs, as ``headless material`` does.

The .blend stores the fit in the form of result.json. The job writes this to a temporary folder,
with a copy of the .blend as scene.blend, and then calls the functions of the command ``material``.
Blender's own formats have to open other files, so that a second Blender process writes them.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from typing import Any

import bpy

from ...core.concurrency.job import Job, Step
from ...core.errors import InputError, PatinaError
from ...core.export import Loss
from ...core.export.export_job import ExportMaterialsJob
from ...core.export.material_formats import BLENDER
from ...core.jobs import CaptureResult
from ...core.output_folder import check_out, staged_folder
from ...core.report.report_job import ReportJob
from ...core.report.result_json import write_json
from ...core.varying import storage
from ..material.trait_update import finish_updates
from ..session.background_blender import in_background
from ..session.child_processes import in_child
from ..session.last_fit import kept_fit
from ..session.scene_properties import DIAGNOSIS, capture_path, stored_result
from .export_choice import FORMATS, RECORD, REPORT, missing
from .present_result import present_result

MARKS = ("losses.txt", "result.json", "report/index.html")  # files that identify an earlier export
FIT = ("scene.blend",)  # identifies the output folder of `fit`, which is never overwritten


class ExportJob(Job):
    """Export the materials of the last fit as they are now; record and report are those of the
    fit. formats: entries of FORMATS; cache: folder of the
    bases that were computed from the user's own MERL files. Raises PatinaError."""

    def __init__(
        self, scene: bpy.types.Scene, formats: Sequence[str], out: Path, cache: Path
    ) -> None:
        super().__init__()
        capture = capture_path(scene)
        found = stored_result(capture)
        if found is None:
            raise PatinaError("Found no fitted material; fit the materials first")
        if not formats:
            raise InputError(
                "found no format, expected at least one; choose a format", key="formats"
            )
        for word in formats:
            reason = missing(scene, word)
            if reason is not None:
                raise PatinaError(reason)
        self.found, self.out, self.cache = found, check_out(out), cache
        self.capture = capture
        _check_own(self.out)
        self.diagnosis = stored_result(capture, DIAGNOSIS)
        self.fit: CaptureResult | None = kept_fit(capture, found)
        self.formats = [word for word in FORMATS if word in formats]
        self.losses: list[Loss] = []
        self.files: list[str] = []

    def run(self) -> Iterator[Step]:
        """Write the record and the report, then the files of the command ``material``."""
        exported = [word for word in self.formats if word not in (RECORD, REPORT)]
        yield from self._own_files()
        if not exported:
            return
        with tempfile.TemporaryDirectory(prefix="patina-", ignore_cleanup_errors=True) as folder:
            result = Path(folder)
            present = yield from present_result(self.found, self.capture)
            write_json(result / "result.json", self._with_variation(present, result))
            if set(exported) & set(BLENDER):
                yield Step("copying the scene", 0.0)
                finish_updates()  # the copy must show the present traits
                _save_copy(result / "scene.blend")
                yield from self._by_another_blender(result, exported)
            else:
                job = ExportMaterialsJob(result, self.cache, self.out, exported)
                self.losses = (yield from in_child(job)).losses
        self.files += ["losses.txt", "losses.json"]
        self.files += sorted({file for loss in self.losses for file in loss.files})

    def _by_another_blender(self, result: Path, exported: list[str]) -> Generator[Step, None, None]:
        words = ["material", str(result), "--to", *exported, "--out", str(self.out)]
        yield from in_background(words, {"PATINA_CACHE": str(self.cache)})
        content = json.loads((self.out / "losses.json").read_text("utf-8"))
        for loss in content["losses"]:
            lists = {key: tuple(loss[key]) for key in ("files", "dropped", "notes")}
            self.losses.append(Loss(**{**loss, **lists}))

    def _with_variation(self, content: dict[str, Any], folder: Path) -> dict[str, Any]:
        """The content of result.json for a folder that gets the file of the variation too, if the
        fit is still in memory; else it states that there is no such file."""
        entry = content.get("varying")
        if not entry:
            return content
        if self.fit is None or self.fit.varying is None:
            return {**content, "varying": {**entry, "file": None}}
        storage.write(folder / storage.NAME, self.fit.varying)
        return content

    def _own_files(self) -> Generator[Step, None, None]:
        """Write result.json, diagnosis.json and the report, as requested."""
        records: dict[str, dict[str, Any] | None] = {}
        if RECORD in self.formats:
            records = {"result.json": self.found, "diagnosis.json": self.diagnosis}
        report = REPORT in self.formats
        if not records and not report:
            return
        with staged_folder(self.out) as folder:
            for name, content in records.items():
                if content is not None:
                    write_json(folder / name, self._with_variation(content, folder))
                    self.files.append(name)
            if report and self.fit is not None:
                yield from in_child(ReportJob(self.fit, folder / "report"))
                self.files.append("report/index.html")


def _check_own(out: Path) -> None:
    """Raise InputError for a folder with files that are not from an earlier export: files of the
    same name are replaced, and these could belong to the scan."""
    if not out.is_dir() or not any(out.iterdir()):
        return
    exported = any((out / mark).is_file() for mark in MARKS)
    if exported and not any((out / name).exists() for name in FIT) and not any(out.glob("*.toml")):
        return
    raise InputError(
        "contains files that are not from an earlier export; expected an empty or new folder",
        file=out,
    )


def _save_copy(path: Path) -> None:
    """Save a copy of the open .blend in its present state; the open file itself is not saved."""
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, check_existing=False)
    except RuntimeError as error:
        message = " ".join(str(error).split())
        raise PatinaError(f"Cannot save a copy of the scene ({message})") from error
