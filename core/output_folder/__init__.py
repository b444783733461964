"""Write results completely or not at all, and without losing work of the user."""

from .folder import check_out, remove_abandoned, scratch_folder, staged_folder
from .folder_lock import only_writer
from .publication import complete_publication, record_again

__all__ = [
    "check_out",
    "complete_publication",
    "only_writer",
    "record_again",
    "remove_abandoned",
    "scratch_folder",
    "staged_folder",
]
