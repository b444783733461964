"""One table of reflectance samples: who saw what, under which angles, how reliable."""

from .table import SampleTable
from .take import Margins, sample_photo

__all__ = ["Margins", "SampleTable", "sample_photo"]
