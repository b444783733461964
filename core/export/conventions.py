"""README texts for exported arrays: everything that is needed to use them without Patina."""

from __future__ import annotations

from pathlib import Path

from ..basis import Basis
from ..files import write_text_atomic
from .table_files import EXR_README, NPZ_README

ANGLES = """Directions
  Light l and view v are unit vectors that point away from the surface, n is its normal and
  h = (l + v)/|l + v| the half vector. The BRDF is isotropic, so three angles are enough:
    theta_h  angle of n and h
    theta_d  angle of h and l (the same as of h and v)
    phi_d    azimuth of l around h; 0 where l leans away from n, and folded to [0, 180) degrees
             because light and view may be swapped
  In a frame with n = +z and h in the x-z plane:
    h = (sin theta_h, 0, cos theta_h)
    l = sin theta_d cos phi_d t + sin theta_d sin phi_d b + cos theta_d h
    with t = (cos theta_h, 0, -sin theta_h), b = (0, 1, 0);   v = 2 (l.h) h - l

Units and channels
  rho in 1/sr (radiance out / irradiance in): a white matte surface has 1/pi = 0.318.
  Channels are linear R, G, B with the primaries of the photos the fit was made from (Rec. 709 if
  the photos do not state any). All values are linear.
"""

TABLE = """The table
  90 x 90 x 180 cells over (theta_h, theta_d, phi_d) as in the MERL database; values are those
  at the CENTRE of each cell:
    theta_h = 90 degrees * ((ih + 0.5)/90)^2   theta_d = id + 0.5 degrees   phi_d = ip + 0.5 degrees
  Cells with light or view below the horizon are -1. Between centres interpolate linearly in
  (ih, id, ip), ip periodic, without the invalid cells.
"""

MAPPING = """The basis (Nielsen, Jensen, Ramamoorthi 2015)
  cosMap = clip(cos theta_i * cos theta_o, 0.01, 1)     epsilon = 0.001
  rho = max((exp(mean + log_reference + sum_k c_k * components_k) - epsilon) / cosMap, 0)
  with one coefficient c_k for each component and channel. mean is the mean of the mapped training
  columns, log_reference is ln(median of rho * cosMap + epsilon) over them, components are scaled by
  their singular values (training coefficients have variance 1/columns).
  Nodes: {n_h} theta_h x {n_d} theta_d x {n_p} phi_d.
    theta_h = knee * (exp(s * ln(1 + 90 degrees/knee)) - 1), s = 0 ... 1 in {n_h} even steps,
              knee = {knee:.4f} degrees
    theta_d = 0 ... 90 degrees in even steps, both ends included
    phi_d   = 0 ... 180 degrees in even steps, the end excluded (periodic)
  Between nodes interpolate the LOGARITHM linearly in node numbers, then take exp.
  Basis version {version}: {count} components of {columns} training columns.
  {provenance}
"""

EXR = """Files
  NAME_table.exr         180 wide, 8100 high, R G B: row 90*ih + id (0 on top), column ip
  NAME_coefficients.exr  one column a component, one row, R G B
  basis_{version}.exr  one channel Y, {slabs} slabs of {n_h} rows, {width} wide: slab 0 mean, slab 1
                         log_reference, slab 2 + k component k; within a slab row = theta_h node,
                         column = {n_p}*(theta_d node) + phi_d node
  All 32-bit floats, ZIP compressed. Read them without colour management ("Non-Color", "raw").

  import numpy as np, OpenImageIO as oiio
  pixels = oiio.ImageBuf("NAME_table.exr").get_pixels(oiio.FLOAT)
  table = pixels.reshape(90, 90, 180, 3)        # [ih, id, ip, channel]
"""

NPZ = """Files
  NAME.npz
    table         (3, 90, 90, 180) float32, the table, channels first
    log_table     ({n_h}, {n_d}, {n_p}, 3) float32, ln(rho * cosMap + epsilon) at the basis' nodes:
                  the BRDF itself, with all components summed; the plugins for renderers read this
    theta_h, theta_d, phi_d   the nodes' angles in RADIANS;  knee (radians), epsilon
    coefficients  (3, k) float64;  basis_version
    scale_known, scale   scale_known is False if the irradiance is unknown: then rho was multiplied
                  by scale, and its absolute level is arbitrary
  basis_{version}.npz
    mean, log_reference  ({n_h}, {n_d}, {n_p});  components (k, {n_h}, {n_d}, {n_p})
    explained, and the nodes as above

  import numpy as np
  found = np.load("NAME.npz")
  table = found["table"]                        # [channel, ih, id, ip]
"""


def exr_readme(basis: Basis) -> str:
    """The README text for the EXR files of this basis."""
    return _text("Measured BRDFs as EXR pictures", EXR, basis)


def npz_readme(basis: Basis) -> str:
    """The README text for the NPZ files of this basis."""
    return _text("Measured BRDFs as NumPy archives", NPZ, basis)


def write_readme(folder: Path, kind: str, basis: Basis) -> str:
    """Write the README for ``kind`` ("exr" or "npz") into ``folder``; returns its file name."""
    name, text = (
        (EXR_README, exr_readme(basis)) if kind == "exr" else (NPZ_README, npz_readme(basis))
    )
    write_text_atomic(folder / name, text)
    return name


def _text(title: str, files: str, basis: Basis) -> str:
    """The complete README text; files: the section about the files of this format."""
    n_h, n_d, n_p = basis.grid.shape
    words = {
        "n_h": n_h, "n_d": n_d, "n_p": n_p, "width": n_d * n_p, "slabs": 2 + basis.count,
        "count": basis.count, "columns": basis.columns, "version": basis.version,
        "knee": basis.grid.knee * 57.29577951308232, "provenance": basis.provenance,
    }  # fmt: skip
    parts = [f"{title}\n{'=' * len(title)}\n", files, ANGLES, TABLE, MAPPING]
    return "\n".join(part.format(**words) for part in parts)
