"""Clipped pixels are observations of a radiance that is at least the photo's white."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.concurrency.steps import drained
from patina.core.jobs import FitJob, finished
from patina.core.jobs.varying.surface_observations import observe_surface
from tests import make_capture as made

NODES = 3000
WHITE = 0.35  # radiance at which the photos are clipped


@pytest.fixture(scope="module")
def observed(tmp_path_factory):
    """Observations (without a limit, clipped) of the same photos."""
    path = made.make_capture(tmp_path_factory.mktemp("clipped"), photos=3)
    found = []
    for extra in ("", f"\nsaturation = {WHITE}"):
        for number in (1, 2, 3):
            line = f'file = "lit_{number}.exr"'
            path.write_text(path.read_text().replace(line, line + extra))
        job = FitJob(read_capture(path), portable=False)
        job.drain()
        found.append(drained(observe_surface(finished(job.result), NODES, 0.0, 1.0)).seen)
    return found


def test_only_bright_channels_are_clipped(observed):
    free, limited = observed
    assert not free.clipped.any()
    assert 0.01 < limited.clipped[:, 0].mean() < 0.5  # the material is red
    assert limited.clipped[:, 2].mean() < 0.5 * limited.clipped[:, 0].mean()
    assert np.median(limited.radiance[limited.clipped]) > WHITE
    assert (limited.measured().radiance < WHITE).all()


def test_clipped_pixels_are_observed_at_the_same_nodes(observed):
    free, limited = observed
    assert np.array_equal(free.node, limited.node)
    assert np.array_equal(free.photo, limited.photo)
    few = limited.measured()
    assert len(few) < len(limited) and not few.clipped.any()
