"""Structure from motion (COLMAP), and poses of further photos in an existing reconstruction."""

from .localise import Localised
from .localise_job import LocaliseJob
from .photo_set import find_photos
from .solve_job import Solution, SolveJob, SolveToFolderJob

__all__ = ["LocaliseJob", "Localised", "Solution", "SolveJob", "SolveToFolderJob", "find_photos"]
