// The data of the page (core/viewer/page.py) as typed arrays and textures.

import * as THREE from "three";

const QUANTILES = 256; // also in shading.glsl.js
const EVEN_SHARE = 0.05; // of the half vectors that are spread over all angles
const MAX_DIFFERENCE = 60; // degrees of theta_d whose reflectance decides where half vectors are drawn

function bytes(text) {
  const raw = atob(text);
  const out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
}

export function readData() {
  const data = JSON.parse(document.getElementById("patina-data").textContent);
  for (const material of data.materials) {
    for (const model of Object.values(material.models)) model.halves = new Uint16Array(bytes(model.table));
    material.factor = material.interval ? new Uint8Array(bytes(material.interval)) : null;
    material.quantiles = halfVectorQuantiles(data.grid, material.models.measured.halves);
  }
  for (const world of data.worlds) Object.assign(world, readWorld(world));
  if (data.object) {
    data.object.positions = new Float32Array(bytes(data.object.positions));
    data.object.parts = data.object.parts.map((part) => ({
      ...part,
      index: new Uint32Array(bytes(part.index)),
      factors: part.factors && Float32Array.from(new Uint16Array(bytes(part.factors)), THREE.DataUtils.fromHalfFloat),
    }));
  }
  return data;
}

// The table of one model as a 3D texture: phi_d, theta_d, theta_h.
export function tableTexture(grid, halves) {
  const count = halves.length / 3;
  const four = new Uint16Array(4 * count);
  for (let i = 0; i < count; i++) for (let c = 0; c < 3; c++) four[4 * i + c] = halves[3 * i + c];
  const texture = new THREE.Data3DTexture(four, grid.n_p, grid.n_d, grid.n_h);
  texture.format = THREE.RGBAFormat;
  texture.type = THREE.HalfFloatType;
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.wrapS = THREE.RepeatWrapping;
  texture.needsUpdate = true;
  return texture;
}

export function quantileTexture(quantiles) {
  const texture = new THREE.DataTexture(quantiles, quantiles.length, 1, THREE.RedFormat, THREE.FloatType);
  texture.needsUpdate = true;
  return texture;
}

// Radiance, and in alpha the density of directions drawn in proportion to it, 1/sr.
export function worldTexture(world) {
  const { width, height, radiance, density } = world;
  const four = new Uint16Array(4 * width * height);
  for (let i = 0; i < width * height; i++) {
    for (let c = 0; c < 3; c++) four[4 * i + c] = THREE.DataUtils.toHalfFloat(Math.min(radiance[3 * i + c], 65000));
    four[4 * i + 3] = THREE.DataUtils.toHalfFloat(Math.min(density[i], 65000));
  }
  const texture = new THREE.DataTexture(four, width, height, THREE.RGBAFormat, THREE.HalfFloatType);
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.wrapS = THREE.RepeatWrapping;
  texture.needsUpdate = true;
  return texture;
}

function readWorld(world) {
  const halves = new Uint16Array(bytes(world.pixels));
  const { width, height } = world;
  const radiance = Float32Array.from(halves, THREE.DataUtils.fromHalfFloat);
  const density = new Float32Array(width * height);
  const cumulative = new Float64Array(width * height);
  let total = 0;
  for (let row = 0; row < height; row++) {
    const solidAngle =
      ((2 * Math.PI) / width) * (Math.cos((Math.PI * row) / height) - Math.cos((Math.PI * (row + 1)) / height));
    for (let column = 0; column < width; column++) {
      const i = row * width + column;
      density[i] = 0.2126 * radiance[3 * i] + 0.7152 * radiance[3 * i + 1] + 0.0722 * radiance[3 * i + 2] + 1e-6;
      total += density[i] * solidAngle;
      cumulative[i] = total;
    }
  }
  for (let i = 0; i < density.length; i++) {
    density[i] /= total;
    cumulative[i] /= total;
  }
  return { radiance, density, cumulative };
}

