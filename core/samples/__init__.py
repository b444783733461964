"""The table of reflectance samples that all estimators read, how samples are taken and how many are
kept."""

from .criterion import Criterion
from .measured_points import MeasuredPoints
from .reservoir import SampleReservoir
from .sink import SampleSink
from .table import SampleTable
from .take import Margins, sample_photo

__all__ = [
    "Criterion",
    "Margins",
    "MeasuredPoints",
    "SampleReservoir",
    "SampleSink",
    "SampleTable",
    "sample_photo",
]
