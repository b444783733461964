"""Colours as spectra, for renderers that trace wavelengths.

Three reflectance spectra, one for each of linear R, G and B of Rec. 709: what is least steep among
those that stay within [0, 1], add up to 1 at every wavelength, and come back as exactly (1, 0, 0),
(0, 1, 0) and (0, 0, 1) under daylight D65 by the CIE 1931 observer. The construction is that of
Mallett and Yuksel 2019, "Spectral primary decomposition for rendering with sRGB reflectance"; being
linear, it takes any reflectance and never gains energy. What a colour does under another light is
a guess: three numbers cannot tell.
"""

from __future__ import annotations

import numpy as np

WAVELENGTHS = np.arange(400.0, 621.0, 20.0)
"""Nanometres; linear in between, constant beyond."""

RED = (0.06435, 0.0598, 0.03206, 0, 0, 0, 0, 0, 0, 0.12158, 0.81155, 1)
GREEN = (0, 0, 0, 0, 0.24456, 0.76351, 1, 1, 1, 0.80868, 0.1841, 0)
BASIS = np.stack([RED, GREEN, 1.0 - np.array(RED) - np.array(GREEN)], axis=1)
"""(wavelengths, 3): what each of R, G and B reflects."""
