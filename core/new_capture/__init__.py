"""A new capture from loose files: recognise them, match photos to cameras, group them by lamp."""

from .draft import Draft, DraftLamp, DraftPhoto, LampKind
from .draft_job import DraftJob

__all__ = ["Draft", "DraftJob", "DraftLamp", "DraftPhoto", "LampKind"]
