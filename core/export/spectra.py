"""RGB reflectances as spectra, for spectral renderers.

Three reflectance spectra, one each for linear R, G and B of Rec. 709: the smoothest ones that stay
within [0, 1], sum to 1 at every wavelength, and give exactly (1, 0, 0), (0, 1, 0) and (0, 0, 1)
under daylight D65 for the CIE 1931 observer. The construction is that of Mallett and Yuksel 2019,
"Spectral primary decomposition for rendering with sRGB reflectance". It is linear, so it applies to
any reflectance and never gains energy. Colours under another light are a guess: RGB values do not
determine the spectrum.
"""

from __future__ import annotations

import numpy as np

WAVELENGTHS = np.arange(400.0, 621.0, 20.0)
"""Nanometres; spectra are linear in between and constant beyond."""

RED = (0.06435, 0.0598, 0.03206, 0, 0, 0, 0, 0, 0, 0.12158, 0.81155, 1)
GREEN = (0, 0, 0, 0, 0.24456, 0.76351, 1, 1, 1, 0.80868, 0.1841, 0)
BASIS = np.stack([RED, GREEN, 1.0 - np.array(RED) - np.array(GREEN)], axis=1)
"""(wavelengths, 3) the reflectance spectra of R, G and B."""
