// The BRDF at one direction, for the values under the pointer.

import { DataUtils, Vector3 } from "three";

// Half and difference angles (core/angles/half_difference.py), radians.
export function halfDifference(normal, light, view) {
  const half = new Vector3().addVectors(light, view).normalize();
  const across = new Vector3().crossVectors(normal, half);
  const thetaH = Math.atan2(across.length(), normal.dot(half));
  if (across.length() < 1e-6)
    across.crossVectors(Math.abs(half.x) < 0.5 ? new Vector3(1, 0, 0) : new Vector3(0, 1, 0), half);
  across.normalize();
  const along = new Vector3().crossVectors(across, half);
  const x = light.dot(along),
    y = light.dot(across);
  const phi = Math.atan2(y, x);
  return {
    thetaH,
    thetaD: Math.atan2(Math.hypot(x, y), light.dot(half)),
    phiD: phi - Math.PI * Math.floor(phi / Math.PI),
  };
}

// The eight nodes around a direction, with their weights (core/basis/grid.py).
function corners(grid, { thetaH, thetaD, phiD }) {
  const h = Math.min((Math.log1p(thetaH / grid.knee) / Math.log1p(Math.PI / 2 / grid.knee)) * (grid.n_h - 1), grid.n_h - 1);
  const d = Math.min(Math.max(thetaD / (Math.PI / 2), 0), 1) * (grid.n_d - 1);
  const p = (phiD / Math.PI) * grid.n_p;
  const h0 = Math.min(Math.floor(h), grid.n_h - 2),
    d0 = Math.min(Math.floor(d), grid.n_d - 2),
    p0 = Math.floor(p);
  const found = [];
  for (const i of [0, 1])
    for (const j of [0, 1])
      for (const k of [0, 1])
        found.push([
          ((h0 + i) * grid.n_d + d0 + j) * grid.n_p + ((p0 + k) % grid.n_p),
          (i ? h - h0 : 1 - h + h0) * (j ? d - d0 : 1 - d + d0) * (k ? p - p0 : 1 - p + p0),
        ]);
  return found;
}

// [R, G, B] in 1/sr. varied: factors of a material that varies (core/varying/node_model.py), or null.
export function reflectance(grid, halves, normal, light, view, varied) {
  const cosI = normal.dot(light),
    cosO = normal.dot(view);
  if (cosI <= 0 || cosO <= 0) return [0, 0, 0];
  const angles = halfDifference(normal, light, view);
  let cosines = cosI * cosO;
  if (varied) {
    angles.thetaH = Math.atan(Math.tan(Math.min(angles.thetaH, 1.55)) / varied.roughness);
    const along = Math.cos(angles.thetaH) * Math.cos(angles.thetaD);
    const across = Math.sin(angles.thetaH) * Math.sin(angles.thetaD) * Math.cos(angles.phiD);
    cosines = along * along - across * across;
  }
  const logarithm = [0, 0, 0];
  for (const [node, weight] of corners(grid, angles))
    for (let c = 0; c < 3; c++) logarithm[c] += weight * DataUtils.fromHalfFloat(halves[3 * node + c]);
  const cosMap = Math.min(Math.max(cosines, 0.01), 1);
  const rho = logarithm.map((value) => Math.max(Math.exp(value) - grid.epsilon, 0) / cosMap);
  if (!varied) return rho;
  return rho.map((value, c) => {
    const below = Math.min(value, varied.body[c]);
    return varied.diffuse[c] * below + (varied.specular[c] / varied.roughness ** 2) * (value - below);
  });
}

// The factor either way of the 90 % interval; null where it is not known.
export function intervalFactor(grid, factor, step, angles) {
  if (!factor) return null;
  let sum = 0;
  for (const [node, weight] of corners(grid, angles)) sum += weight * factor[node];
  return Math.exp(sum * step);
}
