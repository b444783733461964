"""A new capture from loose files: recognise them, match photos to cameras, group them by lamp."""

from .draft import Draft, DraftLamp, DraftPhoto, LampKind
from .draft_job import DraftJob
from .localise_draft import LocaliseDraftJob
from .solve_draft import SolveDraftJob, photo_folders

__all__ = [
    "Draft",
    "DraftJob",
    "DraftLamp",
    "DraftPhoto",
    "LampKind",
    "LocaliseDraftJob",
    "SolveDraftJob",
    "photo_folders",
]
