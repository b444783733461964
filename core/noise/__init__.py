"""The noise model: how far a recorded pixel may be from its prediction.

photo_noise.py is the noise of the camera, estimated from each photo by photo/noise_estimate.py;
pixel_error.py adds the errors of any prediction of a pixel, basis_error.py those of a prediction in
the basis. Brackets, the fit and the diagnosis take their variances from here.
"""

from .photo_noise import MergedNoise, PhotoNoise, PixelNoise

__all__ = ["MergedNoise", "PhotoNoise", "PixelNoise"]