// A direction of the sky for two numbers in [0, 1), with its radiance and density.
export function drawFromWorld(world, first, second, third) {
  let low = 0,
    high = world.cumulative.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (world.cumulative[middle] <= first) low = middle + 1;
    else high = middle;
  }
  const row = Math.floor(low / world.width),
    column = low % world.width;
  const top = Math.cos((Math.PI * row) / world.height),
    bottom = Math.cos((Math.PI * (row + 1)) / world.height);
  const z = top + (bottom - top) * second;
  const phi = 2 * Math.PI * (0.5 - (column + third) / world.width);
  const across = Math.sqrt(Math.max(1 - z * z, 0));
  const direction = new THREE.Vector3(across * Math.cos(phi), across * Math.sin(phi), z);
  return { direction, ...worldAt(world, direction) };
}

// Radiance and density towards a direction, interpolated like the texture.
function worldAt(world, d) {
  const { width, height } = world;
  const x = (0.5 - Math.atan2(d.y, d.x) / (2 * Math.PI)) * width - 0.5;
  const y = (Math.acos(Math.min(Math.max(d.z, -1), 1)) / Math.PI) * height - 0.5;
  const x0 = Math.floor(x),
    y0 = Math.floor(y);
  const radiance = [0, 0, 0];
  let density = 0;
  for (const [dx, dy] of [[0, 0], [1, 0], [0, 1], [1, 1]]) {
    const weight = (dx ? x - x0 : 1 - x + x0) * (dy ? y - y0 : 1 - y + y0);
    const row = Math.min(Math.max(y0 + dy, 0), height - 1);
    const column = (x0 + dx + width) % width;
    const i = row * width + column;
    for (let c = 0; c < 3; c++) radiance[c] += weight * world.radiance[3 * i + c];
    density += weight * world.density[i];
  }
  return { radiance, density };
}

// theta_h below which k / QUANTILES of the half vectors are drawn: in proportion to the mean
// reflectance, with a part that is even in the projected solid angle.
function halfVectorQuantiles(grid, halves) {
  const theta = Array.from({ length: grid.n_h }, (_, h) => thetaOf(grid, h));
  const rows = 1 + Math.floor((MAX_DIFFERENCE / 90) * (grid.n_d - 1));
  const mean = theta.map((_, h) => {
    let sum = 0;
    for (let d = 0; d < rows; d++) {
      const at = 3 * (h * grid.n_d + d) * grid.n_p;
      for (let c = 0; c < 3; c++)
        sum += Math.max(Math.exp(THREE.DataUtils.fromHalfFloat(halves[at + c])) - grid.epsilon, 0);
    }
    return sum / rows;
  });
  const FINE = 4000;
  const cumulative = new Float64Array(FINE + 1);
  let whole = 0;
  const weightAt = (angle) => {
    const at = Math.min((Math.log1p(angle / grid.knee) / Math.log1p(Math.PI / 2 / grid.knee)) * (grid.n_h - 1), grid.n_h - 1.001);
    const h = Math.floor(at);
    return mean[h] + (at - h) * (mean[h + 1] - mean[h]);
  };
  const angleAt = (i) => thetaOf(grid, (i / FINE) * (grid.n_h - 1));
  const even = [];
  for (let i = 0; i < FINE; i++) {
    const a = angleAt(i),
      b = angleAt(i + 1),
      middle = 0.5 * (a + b);
    const solid = Math.sin(middle) * Math.cos(middle) * (b - a);
    even.push(solid);
    whole += weightAt(middle) * solid;
    cumulative[i + 1] = whole;
  }
  let evenly = 0;
  for (let i = 0; i < FINE; i++) {
    evenly += even[i] * 2; // the integral of sin·cos is 1/2
    cumulative[i + 1] = (1 - EVEN_SHARE) * (cumulative[i + 1] / Math.max(whole, 1e-12)) + EVEN_SHARE * evenly;
  }
  const out = new Float32Array(QUANTILES + 1);
  let i = 0;
  for (let k = 1; k < QUANTILES; k++) {
    const wanted = (k / QUANTILES) * cumulative[FINE];
    while (cumulative[i + 1] < wanted) i++;
    const inside = (wanted - cumulative[i]) / Math.max(cumulative[i + 1] - cumulative[i], 1e-12);
    out[k] = angleAt(i) + inside * (angleAt(i + 1) - angleAt(i));
  }
  out[QUANTILES] = Math.PI / 2;
  return out;
}

function thetaOf(grid, h) {
  return grid.knee * Math.expm1((h / (grid.n_h - 1)) * Math.log1p(Math.PI / 2 / grid.knee));
}
